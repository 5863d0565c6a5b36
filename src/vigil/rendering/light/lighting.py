"""The light of a scene: it is computed for geoms when they first come into view, and again for objects that have moved.

Structure and furniture (without its doors) block light, at the places where they were when the scene was loaded. So
moving an object does not change the light on other objects. Things that can be moved do not block light, so no shadow
stays behind when they are moved. Instead, ambient occlusion darkens what they touch when a frame is drawn. Furniture
that was moved or removed does not block light on other moved objects, because one of these may be in its old place.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any

import numpy as np

from vigil.base.free_memory import return_free_memory
from vigil.rendering.geometry import Geometry, geometry_of
from vigil.rendering.light import irradiance, lightmap_atlas
from vigil.rendering.light.irradiance import Occluders, Samples, occluders_of
from vigil.rendering.light.smoothing import move_inward, smooth_edges, smoothed
from vigil.rendering.scene import RenderScene, RenderState

BRIGHTEST = 2.0
"""Strength of light that is drawn as white; `surface.frag` has the same number."""
GRID_M = 0.03
"""Vertices in the same cell of this size (m) get the same light if their normals are similar."""
FACINGS = 4
"""Number of steps between 0 and 1 to which components of normals are rounded to find similar normals."""
IN_HAND = 0.75
"""Strength of the light on the sides of held objects."""
PART_POINTS = 12000
"""Number of points for which a thread computes light at a time; there are two threads."""


class BakedLight:
    """The light of a scene in its initial state, computed for geoms when they first come into view."""

    def __init__(self, scene: RenderScene) -> None:
        self.geometry = geometry_of(scene)
        self.lightmap_atlas, self._samples = _atlas_of(self.geometry)
        self._lamps, self._portals = list(scene.lamps), scene.portals
        self.occluders = occluders_of(self.geometry, scene.initial, scene.static_occluders)
        self._is_cast = np.zeros(len(scene.geom_meshes), dtype=bool)
        self.vertices = np.zeros((len(self.geometry.vertices), 3 + len(self._lamps)), np.float16)
        """Light (vertices, 3 + lamps): the light from all around, and the share of each lamp's light."""
        self.planes = np.zeros((*self.lightmap_atlas.is_used.shape, 3 + len(self._lamps)), np.float16)
        """Light (height, width, 3 + lamps) on the planes of the atlas, in the form of `vertices`."""

    def ensure(self, state: RenderState, geoms: np.ndarray) -> None:
        """Compute the light on geoms in their initial poses, unless this has been done."""
        missing = geoms[~self._is_cast[geoms]]
        if not len(missing):
            return
        is_first = not self._is_cast.any()
        self._is_cast[missing] = True
        is_in_atlas = self.geometry.is_in_atlas[missing]
        meshes, planes = missing[~is_in_atlas], missing[is_in_atlas]
        on_meshes = partial(self.cast_on, state, meshes, self.occluders, self.vertices)
        run_in_parallel([on_meshes, partial(self._cast_planes, planes)])
        if is_first:
            return_free_memory()  # the first picture of a scene has used several times as much as its light takes

    def cast_on(self, state: RenderState, geoms: np.ndarray, occluders: Occluders, into: np.ndarray) -> None:
        """Compute the light on the vertices of geoms in the poses of a state, and write it to the rows of `into`."""
        if not len(geoms):
            return
        places = [self.geometry.world(state, geom) for geom in geoms.tolist()]
        points, normals = (np.concatenate(each) for each in zip(*places, strict=True))
        counts = [len(each) for each, _ in places]
        owners = np.repeat(np.arange(len(geoms)), counts)
        first, which = _merge_similar(points, normals, owners)
        faces = self._faces(geoms, counts)
        edges = which[np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])]
        samples = Samples(points[first], normals[first])
        along = smooth_edges(samples.normals, edges)
        light, is_buried = self._cast(move_inward(samples, along), occluders)
        light = shaded(_smoothed(light, samples, ~is_buried, along, owners[first]), samples, self._lamps)
        start = 0
        for geom, count in zip(geoms.tolist(), counts, strict=True):
            stop = start + count
            into[self.geometry.vertex_slices[geom]] = light[which[start:stop]]
            start = stop

    def _faces(self, geoms: np.ndarray, counts: list[int]) -> np.ndarray:
        """Return the triangles (m, 3) of geoms, whose vertices (`counts`: number per geom) are numbered in sequence."""
        slices, owned = self.geometry.vertex_slices, self.geometry.face_slices
        shifts = np.cumsum([0, *counts[:-1]]) - [slices[geom].start for geom in geoms]
        return np.concatenate(
            [self.geometry.faces[owned[geom]] + shift for geom, shift in zip(geoms, shifts, strict=True)]
        )

    def boxes_of(self, geoms: np.ndarray) -> list[tuple[int, int, int, int]]:
        """Return where the planes of geoms are in the atlas: (row, column, height, width) of each."""
        wanted = set(geoms.tolist())
        atlas = self.lightmap_atlas
        return [box for box, owner in zip(atlas.boxes, atlas.owners, strict=True) if owner in wanted]

    def _cast_planes(self, geoms: np.ndarray) -> None:
        numbers = np.arange(self.lightmap_atlas.is_used.size).reshape(self.lightmap_atlas.is_used.shape)
        boxes = self.boxes_of(geoms)
        if not boxes:
            return
        chosen = np.concatenate(
            [numbers[top : top + tall, left : left + wide].ravel() for top, left, tall, wide in boxes]
        )
        samples = Samples(self._samples.points[chosen], self._samples.normals[chosen])
        light, is_buried = self._cast(samples, self.occluders)
        light, is_open = shaded(light, samples, self._lamps), ~is_buried
        start = 0
        for top, left, tall, wide in boxes:
            part, shape = slice(start, start + tall * wide), (tall, wide)
            start = part.stop
            averaged = lightmap_atlas.averaged_texels(light[part].reshape(*shape, -1), is_open[part].reshape(shape))
            self.planes[top : top + tall, left : left + wide] = averaged

    def _cast(self, samples: Samples, occluders: Occluders) -> tuple[np.ndarray, np.ndarray]:
        """Return the light (n, 3 + lamps) at samples, ignoring their normals, and a mask (n,) of the buried samples."""
        starts = range(0, len(samples.points), PART_POINTS)
        parts = [samples.part(slice(start, start + PART_POINTS)) for start in starts]
        found = run_in_parallel([partial(self._cast_part, part, occluders) for part in parts])
        light, is_buried = zip(*found, strict=True)
        return np.concatenate(light), np.concatenate(is_buried)

    def _cast_part(self, samples: Samples, occluders: Occluders) -> tuple[np.ndarray, np.ndarray]:
        ambient, is_buried = irradiance.ambient(occluders, samples)
        lamps = []
        for room, lamp in enumerate(self._lamps):
            outside = self._portals.distances_from(room, samples.origins[:, :2])
            lamps.append(irradiance.from_lamp(occluders, lamp, samples, irradiance.spill_shares(outside)))
        return np.column_stack([ambient, *lamps]), is_buried


