"""Rays into a model, answered as things and roles."""

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from vigil.pose import Vec3
from vigil.sim.core.engine import RayHits
from vigil.sim.engines.mujoco.compiled import frames
from vigil.sim.engines.mujoco.compiled.binding import mujoco
from vigil.sim.engines.mujoco.compiled.model import GLASS, GROUPS, HELD, HIDDEN, ONLY, STRUCTURE, THING, CompiledModel


def cast(
    model: CompiledModel, origin: Vec3, directions: np.ndarray, *, through_glass: bool, only: str | None = None
) -> RayHits:
    """Casts rays along unit `directions` (n, 3) from `origin`, in THOR's frame (see `Engine.cast`)."""
    count = len(directions)
    geoms, distances = np.full(count, -1, dtype=np.int32), np.full(count, -1.0)
    if count:
        with _only(model, only, through_glass):
            mujoco.mj_multiRay(
                model.native,
                model.data,
                frames.points(np.array(origin, dtype=np.float64)),
                np.ascontiguousarray(frames.points(directions), dtype=np.float64).ravel(),
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
