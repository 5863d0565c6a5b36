import numpy as np
import pytest

from tools.house_measures import DistributionComparison, compare, measure
from vigil.assets.database import AssetDatabase
from vigil.housegen.base.spec import spec_for
from vigil.housegen.document import with_merged_drawers
from vigil.housegen.generate import generate
from vigil.housegen.survey import PART_CATEGORIES, survey


def test_rooms_are_measured():
    house = generate(0, spec_for("bedroom"))
    (room,) = measure(house, AssetDatabase.default())
    assert room.kind == "Bedroom"
    assert room.objects == len(with_merged_drawers(house).objects())
    assert {"Bed", "Pillow"} & room.types
    assert 0.05 < room.covered < 0.6
    assert sum(count for _, count in room.on_support) <= room.loose


def test_only_wanted_kinds_are_counted():
    (room,) = measure(generate(0, spec_for("bedroom")), AssetDatabase.default(), {"Bed"})
    assert (room.objects, room.types, room.loose) == (1, {"Bed"}, 0)


def test_distances_of_distributions():
    same = DistributionComparison("same", np.arange(5.0), np.arange(5.0))
    apart = DistributionComparison("apart", np.zeros(5), np.ones(5))
    half = DistributionComparison("half", np.array([0.0, 1.0]), np.array([1.0, 1.0]))
    assert (same.ks, same.median_ratio, same.is_close) == (0.0, 1.0, True)
    assert apart.ks == 1.0
    assert not apart.is_close
    assert half.ks == pytest.approx(0.5)


def test_compare_names_room_and_support():
    rooms = measure(generate(0, spec_for("bedroom")), AssetDatabase.default())
    names = [each.name for each in compare(rooms, rooms, ("Bed",))]
    assert "Bedroom: objects" in names
    assert names[-1] == "things on: bed"


def test_a_sweep_counts_what_is_there():
    twins = survey([3, 3], [1], lambda _: None, lambda _: None)
    assert twins.houses[1] == 2
    assert twins.problems == []
    assert twins.rare_categories(1)
    assert not PART_CATEGORIES & set(twins.rare_categories(1))
