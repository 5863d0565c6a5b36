"""What the agent's camera sees, found by casting rays: projection, clicks and numbers of visible pixels.

The camera is at the agent's eye, with a vertical field of view of 90 degrees and 640 x 480 pixels. A ray goes through
each pixel's centre (u + 0.5, v + 0.5). No drawn frame is used, so no result depends on a GPU driver. Source:
protocol.md sections 2.1 and 4.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from cachetools import LRUCache

from vigil.base.geometry import Pose, Vec3
from vigil.protocol.observation import FRAME_HEIGHT, FRAME_WIDTH
from vigil.scene.geometry import box_corners, part_boxes, part_motion
from vigil.scene.portals import Extent, Portals
from vigil.scene.things import Scene, Thing
from vigil.sim.core.engine import BEARS_OPEN, BEARS_TOGGLE, Engine, RayHits

WIDTH, HEIGHT = FRAME_WIDTH, FRAME_HEIGHT
FOCAL_PX = HEIGHT / 2
"""Focal length in pixels: half the image's height for a vertical field of view of 90 degrees, since tan(45) = 1."""
NEAR_M = 0.02
"""Depth (m) of the camera's near plane; nothing nearer than this is visible."""
RAYS_PER_OBJECT = 1600
"""Approximate limit on the rays cast for one object. For an object with more pixels, only every n-th pixel is used."""
NEAR_CLICK_PX = 3
"""Objects within this radius (pixels) around a click count as near the click."""
VISIBLE_PX = 200
"""Least number of visible pixels of an object that counts as strictly visible."""
VISIBLE_SHARE = 0.25
"""Least share of an object's outline that must be visible for the object to count as strictly visible."""
BEYOND_M = 0.01
"""Rays that are cast at an object reach this far (m) behind the object's farthest corner."""
MAX_CACHED_POSES = 64
"""Number of poses for which the visible things are cached. A change in the scene empties the cache."""
MAX_CACHED_EYES = 4096
"""Number of (eye, thing) pairs for which the cache says whether walls hide the thing from the eye. A change in the
scene empties the cache."""
MAX_CACHED_OUTLINES = 16
"""Number of cached outlines; they are cached because `see` often follows `may_be_visible`. A change in the scene
empties the cache."""
_EDGES = [(i, i | bit) for i in range(8) for bit in (1, 2, 4) if not i & bit]
"""Edges of a box, each as the numbers of its two corners in `box_corners`."""


@dataclass(frozen=True, slots=True)
class Lens:
    """The size and the focal length of a camera's image, in pixels. The defaults are those of the agent's camera."""

    width: int = WIDTH
    height: int = HEIGHT
    focal_px: float = FOCAL_PX


AGENT_LENS = Lens()


@dataclass(frozen=True, slots=True)
class PixelWindow:
    """A rectangle of pixels, left <= x < right and top <= y < bottom. Every `stride`-th row and column is sampled."""

    left: int
    top: int
    right: int
    bottom: int
    stride: int
    is_whole: bool
    """Whether the boxes for which the window was made are wholly inside the frame and in front of the camera."""

    def pixels(self) -> np.ndarray:
        """Return the sampled pixels (n, 2); they lie on a lattice that is the same for all windows with this stride."""
        first = self.stride // 2
        xs = np.arange(self.left + (first - self.left) % self.stride, self.right, self.stride)
        ys = np.arange(self.top + (first - self.top) % self.stride, self.bottom, self.stride)
        return np.stack(np.meshgrid(xs, ys), axis=-1).reshape(-1, 2)

    @property
    def most_px(self) -> int:
        """Greatest number of pixels that can be counted, which is reached if every sampled ray meets the thing."""
        first = self.stride // 2
        columns = len(range(self.left + (first - self.left) % self.stride, self.right, self.stride))
        rows = len(range(self.top + (first - self.top) % self.stride, self.bottom, self.stride))
        return columns * rows * self.stride**2


@dataclass(frozen=True, slots=True, eq=False)
class _Outline:
    """The part of the frame that a thing with its drawers would cover if nothing else hid it."""

    rays: np.ndarray
    """Unit directions (n, 3) that meet the thing."""
    hits: RayHits
    """Where each of the n `rays` hits the thing."""


@dataclass(frozen=True, slots=True)
class ObjectVisibility:
    """What the camera sees of one thing."""

    visible: bool = False
    """Whether the thing is strictly visible."""
    visible_px: int = 0
    """Number of the thing's visible pixels."""
    open_px: int = 0
    """Number of visible pixels of the parts that show whether the thing is open."""
    toggle_px: int = 0
    """Number of visible pixels of the parts that show whether the thing is switched on."""
    nearest_m: float | None = None
    """Least distance (m) from the eye to a visible point of the thing; None when no point is visible."""


