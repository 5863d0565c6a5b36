"""What the camera sees, counted by rays: projection, clicks, visible pixels.

The camera: vertical field of view 90 degrees, 640 x 480, at the agent's eye; a ray goes through each pixel's centre
(u + 0.5, v + 0.5). Nothing here looks at a drawn frame, so nothing depends on a GPU driver. Source: protocol.md
sections 2.1 and 4.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from cachetools import LRUCache

from vigil.base.geometry import Pose, Vec3
from vigil.scene.geometry import box_corners, part_boxes, part_motion
from vigil.scene.portals import Extent, Portals
from vigil.scene.things import Scene, Thing
from vigil.sim.core.engine import BEARS_OPEN, BEARS_TOGGLE, Engine, RayHits

WIDTH, HEIGHT = 640, 480
FOCAL_PX = HEIGHT / 2
"""Vertical field of view 90 degrees: tan(45) = 1."""
NEAR_M = 0.02
RAYS_PER_OBJECT = 1600
NEAR_CLICK_PX = 3
VISIBLE_PX = 200
VISIBLE_SHARE = 0.25
BEYOND_M = 0.01
"""What a ray that is to meet a thing still looks at behind it."""
MAX_CACHED_POSES = 64
"""From how many poses what was seen is kept while nothing changes."""
MAX_CACHED_EYES = 4096
"""Of so many pairs of an eye and a thing it is kept, while nothing changes, whether walls hide the thing."""
MAX_CACHED_OUTLINES = 16
"""How many outlines are kept while nothing changes: what may show enough is looked at next."""
_EDGES = [(i, i | bit) for i in range(8) for bit in (1, 2, 4) if not i & bit]


@dataclass(frozen=True, slots=True)
class Lens:
    """The size of a picture, and how far before the eye a pixel is as wide as one metre; the agent's own by default."""

    width: int = WIDTH
    height: int = HEIGHT
    focal_px: float = FOCAL_PX


AGENT_LENS = Lens()


@dataclass(frozen=True, slots=True)
class PixelWindow:
    """A rectangle of pixels sampled with a stride: left <= x < right, top <= y < bottom."""

    left: int
    top: int
    right: int
    bottom: int
    stride: int
    is_whole: bool
    """The projected box lies wholly inside the frame and before the camera."""

    def pixels(self) -> np.ndarray:
        """Return the sampled pixels (n, 2), on a lattice fixed in the frame."""
        first = self.stride // 2
        xs = np.arange(self.left + (first - self.left) % self.stride, self.right, self.stride)
        ys = np.arange(self.top + (first - self.top) % self.stride, self.bottom, self.stride)
        return np.stack(np.meshgrid(xs, ys), axis=-1).reshape(-1, 2)

    @property
    def most_px(self) -> int:
        """What is counted where the rays through all sampled pixels meet something; no count is above it."""
        first = self.stride // 2
        columns = len(range(self.left + (first - self.left) % self.stride, self.right, self.stride))
        rows = len(range(self.top + (first - self.top) % self.stride, self.bottom, self.stride))
        return columns * rows * self.stride**2


@dataclass(frozen=True, slots=True, eq=False)
class _Outline:
    """What the frame would show of a whole thing if there were nothing else."""

    rays: np.ndarray
    """(n, 3) the unit directions that meet it, and ..."""
    hits: RayHits
    """what they meet."""


@dataclass(frozen=True, slots=True)
class ObjectVisibility:
    """What is seen of one thing."""

    visible: bool = False
    visible_px: int = 0
    open_px: int = 0
    toggle_px: int = 0
    nearest_m: float | None = None


NOT_VISIBLE = ObjectVisibility()


