"""Rays into a model."""

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np

from vigil.base.geometry import Vec3
from vigil.sim.core.engine import RayHits
from vigil.sim.engines.mujoco.compiled import frames
from vigil.sim.engines.mujoco.compiled.binding import mujoco
from vigil.sim.engines.mujoco.compiled.builder import GLASS, GROUPS, HELD, HIDDEN, ONLY, STRUCTURE, THING
from vigil.sim.engines.mujoco.compiled.model import CompiledModel

PRUNED_FROM = 8
"""Least number of rays for which geoms that they cannot meet are searched."""


def cast(
    model: CompiledModel,
    origin: Vec3,
    directions: np.ndarray,
    *,
    through_glass: bool,
    only: str | None = None,
    without: Sequence[str] = (),
    within_m: float = math.inf,
) -> RayHits:
    """Cast rays along unit `directions` (n, 3) from `origin`, in THOR's frame (see `Engine.cast`)."""
    count = len(directions)
    geoms, distances = np.full(count, -1, dtype=np.int32), np.full(count, -1.0)
    if count:
        eye, rays = frames.points(np.array(origin, dtype=np.float64)), frames.points(directions)
        outside = np.empty(0, dtype=np.int64)
        if only is None and count >= PRUNED_FROM:
            outside = _geoms_rays_cannot_meet(model, eye, rays, within_m)
        hidden = np.concatenate([outside, *(model.things[thing_id].geoms for thing_id in without)])
        with _only(model, only, through_glass), _without(model, hidden):
            mujoco.mj_multiRay(
                model.native,
                model.data,
                eye,
                np.ascontiguousarray(rays, dtype=np.float64).ravel(),
                _mask(through_glass, only is not None),
                True,
                -1,
                geoms,
                distances,
                None,
                count,
                mujoco.mjMAXVAL,
            )
    return RayHits(model.geom_things[geoms], model.geom_roles[geoms], np.where(geoms < 0, np.inf, distances))


def _geoms_rays_cannot_meet(model: CompiledModel, eye: np.ndarray, rays: np.ndarray, within_m: float) -> np.ndarray:
    """Return the geoms that no ray can meet, because they are outside the box around the rays."""
    ends = eye + min(within_m, mujoco.mjMAXVAL) * rays
    low, high = np.minimum(eye, ends.min(axis=0)), np.maximum(eye, ends.max(axis=0))
    return np.flatnonzero(model.bounds().geoms_outside(low, high, model.native.ngeom))


@contextmanager
def _without(model: CompiledModel, geoms: np.ndarray) -> Iterator[None]:
    """Hide geoms within the context."""
    before = model.native.geom_group[geoms]
    model.native.geom_group[geoms] = HIDDEN
    try:
        yield
    finally:
        model.native.geom_group[geoms] = before


def _mask(through_glass: bool, is_only: bool) -> np.ndarray:
    mask = np.zeros(GROUPS, dtype=np.uint8)
    if is_only:
        mask[ONLY] = 1
    else:
        mask[[STRUCTURE, THING]] = 1
        mask[GLASS] = not through_glass
    return mask


@contextmanager
def _only(model: CompiledModel, thing_id: str | None, through_glass: bool) -> Iterator[None]:
    """Put one thing's visible geoms into the group `ONLY` within the context."""
    if thing_id is None:
        yield
        return
    geoms = model.things[thing_id].geoms
    before = model.native.geom_group[geoms].copy()
    unseen = (before == HIDDEN) | (before == HELD) | ((before == GLASS) & through_glass)
    model.native.geom_group[geoms] = np.where(unseen, before, ONLY)
    try:
        yield
    finally:
        model.native.geom_group[geoms] = before
