"""The light of a scene: cast when it is loaded, and cast anew for whatever has moved since.

What stands still (structure, furniture without its leaves) stops light. What can move stops none, so it leaves no shade
behind; its own contact with what is around it is darkened when a frame is drawn.
"""

from dataclasses import dataclass, replace

import numpy as np

from vigil.sim.engines.mujoco.compiled.model import HELD, CompiledModel
from vigil.sim.engines.mujoco.raster import charts, irradiance
from vigil.sim.engines.mujoco.raster.geometry import Geometry, geometry_of
from vigil.sim.engines.mujoco.raster.irradiance import Samples
from vigil.sim.engines.mujoco.raster.occluders import Occluders

BRIGHTEST = 2.0
"""Light of this strength is white; the shaders know it too."""
GRID_M = 0.03
"""Vertices this near to each other that face the same way get the same light."""
FACINGS = 4
NEIGHBOURS = 200
"""So many vertices in the open are looked at for the one that is nearest to a buried one."""
IN_HAND = 0.75


@dataclass(frozen=True, slots=True, eq=False)
class Baked:
    """The light of a model as it was built."""

    geometry: Geometry
    occluders: Occluders
    lamps: tuple[np.ndarray, ...]
    """Place (3,) of each."""
    charts: charts.Charts
    chart_ambient: np.ndarray
    """(texels, 3), for those that are used."""
    chart_reach: np.ndarray
    """(lamps, texels): the share of each lamp's light."""
    ambient: np.ndarray
    """(vertices, 3) float16."""
    reach: np.ndarray
    """(lamps, vertices) float16."""
    poses: np.ndarray
    """(ngeom, 12): where each geom was."""

    def cast(self, samples: Samples) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Returns the light from around (n, 3), the share of each lamp's (lamps, n), and which are buried (n,)."""
        reach = [irradiance.from_lamp(self.occluders, lamp, samples) for lamp in self.lamps]
        around, is_buried = irradiance.ambient(self.occluders, samples)
        return around, np.array(reach, np.float32).reshape(len(reach), -1), is_buried

    def cast_on(self, model: CompiledModel, geoms: np.ndarray, ambient: np.ndarray, reach: np.ndarray) -> None:
        """Casts light on the vertices of geoms where they are now, into the arrays for all vertices."""
        places = [self.geometry.world(model, geom) for geom in geoms]
        points, normals = (np.concatenate(each) for each in zip(*places, strict=True))
        first, which = _alike(points, normals)
        around, shares, is_buried = self.cast(Samples(points[first], normals[first]))
        start = 0
        for geom in geoms:
            part = self.geometry.vertex_slices[geom]
            stop = start + part.stop - part.start
            own = _unburied(points[start:stop], which[start:stop], is_buried)
            ambient[part], reach[:, part] = around[own], shares[:, own]
            start = stop


def baked(model: CompiledModel) -> Baked:
    """Returns the light of a model that has just been built or copied; cast once for all copies."""
    if "light" not in model.keepsake:
        model.keepsake["light"] = _bake(model)
    return model.keepsake["light"]


def _bake(model: CompiledModel) -> Baked:
    geometry = geometry_of(model)
    laid_out, samples = _charts(model, geometry)
    count = len(geometry.vertices)
    lamps = tuple(model.lamps.places)
    nothing = np.zeros((0, 3), np.float32)
    ambient, reach = np.zeros((count, 3), np.float16), np.zeros((len(lamps), count), np.float16)
    begun = Baked(
        geometry, _occluders(model, geometry), lamps, laid_out, nothing, nothing, ambient, reach, _poses(model)
    )
    begun.cast_on(model, np.setdiff1d(np.flatnonzero(~geometry.is_charted), geometry.hand), ambient, reach)
    chart_ambient, chart_reach, _ = begun.cast(samples)
    return replace(begun, chart_ambient=chart_ambient, chart_reach=chart_reach)