class Lighting:
    """The light on the vertices and planes in view. It follows objects that move and lamps that are switched."""

    def __init__(self, scene: RenderScene) -> None:
        if "light" not in scene.cache:
            scene.cache["light"] = BakedLight(scene)
        self._scene, self._baked = scene, scene.cache["light"]
        self.geometry = self._baked.geometry
        self._moved = np.zeros(self._baked.vertices.shape, np.float16)  # takes memory only where it is written
        """Light on objects that have moved, in the form of `BakedLight.vertices`."""
        self._state = scene.initial
        """The state at the last update."""
        self._displaced, self._occluders = np.zeros(len(scene.static_occluders), dtype=bool), self._baked.occluders
        """Mask of the furniture that was moved or removed; all other surfaces that block light on moved objects."""
        self._is_lit = np.zeros(len(scene.geom_meshes), dtype=bool)
        """Whether (geoms,) the light on each geom is up to date."""
        self._lamp_colours = np.zeros(0)
        self.vertices = np.zeros((len(self.geometry.vertices), 4), np.uint8)
        """Square root (n, 4) of the light on each vertex. The fourth column is padding for OpenGL."""
        self.planes = np.zeros((*self._baked.lightmap_atlas.is_used.shape, 4), np.uint8)
        """Square root (height, width, 4) of the light on the planes."""
        for geom in self.geometry.hand:
            self._light_by_hand(geom, self.geometry.normals[self.geometry.vertex_slices[geom], 1])

    @property
    def places(self) -> np.ndarray:
        """Positions (k, 2) in the atlas of all vertices whose light is stored there, in the order of the vertices."""
        return self._baked.lightmap_atlas.places

    def update(self, state: RenderState, shown: np.ndarray) -> tuple[bool, list[slice]]:
        """Compute the light on shown geoms that are in view for the first time or have moved.

        Return whether the planes have changed, and the slices of the vertices that have changed.
        """
        if self._is_same(state) and (self._is_lit[shown] | state.is_held[shown]).all():
            return False, []
        if not np.array_equal(state.lamp_colours, self._lamp_colours):
            self._lamp_colours = state.lamp_colours
            self._is_lit[:] = False
        is_elsewhere = state.is_elsewhere(self._scene.initial)
        self._update_occluders(state, is_elsewhere | ~state.is_visible)
        self._is_lit[self._scene.with_furniture(state.is_elsewhere(self._state))] = False
        self._state = state.copy()
        stale = shown[~state.is_held[shown] & ~self._is_lit[shown]]
        self._is_lit[stale] = True
        is_in_atlas = self.geometry.is_in_atlas[stale]
        is_moved = self._scene.with_furniture(is_elsewhere)[stale]
        self._baked.ensure(state, stale[~is_moved])
        self._baked.cast_on(state, stale[is_moved], self._occluders, self._moved)
        for geom, moved in zip(stale[~is_in_atlas].tolist(), is_moved[~is_in_atlas].tolist(), strict=True):
            part = self.geometry.vertex_slices[geom]
            cast = self._moved if moved else self._baked.vertices
            self.vertices[part, :3] = encoded(mixed(cast[part], state.lamp_colours))
        self._mix_planes(stale[is_in_atlas])
        return bool(is_in_atlas.any()), [self.geometry.vertex_slices[geom] for geom in stale[~is_in_atlas].tolist()]

    def _is_same(self, state: RenderState) -> bool:
        """Return whether the light on all surfaces is that of the last update."""
        last = self._state
        pairs = (
            (state.lamp_colours, self._lamp_colours),
            (state.positions, last.positions),
            (state.rotations, last.rotations),
            (state.is_visible, last.is_visible),
        )
        return all(np.array_equal(now, then) for now, then in pairs)

    def _update_occluders(self, state: RenderState, is_displaced: np.ndarray) -> None:
        """Let all furniture block light on moved objects, except the furniture in the mask `is_displaced` (geoms,)."""
        displaced = is_displaced[self._scene.static_occluders]
        if np.array_equal(displaced, self._displaced):
            return
        self._displaced, self._is_lit[:] = displaced, False
        left = self._scene.static_occluders[~displaced]
        self._occluders = occluders_of(self.geometry, state, left) if displaced.any() else self._baked.occluders

    def in_hand(self, state: RenderState, geoms: np.ndarray, up: np.ndarray) -> list[slice]:
        """Light held geoms from above (`up` (3,) is the camera's axis); return the slices of the changed vertices."""
        for geom in geoms.tolist():
            self._light_by_hand(geom, self.geometry.world(state, geom)[1] @ up)
            self._is_lit[geom] = False
        return [self.geometry.vertex_slices[geom] for geom in geoms.tolist()]

    def _light_by_hand(self, geom: int, rising: np.ndarray) -> None:
        """Light a held geom; `rising` (n,) are the upward components of its normals."""
        light = IN_HAND * (1.0 + 0.35 * rising)
        self.vertices[self.geometry.vertex_slices[geom], :3] = encoded(light)[:, None]

    def _mix_planes(self, geoms: np.ndarray) -> None:
        for top, left, tall, wide in self._baked.boxes_of(geoms):
            rows, columns = slice(top, top + tall), slice(left, left + wide)
            self.planes[rows, columns, :3] = encoded(mixed(self._baked.planes[rows, columns], self._lamp_colours))


