"""Where to stand: places that see enough of a thing, none of them looked from further than an answer needs."""

import numpy as np
import pytest

from vigil.authoring.drafting.house_context import SEEN_SHARE, HouseContext
from vigil.authoring.solving.look_targets import BATCHES, SEEN_POINTS, PointCount, places_seeing_enough, surface_points
from vigil.base.geometry import Pose, Vec3
from vigil.packs.pack import Pack
from vigil.protocol.world import Setup
from vigil.sim.core.sight import Sight
from vigil.sim.engines.mujoco.engine import MujocoEngine
from vigil.sim.privileged import PrivilegedSimulator

MOST = 128
PLACES = [Vec3(float(number), 0.0, 0.0) for number in range(40)]


def count_of(is_seen: np.ndarray, asked: list[int] | None = None) -> PointCount:
    """Return a counter of points, which notes how many points are asked about."""

    def sees(points: np.ndarray) -> np.ndarray:
        if asked is not None:
            asked.append(len(points))
        return is_seen[points[:, 0].astype(int)]

    return PointCount(np.repeat(np.arange(len(is_seen))[:, None], 3, axis=1), sees)


def found_among(seen: dict[Vec3, np.ndarray]) -> list[Vec3]:
    return list(places_seeing_enough(PLACES, lambda place: count_of(seen[place]), SEEN_SHARE))


@pytest.mark.parametrize("best", [0, SEEN_POINTS - 1, SEEN_POINTS, 60, MOST])
def test_enough_is_a_share_of_what_the_best_place_sees(best: int) -> None:
    rng = np.random.default_rng(best)
    for _ in range(20):
        counts = dict(zip(PLACES, rng.integers(0, best + 1, len(PLACES)).tolist(), strict=True))
        seen = {place: rng.permutation(MOST) < count for place, count in counts.items()}
        enough = max(SEEN_POINTS, SEEN_SHARE * max(counts.values()))
        assert found_among(seen) == [place for place in PLACES if counts[place] >= enough]


def test_no_place_sees_anything_of_a_thing_without_places() -> None:
    assert list(places_seeing_enough([], lambda _: count_of(np.ones(MOST, dtype=bool)), SEEN_SHARE)) == []


def test_no_place_is_looked_from_after_the_first_that_sees_all() -> None:
    asked: list[int] = []
    seen = {place: np.full(MOST, number == 3) for number, place in enumerate(PLACES)}
    found = places_seeing_enough(PLACES, lambda place: count_of(seen[place], asked), SEEN_SHARE)
    assert next(found) == PLACES[3]
    assert sum(asked) == 4 * MOST


@pytest.mark.parametrize("points", [0, 1, BATCHES - 1, BATCHES, 130])
def test_a_count_tells_every_number_of_points(points: int) -> None:
    is_seen = np.arange(points) % 3 == 0
    for least in range(points + 2):
        assert count_of(is_seen).is_at_least(least) == (int(is_seen.sum()) >= least)


def test_a_count_asks_about_no_more_points_than_tell() -> None:
    asked: list[int] = []
    count = count_of(np.ones(MOST, dtype=bool), asked)
    assert count.is_at_least(0)
    assert not count.is_at_least(MOST + 1)
    assert not asked
    assert count.is_at_least(SEEN_POINTS)
    assert asked == [MOST // BATCHES]
    assert count.is_at_least(MOST)
    assert sum(asked) == MOST


def test_what_walls_hide_no_ray_meets(simulator: PrivilegedSimulator, starter: Pack, monkeypatch) -> None:
    episode = max(starter.episodes, key=lambda each: len(starter.house_of(each).document.rooms))
    context = HouseContext(simulator, starter.house_of(episode), np.random.default_rng(0))
    places = list(context.starts(lambda places: np.ones(len(places), dtype=bool), 12))
    things = list(context.view.scene.things.values())[::3]

    def counts() -> tuple[list[int], int]:
        """Return the number of points of things that are seen from places, and how often rays were cast."""
        cast, found = [], []
        original = MujocoEngine.cast
        with monkeypatch.context() as patch:
            patch.setattr(MujocoEngine, "cast", lambda *args, **options: cast.append(1) or original(*args, **options))
            for thing in things:
                points = surface_points(thing, 48)
                for place in places:
                    eye = Pose(position=place, rotation=0.0).eye
                    found.append(int(context.view.sees(eye, points, thing.id, through_glass=True).sum()))
        return found, len(cast)

    known, casts = counts()
    monkeypatch.setattr(Sight, "_is_behind_walls", lambda *_: False)
    context.begin(Setup())
    asked, all_casts = counts()
    assert asked == known
    assert any(known)
    assert casts < 0.9 * all_casts


def test_a_thing_is_sighted_where_any_point_of_it_is_seen(simulator: PrivilegedSimulator, starter: Pack) -> None:
    episode = max(starter.episodes, key=lambda each: len(starter.house_of(each).document.rooms))
    context = HouseContext(simulator, starter.house_of(episode), np.random.default_rng(0))
    told: list[bool] = []
    for thing in list(context.view.scene.things.values())[::7]:
        for place in context.starts(lambda places: np.ones(len(places), dtype=bool), 6):
            told.append(context.is_visible_from(place, thing))
            assert told[-1] == context.visible_points(place, thing).is_at_least(1)
    assert any(told)
    assert not all(told)