def camera_axes(agent: Pose) -> np.ndarray:
    """Return the (3, 3) rows right, up and forward of the camera in the house's frame."""
    yaw, pitch = math.radians(agent.rotation), math.radians(agent.horizon)
    right = (math.cos(yaw), 0.0, -math.sin(yaw))
    up = (math.sin(yaw) * math.sin(pitch), math.cos(pitch), math.cos(yaw) * math.sin(pitch))
    forward = (math.sin(yaw) * math.cos(pitch), -math.sin(pitch), math.cos(yaw) * math.cos(pitch))
    return np.array([right, up, forward])


def directions(agent: Pose, pixels: np.ndarray, lens: Lens = AGENT_LENS) -> np.ndarray:
    """Return the unit directions (n, 3) through the centres of (n, 2) pixels."""
    right = (pixels[:, 0] + 0.5 - lens.width / 2) / lens.focal_px
    up = (lens.height / 2 - pixels[:, 1] - 0.5) / lens.focal_px
    rays = np.column_stack([right, up, np.ones(len(pixels))])
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    return rays @ camera_axes(agent)


def project(agent: Pose, points: np.ndarray, lens: Lens = AGENT_LENS) -> np.ndarray:
    """Return (n, 3): x and y (pixels, continuous), and depth (m) along the view; only a depth > 0 has an x and y."""
    local = (points - np.array(agent.eye)) @ camera_axes(agent).T
    depth = np.where(np.abs(local[:, 2]) < 1e-9, 1e-9, local[:, 2])
    x = lens.width / 2 + lens.focal_px * local[:, 0] / depth
    y = lens.height / 2 - lens.focal_px * local[:, 1] / depth
    return np.column_stack([x, y, local[:, 2]])


def pixel_of(agent: Pose, point: Vec3) -> tuple[int, int] | None:
    """Return the pixel that a point projects to; None outside the frame or behind."""
    x, y, depth = project(agent, np.array([point]))[0]
    if depth < NEAR_M or not (0 <= x < WIDTH and 0 <= y < HEIGHT):
        return None
    return int(x), int(y)


def window_of(agent: Pose, boxes: list[np.ndarray], lens: Lens = AGENT_LENS) -> PixelWindow | None:
    """Return the pixels that boxes, each of corners (8, 3), can cover; None outside of the frame."""
    points, is_before = _clipped(agent, boxes)
    if not len(points):
        return None
    flat = project(agent, points, lens)[:, :2]
    left, top = (math.floor(value - 0.5) for value in flat.min(axis=0))
    right, bottom = (math.ceil(value + 0.5) for value in flat.max(axis=0))
    is_whole = is_before and left >= 0 and top >= 0 and right <= lens.width and bottom <= lens.height
    left, top, right, bottom = max(left, 0), max(top, 0), min(right, lens.width), min(bottom, lens.height)
    if left >= right or top >= bottom:
        return None
    stride = max(1, math.ceil(math.sqrt((right - left) * (bottom - top) / RAYS_PER_OBJECT)))
    return PixelWindow(left, top, right, bottom, stride, is_whole)


def farthest_m(eye: Vec3, boxes: list[np.ndarray]) -> float:
    """Return a distance from an eye that nothing in boxes, each of corners (8, 3), is beyond."""
    return float(np.linalg.norm(np.concatenate(boxes) - np.array(eye), axis=1).max()) + BEYOND_M


def boxes_of(things: Iterable[Thing]) -> list[np.ndarray]:
    """Return the corners (8, 3) of the boxes of all parts of some things, leaves where they are now."""
    return [
        part_motion(thing, joint)(box_corners(low, high))
        for thing in things
        for joint, low, high in part_boxes(thing.asset)
    ]


def _clipped(agent: Pose, boxes: list[np.ndarray]) -> tuple[np.ndarray, bool]:
    """Return the corners before the near plane, with the crossings of box edges through it, and whether all were."""
    forward, eye = camera_axes(agent)[2], np.array(agent.eye)
    kept: list[np.ndarray] = []
    is_before = True
    for corners in boxes:
        depth = (corners - eye) @ forward
        before = depth >= NEAR_M
        is_before = is_before and bool(before.all())
        kept.append(corners[before])
        if before.any() and not before.all():
            for a, b in _EDGES:
                if before[a] != before[b]:
                    share = (NEAR_M - depth[a]) / (depth[b] - depth[a])
                    kept.append((corners[a] + share * (corners[b] - corners[a]))[None])
    return np.concatenate(kept), is_before


