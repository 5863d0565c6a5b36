"""Bodies: the things of a house document as upright prisms, closed, open or in between.

Only upright things are exact; a thing or a lid that tilts is taken as the box about it.
"""

import re
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from shapely import Polygon

from vigil.assets import make
from vigil.assets.asset import Asset, Joint, Solid, Surface
from vigil.assets.meshes import cross
from vigil.assets.sizes import AssetDatabase, AssetEntry
from vigil.house import Door, House, HouseObject, Opening
from vigil.pose import Vec3, heading, rotate_floor

HOVER_M = 0.07
"""Children that hover less than this are let down (ProcTHOR's own do by 5 to 6 cm)."""
LEVEL_STEP_M = 0.005
OPENING_DEPTH_M = 0.14
EDGE_M = 0.1


@dataclass(frozen=True, eq=False)
class Prism:
    """An upright prism in the house's frame."""

    corners: np.ndarray
    """(n, 2) x, z."""
    bottom: float
    top: float
    joint: str | None = None

    @cached_property
    def polygon(self) -> Polygon:
        """Its footprint."""
        return Polygon(self.corners)


@dataclass(slots=True, eq=False)
class Body:
    """A thing with its asset in its place."""

    id: str
    category: str
    asset: Asset
    position: Vec3
    yaw: float
    room: str | None
    """Id of the room that its own id or place names."""
    parent: "Body | None" = None
    children: list["Body"] = field(default_factory=list)
    openness: float = 0.0
    is_opening: bool = False
    is_tilted: bool = False
    can_open: bool = False
    surface: Surface | None = None
    """The parent's surface that it rests on."""
    gap: float | None = None
    """Height of its bottom over what it rests on, as the document says; None when nothing is under it."""

    @property
    def bottom(self) -> float:
        """Height of its lowest face."""
        return self.position.y - self.asset.size.y / 2

    def prisms(self, openness: float | None = None) -> list[Prism]:
        """Returns its solids at an openness (default: as it stands)."""
        openness = self.openness if openness is None else openness
        joints = {joint.name: joint for joint in self.asset.joints}
        return [self._prism(solid, joints.get(solid.joint or ""), openness) for solid in self.asset.solids]

    def leaves(self, openness: float) -> list[Prism]:
        """Returns the solids of its doors, drawers and lids at an openness."""
        joints = {joint.name: joint for joint in self.asset.joints}
        moving = [solid for solid in self.asset.solids if solid.joint is not None]
        return [self._prism(solid, joints.get(solid.joint or ""), openness) for solid in moving]

    def _prism(self, solid: Solid, joint: Joint | None, openness: float) -> Prism:
        corners, bottom, top = moved_solid(solid, joint, openness)
        y = self.position.y
        return Prism(self.over_floor(corners), y + bottom, y + top, solid.joint)

    def over_floor(self, points: np.ndarray) -> np.ndarray:
        """Returns where points (..., 2: x, z) of the asset's frame are on the house's floor."""
        x, z, (sin, cos) = points[..., 0], points[..., 1], heading(self.yaw)
        return np.stack((x * cos + z * sin, z * cos - x * sin), axis=-1) + self._middle()

    def _middle(self) -> np.ndarray:
        return np.array((self.position.x, self.position.z))

    def box_corners(self) -> np.ndarray:
        """Returns the four floor corners of its bounding box."""
        half_x, half_z = self.asset.size.x / 2, self.asset.size.z / 2
        corners = [(-half_x, -half_z), (half_x, -half_z), (half_x, half_z), (-half_x, half_z)]
        return np.array([rotate_floor(x, z, self.yaw) for x, z in corners]) + self._middle()

    def local(self, x: float, z: float) -> tuple[float, float]:
        """Returns a floor point in the asset's frame."""
        return rotate_floor(x - self.position.x, z - self.position.z, -self.yaw)

    def ancestors(self) -> list["Body"]:
        """Returns what carries it, nearest first."""
        return [] if self.parent is None else [self.parent, *self.parent.ancestors()]


def moved_solid(solid: Solid, joint: Joint | None, openness: float) -> tuple[np.ndarray, float, float]:
    """Returns corners, bottom and top of a solid (in the asset's frame) at an openness."""
    corners = np.array(solid.polygon, dtype=float)
    if joint is None or openness == 0.0:
        return corners, solid.bottom, solid.top
    points = moved_points(solid_corners(solid), joint, openness)
    low, high = float(points[:, 1].min()), float(points[:, 1].max())
    if joint.kind == "slide" or abs(joint.axis[1]) > 0.999:
        return points[: len(corners), [0, 2]], low, high
    (x0, z0), (x1, z1) = points[:, [0, 2]].min(axis=0), points[:, [0, 2]].max(axis=0)
    return np.array([(x0, z0), (x1, z0), (x1, z1), (x0, z1)]), low, high


def solid_corners(solid: Solid) -> np.ndarray:
    """Returns the corners (2 n, 3) of a solid, those of its bottom first."""
    return np.array([(x, y, z) for y in (solid.bottom, solid.top) for x, z in solid.polygon])


def moved_points(points: np.ndarray, joint: Joint, openness: float | np.ndarray) -> np.ndarray:
    """Returns where points (n, 3) that a joint carries are at an openness; (k, n, 3) for an array of k."""
    axis, travel = np.array(joint.axis), joint.travel * np.asarray(openness)[..., None, None]
    if joint.kind == "slide":
        return points + axis * travel
    origin, angle = np.array(joint.origin), np.radians(travel)
    arm = points - origin
    along = np.outer(arm @ axis, axis)
    return origin + arm * np.cos(angle) + cross(axis, arm) * np.sin(angle) + along * (1 - np.cos(angle))


