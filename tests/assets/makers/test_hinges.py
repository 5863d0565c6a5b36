"""What opens stays between the sides of its box, so that it can stand beside a wall or another thing."""

import numpy as np
import pytest

from vigil.assets.catalog import CATALOG
from vigil.assets.kernel.asset import Asset
from vigil.assets.making import make
from vigil.base.geometry import Vec3
from vigil.scene.geometry import joint_motion

SLACK_M = 0.0005
"""Less would be lost when a leaf is checked against a wall."""
WIDE_FRIDGE, NARROW_CABINET = Vec3(0.95, 1.8, 0.75), Vec3(0.4, 0.7, 0.4)


def reach(asset: Asset, axis: int) -> float:
    """Return how far (m) moving parts leave the asset's box along an axis, in both directions."""
    joints = {joint.name: joint for joint in asset.joints}
    moved = [
        joint_motion(joints[part.joint], float(openness))(part.mesh.vertices.astype(float))[:, axis]
        for part in asset.parts
        if part.joint is not None
        for openness in np.linspace(0.0, 1.0, 33)
    ]
    return float(np.abs(np.concatenate(moved)).max()) - tuple(asset.size)[axis] / 2


@pytest.mark.parametrize("variant", range(6))
@pytest.mark.parametrize(
    ("category", "size"),
    [
        ("Fridge", None), ("Fridge", WIDE_FRIDGE), ("Cabinet", None), ("Cabinet", NARROW_CABINET), ("Microwave", None),
        ("Safe", None), ("WashingMachine", None), ("ClothesDryer", None), ("Box", None),
    ],
    ids=lambda each: None if isinstance(each, Vec3) else each,
)  # fmt: skip
def test_leaves_stay_between_the_sides(category: str, size: Vec3 | None, variant: int) -> None:
    asset = make(category, size or CATALOG[category].typical_size, variant)
    assert reach(asset, 0) <= SLACK_M


@pytest.mark.parametrize("variant", range(4))
def test_the_flaps_of_a_box_stay_above_it(variant: int) -> None:
    asset = make("Box", CATALOG["Box"].typical_size, variant)
    assert reach(asset, 2) <= SLACK_M


@pytest.mark.parametrize("category", ["Fridge", "Cabinet", "Microwave", "Safe", "WashingMachine", "ClothesDryer"])
def test_leaves_open_by_a_right_angle(category: str) -> None:
    joints = [joint for variant in range(6) for joint in make(category, CATALOG[category].typical_size, variant).joints]
    assert {abs(joint.travel) for joint in joints} == {90.0}