NOT_VISIBLE = ObjectVisibility()


def camera_axes(agent: Pose) -> np.ndarray:
    """Return a matrix (3, 3) whose rows are the camera's unit vectors right, up and forward in the house's frame."""
    yaw, pitch = math.radians(agent.rotation), math.radians(agent.horizon)
    right = (math.cos(yaw), 0.0, -math.sin(yaw))
    up = (math.sin(yaw) * math.sin(pitch), math.cos(pitch), math.cos(yaw) * math.sin(pitch))
    forward = (math.sin(yaw) * math.cos(pitch), -math.sin(pitch), math.cos(yaw) * math.cos(pitch))
    return np.array([right, up, forward])


def directions(agent: Pose, pixels: np.ndarray, lens: Lens = AGENT_LENS) -> np.ndarray:
    """Return the unit directions (n, 3) from the eye through the centres of pixels (n, 2)."""
    right = (pixels[:, 0] + 0.5 - lens.width / 2) / lens.focal_px
    up = (lens.height / 2 - pixels[:, 1] - 0.5) / lens.focal_px
    rays = np.column_stack([right, up, np.ones(len(pixels))])
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    return rays @ camera_axes(agent)


def project(agent: Pose, points: np.ndarray, lens: Lens = AGENT_LENS) -> np.ndarray:
    """Return the projections (n, 3) of points: x and y (fractional pixels) and depth (m) along the view direction.

    x and y are valid only if the depth is above 0.
    """
    local = (points - np.array(agent.eye)) @ camera_axes(agent).T
    depth = np.where(np.abs(local[:, 2]) < 1e-9, 1e-9, local[:, 2])
    x = lens.width / 2 + lens.focal_px * local[:, 0] / depth
    y = lens.height / 2 - lens.focal_px * local[:, 1] / depth
    return np.column_stack([x, y, local[:, 2]])


def pixel_of(agent: Pose, point: Vec3) -> tuple[int, int] | None:
    """Return the pixel to which a point projects; None if the point is outside the frame or behind the camera."""
    x, y, depth = project(agent, np.array([point]))[0]
    if depth < NEAR_M or not (0 <= x < WIDTH and 0 <= y < HEIGHT):
        return None
    return int(x), int(y)


def pixels_near(x: int, y: int) -> np.ndarray:
    """Return the pixels (n, 2) of the frame within `NEAR_CLICK_PX` of a pixel."""
    reach = np.arange(-NEAR_CLICK_PX, NEAR_CLICK_PX + 1)
    disc = np.stack(np.meshgrid(reach, reach), axis=-1).reshape(-1, 2)
    pixels = disc[(disc**2).sum(axis=1) <= NEAR_CLICK_PX**2] + np.array([x, y])
    return pixels[((pixels >= 0) & (pixels < [WIDTH, HEIGHT])).all(axis=1)]


def window_of(agent: Pose, boxes: list[np.ndarray], lens: Lens = AGENT_LENS) -> PixelWindow | None:
    """Return the window of pixels that boxes, each given as corners (8, 3), can cover; None if they are out of view."""
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
    """Return slightly more than the distance (m) from an eye to the farthest of the boxes' corners (8, 3)."""
    return float(np.linalg.norm(np.concatenate(boxes) - np.array(eye), axis=1).max()) + BEYOND_M


def boxes_of(things: Iterable[Thing]) -> list[np.ndarray]:
    """Return the corners (8, 3) of the boxes of all parts of the things, at their present openness."""
    return [
        part_motion(thing, joint)(box_corners(low, high))
        for thing in things
        for joint, low, high in part_boxes(thing.asset)
    ]


