"""Places to put things are open from above, up to the clearance that they state, and lie on something."""

from collections.abc import Iterator

import numpy as np
import pytest

from vigil.assets.catalog import CATALOG
from vigil.assets.kernel.asset import Asset, Surface
from vigil.assets.making import make

NEAR_M = 0.02
SPOTS = ((0.0, 0.0), (0.3, 0.3), (-0.3, 0.3), (0.3, -0.3), (-0.3, -0.3))
SOFT = {"Chair", "Footstool", "CoffeeMachine"}
"""A padded seat bulges over its surface; a coffee machine's spout hangs over its tray."""
HOLLOW_BELOW = {"ClothesDryer", "WashingMachine", "Stove", "Sink", "Sofa"}
"""Drums and racks have gaps; a basin's rim and a seat's edge are narrow."""


def _heights(asset: Asset, x: float, z: float) -> np.ndarray:
    """Return the heights at which a vertical line meets the fixed parts of an asset that is off."""
    found = []
    for part in asset.parts:
        if part.joint is not None or part.shown == "on":
            continue
        a, b, c = (part.mesh.vertices[part.mesh.faces[:, corner]].astype(float) for corner in range(3))
        ab, ac = b - a, c - a
        area = ab[:, 0] * ac[:, 2] - ab[:, 2] * ac[:, 0]
        upright = np.abs(area) < 1e-12
        area = np.where(upright, 1.0, area)
        u = ((x - a[:, 0]) * ac[:, 2] - (z - a[:, 2]) * ac[:, 0]) / area
        v = (ab[:, 0] * (z - a[:, 2]) - ab[:, 2] * (x - a[:, 0])) / area
        met = ~upright & (u >= 0) & (v >= 0) & (u + v <= 1)
        found.append(a[met, 1] + u[met] * ab[met, 1] + v[met] * ac[met, 1])
    return np.concatenate(found)


def _spots(asset: Asset) -> Iterator[tuple[Surface, np.ndarray]]:
    for surface in asset.surfaces:
        for part_x, part_z in SPOTS if surface.joint is None else ():
            yield (
                surface,
                _heights(asset, surface.center.x + part_x * surface.size_x, surface.center.z + part_z * surface.size_z),
            )


@pytest.mark.parametrize("category", sorted(name for name, row in CATALOG.items() if row.is_receptacle))
def test_nothing_covers_a_place_or_misses_under_it(category: str) -> None:
    for variant in range(6):
        for surface, heights in _spots(make(category, CATALOG[category].typical_size, variant)):
            top = surface.center.y + min(surface.clearance, 5.0)
            if category not in SOFT:
                assert not ((heights > surface.center.y + 0.012) & (heights < top - 0.012)).any(), surface.name
            if category not in HOLLOW_BELOW:
                assert (np.abs(heights - surface.center.y) < NEAR_M).any(), surface.name
