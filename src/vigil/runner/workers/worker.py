"""A simulator worker: the process that holds a simulator and answers one request at a time.

`vigil.runner.workers.process` starts it as `python -m vigil.runner.workers.worker FD`, with one end of a socket pair.
It ends when the other end is closed, even in the middle of a request.
"""

import faulthandler
import gc
import hashlib
import os
import select
import signal
import sys
import threading
import time
import traceback
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.connection import Connection

from vigil.agents.agent import Agent, Closeable
from vigil.agents.exec_agent import ProgramSettings
from vigil.agents.frame_encoding import encode_frame
from vigil.agents.registry import is_exec, make_agent
from vigil.assets.database import AssetDatabase
from vigil.base.imports import import_modules_from_environment
from vigil.env import Env
from vigil.errors import SettingError, SimulatorError, VigilError
from vigil.packs.pack import Pack
from vigil.protocol.actions import Reply
from vigil.protocol.episode import Episode
from vigil.protocol.house import House
from vigil.protocol.observation import Observation
from vigil.records.record import EpisodeRecord
from vigil.runner.models.redaction import Secrets
from vigil.runner.workers.drawing import DrawingHandler
from vigil.runner.workers.frames import FrameStore
from vigil.runner.workers.messages import (
    AboutToShowFrame,
    AdvanceEpisode,
    Assignment,
    BeginEpisode,
    Done,
    DrawingPlan,
    DropEpisode,
    EncodedObservation,
    EpisodeRequest,
    Failed,
    FailEpisode,
    GetSimulatorFacts,
    Heartbeat,
    PlayEpisode,
    Resimulate,
    SimulatorFacts,
    WorkerPlan,
)
from vigil.runner.workers.play import EpisodeObserver, play
from vigil.runner.workers.resimulation import ComparisonSettings, FactDifference, resimulate
from vigil.sim import make_simulator
from vigil.sim.privileged import PrivilegedSimulator
from vigil.sim.protocol import Simulator

UNWIND_AFTER_S = 0.5
"""Time that a worker may continue a request whose answer nobody awaits, in seconds."""
POLL_END = getattr(select, "POLLRDHUP", 0)
"""Flag with which a poll reports only that the other end has closed.

Without the flag, a poll still reports this for a socket pair, but not for a TCP connection.
"""
END_AFTER_S = 15.0
"""Time that the worker may take to unwind, in seconds; it first ends agents' programs."""


@dataclass(slots=True)
class EnvSlot:
    """Simulator with its Env and the episode that is being played in it."""

    simulator: Simulator
    env: Env
    assignment: Assignment | None = None
    observation: Observation | None = None


class WorkerChannel:
    """Channel for messages from a worker to the main process during a request."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def send_heartbeat(self, reply: Reply | None = None) -> None:
        """Report that the worker is alive, with the agent's reply if there is one."""
        self._connection.send(Heartbeat(reply))

    def on_first_frame(self) -> None:
        """Report that the agent is about to see the first frame, and wait until the attempt is recorded on disk."""
        self._connection.send(AboutToShowFrame())
        self._connection.recv()


