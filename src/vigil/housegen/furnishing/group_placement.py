"""Placement of furniture groups. A group is furniture that stands together and is placed as one unit.

The origin of a group's frame is the middle of the group's back edge: x is along the wall, z away from it, and an object
with yaw 0 faces away from the wall.
"""

from dataclasses import dataclass, field

import numpy as np

from vigil.base.geometry import Vec3, rotate_floor
from vigil.housegen.base.models import AssetModel, PlacedObject, Rect, leaf_reach, swept_rect, turned_rect
from vigil.housegen.furnishing.floor import WALL_GAP, Floor

TALL_M = 0.97
"""Furniture higher than this (m) is not placed in front of a window."""
STAND_M = 0.45
"""Depth (m) of floor for the agent's body in front of furniture that opens, in addition to the reach of its leaves."""
LEAST_ACCESS = 0.8
"""Least depth (m) of the floor that is kept free in front of furniture that opens."""
ACCESS_M, HALF_ACCESS_M = 0.5, 0.3
"""Depth (m) of the floor that is kept free in front of furniture that does not open, and half the least width (m) of
the floor that is kept free in front of any furniture."""
FLUSH_M = 1e-6
"""A group is in a corner if it is less than this (m) from the end of a wall."""
ALONG_STEP_M, ACROSS_STEP_M = 0.15, 0.3
"""Step (m) between the places that are tried along walls, and step (m) between those away from walls."""
ACROSS_SHIFT_M = 0.25
"""Largest random offset (m) of the grid of places away from walls."""
TRIES = 14
"""Number of places, the best first, that are tested for whether an agent can still walk through the room."""


@dataclass(slots=True)
class GroupMember:
    """One piece of furniture in a group; its centre and yaw are in the group's frame."""

    model: AssetModel
    x: float
    z: float
    yaw: float = 0.0
    on: int | None = None
    """Index of the member on which this member stands; None if this member stands on the floor."""

    def rects(self) -> list[Rect]:
        """Return the rectangles that the member covers: its box's, or one for each straight part of a countertop."""
        if self.model.category != "CounterTop":
            return [self.rect()]
        corners = [np.asarray(solid.polygon) for solid in self.model.asset.solids if solid.joint is None]
        boxes = [(*part.min(axis=0).tolist(), *part.max(axis=0).tolist()) for part in corners]
        return [turned_rect(box, self.x, self.z, self.yaw) for box in boxes]

    def rect(self) -> Rect:
        """Return the rectangle around the member's box, in the group's frame."""
        return turned_rect(self.model.rect, self.x, self.z, self.yaw)


@dataclass(slots=True)
class FurnitureGroup:
    """Furniture that is placed together."""

    members: list[GroupMember]
    access: list[Rect] = field(default_factory=list)
    """Floor in front of the furniture, in the group's frame, on which an agent must be able to stand."""
    open: list[Rect] = field(default_factory=list)
    """Floor, in the group's frame, that other furniture must not cover, e.g. where a chair is pulled back."""

    def solid(self) -> list[Rect]:
        """Return the rectangles of the members that stand on the floor, except rugs."""
        standing = [member for member in self.members if member.on is None and member.model.category != "Rug"]
        return [rect for member in standing for rect in member.rects()]

    def sweeps(self) -> list[Rect]:
        """Return the floor to keep free: `open`, and the floor over which doors and drawers of the members move."""
        found: list[Rect] = list(self.open)
        for member in self.members:
            rect = swept_rect(member.model) if member.on is None else None
            if rect is not None:
                found.append(turned_rect(rect, member.x, member.z, member.yaw))
        return found

    def extent(self) -> Rect:
        """Return the rectangle around the whole group."""
        rects = np.asarray([member.rect() for member in self.members])
        (x0, z0), (x1, z1) = rects[:, :2].min(axis=0).tolist(), rects[:, 2:].max(axis=0).tolist()
        return x0, z0, x1, z1

    @property
    def is_tall(self) -> bool:
        """Whether the group would hide a window."""
        return any(member.on is None and member.model.size.y > TALL_M for member in self.members) or any(
            member.on is not None and member.model.category == "Television" for member in self.members
        )


@dataclass(frozen=True, slots=True)
class Anchor:
    """A place in the room where a furniture group may be put."""

    x: float
    """x (m) of the middle of the group's back edge, in the house's frame."""
    z: float
    yaw: float
    corner: float = 0.0
    """1 if the group is at an end of the wall, else 0."""
    centre: float = 0.0
    """How near the place is to the middle: 1 in the middle of the wall (or room), falling to 0 at its end."""


def single_group(model: AssetModel, access_m: float | None = None) -> FurnitureGroup:
    """Return a group of one piece of furniture with its back to the wall, and with the floor needed in front of it.

    `access_m` is the depth (m) of this floor; if None, the depth depends on the model.
    """
    depth = front_access(model) if access_m is None else access_m
    half = max(model.size.x / 2, HALF_ACCESS_M)
    rect = swept_rect(model)
    behind = 0.0 if rect is None else max(0.0, -model.size.z / 2 - rect[1])
    front = behind + model.size.z
    access = [(-half, front, half, front + depth)] if depth > 0 else []
    return FurnitureGroup([GroupMember(model, 0.0, behind + model.size.z / 2)], list(access))


