"""Every registered category, at several variants and sizes, is a sound asset."""

from collections.abc import Callable, Iterator
from itertools import pairwise

import numpy as np
import pytest

from vigil.assets import making
from vigil.assets.catalog import CATALOG
from vigil.assets.kernel.asset import Asset
from vigil.assets.kernel.materials import material
from vigil.assets.making import MAKERS, make
from vigil.base.geometry import Vec3

SOMETIMES_OPEN = {"Desk", "SideTable"}
"""Categories of which some variants have drawers and others not."""
BELOW_M = {"ShowerHead": 1.4}
"""How far what is shown only while on may reach below a box: a shower's water to the floor, stretched or not."""
MOST_PARTS = 14
MOST_TRIANGLES = 9000
VARIANTS = range(5)
STRETCHES = ((1.0, 1.0, 1.0), (1.3, 0.85, 1.25), (0.8, 1.15, 0.8))


def _usual(category: str) -> Vec3:
    return CATALOG[category].typical_size


def _assets(category: str) -> Iterator[Asset]:
    size = _usual(category)
    for variant in VARIANTS:
        for stretch in STRETCHES if variant < 3 else STRETCHES[:1]:
            yield make(category, Vec3(*(a * b for a, b in zip(size, stretch, strict=True))), variant)


def _extent(asset: Asset) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest and highest corner of the asset closed and off."""
    meshes = [part.mesh for part in asset.parts if part.shown != "on"]
    return (
        np.min([mesh.vertices.min(0) for mesh in meshes], axis=0),
        np.max([mesh.vertices.max(0) for mesh in meshes], axis=0),
    )


def _is_convex(polygon: tuple[tuple[float, float], ...]) -> bool:
    corners = np.array(polygon)
    edges = np.roll(corners, -1, 0) - corners
    following = np.roll(edges, -1, 0)
    turns = edges[:, 0] * following[:, 1] - edges[:, 1] * following[:, 0]
    return bool((turns > -1e-9).all() or (turns < 1e-9).all())


def test_every_catalogued_category_has_a_maker() -> None:
    assert sorted(set(CATALOG) - set(MAKERS)) == []


@pytest.mark.parametrize("category", sorted(MAKERS))
def test_meshes_are_sound(category: str, assert_well_made: Callable[..., None]) -> None:
    for asset in _assets(category):
        assert asset.category == category
        for part in asset.parts:
            assert_well_made(part.mesh, -0.2, strays=0.12)
            assert material(part.material)
            assert part.material_on is None or part.bears_toggle


@pytest.mark.parametrize("category", sorted(MAKERS))
def test_fills_its_box_and_stays_inside(category: str) -> None:
    for asset in _assets(category):
        low, high = _extent(asset)
        half = np.array(asset.size) / 2
        slack = 1e-4 + 0.02 * half
        on = [part.mesh.vertices for part in asset.parts if part.shown == "on"]
        reach = 2 * half.max() + 0.1
        below = max(reach, half[1] + BELOW_M.get(category, 0.0))
        assert (low >= -half - 1e-4).all()
        assert (high <= half + 1e-4).all()
        assert (low <= -half + slack).all(), (category, low, -half)
        assert (high >= half - slack).all(), (category, high, half)
        assert all(vertices.max() < reach and vertices.min() > -below for vertices in on)


@pytest.mark.parametrize("category", sorted(MAKERS))
def test_joints_surfaces_and_solids_belong_to_it(category: str) -> None:
    for asset in _assets(category):
        joints = {joint.name for joint in asset.joints}
        assert len(joints) == len(asset.joints)
        half = np.array(asset.size) / 2 + 2e-3
        carried = {part.joint for part in asset.parts} - {None}
        assert carried == joints, "every joint moves some part, and every part's joint exists"
        for joint in asset.joints:
            assert np.linalg.norm(joint.axis) == pytest.approx(1.0)
            assert 0 < abs(joint.travel) < (181 if joint.kind == "hinge" else 2.5)
        for surface in asset.surfaces:
            assert surface.joint is None or surface.joint in joints
            assert (np.abs(surface.center) <= half).all(), (category, surface)
            assert 0 < surface.size_x <= 2 * half[0], (category, surface)
            assert 0 < surface.size_z <= 2 * half[2], (category, surface)
            assert surface.clearance > 0
            assert not surface.needs_opening or (asset.can_open and surface.is_inside)
        for solid in asset.solids:
            assert solid.joint is None or solid.joint in joints
            assert _is_convex(solid.polygon), (category, solid)
            assert solid.bottom < solid.top
            corners = np.array(solid.polygon)
            assert (np.abs(corners) <= half[[0, 2]]).all(), (category, solid)
            assert max(abs(solid.bottom), abs(solid.top)) <= half[1], (category, solid)


@pytest.mark.parametrize("category", sorted(MAKERS))
def test_body_is_inside_the_box(category: str) -> None:
    for asset in _assets(category):
        if asset.body is not None:
            half = np.array(asset.size) / 2 + 1e-3
            low, high = np.array(asset.body)
            assert (low < high).all()
            assert (np.abs([low, high]) <= half).all()


@pytest.mark.parametrize("category", sorted(set(CATALOG) & set(MAKERS)))
def test_states_show_as_the_catalogue_says(category: str) -> None:
    row = CATALOG[category]
    assets = list(_assets(category))
    opening = [any(part.bears_open and part.joint for part in asset.parts) for asset in assets]
    if row.is_openable:
        assert any(opening) if category in SOMETIMES_OPEN else all(opening)
    else:
        assert not any(asset.can_open for asset in assets)
    for asset in assets:
        telling = [part for part in asset.parts if part.bears_toggle]
        if row.is_toggleable:
            assert any(part.shown != "always" or part.material_on not in (None, part.material) for part in telling)
        else:
            assert not telling
        assert not row.is_receptacle or asset.surfaces or category in ("Cup", "Mug")


@pytest.mark.parametrize("category", sorted(MAKERS))
def test_parts_and_triangles_are_few(category: str) -> None:
    for asset in _assets(category):
        limit = MOST_PARTS + 2 * len(asset.joints)
        assert len(asset.parts) <= limit, (category, len(asset.parts))
        assert sum(len(part.mesh.faces) for part in asset.parts) <= MOST_TRIANGLES, category


def _fingerprint(asset: Asset) -> list[object]:
    parts = [
        (part.name, part.material, part.mesh.vertices.tobytes(), part.mesh.faces.tobytes(), part.mesh.uvs.tobytes())
        for part in asset.parts
    ]
    return [*parts, asset.solids, asset.surfaces, asset.joints, sorted(asset.tags)]


def test_same_arguments_same_bytes() -> None:
    before = {category: _fingerprint(make(category, _usual(category), 7)) for category in sorted(MAKERS)}
    making._make_cached.cache_clear()
    for category, fingerprint in before.items():
        assert _fingerprint(make(category, _usual(category), 7)) == fingerprint


@pytest.mark.parametrize("category", sorted(MAKERS))
def test_variants_differ(category: str) -> None:
    looks = {str(_fingerprint(make(category, _usual(category), variant))) for variant in range(8)}
    assert len(looks) >= 2


def test_no_shape_is_made_twice() -> None:
    size = _usual("Fridge")
    usual = make("Fridge", size, 3)
    assert make("Fridge", size, 3, ()) is usual
    assert make("Fridge", size=size, variant=3) is usual


def test_an_unknown_category_becomes_a_box() -> None:
    asset = make("Zeppelin", Vec3(0.4, 0.5, 0.6), 0)
    assert asset.category == "Zeppelin"
    assert asset.size == Vec3(0.4, 0.5, 0.6)
    assert asset.surfaces


@pytest.mark.parametrize(
    "size", [Vec3(0.0, 0.0, 0.0), Vec3(0.01, 3.0, 0.01), Vec3(4.0, 0.01, 4.0), Vec3(3.0, 3.0, 3.0)]
)
@pytest.mark.parametrize("category", sorted(MAKERS))
def test_odd_sizes_do_not_break(category: str, size: Vec3) -> None:
    asset = make(category, size, 1)
    assert all(np.isfinite(part.mesh.vertices).all() for part in asset.parts)


@pytest.mark.parametrize(
    ("category", "levels"),
    [("ShelvingUnit", (0.3, 0.9, 1.3)), ("TVStand", (0.12,)), ("Fridge", (0.4, 0.9, 1.2)), ("Cabinet", (0.3, 0.6))],
)
def test_shelves_stand_where_things_rest(category: str, levels: tuple[float, ...]) -> None:
    size = _usual(category)
    for variant in range(4):
        asset = make(category, size, variant, levels)
        tops = [surface.center.y + size.y / 2 for surface in asset.surfaces]
        for level in levels:
            assert min(abs(top - level) for top in tops) < 0.03, (level, sorted(tops))


@pytest.mark.parametrize("category", ["TVStand", "Dresser", "Fridge", "Desk", "SideTable", "Sofa"])
def test_levels_that_the_usual_shape_has_change_nothing(category: str) -> None:
    size = _usual(category)
    for variant in range(4):
        usual = make(category, size, variant)
        levels = tuple(round(surface.center.y + size.y / 2 + 0.01, 3) for surface in usual.surfaces)
        assert make(category, size, variant, levels) is usual


@pytest.mark.parametrize(("category", "level"), [("Sofa", 0.42), ("Chair", 0.45), ("Bed", 0.5), ("ArmChair", 0.4)])
def test_seats_and_mattresses_are_where_things_rest(category: str, level: float) -> None:
    size = _usual(category)
    asset = make(category, size, 3, (level,))
    assert asset.surfaces[0].center.y + size.y / 2 == pytest.approx(level, abs=0.03)


@pytest.mark.parametrize("category", ["Dresser", "Desk", "TVStand", "SideTable", "Drawer"])
def test_drawers_carry_what_lies_in_them_to_the_front(category: str) -> None:
    drawers = [asset for asset in _assets(category) if asset.can_open]
    assert drawers
    for asset in drawers:
        inside = [surface for surface in asset.surfaces if surface.joint]
        assert {surface.joint for surface in inside} == {joint.name for joint in asset.joints}
        assert all(joint.kind == "slide" and joint.axis == (0, 0, 1) and joint.travel > 0.08 for joint in asset.joints)


@pytest.mark.parametrize("category", ["Fridge", "Microwave", "Cabinet", "Safe", "Doorway", "WashingMachine"])
def test_doors_swing_to_the_front(category: str) -> None:
    """The far edge of each leaf ends up in front of the box."""
    for asset in _assets(category):
        for joint in asset.joints:
            leaf = np.concatenate([part.mesh.vertices for part in asset.parts if part.joint == joint.name])
            turn = np.radians(joint.travel)
            offset = leaf[:, [0, 2]] - [joint.origin.x, joint.origin.z]
            ahead = joint.origin.z + offset[:, 1] * np.cos(turn) - joint.axis.y * offset[:, 0] * np.sin(turn)
            assert ahead.max() > asset.size.z / 2 + 0.2 * np.ptp(leaf[:, 0])


def test_wide_doors_have_two_leaves() -> None:
    assert len(make("Doorway", Vec3(1.0, 2.1, 0.14), 1).joints) == 1
    assert len(make("Doorway", Vec3(2.0, 2.1, 0.14), 1).joints) == 2


def test_an_open_door_leaves_room_for_a_body() -> None:
    asset = make("Doorway", Vec3(1.0, 2.1, 0.14), 2)
    jambs = [solid for solid in asset.solids if solid.joint is None and solid.bottom < -1.0]
    edges = sorted(x for solid in jambs for x, _ in solid.polygon)
    assert max(right - left for left, right in pairwise(edges)) > 0.8


def test_corner_counters_leave_their_inside_free() -> None:
    asset = make("CounterTop", Vec3(2.44, 0.94, 1.83), 0)
    assert len(asset.surfaces) == len(asset.solids) == 2
    inside = [
        solid
        for solid in asset.solids
        if min(x for x, _ in solid.polygon) < -0.5 and max(z for _, z in solid.polygon) > 0
    ]
    assert not inside
    assert len(make("CounterTop", Vec3(2.44, 0.94, 1.24), 0).solids) == 3
