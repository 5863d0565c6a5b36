"""Where to stand: places that see enough of a thing, none of them asked before it must be."""

import numpy as np
import pytest

from vigil.authoring.drafting.house_context import SEEN_POINTS, SEEN_SHARE, HouseContext, seeing_enough
from vigil.pack import Pack
from vigil.pose import Vec3
from vigil.sim.privileged import PrivilegedSimulator

MOST = 128
PLACES = [Vec3(float(number), 0.0, 0.0) for number in range(40)]


def found_among(counts: dict[Vec3, int]) -> list[Vec3]:
    return list(seeing_enough(PLACES, counts.__getitem__, SEEN_SHARE, MOST))


@pytest.mark.parametrize("best", [0, SEEN_POINTS - 1, SEEN_POINTS, 60, MOST])
def test_enough_is_a_share_of_what_the_best_place_sees(best: int) -> None:
    rng = np.random.default_rng(best)
    for _ in range(20):
        counts = dict(zip(PLACES, rng.integers(0, best + 1, len(PLACES)).tolist(), strict=True))
        enough = max(SEEN_POINTS, SEEN_SHARE * max(counts.values()))
        assert found_among(counts) == [place for place in PLACES if counts[place] >= enough]


def test_no_place_sees_anything_of_a_thing_without_places() -> None:
    assert list(seeing_enough([], lambda _: MOST, SEEN_SHARE, MOST)) == []


def test_no_place_is_asked_after_the_first_that_sees_all() -> None:
    asked: list[Vec3] = []

    def sights(place: Vec3) -> int:
        asked.append(place)
        return MOST if len(asked) > 3 else 10

    assert next(seeing_enough(PLACES, sights, SEEN_SHARE, MOST)) == PLACES[3]
    assert asked == PLACES[:4]


def test_a_thing_is_sighted_where_any_point_of_it_is_seen(simulator: PrivilegedSimulator, starter: Pack) -> None:
    episode = max(starter.episodes, key=lambda each: len(starter.house_of(each).document.rooms))
    context = HouseContext(simulator, starter.house_of(episode), np.random.default_rng(0))
    told: list[bool] = []
    for thing in list(context.oracle.scene.things.values())[::7]:
        for place in context.starts(lambda places: np.ones(len(places), dtype=bool), 6):
            told.append(context.is_sighted(place, thing))
            assert told[-1] == (context.sights(place, thing) > 0)
    assert any(told)
    assert not all(told)
