import itertools

import numpy as np
import pytest

from vigil.assets.catalog import CATALOG
from vigil.assets.database import AssetDatabase
from vigil.scene.build import build_scene
from vigil.scene.geometry import bounding_box
from vigil.scene.supports import children


def built(house):
    scene = build_scene(house, AssetDatabase.default())
    assert scene.notes == []
    return scene


def test_small_things_rest_on_a_surface_of_their_parent(house):
    scene = built(house)
    for node, parent in house.objects():
        thing = scene.things[node.id]
        assert thing.parent == parent
        rests = thing.surface is not None or thing.is_drawer or thing.category in ("Towel", "HandTowel")
        assert rests or parent is None, node.id


def test_things_stay_where_the_document_puts_them(house):
    scene = built(house)
    for node, _ in house.objects():
        x, y, z = scene.things[node.id].position
        rounding = 1e-4 if scene.things[node.id].is_drawer else 0.0
        assert (x, z) == pytest.approx((node.position.x, node.position.z), abs=rounding, rel=0), node.id
        assert abs(y - node.position.y) < 0.02, node.id


def test_small_things_go_where_their_kind_goes(house):
    things = built(house).things
    for thing in things.values():
        is_hung = thing.category in ("Towel", "HandTowel")
        if thing.parent is not None and thing.is_pickupable and not is_hung:
            assert CATALOG[things[thing.parent].category].is_receptacle


def test_siblings_on_a_surface_are_apart(house):
    scene = built(house)
    for parent in scene.things:
        for one, two in itertools.combinations(children(scene, parent), 2):
            is_basin = bool({one.category, two.category} & {"Sink", "Faucet"})
            if is_basin or abs(bounding_box(one).bottom - bounding_box(two).bottom) > 0.005:
                continue
            gap = np.hypot(one.position.x - two.position.x, one.position.z - two.position.z)
            assert gap > 0.02


def test_something_small_lies_about(house):
    loose = [thing for thing in built(house).things.values() if thing.parent is not None and thing.is_pickupable]
    is_bathroom = {room.room_type for room in house.document.rooms} == {"Bathroom"}
    assert len(loose) >= (2 if is_bathroom else 6)
