"""FakeEngine: an engine without a 3-D library. It casts rays at boxes in numpy and draws flat-coloured frames.

Every connected piece of a mesh is replaced by its bounding box, which moves with the piece's joint. If a box has a
support surface inside (a bowl, an open fridge), rays pass through its near side, so that the things inside are visible.
The engine is fast enough for tests, and exact enough to try solvers, budgets and goals without a renderer.
"""

import math
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from vigil.assets.kernel.asset import Asset, Part
from vigil.assets.notice import notice_parts
from vigil.base.caches import cached_while_alive
from vigil.base.geometry import Pose, Vec3
from vigil.protocol.world import OPEN_ABOVE
from vigil.scene.geometry import STILL, Motion, part_motion
from vigil.scene.outlines import wall_prisms
from vigil.scene.supports import is_shut
from vigil.scene.things import Scene, Thing
from vigil.sim.core.engine import BEARS_OPEN, BEARS_TOGGLE, RayHits
from vigil.sim.core.sight import HEIGHT, WIDTH, directions
from vigil.sim.core.views import rays_of
from vigil.sim.scene_editor import NOTHING, CameraImage, CameraView, Layer

CHUNK_RAYS = 400
"""Greatest number of rays that are tested together against the boxes."""
CONE_STEPS = 3.0
"""Number of steps into which each coordinate (0 to 1) of a ray's direction is divided, to group rays by direction.

The rays of one group can meet only few boxes, which saves tests.
"""
DRAW_STRIDE, LOOK_STRIDE = 16, 8
"""Width and height (pixels) of the block that one ray colours, in the agent's frame and in a camera's image."""
WELD_M = 1e-4
"""Vertices of a mesh that are closer than this (m) count as one vertex."""
MAX_PIECES = 40
"""A mesh with more connected pieces than this becomes a single box."""
THIN_M = 0.002
"""Thickness (m) that is given to flat boxes."""
_FLOOR, _CEILING, _WALL, _SKY = (0.55, 0.45, 0.35), (0.92, 0.92, 0.9), (0.8, 0.78, 0.72), (0.6, 0.75, 0.9)


@dataclass(frozen=True, slots=True, eq=False)
class BoxPiece:
    """A box of an asset, in the asset's frame."""

    low: np.ndarray
    """Lowest corner (3,)."""
    high: np.ndarray
    """Highest corner (3,)."""
    joint: str | None
    """Name of the joint that carries the box; None for the asset's body."""
    roles: int
    """Bits BEARS_OPEN and BEARS_TOGGLE of the box."""
    is_glass: bool
    shown: str
    """When the box is visible: "always", or while the asset is "on", "off" or "broken"."""
    holds_open: bool
    """Whether the box has a surface inside that can be reached at any time."""
    holds_shut: bool
    """Whether the box has a surface inside that can be reached only while the asset is open."""


@dataclass(frozen=True, slots=True, eq=False)
class _Boxes:
    """n boxes in the house's frame."""

    turn: np.ndarray  # (n, 3, 3)
    shift: np.ndarray  # (n, 3)
    low: np.ndarray  # (n, 3), in the box's own frame
    high: np.ndarray
    thing: np.ndarray  # (n,) int32
    roles: np.ndarray  # (n,) uint8
    is_glass: np.ndarray  # (n,) bool
    is_hollow: np.ndarray  # (n,) bool


@cached_while_alive
def box_pieces_of(asset: Asset) -> tuple[BoxPiece, ...]:
    """Return one box for each connected piece of the asset's meshes; a box around a pane is cut into bars."""
    return tuple(
        BoxPiece(
            low - THIN_M / 2,
            high + THIN_M / 2,
            part.joint,
            part.bears_open * BEARS_OPEN | part.bears_toggle * BEARS_TOGGLE,
            part.is_glass,
            part.shown,
            _holds(asset, part, low, high, needs_opening=False),
            _holds(asset, part, low, high, needs_opening=True),
        )
        for part in (*asset.parts, *notice_parts(asset))
        if len(part.mesh.vertices)
        for low, high in _around_panes(_mesh_boxes(part), [] if part.is_glass else _panes(asset, part.joint))
    )