class Lighting:
    """Light on every vertex and on the planes of the structure, which follows what moves."""

    def __init__(self, model: CompiledModel) -> None:
        self._model, self._baked = model, baked(model)
        geometry = self._baked.geometry
        self._ambient, self._reach = self._baked.ambient.copy(), self._baked.reach.copy()
        self._poses = self._baked.poses.copy()
        self._strengths = np.zeros(0)
        self.vertices = np.zeros((len(geometry.vertices), 4), np.uint8)
        """(n, 4): the square root of the light on each vertex, and nothing."""
        self.planes = np.zeros((*self._baked.charts.points.shape[:2], 4), np.uint8)
        """(height, width, 4): the same for the planes."""
        for geom in geometry.hand:
            self._light_by_hand(geom, geometry.normals[geometry.vertex_slices[geom], 1])

    @property
    def geometry(self) -> Geometry:
        """The triangles that are lit."""
        return self._baked.geometry

    @property
    def places(self) -> np.ndarray:
        """Where the vertices of charted geoms are found on the planes, (k, 2), in their order."""
        return self._baked.charts.places

    def follow(self) -> tuple[bool, list[slice]]:
        """Casts light anew for what has moved. Returns whether the planes and which vertices have changed."""
        strengths = self._model.lamps.strengths()
        poses = _poses(self._model)
        moved = np.flatnonzero((poses != self._poses).any(axis=1) & (self._model.native.geom_group != HELD))
        self._poses[moved] = poses[moved]
        if len(moved):
            self._baked.cast_on(self._model, moved, self._ambient, self._reach)
        if not np.array_equal(strengths, self._strengths):
            self._strengths = strengths
            self.planes = self._plane_light()
            whole = slice(0, self.geometry.vertex_slices[self.geometry.hand[0]].start)
            self._mix(whole)
            return True, [slice(0, len(self.vertices))]
        changed = [self.geometry.vertex_slices[geom] for geom in moved]
        for part in changed:
            self._mix(part)
        return False, changed

    def in_hand(self, geoms: np.ndarray, up: np.ndarray) -> list[slice]:
        """Lights what is held, from above the one who holds it. Returns which vertices have changed."""
        for geom in geoms:
            self._light_by_hand(geom, self.geometry.world(self._model, geom)[1] @ up)
        return [self.geometry.vertex_slices[geom] for geom in geoms]

    def _light_by_hand(self, geom: int, rising: np.ndarray) -> None:
        """Lights a geom by how far its normals (n,) turn up."""
        light = IN_HAND * (1.0 + 0.35 * rising)
        self.vertices[self.geometry.vertex_slices[geom], :3] = encoded(light)[:, None]

    def _mix(self, part: slice) -> None:
        light = self._ambient[part].astype(np.float32) + self._reach[:, part].astype(np.float32).T @ self._strengths
        self.vertices[part, :3] = encoded(light)

    def _plane_light(self) -> np.ndarray:
        laid_out = self._baked.charts
        light = np.zeros((*laid_out.points.shape[:2], 3), np.float32)
        light[laid_out.is_used] = self._baked.chart_ambient + self._baked.chart_reach.T @ self._strengths
        planes = np.zeros_like(self.planes)
        planes[..., :3] = encoded(charts.smoothed(laid_out, charts.smoothed(laid_out, light)))
        return planes


def _unburied(points: np.ndarray, samples: np.ndarray, is_buried: np.ndarray) -> np.ndarray:
    """Returns the sample of each point, that of the nearest point in the open where its own is buried."""
    buried = np.flatnonzero(is_buried[samples])
    free = np.flatnonzero(~is_buried[samples])
    if not len(buried) or not len(free):
        return samples
    free = free[:: max(1, len(free) // NEIGHBOURS)]
    nearest = ((points[buried, None] - points[None, free]) ** 2).sum(axis=2).argmin(axis=1)
    chosen = samples.copy()
    chosen[buried] = samples[free[nearest]]
    return chosen


def encoded(light: np.ndarray) -> np.ndarray:
    """Returns light as bytes: the square root of its share of the brightest."""
    return (np.sqrt(np.clip(light / BRIGHTEST, 0.0, 1.0)) * 255.0 + 0.5).astype(np.uint8)


def _poses(model: CompiledModel) -> np.ndarray:
    return np.concatenate([model.data.geom_xpos, model.data.geom_xmat], axis=1).astype(np.float32)


def _alike(points: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns one vertex of each group that is alike, and the group of each vertex."""
    key = np.zeros(len(points), np.int64)
    for values, steps in ((points / GRID_M, 4096), (normals * FACINGS, 2 * FACINGS + 1)):
        whole = np.round(values).astype(np.int64)
        for column in (whole - whole.min(axis=0)).T:
            key = key * steps + column
    _, first, which = np.unique(key, return_index=True, return_inverse=True)
    return first, which.reshape(-1)


def _occluders(model: CompiledModel, geometry: Geometry) -> Occluders:
    vertices = np.concatenate([geometry.world(model, geom)[0] for geom in model.still])
    counts = [geometry.vertex_slices[geom].stop - geometry.vertex_slices[geom].start for geom in model.still]
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
    faces = [
        geometry.faces[geometry.face_slices[geom]] - geometry.vertex_slices[geom].start + start
        for geom, start in zip(model.still, starts, strict=True)
    ]
    return Occluders(vertices, np.concatenate(faces))


def _charts(model: CompiledModel, geometry: Geometry) -> tuple[charts.Charts, Samples]:
    places = [geometry.world(model, geom) for geom in np.flatnonzero(geometry.is_charted).tolist()]
    laid_out = charts.lay_out(*(np.concatenate(each) for each in zip(*places, strict=True)))
    return laid_out, Samples(laid_out.points[laid_out.is_used], laid_out.normals[laid_out.is_used])
