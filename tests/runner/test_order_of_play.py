"""The order in which a run plays its episodes."""

import json
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

from tests.support.quick_runs import quick
from tests.support.tiny_pack import loose_pack, tiny_episode, tiny_house
from vigil.packs.pack import Pack
from vigil.records.record import EPISODES_FILE
from vigil.records.shards import play_order
from vigil.runner.plan import plan_run
from vigil.runner.run import PlayQueue, run_pack
from vigil.runner.verify_run import VerifySettings, verify_run
from vigil.runner.workers.messages import Assignment
from vigil.runner.workers.pool import SimulatorPool


def test_a_run_goes_from_house_to_house_and_its_records_are_told_by_episode(tmp_path: Path) -> None:
    houses = [tiny_house("one"), tiny_house("two")]
    episodes = [tiny_episode(number, house=houses[number % 2]) for number in range(6)]
    loose_pack(tmp_path / "pack", episodes, houses)
    result = run_pack(quick(tmp_path / "pack", tmp_path / "run", agent="noop", epochs=2))
    lines = (tmp_path / "run" / EPISODES_FILE).read_text().splitlines()
    played = [(row["epoch"], row["episode_id"]) for row in map(json.loads, lines)]
    assert played == [(epoch, f"tiny-DA-{number:03d}") for epoch in (1, 2) for number in (0, 2, 4, 1, 3, 5)]
    assert [record.episode_id for record in result.records[::2]] == [episode.id for episode in episodes]
    assert verify_run(tmp_path / "run", VerifySettings(workers=1)).is_verified


@given(st.integers(1, 4), st.integers(0, 3), st.integers(1, 3), st.integers(1, 4), st.data())
def test_no_worker_plays_a_twin_after_the_other_while_anything_else_is_left(
    twins: int, singles: int, epochs: int, workers: int, data: st.DataObject
) -> None:
    episodes = [tiny_episode(number) for number in range(2 * twins + singles)]
    pairs = {episode.id: f"pair {number // 2}" for number, episode in enumerate(episodes[: 2 * twins])}
    order = data.draw(st.permutations([Assignment(each, epoch) for each in episodes for epoch in range(1, epochs + 1)]))
    queue, left = PlayQueue(order, pairs), list(order)
    last: dict[int, Assignment] = {}
    while left:
        worker = data.draw(st.integers(1, workers))
        before, played = last.get(worker), queue.take(last.get(worker))
        assert played is not None
        place = place_of(played, pairs)
        if before is not None and place == place_of(before, pairs):
            assert {place_of(each, pairs) for each in left} == {place}
        left.remove(played)
        last[worker] = played
    assert queue.take(None) is None


def place_of(assignment: Assignment, pairs: dict[str, str]) -> str:
    return pairs.get(assignment.episode.id, assignment.episode.id)


def test_twins_of_the_packaged_suite_are_played_far_apart() -> None:
    pack = Pack.load("vigil_closure_400")
    at = {episode.id: place for place, episode in enumerate(play_order(pack.episodes, pack.pairs))}
    places: dict[str, list[int]] = {}
    for name, pair in pack.pairs.items():
        places.setdefault(pair, []).append(at[name])
    assert len(places) > 50
    assert all(len(both) == 2 for both in places.values())
    assert min(abs(one - other) for one, other in places.values()) > 50


def test_each_worker_plays_its_own_sequence(tmp_path: Path) -> None:
    """Of several free workers an episode goes to that which is to play it: the queue knows what that one played."""
    houses = [tiny_house("one")]
    loose_pack(tmp_path / "pack", [tiny_episode(number, house=houses[0]) for number in range(4)], houses)
    plan = plan_run(quick(tmp_path / "pack", None, agent="noop")).worker
    with SimulatorPool(plan, 3) as pool:
        for wanted in pool.workers:
            assert pool.acquire(wanted) is wanted
            pool.release(wanted)
        first = pool.acquire(pool.workers[1])
        assert pool.acquire(first) is pool.workers[0]
