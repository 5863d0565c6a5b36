"""Runs that are verified together: a house is loaded once for all, and each run has its own result."""

from itertools import groupby
from pathlib import Path
from typing import Any

import pytest

from tests.support.played_runs import make_run
from tests.support.tiny_pack import loose_pack, tiny_episode, tiny_house
from vigil.packs.pack import Pack
from vigil.protocol.profile import Profile
from vigil.records.record import EPISODES_FILE
from vigil.runner.settings import VerifySettings
from vigil.runner.verify_run import Verification, simulation_of, verify_runs
from vigil.runner.workers.messages import Assignment
from vigil.runner.workers.pool import SimulatorPool
from vigil.scoring.saved_run import SavedRun, read_run

PROFILES = (Profile(), Profile(prompt_variant="neutral_report"))


@pytest.fixture(scope="module")
def pack(tmp_path_factory: pytest.TempPathFactory) -> Pack:
    """Episodes of two houses in turn."""
    houses = [tiny_house(), tiny_house("other", Mug="Mug|9|9")]
    episodes = [tiny_episode(number, house=houses[number % 2]) for number in range(4)]
    return loose_pack(tmp_path_factory.mktemp("packs") / "loose", episodes, houses)


@pytest.fixture
def runs(pack: Pack, tmp_path: Path) -> list[SavedRun]:
    """The same agent under two profiles."""
    folders = [
        make_run(tmp_path / str(number), pack, "always_success", frames=False, profile=profile)
        for number, profile in enumerate(PROFILES)
    ]
    return [read_run(folder, pack.folder) for folder in folders]


def watch(monkeypatch: pytest.MonkeyPatch, failing_run: str = "") -> list[str]:
    """Return the houses in which episodes are played again; the records of a run can fail."""
    houses: list[str] = []
    resimulate = SimulatorPool.resimulate

    async def watched(self: SimulatorPool, assignment: Assignment, record: Any, settings: Any) -> Any:
        houses.append(assignment.episode.house.name)
        if record.run_id == failing_run:
            raise ValueError("an odd value")
        return await resimulate(self, assignment, record, settings)

    monkeypatch.setattr(SimulatorPool, "resimulate", watched)
    return houses


def test_each_house_is_loaded_once(runs: list[SavedRun], monkeypatch: pytest.MonkeyPatch) -> None:
    houses = watch(monkeypatch)
    assert len({simulation_of(run) for run in runs}) == 1
    found = verify_runs(runs, VerifySettings(workers=1))
    assert all(isinstance(each, Verification) and each.is_verified and each.checked == 4 for each in found)
    assert [name for name, _ in groupby(houses)] == ["tiny", "other"]


def test_a_difference_belongs_to_its_run(runs: list[SavedRun], pack: Pack) -> None:
    path = runs[1].folder / EPISODES_FILE
    path.write_text(path.read_text().replace('"horizon":30.0', '"horizon":31.0', 1))
    edited = read_run(runs[1].folder, pack.folder)
    first, second = verify_runs([runs[0], edited], VerifySettings(workers=1))
    assert isinstance(first, Verification)
    assert first.is_verified
    assert isinstance(second, Verification)
    assert [(each.episode_id, each.fact) for each in second.differences] == [
        ("tiny-DA-000", "initial.agent.horizon"),
    ]


def test_an_error_of_one_run_does_not_end_the_others(runs: list[SavedRun], monkeypatch: pytest.MonkeyPatch) -> None:
    watch(monkeypatch, failing_run="0")
    first, second = verify_runs(runs, VerifySettings(workers=1))
    assert isinstance(first, ValueError)
    assert isinstance(second, Verification)
    assert second.is_verified
