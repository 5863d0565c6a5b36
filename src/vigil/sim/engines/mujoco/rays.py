"""Rays into a model, answered as things and roles."""

import math
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from vigil.pose import Vec3
from vigil.sim.core.engine import RayHits
from vigil.sim.engines.mujoco.compiled import frames
from vigil.sim.engines.mujoco.compiled.binding import mujoco
from vigil.sim.engines.mujoco.compiled.model import GLASS, GROUPS, HELD, HIDDEN, ONLY, STRUCTURE, THING, CompiledModel

PRUNED_FROM = 8
"""So many rays are worth the search for what they cannot meet."""
SLACK_M, SLACK_RAD = 0.001, 0.001
"""By how much what is left out must be out of the rays' way: far more than an error of rounding."""


def cast(
    model: CompiledModel,
    origin: Vec3,
    directions: np.ndarray,
    *,
    through_glass: bool,
    only: str | None = None,
    within_m: float = math.inf,
) -> RayHits:
    """Casts rays along unit `directions` (n, 3) from `origin`, in THOR's frame (see `Engine.cast`)."""
    count = len(directions)
    geoms, distances = np.full(count, -1, dtype=np.int32), np.full(count, -1.0)
    if count:
        eye, rays = frames.points(np.array(origin, dtype=np.float64)), frames.points(directions)
        aside = np.empty(0, dtype=np.int64)
        if only is None and count >= PRUNED_FROM:
            aside = _out_of_the_way(model, eye, rays, within_m)
        with _only(model, only, through_glass), _without(model, aside):
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


def _out_of_the_way(model: CompiledModel, eye: np.ndarray, rays: np.ndarray, within_m: float) -> np.ndarray:
    """Returns the geoms that no ray can meet: their bounding spheres lie beside the cone or too far."""
    axis = rays.mean(axis=0)
    axis /= max(float(np.linalg.norm(axis)), 1e-9)
    half_angle = math.acos(min(1.0, max(-1.0, float((rays @ axis).min()))))
    radii, towards = model.native.geom_rbound, model.data.geom_xpos - eye
    gaps = np.sqrt(np.einsum("ij,ij->i", towards, towards))
    away = np.maximum(gaps, 1e-9)
    angles = np.arccos(np.clip(towards @ axis / away, -1.0, 1.0))
    spreads = np.where(gaps <= radii + SLACK_M, math.pi, np.arcsin(np.minimum(1.0, (radii + SLACK_M) / away)))
    is_aside = (angles > half_angle + spreads + SLACK_RAD) | (gaps > within_m + radii + SLACK_M)
    return np.flatnonzero(is_aside & (radii > 0.0))  # what has no radius has no end


@contextmanager
def _without(model: CompiledModel, geoms: np.ndarray) -> Iterator[None]:
    """Hides some geoms for the time being."""
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
    """Puts one thing's visible geoms into a group of their own for the time being."""
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
