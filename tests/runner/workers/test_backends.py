"""Workers know simulators by their protocols alone: any backend plays, and privileged agents need a privileged one."""

from multiprocessing.connection import Connection, Pipe
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
from vigil.records.record import EpisodeRecord
from vigil.runner.workers.messages import Assignment, PlayEpisode, SimulatorFactory, WorkerPlan
from vigil.runner.workers.worker import RequestHandler, WorkerChannel

pytestmark = pytest.mark.usefixtures("real_workers")


class Told(WorkerChannel):
    """Takes what a worker says while it works."""

    def __init__(self) -> None:
        self.ends: tuple[Connection, Connection] = Pipe()
        super().__init__(self.ends[0])

    def on_first_frame(self) -> None:
        """Nothing has to be on disk."""


def handler(factory: SimulatorFactory) -> RequestHandler:
    plan = WorkerPlan(
        Path("starter"), "run", Profile(), agent="solver", agent_factory=privileged_agent, simulator_factory=factory
    )
    return RequestHandler(plan, Told())


def test_a_privileged_agent_plays_on_a_backend_of_another_make():
    episode = next(episode for episode in Pack.load("starter").episodes if episode.family == "DA")
    record = handler(protocol_backend.make).answer(PlayEpisode(Assignment(episode)))
    assert isinstance(record, EpisodeRecord)
    assert record.end == "report"


def test_a_privileged_agent_is_refused_a_backend_without_privileged_sight():
    episode = Pack.load("starter").episodes[0]
    with pytest.raises(
        SettingError, match=r"'solver' needs the hidden state, which simulator 'stand-in 1' does not give"
    ):
        handler(lambda assets, quality: ScriptedSimulator({})).answer(PlayEpisode(Assignment(episode)))


def test_a_worker_whose_engine_ends_starts_another_and_plays_the_episode_again(tmp_path: Path):
    pack = tiny_pack(tmp_path / "tiny", 1)
    plan = WorkerPlan(pack.folder, "run", Profile(), agent="sweep", simulator_factory=dies_once)
    worker, episode = RequestHandler(plan, Told()), pack.episodes[0]
    lost, played = (worker.answer(PlayEpisode(Assignment(episode, attempt=attempt))) for attempt in (1, 2))
    assert isinstance(lost, EpisodeRecord)
    assert isinstance(played, EpisodeRecord)
    assert lost.error is not None
    assert (lost.end, lost.error.boundary) == ("error", "simulator")
    assert played.end != "error"
    assert played.steps[: len(lost.steps)] == lost.steps
    assert DiesOnce.started == 2
    worker.close()
