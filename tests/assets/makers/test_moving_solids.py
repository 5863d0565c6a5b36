"""Every part that moves has solids: what opens is stopped by things, and stops them."""

import numpy as np
import pytest
import shapely

from vigil.assets.catalog import CATALOG
from vigil.assets.kernel.asset import Asset
from vigil.assets.making import make
from vigil.base.geometry import Vec3

HANDLE_M = 0.09
"""Handles and racks may stand out so far over a leaf's solids."""
OPENABLE = sorted(name for name, kind in CATALOG.items() if make(name, kind.typical_size, 0).joints)


def uncovered_m(asset: Asset, joint: str) -> float:
    """Return how far the farthest vertex that a joint carries is from the joint's solids."""
    meshes = [part.mesh.vertices for part in asset.parts if part.joint == joint]
    vertices = np.concatenate(meshes).astype(float) if meshes else np.empty((0, 3))
    away = np.full(len(vertices), np.inf)
    for solid in asset.solids:
        if solid.joint == joint:
            aside = shapely.distance(shapely.Polygon(solid.polygon), shapely.points(vertices[:, 0], vertices[:, 2]))
            above = np.maximum(np.maximum(solid.bottom - vertices[:, 1], vertices[:, 1] - solid.top), 0.0)
            away = np.minimum(away, np.hypot(aside, above))
    return float(away.max(initial=0.0))


@pytest.mark.parametrize("category", OPENABLE)
def test_solids_cover_all_that_moves(category):
    typical = CATALOG[category].typical_size
    for factor in (0.6, 1.0, 1.5):
        for variant in range(5):
            asset = make(category, Vec3(*(factor * side for side in typical)), variant)
            for joint in asset.joints:
                assert uncovered_m(asset, joint.name) <= HANDLE_M, (factor, variant, joint.name)


def test_what_has_no_solid_of_its_body_keeps_its_box():
    for category in ("Box", "Kettle", "Blinds", "Book", "Toilet"):
        asset = make(category, CATALOG[category].typical_size, 0)
        assert any(solid.joint is None for solid in asset.solids), category


def test_the_catalogue_has_openable_things():
    assert {"Book", "Box", "Toilet", "Kettle", "Blinds", "Fridge", "Doorway"} <= set(OPENABLE)
