"""Workers know simulators by their protocols alone: any backend plays, and privileged agents need a privileged one."""

from pathlib import Path

import pytest

from tests.support import protocol_backend
from tests.support.scripted_simulator import ScriptedSimulator
from tests.support.thor_client import DiesOnce, dies_once
from tests.support.tiny_pack import tiny_pack
from vigil.authoring.solving.solvers import privileged_agent
from vigil.errors import SettingError
from vigil.packs.pack import Pack
from vigil.protocol.profile import Profile
from vigil.runner.workers.messages import Assignment, SimulatorFactory, WorkerPlan
from vigil.runner.workers.worker import EpisodeWorker


def worker_of(factory: SimulatorFactory) -> EpisodeWorker:
    plan = WorkerPlan(
        Path("starter"), "run", Profile(), agent="solver", agent_factory=privileged_agent, simulator_factory=factory
    )
    return EpisodeWorker(plan)


def test_a_privileged_agent_plays_on_a_backend_of_another_make():
    episode = next(episode for episode in Pack.load("starter").episodes if episode.family == "DA")
    record = worker_of(protocol_backend.make).play(Assignment(episode), None)
    assert record.end == "report"


def test_a_privileged_agent_is_refused_a_backend_without_privileged_sight():
    episode = Pack.load("starter").episodes[0]
    with pytest.raises(
        SettingError, match=r"'solver' needs the hidden state, which simulator 'stand-in 1' does not give"
    ):
        worker_of(lambda assets, quality: ScriptedSimulator({})).play(Assignment(episode), None)


def test_a_worker_whose_engine_ends_starts_another_and_plays_the_episode_again(tmp_path: Path):
    pack = tiny_pack(tmp_path / "tiny", 1)
    plan = WorkerPlan(pack.folder, "run", Profile(), agent="sweep", simulator_factory=dies_once)
    worker, episode = EpisodeWorker(plan), pack.episodes[0]
    lost, played = (worker.play(Assignment(episode, attempt=attempt), None) for attempt in (1, 2))
    assert lost.error is not None
    assert (lost.end, lost.error.boundary) == ("error", "simulator")
    assert played.end != "error"
    assert played.steps[: len(lost.steps)] == lost.steps
    assert DiesOnce.started == 2
    worker.close()