class RequestHandler:
    """Handler of one worker's requests; it has the pack, the live episodes, and the agents that play in the worker."""

    def __init__(self, plan: WorkerPlan, channel: "WorkerChannel") -> None:
        self._plan = plan
        self._channel = channel
        self._program = ProgramSettings(
            plan.reply_seconds, plan.frame_interval_seconds, Secrets.of_command(plan.agent).redact
        )
        self._pack = None if plan.pack is None else Pack.load(plan.pack, plan.pack_sha256)
        self._house: House | None = None
        """House that the current assignment includes; None when the pack has it."""
        self._assets = AssetDatabase.from_file(plan.asset_database)
        if self._pack is not None:
            self._pack.check_assets(self._assets)
        self._frames = FrameStore(plan.frames) if plan.frames else None
        self._live: dict[int, EnvSlot] = {}
        self._idle: list[EnvSlot] = []
        self._agents: dict[int, Agent] = {}

    def answer(self, request: EpisodeRequest) -> object:
        """Return the answer to `request`. Raises VigilError."""
        match request:
            case GetSimulatorFacts(drawn):
                return self._facts(drawn)
            case PlayEpisode(assignment, earlier):
                return self._play(assignment, earlier)
            case BeginEpisode(session, assignment):
                return self._begin(session, assignment)
            case AdvanceEpisode(session, reply):
                slot = self._live[session]
                slot.observation = slot.env.step(reply)
                return self._view_or_record(slot)
            case FailEpisode(session, boundary, message):
                slot = self._live[session]
                slot.env.fail(boundary, message)
                return self._record(slot)
            case DropEpisode(session):
                slot = self._live.pop(session, None)
                return None if slot is None else self._release(slot)
            case Resimulate():
                return self._resimulate(request)
            case _:
                raise SimulatorError(f"A worker that plays episodes does not answer {type(request).__name__}.")

    def close(self) -> None:
        """End the agents' programs and close the simulators."""
        self._close_agents()
        for slot in [*self._live.values(), *self._idle]:
            slot.simulator.close()

    def _close_agents(self) -> None:
        agents, self._agents = self._agents, {}
        for agent in agents.values():
            if isinstance(agent, Closeable):
                agent.close()

    def _facts(self, drawn: Assignment | None) -> SimulatorFacts:
        slot = self._take_slot() if drawn is None else self._slot_for(drawn)
        self._idle.append(slot)
        observation = None if drawn is None else slot.env.reset(drawn.episode)
        if observation is not None:
            _ = observation.rgb  # raises SimulatorError if the machine cannot draw
        return SimulatorFacts(slot.simulator.name, slot.simulator.renderer())

    def _play(self, assignment: Assignment, earlier: tuple[Reply, ...] | None) -> EpisodeRecord:
        slot = self._slot_for(assignment)
        try:
            with self._agent_for(assignment, slot.simulator) as agent:
                play(
                    assignment.episode,
                    slot.env,
                    agent,
                    EpisodeObserver(self._channel.on_first_frame, self._on_reply),
                    earlier,
                )
            return self._record(slot)
        finally:
            self._release(slot)

    def _on_reply(self, observation: Observation, reply: Reply) -> None:
        self._channel.send_heartbeat(reply)
        if self._frames is not None:
            self._frames.save(observation.rgb)

    @contextmanager
    def _agent_for(self, assignment: Assignment, simulator: Simulator) -> Generator[Agent, None, None]:
        """Yield the agent that plays an episode; a program ends with the episode, unless the run keeps programs."""
        plan = self._plan
        if plan.agent_factory is not None:
            if not isinstance(simulator, PrivilegedSimulator):
                raise SettingError(
                    f"Agent {plan.agent!r} needs the hidden state, which simulator {simulator.name!r} does not give."
                )
            yield plan.agent_factory(plan.agent, assignment.episode, simulator)
            return
        seed = 0 if is_exec(plan.agent) else _epoch_seed(plan.seed, assignment.epoch)
        if seed not in self._agents:
            self._agents[seed] = make_agent(plan.agent, plan.profile, seed, self._program)
        try:
            yield self._agents[seed]
        finally:
            if is_exec(plan.agent) and not plan.keep_program:
                self._close_agents()

    def _begin(self, session: int, assignment: Assignment) -> EncodedObservation | EpisodeRecord:
        slot = self._slot_for(assignment)
        self._live[session] = slot
        slot.observation = slot.env.reset(assignment.episode)
        return self._view_or_record(slot)

    def _view_or_record(self, slot: EnvSlot) -> EncodedObservation | EpisodeRecord:
        observation = slot.observation
        if observation is None:
            return self._record(slot)
        rgb = observation.rgb
        if self._frames is not None:
            self._frames.save(rgb)
        return EncodedObservation(encode_frame(rgb, self._plan.profile.image_format), observation.feedback)

    def _record(self, slot: EnvSlot) -> EpisodeRecord:
        assignment = slot.assignment
        assert assignment is not None
        return slot.env.record(run_id=self._plan.run_id, epoch=assignment.epoch, attempt=assignment.attempt)

    def _release(self, slot: EnvSlot) -> None:
        """Keep a simulator for the next episode, or close it if one is kept already or this one failed."""
        slot.observation = None
        if self._idle or slot.env.end in (None, "error"):
            slot.simulator.close()
        else:
            self._idle.append(slot)

    def _resimulate(self, request: Resimulate) -> list[FactDifference]:
        slot = self._slot_for(request.assignment)
        try:
            how = ComparisonSettings(frames=request.frames, exact=request.exact, on_step=self._channel.send_heartbeat)
            return resimulate(request.assignment.episode, request.record, slot.env, how)
        finally:
            self._release(slot)

    def _slot_for(self, assignment: Assignment) -> EnvSlot:
        slot = self._take_slot()
        slot.assignment = assignment
        self._house = assignment.house
        return slot

    def _house_of(self, episode: Episode) -> House:
        """Return the house of the episode that begins. Raises HouseError."""
        if self._house is not None:
            return self._house
        assert self._pack is not None
        return self._pack.house_of(episode)

    def _take_slot(self) -> EnvSlot:
        """Return a free simulator; one is kept, because building a simulator takes time and memory."""
        if self._idle:
            return self._idle.pop()
        plan = self._plan
        if plan.simulator_factory is not None:
            simulator: Simulator = plan.simulator_factory(self._assets, plan.quality)
        else:
            simulator = make_simulator(plan.backend, assets=self._assets, quality=plan.quality)
        return EnvSlot(simulator, Env(simulator, self._house_of, self._plan.profile))