def _clipped(agent: Pose, boxes: list[np.ndarray]) -> tuple[np.ndarray, bool]:
    """Return points (n, 3) around the part of the boxes beyond the near plane, and whether the boxes are wholly beyond
    it.

    The points are the boxes' corners beyond the plane, and the points where the boxes' edges cross the plane.
    """
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
    """What the agent's camera sees of a scene: which thing a click meets, and how much of a thing is visible."""

    def __init__(self, engine: Engine, scene: Scene) -> None:
        self._engine, self._scene = engine, scene
        self._things = list(scene.things.values())
        self._index = {thing_id: index for index, thing_id in enumerate(scene.things)}
        self._parts: dict[str, list[Thing]] = {}
        """Id of a piece of furniture -> its drawers, which are seen as part of the furniture."""
        for thing in self._things:
            if thing.is_drawer and thing.parent is not None:
                self._parts.setdefault(thing.parent, []).append(thing)
        self._seen: dict[Pose, dict[str, ObjectVisibility]] = {}
        """Cached results of `see`, by pose and id. A change in the scene empties all caches of this object."""
        self._boxes: dict[str, list[np.ndarray]] = {}
        """Cached corners of the boxes of things, each together with its drawers, by id."""
        self._outlines: LRUCache[tuple[Pose, str], _Outline] = LRUCache(MAX_CACHED_OUTLINES)
        """Cached outlines of things, by pose and id."""
        self._behind_walls: LRUCache[tuple[Vec3, str], bool] = LRUCache(MAX_CACHED_EYES)
        """Whether walls alone hide a thing from an eye: cached results by eye and id."""
        self._extents: dict[str, Extent] = {}
        """Cached extents of things, each together with its drawers, by id."""

    @cached_property
    def _portals(self) -> Portals:
        return Portals(self._scene)

    def clear_cache(self) -> None:
        """Empty all caches. It must be called when anything in the scene has changed."""
        self._seen.clear()
        self._boxes.clear()
        self._outlines.clear()
        self._behind_walls.clear()
        self._extents.clear()

    def click(self, agent: Pose, x: int, y: int) -> tuple[Thing | None, Vec3 | None]:
        """Return the thing and the point (m) that a pixel's ray meets first; glass stops the ray.

        The thing is None if the ray meets e.g. a wall, which has no id. Both are None if the ray meets nothing.
        """
        rays = directions(agent, np.array([[x, y]]))
        hits = self._engine.cast(agent.eye, rays, through_glass=False)
        if not np.isfinite(hits.distances[0]):
            return None, None
        point = np.array(agent.eye) + float(hits.distances[0]) * rays[0]
        thing = self._things[int(hits.things[0])] if hits.things[0] >= 0 else None
        return thing, Vec3(*(float(value) for value in point))

    def ids_near_pixel(self, agent: Pose, x: int, y: int) -> tuple[str, ...]:
        """Return the sorted ids of the things within 3 px of a pixel; for a drawer, its furniture is listed, too."""
        rays = directions(agent, pixels_near(x, y))
        hit = np.unique(self._engine.cast(agent.eye, rays, through_glass=False).things)
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
        """Return a mask (n,) of the rays from `eye` along unit directions (n, 3) that meet `thing` first.

        The thing's own glass counts as part of the thing.
        """
        if self._is_behind_walls(eye, thing):
            return np.zeros(len(rays), dtype=bool)
        within_m = farthest_m(eye, self._boxes_of(thing))
        hits = self._engine.cast(eye, rays, through_glass=through_glass, within_m=within_m)
        is_met = self._is_of(hits.things, thing)
        if through_glass and thing.asset.has_glass:
            alone = self._engine.cast(eye, rays, through_glass=False, only=thing.id)
            is_met |= alone.distances < hits.distances
        return is_met

    def see(self, agent: Pose, things: list[Thing]) -> dict[str, ObjectVisibility]:
        """Return what the camera sees of each thing: id -> visibility.

        Rays pass through the glass of other things; the thing's own glass counts as part of the thing.
        """
        if agent not in self._seen and len(self._seen) >= MAX_CACHED_POSES:
            self._seen.clear()
        known = self._seen.setdefault(agent, {})
        missing = [thing for thing in things if thing.id not in known]
        if missing:
            known |= self._see(agent, missing)
        return {thing.id: known[thing.id] for thing in things}

    def may_be_visible(self, agent: Pose, thing: Thing, min_px: int) -> bool:
        """Return whether at least `min_px` pixels of a thing would be visible if nothing else hid it. This method is
        faster than `see`."""
        window = self._window_of(agent, thing)
        if window is None or window.most_px < min_px:
            return min_px <= 0
        return len(self._outline(agent, thing, window).rays) * window.stride**2 >= min_px

    def is_in_frame(self, agent: Pose, thing: Thing) -> bool:
        """Return whether at least one pixel shows a thing.

        Unlike `see`, this method tests every pixel: `see` may miss a thin part between two sampled pixels. It is slower
        than `see` where the thing covers much of the frame but is hidden.
        """
        if self.see(agent, [thing])[thing.id].visible_px:
            return True
        window = self._window_of(agent, thing)
        if window is None or window.stride == 1 or self._is_behind_walls(agent.eye, thing):
            return False
        outline = self._cast_outline(agent, thing, replace(window, stride=1))
        return bool(self._visible_rays(agent, thing, outline)[0].any())

    def _see(self, agent: Pose, things: list[Thing]) -> dict[str, ObjectVisibility]:
        """Return what the camera sees of each thing, without a cache.

        Rays are first cast at the thing alone. Those rays that meet it are then cast into the whole scene.
        """
        found = {thing.id: NOT_VISIBLE for thing in things}
        for thing in things:
            window = self._window_of(agent, thing)
            if window is None or self._is_behind_walls(agent.eye, thing):
                continue
            outline = self._outline(agent, thing, window)
            is_hit, roles = self._visible_rays(agent, thing, outline)
            if is_hit.any():
                found[thing.id] = _visibility_from_rays(thing, window, is_hit, roles, outline.hits.distances)
        return found

    def _window_of(self, agent: Pose, thing: Thing) -> PixelWindow | None:
        """Return the window of pixels that a thing with its drawers can cover; None if held, absent or out of view."""
        is_there = thing.is_present and not thing.is_held
        return window_of(agent, self._boxes_of(thing)) if is_there else None

    def _outline(self, agent: Pose, thing: Thing, window: PixelWindow) -> _Outline:
        """Return the outline of a thing, found by rays through the pixels of a window. Outlines are cached."""
        if (agent, thing.id) not in self._outlines:
            self._outlines[agent, thing.id] = self._cast_outline(agent, thing, window)
        return self._outlines[agent, thing.id]

    def _cast_outline(self, agent: Pose, thing: Thing, window: PixelWindow) -> _Outline:
        """Return the outline of a thing without a cache."""
        rays = directions(agent, window.pixels())
        alone = self._alone(agent, thing, rays)
        is_met = self._is_of(alone.things, thing)
        hits = RayHits(alone.things[is_met], alone.roles[is_met], alone.distances[is_met])
        return _Outline(rays[is_met], hits)

    def _visible_rays(self, agent: Pose, thing: Thing, outline: _Outline) -> tuple[np.ndarray, np.ndarray]:
        """Return a mask (n,) of the outline's rays that meet the thing before anything else, and the roles (n,) of the
        part met.

        If the thing has no glass, rays are cast into the scene without the thing, and their distances are compared with
        those in the outline. If it has glass, rays are cast into the whole scene, because they pass through its panes
        to its parts behind.
        """
        whole = self._with_drawers(thing)
        has_glass = any(each.asset.has_glass for each in whole)
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
        """Return a thing together with its drawers that are separate things."""
        return [thing, *(part for part in self._parts.get(thing.id, ()) if part.is_present)]

    def _boxes_of(self, thing: Thing) -> list[np.ndarray]:
        """Return the corners (8, 3) of the boxes of a thing and its drawers.

        The corners are cached, except for a held thing, because it often moves.
        """
        if thing.is_held:
            return boxes_of(self._with_drawers(thing))
        if thing.id not in self._boxes:
            self._boxes[thing.id] = boxes_of(self._with_drawers(thing))
        return self._boxes[thing.id]

    def _is_behind_walls(self, eye: Vec3, thing: Thing) -> bool:
        """Return whether walls alone hide a thing from an eye; this is faster than casting rays."""
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
        """Return a mask (n,) of the rays that met `thing` or one of its drawers; `met` (n,) are indices of the things
        met."""
        own = [self._index[each.id] for each in self._with_drawers(thing)]
        return met == own[0] if len(own) == 1 else np.isin(met, own)

    def _alone(self, agent: Pose, thing: Thing, rays: np.ndarray) -> RayHits:
        """Return the hits of rays on a thing and its drawers, as if nothing else were in the scene."""
        first, *rest = (
            self._engine.cast(agent.eye, rays, through_glass=False, only=each.id) for each in self._with_drawers(thing)
        )
        for hits in rest:
            nearer = hits.distances < first.distances
            first = RayHits(*(np.where(nearer, new, old) for new, old in zip(_rows(hits), _rows(first), strict=True)))
        return first


def _rows(hits: RayHits) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return hits.things, hits.roles, hits.distances


def _visibility_from_rays(
    thing: Thing, window: PixelWindow, is_hit: np.ndarray, roles: np.ndarray, distances: np.ndarray
) -> ObjectVisibility:
    """Return what the camera sees of a thing; `is_hit` (n,) is True for the outline's rays that meet the thing first.

    The thing is strictly visible if at least 200 px and 25 % of its outline are visible. It is also strictly visible if
    its whole outline is inside the frame and visible.
    """
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
    """Return how many of the `roles` contain `bit`."""
    return int(np.count_nonzero(roles & bit))