def shaded(light: np.ndarray, samples: Samples, lamps: list[np.ndarray]) -> np.ndarray:
    """Return the light (n, 3 + lamps) multiplied by factors that depend on the normals, so that shapes can be seen."""
    shares = [irradiance.lamp_facing_shares(lamp, samples) for lamp in lamps]
    return light * np.stack([*[irradiance.ambient_facing_shares(samples)] * 3, *shares], axis=1).astype(np.float32)


def mixed(light: np.ndarray, lamp_colours: np.ndarray) -> np.ndarray:
    """Return the colour (..., 3) of light (..., 3 + lamps) if the lamps have the colours `lamp_colours` (lamps, 3)."""
    exact = light.astype(np.float32)
    return exact[..., :3] + exact[..., 3:] @ lamp_colours


def encoded(light: np.ndarray) -> np.ndarray:
    """Return the square root of light as bytes; 255 stands for the brightest light."""
    return (np.sqrt(np.clip(light / BRIGHTEST, 0.0, 1.0)) * 255.0 + 0.5).astype(np.uint8)


def run_in_parallel(tasks: Sequence[Callable[[], Any]]) -> list[Any]:
    """Return the results of independent tasks, which run on two threads."""
    if len(tasks) == 1:
        return [tasks[0]()]
    with ThreadPoolExecutor(2) as pool:  # a new pool, since the process may be forked later
        return [future.result() for future in [pool.submit(task) for task in tasks]]