def _epoch_seed(seed: int, epoch: int) -> int:
    """Return the seed of an epoch: the run's seed in the first, a hash of seed and epoch in the others."""
    if epoch == 1:
        return seed
    return int.from_bytes(hashlib.sha256(f"{seed}:{epoch}".encode()).digest()[:4], "big")


def serve(connection: Connection) -> None:
    """Answer requests until the other end closes the connection."""
    gc.freeze()  # imported modules are never garbage, so the collector need not look through them
    is_ending = threading.Event()
    signal.signal(signal.SIGTERM, lambda _signal, _frame: None if is_ending.is_set() else sys.exit())
    threading.Thread(target=_end_with_main_process, args=(connection.fileno(), is_ending), daemon=True).start()
    plan, channel = connection.recv(), WorkerChannel(connection)
    handler: RequestHandler | DrawingHandler | None = None
    try:
        while True:
            request = connection.recv()
            try:
                if handler is None:
                    handler = DrawingHandler() if isinstance(plan, DrawingPlan) else RequestHandler(plan, channel)
                    channel.send_heartbeat()
                answer: Done | Failed = Done(handler.answer(request))
            except VigilError as error:
                answer = Failed(error)
            except Exception:  # noqa: BLE001 - a fault of the simulator is reported, and the worker continues
                answer = Failed(SimulatorError(traceback.format_exc(limit=-8)))
            connection.send(answer)
    except (EOFError, BrokenPipeError, ConnectionResetError):
        return  # the main process has ended, or has no more requests
    finally:
        is_ending.set()
        if handler is not None:
            handler.close()


def _end_with_main_process(fd: int, is_ending: threading.Event) -> None:
    """End a busy worker when the other end is closed: it unwinds, or else the process exits as it is."""
    other_end = select.poll()
    other_end.register(fd, POLL_END)
    other_end.poll()
    if not is_ending.wait(UNWIND_AFTER_S):
        os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(END_AFTER_S)
    os._exit(1)


if __name__ == "__main__":
    faulthandler.enable()
    import_modules_from_environment()
    serve(Connection(int(sys.argv[1])))
