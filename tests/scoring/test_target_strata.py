"""Strata: sizes as the paper gives them, and by measure where it gives none."""

import json
from pathlib import Path

import pytest

from vigil.assets.catalog import CATALOG
from vigil.scoring.target_strata import SIZE_OF_CATEGORY, distance_band, size_of, sort_by_size


@pytest.mark.parametrize("longest_side_m", [0.05, 0.5, 2.5])
@pytest.mark.parametrize(("category", "size"), [("Cabinet", "medium"), ("Television", "large"), ("Egg", "small")])
def test_what_the_paper_names_has_its_size_whatever_it_measures(category: str, size: str, longest_side_m: float):
    assert size_of(category, longest_side_m) == size


@pytest.mark.parametrize(("side", "size"), [(0.22, "small"), (0.23, "medium"), (0.69, "medium"), (0.7, "large")])
def test_everything_else_goes_by_its_longest_side(side: float, size: str):
    assert size_of("Box", side) == size


def test_every_named_category_exists():
    assert SIZE_OF_CATEGORY.keys() <= CATALOG.keys()


def test_frozen_targets_follow_the_rule():
    folder = Path(__file__).parents[2] / "src/vigil/data/packs/vigil_balanced_1000_v6"
    rows = map(json.loads, (folder / "episodes.jsonl").read_text(encoding="utf-8").splitlines())
    graded = [(row["bindings"]["target"].split("|")[0], row["target_size"]) for row in rows if row["family"] == "PG"]
    assert len(graded) == 125
    assert [pair for pair in graded if SIZE_OF_CATEGORY.get(pair[0], pair[1]) != pair[1]] == []


@pytest.mark.parametrize(("distance_m", "band"), [(2.99, "under 3 m"), (3.0, "3 to 4 m"), (4.0, "over 4 m")])
def test_distances_fall_into_bands(distance_m: float, band: str):
    assert distance_band(distance_m) == band


def test_strata_are_sorted_by_size_and_number():
    named = dict.fromkeys(["over 4 m", "2 to 4 m", "large", "small", "10 steps", "under 2 m", "medium"], 1)
    assert list(sort_by_size(named)) == ["small", "under 2 m", "medium", "2 to 4 m", "10 steps", "large", "over 4 m"]
