"""What tells a thing from those that it was taken for (docs/decisions/0028)."""

import numpy as np
import pytest

from vigil.assets import make
from vigil.assets.catalog import CATALOG
from vigil.assets.kernel.asset import Asset, Part

VARIANTS = range(8)


def typical(name: str, variant: int) -> Asset:
    return make(name, CATALOG[name].typical_size, variant)


def extent(*parts: Part) -> np.ndarray:
    return np.ptp(np.concatenate([part.mesh.vertices for part in parts]), axis=0)


@pytest.mark.parametrize("variant", VARIANTS)
def test_a_forks_tines_are_slimmer_than_its_gaps(variant: int) -> None:
    fork = typical("Fork", variant)
    head = fork.parts[0].mesh
    corners = head.vertices[head.faces]
    is_tine = corners[..., 2].min(axis=1) > 0.12 * fork.size.z
    sides = np.unique(np.round(corners[is_tine][..., 0].ravel(), 5))
    tines = np.split(sides, np.flatnonzero(np.diff(sides) > 0.15 * fork.size.x) + 1)
    assert len(tines) == 4
    assert sum(np.ptp(tine) for tine in tines) < 0.6 * fork.size.x


@pytest.mark.parametrize("variant", VARIANTS)
def test_a_fridge_has_two_doors_and_no_bare_front(variant: int) -> None:
    fridge = typical("Fridge", variant)
    assert len(fridge.joints) == 2
    assert any(part.joint and part.material.startswith(("paper", "picture")) for part in fridge.parts)


@pytest.mark.parametrize("variant", VARIANTS)
def test_a_safes_lining_has_vertices_away_from_its_corners(variant: int) -> None:
    (lining,) = (part for part in typical("Safe", variant).parts if part.material.startswith("fabric"))
    low, high = lining.mesh.vertices.min(axis=0), lining.mesh.vertices.max(axis=0)
    is_inner = np.minimum(lining.mesh.vertices - low, high - lining.mesh.vertices) > 0.03
    assert (is_inner.sum(axis=1) >= 2).any()


@pytest.mark.parametrize("variant", VARIANTS)
def test_a_drawers_front_is_larger_than_its_case_and_of_another_finish(variant: int) -> None:
    drawer = typical("Drawer", variant)
    case = next(part for part in drawer.parts if part.joint is None)
    front = next(part for part in drawer.parts if part.joint is not None)
    assert front.material != case.material
    assert (extent(front)[:2] > extent(case)[:2] + 0.005).all()


@pytest.mark.parametrize("variant", VARIANTS)
def test_a_knobs_bar_stands_while_off_and_lies_while_on(variant: int) -> None:
    knob = typical("StoveKnob", variant)
    for shown, across, along in (("off", 0, 1), ("on", 1, 0)):
        size = extent(*(part for part in knob.parts if part.shown == shown))
        assert size[along] > 2 * size[across]


@pytest.mark.parametrize("variant", VARIANTS)
def test_washing_hangs_before_a_hamper(variant: int) -> None:
    hamper = typical("LaundryHamper", variant)
    hanging = [part for part in hamper.parts if part.joint is None and part.material.startswith("fabric")]
    front = [part for part in hanging if part.mesh.vertices[:, 2].max() > 0.99 * hamper.size.z / 2]
    assert len(front) >= 2