def front_access(model: AssetModel) -> float:
    """Return the depth (m) of floor to keep free in front of a model; it is greater if parts open towards the front."""
    reach = leaf_reach(model)
    return max(LEAST_ACCESS, reach + STAND_M) if reach > 0 else ACCESS_M


def wall_anchors(floor: Floor, group: FurnitureGroup, rng: np.random.Generator) -> list[Anchor]:
    """Return places for a group along the room's walls; the ends and the middle of each wall are among them."""
    low, _, high, _ = group.extent()
    found: list[Anchor] = []
    for edge in floor.edges:
        first, last = high + WALL_GAP, edge.length + low - WALL_GAP
        if last < first:
            continue
        steps = np.arange(first + ALONG_STEP_M * float(rng.random()), last, ALONG_STEP_M)
        along = np.array([first, last, (first + last) / 2, *steps])
        (dx, dz), (x0, z0) = edge.direction, edge.at(0.0, WALL_GAP)
        corner = (np.minimum(along - first, last - along) < FLUSH_M).astype(float)
        centre = 1.0 - np.abs(2 * (along - first) / (last - first) - 1) if last > first else np.ones_like(along)
        places = zip(
            (x0 + along * dx).tolist(), (z0 + along * dz).tolist(), corner.tolist(), centre.tolist(), strict=True
        )
        found.extend(Anchor(x, z, edge.yaw, corner, centre) for x, z, corner, centre in places)
    return found


def free_anchors(floor: Floor, rng: np.random.Generator) -> list[Anchor]:
    """Return places all over the floor, each repeated with four yaws."""
    x0, z0, x1, z1 = floor.room.polygon.bounds
    middle = floor.room.polygon.representative_point()
    step = ACROSS_STEP_M
    xs = np.arange(x0 + step + ACROSS_SHIFT_M * float(rng.random()), x1 - step, step)
    zs = np.arange(z0 + step + ACROSS_SHIFT_M * float(rng.random()), z1 - step, step)
    far = max(x1 - x0, z1 - z0)
    return [
        Anchor(float(x), float(z), yaw, 0.0, 1.0 - (abs(x - middle.x) + abs(z - middle.y)) / far)
        for yaw in (0.0, 90.0, 180.0, 270.0)
        for x in xs
        for z in zs
    ]


def rects_at(rects: list[Rect], anchors: list[Anchor]) -> np.ndarray:
    """Return the group's rectangles (anchors, rects, 4) when the group is at each of the anchors."""
    if not rects:
        return np.empty((len(anchors), 0, 4))
    turned = {yaw: np.asarray([turned_rect(rect, 0.0, 0.0, yaw) for rect in rects]) for yaw in {a.yaw for a in anchors}}
    shift = np.asarray([(anchor.x, anchor.z, anchor.x, anchor.z) for anchor in anchors])
    return np.stack([turned[anchor.yaw] for anchor in anchors]) + shift[:, None]


def place_group(
    floor: Floor, group: FurnitureGroup, anchors: list[Anchor], scores: np.ndarray
) -> list[PlacedObject] | None:
    """Place the group at the best anchor where it fits and leaves enough room to walk.

    `scores` (anchors,) are the anchors' scores; the highest is the best. Return the group's furniture; None if it fits
    at no anchor.
    """
    if not anchors:
        return None
    solids, access, sweeps = (rects_at(rects, anchors) for rects in (group.solid(), group.access, group.sweeps()))
    masks = floor.fits(solids, group.is_tall), floor.is_open(access), floor.is_clear(sweeps)
    fits = np.logical_and.reduce(np.concatenate(masks, axis=1), axis=1)
    order = [int(index) for index in np.argsort(-scores, kind="stable") if fits[index]]
    for index in order[:TRIES]:
        taken, open_zones, passed = (list(map(tuple, each[index].tolist())) for each in (solids, access, sweeps))
        if floor.can_walk(taken, open_zones):
            floor.taken.extend(taken)
            floor.access.extend(open_zones)
            floor.sweeps.extend(passed)
            return pieces_at(group, anchors[index], floor.room.number)
    return None


def pieces_at(group: FurnitureGroup, anchor: Anchor, room: int) -> list[PlacedObject]:
    """Return the group's furniture at an anchor; a piece that stands on another piece becomes its child."""
    pieces: list[PlacedObject] = []
    for member in group.members:
        dx, dz = rotate_floor(member.x, member.z, anchor.yaw)
        below = None if member.on is None else pieces[member.on]
        bottom = 0.0 if below is None else below.top
        place = Vec3(anchor.x + dx, bottom + member.model.size.y / 2, anchor.z + dz)
        piece = PlacedObject(member.model, place, (anchor.yaw + member.yaw) % 360.0, room)
        pieces.append(piece)
        if below is not None:
            below.children.append(piece)
    return [piece for piece, member in zip(pieces, group.members, strict=True) if member.on is None]
