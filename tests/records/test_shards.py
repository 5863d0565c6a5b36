"""Which episodes of a run a shard has."""

from collections import Counter
from functools import cache

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from tests.support.tiny_pack import tiny_episode, tiny_house
from vigil.errors import SettingError
from vigil.protocol.episode import Episode
from vigil.protocol.families import Family
from vigil.records.record import Shard
from vigil.records.shards import parse_shard, play_order, shard_episodes

HOUSES = [tiny_house(name) for name in "abcde"]
DRAWN: list[Family] = ["DA", "PG", "SV", "AI", "VS"]


def episodes(count: int, skipped: int = 1) -> list[Episode]:
    """Return episodes; the numbers per family and per house differ, and `skipped` mixes the two."""
    return [one(number, DRAWN[number * skipped % 7 % len(DRAWN)]) for number in range(count)]


@cache
def one(number: int, family: Family) -> Episode:
    return tiny_episode(number, family, HOUSES[number % len(HOUSES)])


def shards(drawn: list[Episode], count: int) -> list[list[Episode]]:
    return [shard_episodes(drawn, Shard(index=index, of=count)) for index in range(1, count + 1)]


def spread(counts: list[int]) -> int:
    return max(counts) - min(counts)


@given(st.integers(1, 40), st.integers(1, 6), st.data())
def test_shards_share_nothing_are_all_and_are_even(count: int, skipped: int, data: st.DataObject) -> None:
    drawn = episodes(count, skipped)
    parts = shards(drawn, data.draw(st.integers(1, count)))
    together = [episode.id for part in parts for episode in part]
    assert sorted(together) == sorted(episode.id for episode in drawn)
    assert spread([len(part) for part in parts]) <= 1
    families = [Counter(episode.family for episode in part) for part in parts]
    assert all(spread([found[family] for found in families]) <= 1 for family in DRAWN)


def test_the_order_in_which_episodes_are_named_changes_nothing() -> None:
    drawn = episodes(23)
    assert shards(drawn, 4) == shards(drawn[::-1], 4)
    assert shard_episodes(drawn[::-1], None) == sorted(drawn, key=lambda episode: episode.id)


def test_shards_follow_one_another_from_house_to_house() -> None:
    drawn = [tiny_episode(number, "DA", HOUSES[number % 5]) for number in range(20)]
    parts = [play_order(part) for part in shards(drawn, 5)]
    assert [{episode.house.name for episode in part} for part in parts] == [{name} for name in "abcde"]
    assert [episode for part in parts for episode in part] == play_order(drawn)


def test_of_twins_the_second_comes_when_all_else_is_played() -> None:
    drawn = [tiny_episode(number, "DA", HOUSES[number // 2 % 5]) for number in range(20)]
    pairs = {episode.id: f"pair {number // 2}" for number, episode in enumerate(drawn[:16])}
    order = play_order(drawn, pairs)
    assert sorted(order, key=lambda episode: episode.id) == drawn
    at = {episode.id: place for place, episode in enumerate(order)}
    apart = [(at[drawn[number].id], at[drawn[number + 1].id]) for number in range(0, 16, 2)]
    assert min(abs(one - other) for one, other in apart) >= 8
    assert len({one < other for one, other in apart}) == 2, "the order tells the side"
    assert play_order(drawn[::-1], pairs) == order


def test_a_shard_without_an_episode_is_refused_whichever_it_is() -> None:
    for index in (1, 4):
        with pytest.raises(SettingError, match=rf"Shard {index}/4 of 3 episodes: .* Give 3 shards or fewer"):
            shard_episodes(episodes(3), Shard(index=index, of=4))


@pytest.mark.parametrize("text", ["1/1", "2/8", "8/8", "100000/999999"])
def test_a_shard_is_read_as_it_is_written(text: str) -> None:
    assert str(parse_shard(text)) == text


@pytest.mark.parametrize("text", ["", "x", "0/3", "4/3", "1/0", "-1/3", "1", "1/2/3", "1.5/3", "1 / 3", "01/3", "٢/٨"])
def test_what_is_no_shard_is_refused_by_name(text: str) -> None:
    with pytest.raises(SettingError, match=r"is not I/N with I from 1 to N, e\.g\. --shard 2/8"):
        parse_shard(text)


def test_a_header_cannot_name_a_shard_that_is_none() -> None:
    with pytest.raises(ValidationError, match="at most the number of shards"):
        Shard(index=4, of=3)