def _smoothed(
    light: np.ndarray, samples: Samples, is_known: np.ndarray, edges: np.ndarray, owners: np.ndarray
) -> np.ndarray:
    """Return the light (n, k) averaged along `edges` (m, 2); each edge is on one surface.

    Where `is_known` (n,) is False, the light is that of samples nearby or, if there are none, the owner's mean.
    """
    light = light * is_known[:, None]
    near = smoothed(light, is_known, samples.points, edges)
    counts = np.maximum(np.bincount(owners, is_known), 1.0)
    means = np.stack([np.bincount(owners, column) / counts for column in light.T], axis=1)
    return np.where(np.isnan(near), means[owners], near)


def _merge_similar(points: np.ndarray, normals: np.ndarray, owners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return one vertex of each group, and each vertex's group. A group has similar vertices of one owner."""
    key = owners.astype(np.int64)
    for values, steps in ((points / GRID_M, 4096), (normals * FACINGS, 2 * FACINGS + 1)):
        for column in np.round(values).astype(np.int64).T:
            key = key * steps + column % steps
    _, first, which = np.unique(key, return_index=True, return_inverse=True)
    return first, which.reshape(-1)


def _atlas_of(geometry: Geometry) -> tuple[lightmap_atlas.LightmapAtlas, Samples]:
    """Return the atlas of a scene's structure, and the points of its texels as samples."""
    geoms = np.flatnonzero(geometry.is_in_atlas)
    places = [geometry.world(geometry.scene.initial, geom) for geom in geoms.tolist()]
    points, normals = (np.concatenate(each) for each in zip(*places, strict=True))
    atlas = lightmap_atlas.pack_atlas(points, normals, np.repeat(geoms, [len(each) for each, _ in places]))
    return atlas, Samples(atlas.points.reshape(-1, 3), atlas.normals.reshape(-1, 3))