def bodies_of(house: House, assets: AssetDatabase) -> tuple[list[Body], list[str]]:
    """Returns every object, door and window as a body, and what had to be guessed of its assets."""
    bodies: list[Body] = []
    guessed: list[str] = []

    def visit(node: HouseObject, parent: Body | None) -> None:
        note = assets.look_up(node.asset_id, node.id).note
        if note is not None:
            guessed.append(f"{node.id}: {note}")
        body = _body(node, parent, assets)
        bodies.append(body)
        for child in node.children:
            visit(child, body)

    for node in house.document.objects:
        visit(node, None)
    walls = {wall.id: wall for wall in house.document.walls}
    for opening in [*house.document.doors, *house.document.windows]:
        start, end = (np.array((point.x, point.z)) for point in walls[opening.wall0].polygon[:2])
        if np.linalg.norm(end - start) > 1e-6:
            bodies.append(_opening_body(opening, start, end))
    return bodies, guessed


def _body(node: HouseObject, parent: Body | None, assets: AssetDatabase) -> Body:
    entry = assets.look_up(node.asset_id, node.id)
    asset = make(entry.category, entry.size, entry.variant, levels_of(node, entry, assets))
    body = Body(
        id=node.id,
        category=entry.category,
        asset=asset,
        position=node.position.vec,
        yaw=node.rotation.y,
        room=_room_of(node.id),
        parent=parent,
        openness=min(1.0, max(0.0, node.openness or 0.0)) if asset.can_open else 0.0,
        is_tilted=any(abs((angle + 180) % 360 - 180) > 1.0 for angle in (node.rotation.x, node.rotation.z)),
        can_open=asset.can_open,
    )
    if parent is not None:
        parent.children.append(body)
    _let_down(body)
    return body


def _room_of(object_id: str) -> str | None:
    words = object_id.split("|")
    return f"room|{words[1]}" if len(words) > 2 else None


def levels_of(node: HouseObject, entry: AssetEntry, assets: AssetDatabase) -> tuple[float, ...]:
    """Returns the heights above the asset's bottom at which the node's children rest inside its box."""
    base = node.position.y - entry.size.y / 2
    bottoms: list[float] = []
    for child in node.children:
        height = assets.look_up(child.asset_id, child.id).size.y
        bottoms.append(child.position.y - height / 2 - base)
    levels: list[float] = []
    for bottom in sorted(bottoms):
        is_new = not levels or bottom > levels[-1] + HOVER_M
        if is_new and 0.0 <= bottom < entry.size.y - LEVEL_STEP_M:
            levels.append(round(round(bottom / LEVEL_STEP_M) * LEVEL_STEP_M, 4))
    return tuple(levels)


def _let_down(body: Body) -> None:
    """Notes the gap below a body, and lets it down onto what is just below it, as a simulator does."""
    if body.parent is None:
        body.gap = body.bottom
        if 0.0 < body.bottom < HOVER_M:
            body.position = Vec3(body.position.x, body.position.y - body.bottom, body.position.z)
        return
    gaps = [
        (body.bottom - (body.parent.position.y + surface.center.y), surface)
        for surface in body.parent.asset.surfaces
        if _is_over(body, body.parent, surface)
    ]
    near = [(gap, surface) for gap, surface in gaps if -HOVER_M < gap < HOVER_M]
    if near:
        body.gap, body.surface = min(near, key=lambda pair: abs(pair[0]))
        body.position = Vec3(body.position.x, body.position.y - body.gap, body.position.z)


def _is_over(body: Body, parent: Body, surface: Surface) -> bool:
    x, z = parent.local(body.position.x, body.position.z)
    return (
        abs(x - surface.center.x) <= surface.size_x / 2 + EDGE_M
        and abs(z - surface.center.z) <= surface.size_z / 2 + EDGE_M
    )


def _opening_body(opening: Opening, start: np.ndarray, end: np.ndarray) -> Body:
    xs, ys = [point.x for point in opening.hole_polygon], [point.y for point in opening.hole_polygon]
    direction = (end - start) / np.linalg.norm(end - start)
    middle = start + direction * (min(xs) + max(xs)) / 2
    normal = direction[1], -direction[0]
    is_door = isinstance(opening, Door)
    is_frame = opening.asset_id.lower().startswith("doorframe") or opening.asset_id.startswith("vigil_Doorframe")
    category = ("Doorframe" if is_frame or opening.openable is None else "Doorway") if is_door else "Window"
    digits = re.search(r"(\d+)$", opening.asset_id)
    size = Vec3(round(max(xs) - min(xs), 4), round(max(ys) - min(ys), 4), OPENING_DEPTH_M)
    asset = make(category, size, int(digits[1]) if digits else 0)
    return Body(
        id=opening.id,
        category=category,
        asset=asset,
        position=Vec3(float(middle[0]), (min(ys) + max(ys)) / 2, float(middle[1])),
        yaw=float(np.degrees(np.arctan2(normal[0], normal[1]))),
        room=opening.room0,
        openness=min(1.0, max(0.0, opening.openness or 0.0)) if is_door and asset.can_open else 0.0,
        is_opening=True,
        can_open=is_door and bool(opening.openable) and asset.can_open,
        gap=0.0,
    )