class Sight:
    """Counts what the camera sees of a scene's things."""

    def __init__(self, engine: Engine, scene: Scene) -> None:
        self._engine, self._scene = engine, scene
        self._things = list(scene.things.values())
        self._index = {thing_id: index for index, thing_id in enumerate(scene.things)}
        self._parts: dict[str, list[Thing]] = {}
        """The drawers of furniture, which are seen as part of it."""
        for thing in self._things:
            if thing.is_drawer and thing.parent is not None:
                self._parts.setdefault(thing.parent, []).append(thing)
        self._seen: dict[Pose, dict[str, ObjectVisibility]] = {}
        """From where which things were seen, and how, since anything changed: the same is asked again and again."""
        self._boxes: dict[str, list[np.ndarray]] = {}
        """The corners of the boxes of whole things, as they have been since anything changed."""
        self._outlines: LRUCache[tuple[Pose, str], _Outline] = LRUCache(MAX_CACHED_OUTLINES)
        """Outlines of things from poses, as they have been since anything changed."""
        self._behind_walls: LRUCache[tuple[Vec3, str], bool] = LRUCache(MAX_CACHED_EYES)
        """From which eyes walls hide which things, since anything changed, and ..."""
        self._extents: dict[str, Extent] = {}
        """what things take of the house."""

    @cached_property
    def _portals(self) -> Portals:
        return Portals(self._scene)

    def clear_cache(self) -> None:
        """Must be called when anything in the scene has changed."""
        self._seen.clear()
        self._boxes.clear()
        self._outlines.clear()
        self._behind_walls.clear()
        self._extents.clear()

    def click(self, agent: Pose, x: int, y: int) -> tuple[Thing | None, Vec3 | None]:
        """Return the thing that a pixel's ray meets and the point where it meets something; panes stop it."""
        rays = directions(agent, np.array([[x, y]]))
        hits = self._engine.cast(agent.eye, rays, through_glass=False)
        if not np.isfinite(hits.distances[0]):
            return None, None
        point = np.array(agent.eye) + float(hits.distances[0]) * rays[0]
        thing = self._things[int(hits.things[0])] if hits.things[0] >= 0 else None
        return thing, Vec3(*(float(value) for value in point))

    def ids_near_pixel(self, agent: Pose, x: int, y: int) -> tuple[str, ...]:
        """Return the sorted ids of the things within 3 px of a pixel, with a drawer the furniture that it is of."""
        reach = np.arange(-NEAR_CLICK_PX, NEAR_CLICK_PX + 1)
        disc = np.stack(np.meshgrid(reach, reach), axis=-1).reshape(-1, 2)
        pixels = disc[(disc**2).sum(axis=1) <= NEAR_CLICK_PX**2] + np.array([x, y])
        pixels = pixels[((pixels >= 0) & (pixels < [WIDTH, HEIGHT])).all(axis=1)]
        hit = np.unique(self._engine.cast(agent.eye, directions(agent, pixels), through_glass=False).things)
        met = [self._things[index] for index in hit if index >= 0]
        wholes = {thing.parent for thing in met if thing.is_drawer and thing.parent is not None}
        return tuple(sorted({thing.id for thing in met} | wholes))

    def click_pixel(self, agent: Pose, thing: Thing) -> np.ndarray:
        """Return the sampled pixels (n, 2) on which a click hits the thing."""
        boxes = boxes_of([thing])
        window = window_of(agent, boxes) if thing.is_present and not thing.is_held else None
        if window is None:
            return np.empty((0, 2), dtype=int)
        pixels = window.pixels()
        rays, within_m = directions(agent, pixels), farthest_m(agent.eye, boxes)
        hits = self._engine.cast(agent.eye, rays, through_glass=False, within_m=within_m)
        return pixels[hits.things == self._index[thing.id]]

    def meets(self, eye: Vec3, rays: np.ndarray, thing: Thing, *, through_glass: bool) -> np.ndarray:
        """Return which unit directions (n, 3) from any eye meet the thing before all else; its own glass is of it."""
        if self._is_behind_walls(eye, thing):
            return np.zeros(len(rays), dtype=bool)
        within_m = farthest_m(eye, self._boxes_of(thing))
        hits = self._engine.cast(eye, rays, through_glass=through_glass, within_m=within_m)
        is_met = self._is_of(hits.things, thing)
        if through_glass and _has_glass(thing):
            alone = self._engine.cast(eye, rays, through_glass=False, only=thing.id)
            is_met |= alone.distances < hits.distances
        return is_met

    def see(self, agent: Pose, things: list[Thing]) -> dict[str, ObjectVisibility]:
        """Return what is seen of each thing. Rays pass through the glass of other things; a vase of glass is seen."""
        if agent not in self._seen and len(self._seen) >= MAX_CACHED_POSES:
            self._seen.clear()
        known = self._seen.setdefault(agent, {})
        missing = [thing for thing in things if thing.id not in known]
        if missing:
            known |= self._see(agent, missing)
        return {thing.id: known[thing.id] for thing in things}

    def may_be_visible(self, agent: Pose, thing: Thing, min_px: int) -> bool:
        """Whether so many pixels of a thing would be seen if nothing stood before it; sooner told than what is seen."""
        window = self._window_of(agent, thing)
        if window is None or window.most_px < min_px:
            return min_px <= 0
        return len(self._outline(agent, thing, window).rays) * window.stride**2 >= min_px

    def _see(self, agent: Pose, things: list[Thing]) -> dict[str, ObjectVisibility]:
        """Casts each thing's outline alone first, then into the scene."""
        found = {thing.id: NOT_VISIBLE for thing in things}
        for thing in things:
            window = self._window_of(agent, thing)
            if window is None:
                continue
            outline = self._outline(agent, thing, window)
            is_hit, roles = self._visible_rays(agent, thing, outline)
            if is_hit.any():
                found[thing.id] = _visibility_from_rays(thing, window, is_hit, roles, outline.hits.distances)
        return found

    def _window_of(self, agent: Pose, thing: Thing) -> PixelWindow | None:
        """Return the pixels that a whole thing can cover; None where it is held, absent or outside of the frame."""
        is_there = thing.is_present and not thing.is_held
        return window_of(agent, self._boxes_of(thing)) if is_there else None

    def _outline(self, agent: Pose, thing: Thing, window: PixelWindow) -> _Outline:
        """Return what the rays through a window would meet of a thing if there were nothing else."""
        if (agent, thing.id) not in self._outlines:
            rays = directions(agent, window.pixels())
            alone = self._alone(agent, thing, rays)
            is_met = self._is_of(alone.things, thing)
            self._outlines[agent, thing.id] = _Outline(rays[is_met], _only_rows(alone, is_met))
        return self._outlines[agent, thing.id]

    def _visible_rays(self, agent: Pose, thing: Thing, outline: _Outline) -> tuple[np.ndarray, np.ndarray]:
        """Return which rays of an outline meet a whole thing before all else, and the roles of what each meets of it.

        What has glass is cast at once more, for rays pass through its panes to what is behind them.
        """
        whole = self._with_drawers(thing)
        has_glass = any(map(_has_glass, whole))
        hidden = [] if has_glass else [each.id for each in whole]
        within_m = farthest_m(agent.eye, self._boxes_of(thing))
        hits = self._engine.cast(agent.eye, outline.rays, through_glass=True, without=hidden, within_m=within_m)
        alone = outline.hits
        is_nearer = alone.distances < hits.distances
        if not has_glass:
            is_first = (alone.distances == hits.distances) & (alone.things < hits.things)
            return is_nearer | is_first, alone.roles
        is_own = self._is_of(hits.things, thing)
        return is_own | is_nearer, np.where(is_own, hits.roles, alone.roles)

    def _with_drawers(self, thing: Thing) -> list[Thing]:
        """Return a thing with its drawers that are things too."""
        return [thing, *(part for part in self._parts.get(thing.id, ()) if part.is_present)]

    def _boxes_of(self, thing: Thing) -> list[np.ndarray]:
        """Return the corners (8, 3) of the boxes of a whole thing; what is in the hand moves without being told."""
        if thing.is_held:
            return boxes_of(self._with_drawers(thing))
        if thing.id not in self._boxes:
            self._boxes[thing.id] = boxes_of(self._with_drawers(thing))
        return self._boxes[thing.id]

    def _is_behind_walls(self, eye: Vec3, thing: Thing) -> bool:
        """Whether walls alone hide all of a thing from an eye: this is sooner known than what rays meet."""
        if thing.is_held:
            return False
        if (eye, thing.id) not in self._behind_walls:
            if thing.id not in self._extents:
                corners = np.concatenate(self._boxes_of(thing))[:, [0, 2, 1]]
                self._extents[thing.id] = self._portals.extent(
                    corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
                )
            seen = self._portals.may_see((eye.x, eye.z, eye.y), self._extents[thing.id])
            self._behind_walls[eye, thing.id] = not seen
        return self._behind_walls[eye, thing.id]

    def _is_of(self, met: np.ndarray, thing: Thing) -> np.ndarray:
        """Return which of the things that rays met (n,) are a thing, or drawers of it."""
        own = [self._index[each.id] for each in self._with_drawers(thing)]
        return met == own[0] if len(own) == 1 else np.isin(met, own)

    def _alone(self, agent: Pose, thing: Thing, rays: np.ndarray) -> RayHits:
        """Return what rays meet of a thing and its drawers, as if there were nothing else."""
        first, *rest = (
            self._engine.cast(agent.eye, rays, through_glass=False, only=each.id) for each in self._with_drawers(thing)
        )
        for hits in rest:
            nearer = hits.distances < first.distances
            first = RayHits(*(np.where(nearer, new, old) for new, old in zip(_rows(hits), _rows(first), strict=True)))
        return first


