"""The two ray casters."""

import numpy as np
import pytest

from tests.support.cabinet_scene import drawn_block
from vigil.rendering.light import irradiance
from vigil.sim.engines.mujoco.compiled import casters


@pytest.mark.skipif(casters.EmbreeScene is None, reason="Embree has no wheel for this platform")
def test_both_ray_casters_measure_the_same() -> None:
    mesh = drawn_block()
    rng = np.random.default_rng(0)
    origins = rng.uniform(-2.0, 2.0, (300, 3)).astype(np.float32)
    ways = -origins + rng.normal(0.0, 0.3, (300, 3)).astype(np.float32)
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    first, second = (
        np.minimum(caster(mesh.vertices, mesh.faces)(origins, ways), irradiance.FAR_M)
        for caster in (casters.embree_caster, casters.mujoco_caster)
    )
    assert 50 < np.count_nonzero(first < irradiance.FAR_M) < 300
    assert first == pytest.approx(second, abs=1e-4)
