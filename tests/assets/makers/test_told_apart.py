"""What tells a thing from those that it was taken for (docs/decisions/0028)."""

import numpy as np
import pytest
import shapely

from vigil.assets.catalog import CATALOG
from vigil.assets.kernel.asset import Asset, Part
from vigil.assets.making import make
from vigil.base.geometry import Vec3

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


@pytest.mark.parametrize("variant", VARIANTS)
def test_a_dryers_door_is_squarish_and_flat_and_a_washing_machines_round_and_bulging(variant: int) -> None:
    filled, thick = {}, {}
    for name in ("ClothesDryer", "WashingMachine"):
        door = [part for part in typical(name, variant).parts if part.joint]
        (pane,) = (part for part in door if part.is_glass)
        frame = max(door, key=lambda part: float(np.prod(extent(part)[:2])))
        outline = shapely.MultiPoint(frame.mesh.vertices[:, :2].astype(float)).convex_hull
        filled[name] = outline.area / np.prod(extent(frame)[:2])
        thick[name] = extent(pane)[2]
    assert filled["ClothesDryer"] > 0.95
    assert filled["WashingMachine"] < 0.8
    assert thick["ClothesDryer"] < 0.75 * thick["WashingMachine"]


@pytest.mark.parametrize("variant", VARIANTS)
def test_a_dryer_has_a_grille_at_its_foot_and_no_soap_drawer(variant: int) -> None:
    for name, has_grille in (("ClothesDryer", True), ("WashingMachine", False)):
        machine = typical(name, variant)
        corners = np.concatenate([part.mesh.vertices for part in machine.parts if not part.joint]) + machine.size.y / 2
        front = corners[corners[:, 2] > corners[:, 2].max() - 0.03]
        foot = front[(front[:, 1] > 0.055) & (front[:, 1] < 0.14)]
        assert (len(np.unique(foot[:, 1].round(3))) > 8) == has_grille


@pytest.mark.parametrize("variant", VARIANTS)
def test_the_knob_of_a_kettles_lid_has_another_colour_than_its_body(variant: int) -> None:
    kettle = typical("Kettle", variant)
    lid = [part for part in kettle.parts if part.joint]
    knob = max(lid, key=lambda part: part.mesh.vertices[:, 1].max())
    body = max((part for part in kettle.parts if not part.joint), key=lambda part: float(np.prod(extent(part))))
    assert knob.material != body.material
    assert len({part.material for part in lid}) == 3


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("height", [0.15, 0.18, 0.19])
def test_a_taps_water_reaches_the_floor_of_the_basin_below_it(variant: int, height: float) -> None:
    tap, sink = typical("Faucet", variant), make("Sink", Vec3(0.6, height, 0.48), variant)
    (floor,) = (surface for surface in sink.surfaces if surface.is_inside)
    (rim,) = (surface for surface in sink.surfaces if surface.name == "rim")
    water = min(part.mesh.vertices[:, 1].min() for part in tap.parts if part.shown == "on")
    assert water + tap.size.y / 2 <= floor.center.y - rim.center.y


def test_a_showers_water_reaches_the_floor_from_where_showers_hang() -> None:
    shower = typical("ShowerHead", 0)
    water = min(part.mesh.vertices[:, 1].min() for part in shower.parts if part.shown == "on")
    assert water + shower.size.y / 2 < -1.05


@pytest.mark.parametrize("variant", VARIANTS)
def test_nothing_but_water_is_in_a_toilets_bowl(variant: int) -> None:
    toilet = typical("Toilet", variant)
    (water,) = (part for part in toilet.parts if part.material == "water")
    foot = next(part for part in toilet.parts if part.material.startswith("ceramic"))
    top = foot.mesh.vertices[np.abs(foot.mesh.vertices[:, 0]) < 0.11]
    middle = water.mesh.vertices.mean(axis=0)
    near = top[np.linalg.norm(top[:, ::2] - middle[::2], axis=1) < 0.12]
    assert near[:, 1].max() < 0.42 - toilet.size.y / 2


def test_no_strip_of_another_colour_is_on_the_edge_of_a_door() -> None:
    for variant in VARIANTS:
        leaf = {part.material for part in typical("Doorway", variant).parts if part.joint and not part.is_glass}
        assert len(leaf) == 2, "the leaf and its handles"
