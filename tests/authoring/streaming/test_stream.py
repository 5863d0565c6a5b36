"""The stream: what it holds, that seed, filters and versions alone decide it, and that it leaves nothing behind."""

import hashlib
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.support.waiting import HANGS_AFTER_S, wait_until
from vigil.authoring.review.validate import Validator
from vigil.authoring.streaming import houses, stream
from vigil.authoring.streaming.address import address_of, is_stream, seed_in, stream_version
from vigil.authoring.streaming.difficulty import difficulties_named, difficulty_of
from vigil.authoring.streaming.houses import PACKAGED, StreamHouse, StreamHouseMaker, StreamSettings, is_packaged
from vigil.authoring.streaming.stream import HousePool, SharedHouses, Stream
from vigil.errors import SettingError, SimulatorError
from vigil.packs.freeze import freeze
from vigil.packs.pack import Pack
from vigil.protocol.house import canonical_json
from vigil.sim.privileged import PrivilegedSimulator

BATHROOM = 15
PG = StreamSettings(7, ("PG",))
PINNED = "496b2bda9a291406aac5bcfd5242d98fbe7cc07d099883defce16cf5fc3cd5b3"


@pytest.fixture(scope="module")
def made() -> StreamHouse:
    return StreamHouseMaker(StreamSettings(7, ("PG", "SV"))).made(BATHROOM)


def is_running(pid: int) -> bool:
    try:
        return "Z" not in Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except FileNotFoundError:
        return False


def test_episodes_hold_and_a_frozen_pack_takes_them(
    made: StreamHouse, simulator: PrivilegedSimulator, tmp_path: Path
) -> None:
    assert {draft.episode.family for draft in made.drafts} == {"PG", "SV"}
    house, validator = made.house, Validator(simulator)
    for draft in made.drafts[:2]:
        assert validator.validate(draft.episode, house, draft.actions).is_valid
    items = list(stream.items_in([made]))
    assert [item.number for item in items] == list(range(len(items)))
    pack = freeze(tmp_path / "p", [i.episode for i in items], [i.solution for i in items], [house], name="p")
    assert [episode.id for episode in pack.episodes] == [item.episode.id for item in items]


def test_ids_say_the_stream_its_version_and_the_house(made: StreamHouse) -> None:
    for draft in made.drafts:
        start = f"stream7v{stream_version()}_0000000015_"
        assert draft.episode.id.startswith(start)
        assert draft.episode.id.endswith(f"_{draft.facts.category.lower()}_{draft.episode.family.lower()}")


def test_the_bytes_of_this_version_are_pinned(pointing: StreamHouse) -> None:
    """Another hash is another stream: raise DRAFTS_VERSION, or the version of what changed."""
    told = [canonical_json(draft.model_dump(mode="json")) for draft in pointing.drafts]
    assert hashlib.sha256(b"\n".join([canonical_json(pointing.document), *told])).hexdigest() == PINNED


def test_a_filter_leaves_episodes_out_and_changes_none(made: StreamHouse, pointing: StreamHouse) -> None:
    assert pointing.drafts == tuple(draft for draft in made.drafts if draft.episode.family == "PG")
    assert pointing.document == made.document
    hard = StreamHouseMaker(StreamSettings(7, ("PG",), ("hard",))).made(BATHROOM)
    assert hard.drafts == tuple(draft for draft in pointing.drafts if difficulty_of(draft) == "hard")
    assert 0 < len(hard.drafts) < len(pointing.drafts)


def test_two_killed_processes_change_nothing_and_none_is_left(pointing: StreamHouse) -> None:
    pool = HousePool(PG, workers=2)
    first, second = pool.ask(BATHROOM), pool.ask(BATHROOM)
    wait_until(lambda: len(pool.pids()) == 2, "the start of both")
    killed = pool.pids()
    for pid in killed:
        os.kill(pid, signal.SIGKILL)
    assert first.result(HANGS_AFTER_S) == second.result(HANGS_AFTER_S) == pointing
    again = pool.pids()
    assert not set(again) & set(killed)
    pool.close()
    wait_until(lambda: not any(map(is_running, [*killed, *again])), "the end of all")


@pytest.mark.usefixtures("started_workers")
def test_a_process_that_ends_time_and_again_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "executable", "/bin/false")
    pool = HousePool(PG, workers=1)
    with pytest.raises(
        SimulatorError,
        match=r"Stream 7: house maker 1 died 3 times \(exit code 1\)\. Check",
    ):
        pool.ask(BATHROOM).result(HANGS_AFTER_S)
    pool.close()


def test_a_closed_stream_says_so() -> None:
    pool = HousePool(PG, workers=1)
    pool.close()
    with pytest.raises(SimulatorError, match="closed"):
        pool.ask(0).result(HANGS_AFTER_S)


def test_no_process_outlives_a_reader_that_is_killed() -> None:
    program = (
        "from vigil.authoring.streaming.stream import HousePool\n"
        "from vigil.authoring.streaming.houses import StreamSettings\n"
        "pool = HousePool(StreamSettings(7), 1); pool.ask(19)\n"
        "while not pool.pids(): pass\n"
        "print(*pool.pids(), flush=True); input()"
    )
    with subprocess.Popen([sys.executable, "-c", program], stdin=-1, stdout=-1, text=True) as reader:
        assert reader.stdout is not None
        pid = int(reader.stdout.readline())
        assert is_running(pid)
        reader.kill()
    wait_until(lambda: not is_running(pid), "the end of the process")


