"""Rays that are cast into a MuJoCo model."""

import math
from collections.abc import Sequence

import numpy as np

from vigil.base.geometry import Vec3
from vigil.sim.core.engine import RayHits
from vigil.sim.engines.mujoco.compiled import frames
from vigil.sim.engines.mujoco.compiled.binding import mujoco
from vigil.sim.engines.mujoco.compiled.builder import GLASS, GROUPS, HELD, HIDDEN, ONLY, STRUCTURE, THING
from vigil.sim.engines.mujoco.compiled.model import CompiledModel

PRUNED_FROM = 8
"""In a cast of at least this many rays, geoms that the rays cannot meet are left out before the cast."""


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
            ends = eye + min(within_m, mujoco.mjMAXVAL) * rays
            low, high = np.minimum(eye, ends.min(axis=0)), np.maximum(eye, ends.max(axis=0))
            outside = np.flatnonzero(model.bounds().geoms_outside(low, high, model.native.ngeom))
        hidden = np.concatenate([outside, *(model.things[thing_id].geoms for thing_id in without)])
        groups, mask = _groups_of(model, only, through_glass, hidden)
        with model.lock:
            model.native.geom_group[:] = groups
            mujoco.mj_multiRay(
                model.native,
                model.data,
                eye,
                np.ascontiguousarray(rays, dtype=np.float64).ravel(),
                mask,
                True,
                -1,
                geoms,
                distances,
                None,
                count,
                mujoco.mjMAXVAL,
            )
    return RayHits(model.geom_things[geoms], model.geom_roles[geoms], np.where(geoms < 0, np.inf, distances))


def _groups_of(
    model: CompiledModel, only: str | None, through_glass: bool, hidden: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the groups (geoms,) of all geoms for a cast, and the mask of the groups that the rays can meet.

    The geoms with the numbers `hidden` are hidden. If `only` is given, the visible geoms of this thing are in the group
    `ONLY`.
    """
    groups, mask = model.groups.copy(), np.zeros(GROUPS, dtype=np.uint8)
    if only is None:
        mask[[STRUCTURE, THING]] = 1
        mask[GLASS] = not through_glass
    else:
        mask[ONLY] = 1
        own = model.things[only].geoms
        before = groups[own]
        is_unseen = np.isin(before, (HIDDEN, HELD)) | ((before == GLASS) & through_glass)
        groups[own] = np.where(is_unseen, before, ONLY)
    groups[hidden] = HIDDEN
    return groups, mask
