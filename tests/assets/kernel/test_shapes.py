"""Mesh primitives: closed ones wind outward, normals are unit and agree with the faces."""

from collections.abc import Callable

import numpy as np
import pytest

from vigil.assets.kernel import shapes

Check = Callable[..., None]

L_SHAPE = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]
BOWL = [(0, 0), (0.4, 0), (0.5, 0.3), (0.46, 0.3), (0.36, 0.04), (0, 0.04)]
CLOSED = {
    "box": (shapes.box((1, 2, 3)), 6.0),
    "bevelled box": (shapes.box((1, 2, 3), (1, 1, 1), 0.05), 6.0),
    "span": (shapes.span((0, 0, 0), (1, 2, 3)), 6.0),
    "rounded box": (shapes.rounded_box((1, 2, 3), radius=0.1), 6.0),
    "cushion": (shapes.cushion((0.6, 0.2, 0.5)), None),
    "cylinder": (shapes.cylinder(1, 2, segments=48), 2 * np.pi),
    "cylinder along x": (shapes.cylinder(1, 2, axis="x", segments=48), 2 * np.pi),
    "cone along z": (shapes.cylinder(1, 3, axis="z", segments=48, top=0.0), np.pi),
    "ellipsoid": (shapes.ellipsoid((1, 2, 3), segments=32, rings=24), np.pi),
    "lathe": (shapes.lathe(BOWL), None),
    "tube": (shapes.tube([(0, 0, 0), (0, 1, 0), (0, 1, 1), (1, 1, 1)], 0.1), None),
    "extruded y": (shapes.extrude(L_SHAPE, 0, 1), 3.0),
    "extruded x": (shapes.extrude(L_SHAPE[::-1], 0, 1, "x"), 3.0),
    "extruded z": (shapes.extrude(L_SHAPE, 0, 1, "z"), 3.0),
    "slab": (shapes.slab((1, 0.1, 2), radius=0.02), 0.2),
}


@pytest.mark.parametrize("name", CLOSED)
def test_closed_primitives_wind_outward(name: str, assert_well_made: Check) -> None:
    mesh, volume = CLOSED[name]
    assert_well_made(mesh)
    assert shapes.volume(mesh) > 0
    if volume is not None:
        assert shapes.volume(mesh) == pytest.approx(volume, rel=0.06)


@pytest.mark.parametrize("facing", ["+x", "-x", "+y", "-y", "+z", "-z"])
def test_panel_faces_and_is_upright(facing: str, assert_well_made: Check) -> None:
    mesh = shapes.panel(2, 1, facing=facing)
    assert_well_made(mesh)
    normal = np.zeros(3)
    normal["xyz".index(facing[1])] = 1 if facing[0] == "+" else -1
    assert np.allclose(mesh.normals, normal)
    low_left = mesh.vertices[np.argmin(mesh.uvs.sum(1))]
    low_right = mesh.vertices[np.argmax(mesh.uvs[:, 0] - mesh.uvs[:, 1])]
    up = np.array([0, 0, -1.0]) if facing[1] == "y" else np.array([0, 1.0, 0])
    # In this left-handed frame somebody who looks along `forward` has cross(up, forward) on his right.
    assert np.allclose(low_right - low_left, 2 * np.cross(up, -normal))


def test_disc_faces_its_axis(assert_well_made: Check) -> None:
    axes: tuple[shapes.Axis, ...] = ("x", "y", "z")
    for axis, normal in zip(axes, np.eye(3), strict=True):
        mesh = shapes.disc(0.5, axis=axis)
        assert_well_made(mesh)
        assert np.allclose(mesh.normals, normal)


def test_bevelled_box_is_cheap() -> None:
    assert len(shapes.box((1, 1, 1), bevel=0.01).faces) == 44
    assert len(shapes.box((1, 1, 1)).faces) == 12


def test_boxes_made_together_are_those_made_alone() -> None:
    sizes = np.random.default_rng(0).uniform(0.0, 1.0, (20, 3))
    together = shapes.boxes([*sizes], [*3.0 * sizes[::-1]])
    alone = shapes.merge(shapes.box(size, center) for size, center in zip(sizes, 3.0 * sizes[::-1], strict=True))
    for name in ("vertices", "faces", "normals", "uvs"):
        assert np.array_equal(getattr(together, name), getattr(alone, name)), name
        assert getattr(together, name).dtype == getattr(alone, name).dtype


def test_mirroring_keeps_the_outside_out(assert_well_made: Check) -> None:
    mesh = shapes.scale(shapes.box((1, 2, 3)), (-1, 2, 0.5))
    assert_well_made(mesh)
    assert shapes.volume(mesh) == pytest.approx(6.0)


def test_rotation_is_clockwise_from_above() -> None:
    turned = shapes.rotation("y", 90) @ np.array([0, 0, 1.0])
    assert np.allclose(turned, [1, 0, 0])


def test_merging_keeps_every_triangle() -> None:
    parts = [shapes.box((1, 1, 1)), shapes.cylinder(1, 1)]
    merged = shapes.merge(parts)
    assert len(merged.faces) == sum(len(part.faces) for part in parts)
    assert shapes.volume(merged) == pytest.approx(sum(shapes.volume(part) for part in parts), rel=1e-5)
