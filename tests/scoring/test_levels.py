"""Levels: what the index adds up, where the levels part, and the file that they stand in."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.tiny_pack import tiny_episode
from vigil.errors import SettingError
from vigil.protocol.families import FAMILIES
from vigil.scoring.levels import (
    COSTS,
    LEVELS,
    LEVELS_FILE,
    LevelMeasures,
    dump_levels,
    grade_episode,
    index_of,
    level_of,
    parse_levels,
    read_levels,
    read_pack_levels,
)

PLAIN = LevelMeasures(
    path_m=0.0, turns=0, doors=0, rooms=1, look_alikes=0, target_px=9000, containers=0, occlusion=0.0, slack=1.0,
    reference_words=1,
)  # fmt: skip
HARDER = {
    "path_m": 7.0, "turns": 4, "doors": 2, "rooms": 4, "look_alikes": 1, "target_px": 1000, "containers": 2,
    "occlusion": 0.5, "slack": 0.5, "reference_words": 5,
}  # fmt: skip
POINTS = {
    "path_m": 3.0, "turns": 1.0, "doors": 1.0, "rooms": 1.0, "look_alikes": 1.0, "target_px": 1.0, "containers": 3.0,
    "occlusion": 1.0, "slack": 1.5, "reference_words": 1.0,
}  # fmt: skip


def test_every_figure_has_its_cost() -> None:
    assert set(COSTS) == set(LevelMeasures.model_fields) == set(HARDER)
    assert index_of(PLAIN) == 0.0


@pytest.mark.parametrize("figure", COSTS)
def test_each_figure_adds_what_the_table_says(figure: str) -> None:
    assert index_of(PLAIN.model_copy(update={figure: HARDER[figure]})) == pytest.approx(POINTS[figure])


def test_the_index_is_the_sum() -> None:
    assert index_of(PLAIN.model_copy(update=HARDER)) == pytest.approx(sum(POINTS.values()))


def test_an_unseen_target_costs_no_more_than_one_of_ten_pixels() -> None:
    unseen, tiny = (index_of(PLAIN.model_copy(update={"target_px": pixels})) for pixels in (0, 10))
    assert unseen == tiny


@pytest.mark.parametrize("family", FAMILIES)
def test_bounds_rise_and_belong_to_the_easier_level(family: str) -> None:
    bounds = FAMILIES[family].level_bounds
    assert bounds is not None
    assert list(bounds) == sorted(bounds)
    assert [level_of(family, bound) for bound in bounds] == ["easy", "medium", "hard"]
    assert level_of(family, bounds[-1] + 0.001) == "extreme"


@given(st.floats(0, 30), st.floats(0, 30), st.sampled_from(list(FAMILIES)))
def test_a_higher_index_is_never_an_easier_level(one: float, other: float, family: str) -> None:
    low, high = sorted((one, other))
    assert LEVELS.index(level_of(family, low)) <= LEVELS.index(level_of(family, high))


def test_names_of_levels() -> None:
    assert parse_levels(["extreme", "hard,easy"]) == ("easy", "hard", "extreme")
    assert parse_levels(["all"]) == LEVELS
    assert parse_levels([]) == ()
    with pytest.raises(SettingError, match=r"'hrad' does not exist\. Did you mean 'hard'"):
        parse_levels(["hrad"])


def test_the_file_keeps_every_figure(tmp_path: Path) -> None:
    levels = [grade_episode(tiny_episode(number), PLAIN.model_copy(update={"turns": number})) for number in (2, 1)]
    file = tmp_path / LEVELS_FILE
    assert read_pack_levels(tmp_path) == {}
    file.write_bytes(dump_levels(levels))
    assert read_levels(file) == read_pack_levels(tmp_path) == {each.episode_id: each for each in levels}
    assert list(read_levels(file)) == sorted(each.episode_id for each in levels)


def test_a_wrong_file_is_named_with_its_line(tmp_path: Path) -> None:
    file = tmp_path / "mine.jsonl"
    with pytest.raises(SettingError, match="does not exist"):
        read_levels(file)
    file.write_bytes(dump_levels([grade_episode(tiny_episode(1), PLAIN)]).replace(b'"easy"', b'"simple"'))
    with pytest.raises(SettingError, match=r"line 1: level.*`vigil pack levels`"):
        read_levels(file)
