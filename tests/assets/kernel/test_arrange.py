"""Whole assets turned, laid lengthwise and set at the bottom of a higher box."""

from collections.abc import Sequence

import numpy as np
import pytest

from vigil.assets.catalog import CATALOG
from vigil.assets.kernel import shapes
from vigil.assets.kernel.arrange import along_longest, lengthwise, quarter_turned
from vigil.assets.kernel.asset import Asset
from vigil.assets.kernel.builder import Builder, PartStyle
from vigil.assets.making import make
from vigil.base.geometry import Vec3


def arrow(size: Vec3, _rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """A bar along z with a red tip to +z, a lid that turns about x at its back, and a place on top."""
    builder = Builder("Pencil", size)
    x, y, z = size
    builder.add("plastic/#ffffff", shapes.span((-x / 2, 0, -z / 2), (x / 2, y, z / 2)))
    hinge = builder.hinge("lid", (1, 0, 0), (0, y, -z / 2), -90)
    builder.add(PartStyle("plastic/#ff0000", joint=hinge), shapes.span((-x / 4, 0, 0.4 * z), (x / 4, y, z / 2)))
    builder.surface("top", (0, y, 0.25 * z), (x, z / 2))
    return builder.build()


def tip(asset: Asset) -> np.ndarray:
    return next(part.mesh for part in asset.parts if part.material == "plastic/#ff0000").vertices.mean(0)


@pytest.mark.parametrize("wrap", [lengthwise, along_longest])
@pytest.mark.parametrize("size", [Vec3(0.1, 0.05, 0.4), Vec3(0.4, 0.05, 0.1)])
def test_length_lies_along_the_longer_floor_axis(wrap, size: Vec3) -> None:
    asset = wrap(arrow)(size, np.random.default_rng(1), ())
    low, high = shapes.bounds([part.mesh for part in asset.parts])
    assert asset.size == pytest.approx(size)
    assert (high - low).tolist() == pytest.approx(list(size), abs=1e-6)
    longest = int(np.argmax(size))
    assert tip(asset)[longest] > 0.4 * size[longest]
    (surface,) = asset.surfaces
    assert surface.center[longest] == pytest.approx(size[longest] / 4, abs=1e-6)
    assert (surface.size_x, surface.size_z) == pytest.approx((0.1, 0.2) if longest == 2 else (0.2, 0.1))
    (solid,) = asset.solids
    assert np.ptp(np.array(solid.polygon), axis=0).tolist() == pytest.approx([size.x, size.z], abs=1e-6)


def test_upright_in_an_upright_box() -> None:
    asset = along_longest(arrow)(Vec3(0.05, 0.8, 0.06), np.random.default_rng(1), ())
    assert asset.size == pytest.approx((0.05, 0.8, 0.06))
    assert tip(asset)[1] > 0.3
    assert asset.surfaces == ()


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_a_quarter_turn_carries_joints_along(axis: shapes.Axis) -> None:
    """Opening and then turning is the same as turning and then opening."""
    plain = arrow(Vec3(0.1, 0.05, 0.4), np.random.default_rng(1), ())
    whole = quarter_turned(plain, axis, 90)

    def opened(asset: Asset) -> np.ndarray:
        joint = asset.joints[0]
        part = next(part for part in asset.parts if part.joint)
        return shapes.rotate(part.mesh, joint.axis, joint.travel, joint.origin).vertices

    expected = opened(plain) @ shapes.rotation(axis, 90).T
    assert np.allclose(opened(whole), expected, atol=1e-6)


def test_a_laptop_measured_open_lies_closed_at_the_bottom_of_its_box() -> None:
    size = Vec3(0.36, 0.3, 0.29)
    asset = make("Laptop", size, 3)
    low, high = shapes.bounds([part.mesh for part in asset.parts])
    assert asset.size == size
    assert low[1] == pytest.approx(-0.15, abs=1e-6)
    assert high[1] < -0.12
    assert asset.body is not None
    assert asset.body[0].y == pytest.approx(-0.15, abs=1e-6)
    joint = asset.joints[0]
    lid = shapes.merge([part.mesh for part in asset.parts if part.joint == joint.name])
    raised = shapes.rotate(lid, joint.axis, joint.travel, joint.origin)
    assert raised.vertices[:, 1].max() == pytest.approx(0.1, abs=0.06)


@pytest.mark.parametrize("variant", range(6))
def test_a_book_opens_to_its_left_and_shows_its_pages(variant: int) -> None:
    asset = make("Book", CATALOG["Book"].typical_size, variant)
    joint = asset.joints[0]
    cover = shapes.merge([part.mesh for part in asset.parts if part.joint == joint.name])
    opened = shapes.rotate(cover, joint.axis, joint.travel, joint.origin)
    assert cover.vertices[:, 0].mean() == pytest.approx(0.0, abs=0.02)
    assert opened.vertices[:, 0].mean() < -asset.size.x / 2
    assert opened.vertices[:, 1].min() > -asset.size.y / 2
    pages = next(part for part in asset.parts if part.material == "print/text" and part.joint is None)
    assert pages.mesh.normals[:, 1].min() > 0.99
