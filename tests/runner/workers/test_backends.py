"""Workers know simulators by their protocols alone: any backend plays, and privileged agents need a privileged one."""

from multiprocessing.connection import Connection, Pipe
from pathlib import Path

import another_backend
import pytest
from stand_in import StandIn

from vigil.authoring.solving.solvers import privileged_agent
from vigil.errors import SettingError
from vigil.pack import Pack
from vigil.profile import Profile
from vigil.record import EpisodeRecord
from vigil.runner.workers.messages import Assignment, Play, SimulatorFactory, WorkerPlan
from vigil.runner.workers.worker import RequestHandler, WorkerChannel

pytestmark = pytest.mark.usefixtures("real_workers")


class Told(WorkerChannel):
    """Takes what a worker says while it works."""

    def __init__(self) -> None:
        self.ends: tuple[Connection, Connection] = Pipe()
        super().__init__(self.ends[0])

    def shows(self) -> None:
        """Nothing has to be on disk."""


def handler(factory: SimulatorFactory) -> RequestHandler:
    plan = WorkerPlan(
        Path("starter"), "run", Profile(), agent="solver", agent_factory=privileged_agent, simulator_factory=factory
    )
    return RequestHandler(plan, Told())


def test_a_privileged_agent_plays_on_a_backend_of_another_make():
    episode = next(episode for episode in Pack.load("starter").episodes if episode.family == "DA")
    record = handler(another_backend.make).answer(Play(Assignment(episode)))
    assert isinstance(record, EpisodeRecord)
    assert record.end == "report"


def test_a_privileged_agent_is_refused_a_backend_without_privileged_sight():
    episode = Pack.load("starter").episodes[0]
    with pytest.raises(SettingError, match=r"'solver' needs hidden sight, which 'stand-in 1' does not give"):
        handler(lambda assets, quality: StandIn({})).answer(Play(Assignment(episode)))
