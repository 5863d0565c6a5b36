import itertools

import numpy as np

from vigil.assets.catalog import CATALOG
from vigil.assets.sizes import AssetDatabase
from vigil.housegen.solids import bodies_of


def bodies(house):
    found, unknown = bodies_of(house, AssetDatabase.default())
    assert unknown == []
    return found


def test_small_things_rest_on_a_surface_of_their_parent(house):
    for body in bodies(house):
        if body.parent is None or body.category in ("Towel", "HandTowel"):
            continue
        assert body.gap is not None, body.id
        assert abs(body.gap) < 0.02, body.id


def test_small_things_go_where_their_kind_goes(house):
    for body in bodies(house):
        is_hung = body.category in ("Towel", "HandTowel")
        if body.parent is not None and CATALOG[body.category].is_pickupable and not is_hung:
            assert CATALOG[body.parent.category].is_receptacle


def test_siblings_on_a_surface_are_apart(house):
    for body in bodies(house):
        for one, two in itertools.combinations(body.children, 2):
            if {one.category, two.category} & {"Sink", "Faucet"} or abs(one.bottom - two.bottom) > 0.005:
                continue
            gap = np.hypot(one.position.x - two.position.x, one.position.z - two.position.z)
            assert gap > 0.02


def test_something_small_lies_about(house):
    loose = [body for body in bodies(house) if body.parent is not None and CATALOG[body.category].is_pickupable]
    is_bathroom = {room.room_type for room in house.document.rooms} == {"Bathroom"}
    assert len(loose) >= (2 if is_bathroom else 6)