def of_numbers(numbers: list[int], monkeypatch: pytest.MonkeyPatch) -> None:
    """Makes houses at no cost, and notes which."""

    def made(self: StreamHouseMaker, number: int) -> StreamHouse:
        numbers.append(number)
        return StreamHouse(number=number, name=f"h{number}", document=None, left_out="none")

    monkeypatch.setattr(StreamHouseMaker, "made", made)


def test_houses_come_in_order_from_first_to_last(monkeypatch: pytest.MonkeyPatch) -> None:
    numbers: list[int] = []
    of_numbers(numbers, monkeypatch)
    asked = Stream(7, first=3, last=6, workers=0)
    assert [house.number for house in asked.houses()] == numbers == [3, 4, 5]
    rest = asked.after(2)
    assert rest is not None
    assert [house.number for house in rest.houses()] == [5]
    assert asked.after(3) is None


def test_a_stream_in_which_nothing_fits_gives_up(monkeypatch: pytest.MonkeyPatch) -> None:
    numbers: list[int] = []
    of_numbers(numbers, monkeypatch)
    with pytest.raises(SettingError, match="no episode of CR that is hard in 40 houses in a row"):
        next(iter(Stream(7, families=("CR",), difficulties=("hard",), workers=0)))
    assert numbers == list(range(40))


def test_a_house_of_a_packaged_pack_is_left_out(
    starter: Pack, pointing: StreamHouse, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert is_packaged(starter.house_of(starter.episodes[0]))
    assert not is_packaged(pointing.house)
    sha256 = hashlib.sha256(canonical_json(pointing.document) + b"\n").hexdigest()
    monkeypatch.setattr(houses, "packaged_houses", lambda: frozenset({sha256}))
    found = StreamHouseMaker(PG).made(BATHROOM)
    assert (found.document, found.drafts, found.left_out) == (None, (), PACKAGED)


def test_houses_of_streams_have_seeds_of_their_own() -> None:
    seeds = [houses.house_source(StreamSettings(seed), number).seed for seed in (7, 8) for number in range(200)]
    assert len(set(seeds)) == len(seeds)
    assert min(seeds) > 1_000_000  # all that packs are drawn from are lower


@pytest.mark.parametrize(("address", "seed"), [("stream:0", 0), ("stream:918273645", 918273645)])
def test_an_address_has_a_seed_and_maybe_the_version(address: str, seed: int) -> None:
    assert is_stream(address)
    assert seed_in(address) == seed_in(address_of(seed)) == seed


@pytest.mark.parametrize("address", ["stream:", "stream:-1", "stream:x", "stream:7@", "stream:7.5"])
def test_a_malformed_address_is_refused(address: str) -> None:
    with pytest.raises(SettingError, match="expected stream:SEED"):
        seed_in(address)


def test_another_version_is_refused() -> None:
    with pytest.raises(SettingError, match=r"asks for version 1\.1\.1\.1, but this package makes version"):
        seed_in("stream:7@1.1.1.1")


@pytest.mark.parametrize("options", [{"first": -1}, {"first": 2, "last": 2}, {"workers": -1}])
def test_settings_without_sense_are_refused(options: dict[str, Any]) -> None:
    with pytest.raises(SettingError):
        Stream(7, **options)


def test_pointing_is_graded_by_size_and_states_by_distance(made: StreamHouse) -> None:
    for draft in made.drafts:
        by_distance = "easy" if draft.facts.distance_m <= 1.1 else "medium" if draft.facts.distance_m <= 2.0 else "hard"
        by_size = {"large": "easy", "medium": "medium", "small": "hard", None: by_distance}
        assert difficulty_of(draft) == by_size[draft.episode.target_size]


def test_a_longer_solution_is_more_difficult(made: StreamHouse) -> None:
    draft = made.drafts[0]
    reached = draft.episode.model_copy(update={"family": "DA", "target_size": None})
    told = [
        difficulty_of(draft.model_copy(update={"episode": reached, "actions": draft.actions[:1] * count}))
        for count in (4, 5, 6, 7)
    ]
    assert told == ["easy", "medium", "medium", "hard"]


def test_difficulties_are_named_in_any_order() -> None:
    assert difficulties_named(["hard,Easy"]) == ("easy", "hard")
    with pytest.raises(SettingError, match="Did you mean 'easy'"):
        difficulties_named(["eazy"])


def test_readers_of_a_stream_in_one_process_share_houses_and_processes(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[int] = []
    ask = HousePool.ask
    monkeypatch.setattr(HousePool, "ask", lambda pool, number: asked.append(number) or ask(pool, number))
    first, second = (SharedHouses(PG, 1) for _ in range(2))
    made = [reader.ask(BATHROOM) for reader in (first, second)]
    assert made[0].result(HANGS_AFTER_S) is made[1].result(HANGS_AFTER_S)
    assert asked == [BATHROOM]
    pids = first.pids()
    assert pids == second.pids()
    first.close()
    with pytest.raises(SimulatorError, match="closed"):
        first.ask(BATHROOM)
    assert second.ask(BATHROOM).result().number == BATHROOM
    assert all(map(is_running, pids))
    second.close()
    wait_until(lambda: not any(map(is_running, pids)), "the end of the shared process")