def _only_rows(hits: RayHits, chosen: np.ndarray) -> RayHits:
    return RayHits(*(values[chosen] for values in _rows(hits)))


def _rows(hits: RayHits) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return hits.things, hits.roles, hits.distances


def _has_glass(thing: Thing) -> bool:
    return any(part.is_glass for part in thing.asset.parts)


def _visibility_from_rays(
    thing: Thing, window: PixelWindow, is_hit: np.ndarray, roles: np.ndarray, distances: np.ndarray
) -> ObjectVisibility:
    """Return what the rays of a thing's outline say; strictly visible: >= 200 px and >= 25 % of it, or all of it."""
    seen, whole = int(is_hit.sum()), len(is_hit)
    visible_px = seen * window.stride**2
    is_plain = visible_px >= VISIBLE_PX and seen >= VISIBLE_SHARE * whole
    return ObjectVisibility(
        visible=is_plain or (window.is_whole and seen == whole),
        visible_px=visible_px,
        open_px=_count_bearing(roles[is_hit], BEARS_OPEN) * window.stride**2 if thing.is_openable else 0,
        toggle_px=_count_bearing(roles[is_hit], BEARS_TOGGLE) * window.stride**2 if thing.is_toggleable else 0,
        nearest_m=float(distances[is_hit].min()),
    )


def _count_bearing(roles: np.ndarray, bit: int) -> int:
    """Return how many hits are on parts that bear a state."""
    return int(np.count_nonzero(roles & bit))