def _panes(asset: Asset, joint: str | None) -> list[tuple[np.ndarray, np.ndarray]]:
    parts = (part for part in asset.parts if part.is_glass and part.joint == joint and len(part.mesh.vertices))
    return [box for part in parts for box in _mesh_boxes(part)]


def _around_panes(
    boxes: list[tuple[np.ndarray, np.ndarray]], panes: list[tuple[np.ndarray, np.ndarray]]
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return the boxes, but replace each box that frames a pane by four bars around the pane (in the x, y plane)."""
    for pane_low, pane_high in panes:
        cut: list[tuple[np.ndarray, np.ndarray]] = []
        for low, high in boxes:
            is_frame = (low[:2] <= pane_low[:2]).all() and (high[:2] >= pane_high[:2]).all()
            cut += _bars(low, high, pane_low, pane_high) if is_frame else [(low, high)]
        boxes = cut
    return boxes


def _bars(
    low: np.ndarray, high: np.ndarray, pane_low: np.ndarray, pane_high: np.ndarray
) -> list[tuple[np.ndarray, np.ndarray]]:
    bars: list[tuple[np.ndarray, np.ndarray]] = []
    for axis in (0, 1):
        before, after = high.copy(), low.copy()
        before[axis], after[axis] = pane_low[axis], pane_high[axis]
        bars += [(low, before), (after, high)]
    return [(a, b) for a, b in bars if float((b - a)[:2].min()) > WELD_M]


def _mesh_boxes(part: Part) -> list[tuple[np.ndarray, np.ndarray]]:
    vertices, faces = part.mesh.vertices.astype(float), part.mesh.faces
    cells = np.round(vertices / WELD_M).astype(np.int64)
    cells -= cells.min(axis=0)
    _, welded = np.unique(np.ravel_multi_index(tuple(cells.T), tuple(cells.max(axis=0) + 1)), return_inverse=True)
    ends = welded[np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]]])]
    count = int(welded.max()) + 1
    links = coo_array((np.ones(len(ends), dtype=np.int8), (ends[:, 0], ends[:, 1])), shape=(count, count))
    found, labels = connected_components(links, directed=False)
    if found > MAX_PIECES:
        return [(vertices.min(axis=0), vertices.max(axis=0))]
    of_vertex = labels[welded]
    pieces = [vertices[of_vertex == label] for label in range(found)]
    return [(piece.min(axis=0), piece.max(axis=0)) for piece in pieces]


def _holds(asset: Asset, part: Part, low: np.ndarray, high: np.ndarray, *, needs_opening: bool) -> bool:
    return any(
        surface.joint == part.joint
        and surface.needs_opening == needs_opening
        and bool((np.array(surface.center)[[0, 2]] > low[[0, 2]]).all())
        and bool((np.array(surface.center)[[0, 2]] < high[[0, 2]]).all())
        and low[1] - 0.01 <= surface.center.y < high[1] - 0.01
        for surface in asset.surfaces
    )


class FakeEngine:
    """An `Engine` without a renderer."""

    name = "fake/1"

    def __init__(self) -> None:
        self._things: list[Thing] = []
        self._rows: list[_Boxes] = []
        self._shell: _Boxes | None = None
        self._shell_colours = np.empty((0, 3))
        self._all: tuple[_Boxes, np.ndarray, np.ndarray] | None = None

    def load(self, scene: Scene) -> None:
        """Build `scene`, replacing any earlier one."""
        self._things = list(scene.things.values())
        self._shell, self._shell_colours = _shell(scene)
        self._rows = [_boxes_of(thing, index) for index, thing in enumerate(self._things)]
        self._all = None

    def prepare(self, scene: Scene) -> None:
        """Do nothing, because the boxes of assets are cached anyway."""

    def update(self, scene: Scene, ids: set[str]) -> None:
        """Copy the present positions and states of the things with these ids."""
        for index, thing in enumerate(self._things):
            if thing.id in ids:
                self._rows[index] = _boxes_of(scene.things[thing.id], index)
        self._all = None

    def cast(
        self,
        origin: Vec3,
        directions: np.ndarray,
        *,
        through_glass: bool,
        only: str | None = None,
        without: Sequence[str] = (),
        within_m: float = math.inf,
    ) -> RayHits:
        """Return what rays along unit `directions` (n, 3) hit first, as `Engine.cast` describes; ignore `within_m`."""
        del within_m
        row, distance = self._meet(origin, directions, through_glass, only, without)
        boxes, _, _ = self._joined()
        thing = np.where(row >= 0, boxes.thing[row], -1).astype(np.int32)
        roles = np.where(row >= 0, boxes.roles[row], 0).astype(np.uint8)
        return RayHits(thing, roles, distance)

    def draw(self, agent: Pose, held: str | None) -> np.ndarray:
        """Return a coarse flat-coloured frame, (480, 640, 3) uint8; the held thing is a square at the bottom."""
        xs, ys = np.arange(DRAW_STRIDE // 2, WIDTH, DRAW_STRIDE), np.arange(DRAW_STRIDE // 2, HEIGHT, DRAW_STRIDE)
        pixels = np.stack(np.meshgrid(xs, ys), axis=-1).reshape(-1, 2)
        row, distance = self._meet(agent.eye, directions(agent, pixels), True)
        coarse = self._colours(row, distance).reshape(len(ys), len(xs), 3)
        if held is not None:
            thing = next(thing for thing in self._things if thing.id == held)
            coarse[-(len(ys) // 5) :, len(xs) * 7 // 16 : len(xs) * 9 // 16] = (_colour(thing)[0] * 255).astype(
                np.uint8
            )
        return np.ascontiguousarray(coarse.repeat(DRAW_STRIDE, axis=0).repeat(DRAW_STRIDE, axis=1))

    def render_view(self, view: CameraView, layers: frozenset[Layer], held: str | None) -> CameraImage:
        """Return a coarse image, with one ray for each block of pixels; the held thing is not drawn."""
        del held
        coarse = replace(view, width=-(-view.width // LOOK_STRIDE), height=-(-view.height // LOOK_STRIDE))
        rays, along = rays_of(coarse)
        row, distance = self._meet(view.eye, rays, True)
        boxes, _, _ = self._joined()
        owner = np.where(row >= 0, boxes.thing[row], NOTHING).astype(np.int32)

        def layer(values: np.ndarray, wanted: Layer) -> np.ndarray | None:
            if wanted not in layers:
                return None
            whole = values.reshape(coarse.height, coarse.width, -1).repeat(LOOK_STRIDE, 0).repeat(LOOK_STRIDE, 1)
            return np.ascontiguousarray(whole[: view.height, : view.width].squeeze())

        return CameraImage(
            layer(self._colours(row, distance), "rgb"),
            layer((distance * along).astype(np.float32), "depth"),
            layer(owner, "things"),
        )

    def _colours(self, row: np.ndarray, distance: np.ndarray) -> np.ndarray:
        """Return the colours (n, 3) uint8 that n rays see. `row` (n,) is the number of the box that each ray met."""
        boxes, _, _ = self._joined()
        owner = np.where(row >= 0, boxes.thing[row], -1)
        tints = np.concatenate([*(_colour(thing) for thing in self._things), np.zeros((1, 3))])
        shell = self._shell_colours[np.minimum(row, len(self._shell_colours) - 1)]
        picture = np.where(owner[:, None] >= 0, tints[owner], np.where(row[:, None] >= 0, shell, np.array([_SKY])))
        is_on = np.array([*(thing.is_toggled for thing in self._things), False])[owner]
        picture[is_on & (boxes.roles[row] & BEARS_TOGGLE > 0)] = 1.0
        shade = 1.0 / (1.0 + 0.04 * np.minimum(distance, 20.0))
        return (picture * shade[:, None] * 255).astype(np.uint8)

    def renderer(self) -> str:
        """Return "none": the engine does not use GL."""
        return "none"

    def close(self) -> None:
        """Release the scene."""
        self._things, self._rows, self._shell, self._all = [], [], None, None

    def _joined(self) -> tuple[_Boxes, np.ndarray, np.ndarray]:
        """Return all n boxes, and the middles (n, 3) and radii (n,) of their bounding spheres. The result is cached."""
        if self._all is None:
            rows = [row for row in (self._shell, *self._rows) if row is not None]
            boxes = _Boxes(*(np.concatenate([getattr(row, name) for row in rows]) for name in _Boxes.__slots__))
            middle = np.einsum("nij,nj->ni", boxes.turn, (boxes.low + boxes.high) / 2) + boxes.shift
            self._all = boxes, middle, np.linalg.norm(boxes.high - boxes.low, axis=1) / 2
        return self._all

    def _meet(
        self, origin: Vec3, rays: np.ndarray, through_glass: bool, only: str | None = None, without: Sequence[str] = ()
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the number (n,) of the box that each of rays (n, 3) meets first (-1: none), and the distance (n,)."""
        boxes, middle, radius = self._joined()
        use = np.ones(len(radius), dtype=bool)
        if through_glass:
            use &= ~boxes.is_glass
        if only is not None:
            use &= np.array([index >= 0 and self._things[index].id == only for index in boxes.thing])
        if without:
            use &= np.array([index < 0 or self._things[index].id not in without for index in boxes.thing])
        rows, distances = np.full(len(rays), -1), np.full(len(rays), np.inf)
        to_box = middle - np.array(origin)
        gap = np.maximum(np.linalg.norm(to_box, axis=1), 1e-9)
        spread = np.where(gap <= radius, np.pi, np.arcsin(np.minimum(1.0, radius / gap)))
        for part in _cones(rays):
            axis = rays[part].mean(axis=0)
            axis /= max(float(np.linalg.norm(axis)), 1e-9)
            cone = float(np.arccos(np.clip((rays[part] @ axis).min(), -1.0, 1.0)))
            angle = np.arccos(np.clip(to_box @ axis / gap, -1.0, 1.0))
            near = np.flatnonzero(use & (angle <= cone + spread + 1e-6))
            if len(near):
                rows[part], distances[part] = _first_met(boxes, near, np.array(origin), rays[part])
        return rows, distances


def _cones(rays: np.ndarray) -> list[np.ndarray]:
    """Return the indices of rays (n, 3) in groups; a group has similar directions and at most `CHUNK_RAYS` rays."""
    if len(rays) < CHUNK_RAYS:
        return [np.arange(len(rays))] if len(rays) else []
    steps = np.floor((rays + 1.0) * CONE_STEPS).astype(np.int64)
    key = (steps[:, 0] << 16) + (steps[:, 1] << 8) + steps[:, 2]
    order = np.argsort(key, kind="stable")
    parts = np.split(order, np.flatnonzero(np.diff(key[order])) + 1)
    return [part[first : first + CHUNK_RAYS] for part in parts for first in range(0, len(part), CHUNK_RAYS)]


def _first_met(boxes: _Boxes, near: np.ndarray, origin: np.ndarray, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    turn = boxes.turn[near]
    start = np.einsum("nji,nj->ni", turn, origin - boxes.shift[near])
    low, high = boxes.low[near] - start, boxes.high[near] - start
    entry, leave = np.array(-np.inf), np.array(np.inf)
    for axis in range(3):  # each axis by itself, because sums over a last axis of three numbers are slow
        along = sum(turn[:, side, axis, None] * rays[:, side] for side in range(3))
        along = np.where(np.abs(along) < 1e-12, 1e-12, along)
        to_low, to_high = low[:, axis, None] / along, high[:, axis, None] / along
        entry = np.maximum(entry, np.minimum(to_low, to_high))
        leave = np.minimum(leave, np.maximum(to_low, to_high))
    is_hollow = boxes.is_hollow[near][:, None]
    is_met = (leave > entry) & (leave > 0) & (is_hollow | (entry > 0))
    reach = np.where(is_met, np.where(is_hollow, leave, entry), np.inf)
    first = reach.argmin(axis=0)
    distance = reach[first, np.arange(len(rays))]
    return np.where(np.isfinite(distance), near[first], -1), distance


def _is_shown(piece: BoxPiece, thing: Thing) -> bool:
    if piece.shown == "broken":
        return thing.is_broken
    return piece.shown == "always" or (piece.shown == "on") == thing.is_toggled


def _boxes_of(thing: Thing, index: int) -> _Boxes:
    is_met = thing.is_present and not thing.is_held
    pieces = [piece for piece in (box_pieces_of(thing.asset) if is_met else ()) if _is_shown(piece, thing)]
    motions = {joint: part_motion(thing, joint) for joint in {piece.joint for piece in pieces}}
    is_open = not is_shut(thing) or thing.openness > OPEN_ABOVE
    hollow = [piece.holds_open or (piece.holds_shut and is_open) for piece in pieces]
    return _stack(
        [(motions[piece.joint], piece.low, piece.high) for piece in pieces],
        [index] * len(pieces),
        [(piece.roles, piece.is_glass, is_hollow) for piece, is_hollow in zip(pieces, hollow, strict=True)],
    )


def _stack(
    places: list[tuple[Motion, np.ndarray, np.ndarray]], things: list[int], kinds: list[tuple[int, bool, bool]]
) -> _Boxes:
    count = len(places)
    return _Boxes(
        np.array([motion.turn for motion, _, _ in places]).reshape(count, 3, 3),
        np.array([motion.shift for motion, _, _ in places]).reshape(count, 3),
        np.array([low for _, low, _ in places]).reshape(count, 3),
        np.array([high for _, _, high in places]).reshape(count, 3),
        np.array(things, dtype=np.int32),
        np.array([roles for roles, _, _ in kinds], dtype=np.uint8),
        np.array([is_glass for _, is_glass, _ in kinds], dtype=bool),
        np.array([is_hollow for _, _, is_hollow in kinds], dtype=bool),
    )


def _shell(scene: Scene) -> tuple[_Boxes, np.ndarray]:
    """Return floors, ceilings and walls as n flat boxes, with their colours (n, 3)."""
    places: list[tuple[Motion, np.ndarray, np.ndarray]] = []
    colours: list[tuple[float, float, float]] = []
    for room in scene.rooms:
        (left, front), (right, back) = room.polygon.min(axis=0), room.polygon.max(axis=0)
        for low, high, colour in ((-THIN_M, 0.0, _FLOOR), (room.height, room.height + THIN_M, _CEILING)):
            places.append((STILL, np.array([left, low, front]), np.array([right, high, back])))
            colours.append(colour)
    for panel in scene.panels:
        for prism in wall_prisms(panel):
            start, end = prism.polygon[0], prism.polygon[1]
            length = float(np.hypot(*(end - start)))
            along = (end - start) / length
            turn = np.array([[along[0], 0.0, -along[1]], [0.0, 1.0, 0.0], [along[1], 0.0, along[0]]])
            motion = Motion(turn, np.array([start[0], 0.0, start[1]]))
            low, high = np.array([0.0, prism.bottom, -THIN_M / 2]), np.array([length, prism.top, THIN_M / 2])
            places.append((motion, low, high))
            colours.append(_WALL)
    return _stack(places, [-1] * len(places), [(0, False, False)] * len(places)), np.array(colours).reshape(-1, 3)


def _colour(thing: Thing) -> np.ndarray:
    code = zlib.crc32(thing.category.encode())
    return np.array([[0.25 + 0.7 * ((code >> shift) & 255) / 255 for shift in (0, 8, 16)]])
