"""What is shut shows nothing of what is behind it."""

import numpy as np
import pytest
import shapely

from vigil.assets.catalog import CATALOG
from vigil.assets.kernel.asset import Asset
from vigil.assets.making import make
from vigil.base.geometry import Vec3

EDGE_M = 0.03
FLOOR_M = 0.002
CORNERS_M2 = 0.0005
"""Of bevelled edges."""
WIDE_FRIDGE, WIDE_CABINET = Vec3(0.95, 1.8, 0.75), Vec3(0.8, 0.7, 0.4)
DOOR, DOUBLE_DOOR = Vec3(0.95, 2.1, 0.14), Vec3(1.8, 2.1, 0.14)


def seen_from_before(asset: Asset, near: float) -> shapely.Geometry:
    """Return the area in x and y covered by parts in front of z = `near`, seen from the front."""
    triangles = np.concatenate([part.mesh.vertices[part.mesh.faces] for part in asset.parts]).astype(float)
    triangles = triangles[triangles[..., 2].max(axis=1) > near][..., :2]
    shapes = np.array([shape for shape in map(shapely.Polygon, triangles) if shape.area > 1e-9])
    return shapely.buffer(shapely.union_all(shapes, grid_size=1e-5), 2e-5)


@pytest.mark.parametrize("variant", range(4))
@pytest.mark.parametrize(
    ("category", "size"),
    [("Doorway", DOOR), ("Doorway", DOUBLE_DOOR), ("Cabinet", WIDE_CABINET), ("Fridge", WIDE_FRIDGE)],
    ids=["door", "double_door", "cabinet", "fridge"],
)
def test_no_gap_between_leaves_or_round_them_lets_sight_through(category: str, size: Vec3, variant: int) -> None:
    asset = make(category, size, variant)
    is_door = category == "Doorway"
    near = -0.03 if is_door else 0.02  # before the shelves, behind the leaves
    low, high = -size.y / 2 + (FLOOR_M if is_door else 0.06), size.y / 2 - EDGE_M
    front = shapely.box(-size.x / 2 + EDGE_M, low, size.x / 2 - EDGE_M, high)
    holes = front.difference(seen_from_before(asset, near))
    assert holes.area <= CORNERS_M2
    assert holes.intersection(shapely.LineString([(0.0, low), (0.0, high)])).length < 0.01


@pytest.mark.parametrize("variant", range(6))
@pytest.mark.parametrize("category", ["Dresser", "TVStand", "Desk", "SideTable"])
def test_seams_between_drawers_show_a_plate_behind_them(category: str, variant: int) -> None:
    size = CATALOG[category].typical_size
    asset = make(category, size, variant)
    fronts = [part.mesh.vertices for part in asset.parts if part.joint is not None]
    if not fronts:
        return
    low, high = (np.concatenate(fronts)[:, :2].min(axis=0) + 0.01, np.concatenate(fronts)[:, :2].max(axis=0) - 0.01)
    columns = sorted({(round(float(part[:, 0].min()), 2), round(float(part[:, 0].max()), 2)) for part in fronts})
    is_open_between = category == "TVStand"  # shelves between two columns of drawers
    spans = columns if is_open_between else [(float(low[0]), float(high[0]))]
    seen = seen_from_before(asset, size.z / 2 - 0.06)
    for left, right in spans:
        front = shapely.box(left + 0.01, float(low[1]), right - 0.01, float(high[1]))
        assert front.difference(seen).area <= CORNERS_M2, (left, right)
