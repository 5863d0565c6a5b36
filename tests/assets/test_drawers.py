"""Furniture taken apart into a body and its drawers."""

import numpy as np
import pytest

from vigil.assets.database import AssetDatabase, own_asset_id
from vigil.assets.drawers import (
    body_of,
    drawer_asset_id,
    drawer_names,
    drawer_of,
    split_drawer_id,
)
from vigil.assets.kernel.asset import Asset
from vigil.assets.making import make
from vigil.protocol.house import drawer_id

DATABASE = AssetDatabase.default()
HOLDS_DRAWERS = ("Dresser", "SideTable", "Desk", "TVStand")


def own(category: str, number: int) -> Asset:
    entry = DATABASE.look_up(own_asset_id(category, number), "")
    return make(entry.category, entry.size, entry.variant)


def vertices(asset: Asset, shift: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> set[tuple[float, ...]]:
    points = [part.mesh.vertices + np.array(shift) for part in asset.parts]
    return set(map(tuple, np.round(np.concatenate(points), 4).tolist())) if points else set()


@pytest.mark.parametrize("category", HOLDS_DRAWERS)
def test_shut_the_pieces_are_the_whole(category: str) -> None:
    for asset in (own(category, number) for number in range(6)):
        pieces = [drawer_of(asset, name) for name in drawer_names(asset)]
        found = vertices(body_of(asset)).union(*(vertices(drawer, middle) for drawer, middle in pieces))
        missing = np.array(sorted(vertices(asset)))
        near = np.array(sorted(found))
        assert len(near) == pytest.approx(len(missing), rel=0.02)  # corners that differ in the last digit
        assert all(np.abs(near - point).max(axis=1).min() < 1e-3 for point in missing[::7])


@pytest.mark.parametrize("category", HOLDS_DRAWERS)
def test_a_drawer_fills_its_box_and_has_one_joint_floor_and_solid(category: str) -> None:
    asset = next(found for number in range(24) if drawer_names(found := own(category, number)))
    for name in drawer_names(asset):
        drawer, _ = drawer_of(asset, name)
        points = np.concatenate([part.mesh.vertices for part in drawer.parts])
        assert np.allclose(points.max(axis=0), np.array(drawer.size) / 2, atol=1e-5)
        assert np.allclose(points.min(axis=0), -np.array(drawer.size) / 2, atol=1e-5)
        assert [joint.name for joint in drawer.joints] == [name]
        (surface,) = drawer.surfaces
        assert surface.needs_opening
        assert surface.joint == name
        assert drawer.solids
        assert all(part.bears_open and part.joint == name for part in drawer.parts)


def test_the_body_neither_opens_nor_holds_anything_inside() -> None:
    asset = own("Dresser", 3)
    body = body_of(asset)
    assert body.size == asset.size
    assert not body.can_open
    assert [surface.name for surface in body.surfaces] == ["top"]
    assert all(solid.joint is None for solid in body.solids)


def test_drawers_come_out_equally_far() -> None:
    asset = own("Dresser", 3)
    farthest = max(joint.travel for joint in asset.joints)
    assert {drawer_of(asset, name)[0].joints[0].travel for name in drawer_names(asset)} == {farthest}
    assert len({joint.travel for joint in asset.joints}) > 1


def test_only_what_nothing_else_of_moves_has_drawers() -> None:
    assert len(drawer_names(own("Dresser", 3))) == 6
    assert drawer_names(own("Cabinet", 3)) == ()
    assert drawer_names(own("Fridge", 3)) == ()
    assert drawer_names(own("Bed", 3)) == ()


def test_the_same_asset_is_taken_apart_once() -> None:
    asset = own("Dresser", 3)
    assert body_of(asset) is body_of(asset)
    assert drawer_of(asset, "drawer1")[0] is drawer_of(asset, "drawer1")[0]


def test_ids_are_read_back() -> None:
    assert split_drawer_id(drawer_asset_id("vigil_Dresser_5", "drawer3")) == ("vigil_Dresser_5", "drawer3")
    assert split_drawer_id("vigil_Dresser_5") is None
    assert drawer_id("Dresser|2|5", "drawer3") == "Drawer|2|5|Dresser3"
    assert drawer_id("Desk|2|5", "drawer3") != drawer_id("Dresser|2|5", "drawer3")
    assert drawer_id("chest", "drawer3") == "Drawer|chest|3"


def test_the_database_knows_the_drawers_of_own_furniture() -> None:
    entry = DATABASE.look_up("vigil_Dresser_3_drawer2", "Drawer|0|1|2")
    assert (entry.category, entry.note) == ("Drawer", None)
    assert entry.size == drawer_of(own("Dresser", 3), "drawer2")[0].size
    unknown = DATABASE.look_up("vigil_Dresser_3_drawer99", "Drawer|0|1|99")
    assert unknown.category == "Drawer"
    assert unknown.size != entry.size
