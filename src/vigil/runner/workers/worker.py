"""A play by an agent next to the simulator, and the state of a worker process that plays episodes: its simulators, and
the episodes that are played in them."""

import gc
import hashlib
import traceback
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial

from vigil.agents.agent import Agent, Closeable, Resumable
from vigil.agents.exec_agent import ProgramSettings
from vigil.agents.frame_encoding import EncodedFrame, encode_frame
from vigil.agents.registry import is_exec, make_agent
from vigil.agents.scripted import StoppingAgent
from vigil.assets.database import AssetDatabase
from vigil.base.free_memory import return_free_memory
from vigil.base.processes.child import report
from vigil.base.processes.worker import WorkerLost
from vigil.env import Env
from vigil.errors import InfrastructureError, InputError, RecordError, SettingError
from vigil.packs.pack import Pack
from vigil.protocol.actions import Reply
from vigil.protocol.episode import Episode
from vigil.protocol.house import House
from vigil.protocol.observation import Observation
from vigil.records.record import Boundary, EpisodeRecord
from vigil.runner.models.redaction import Secrets
from vigil.runner.workers.frames import FrameStore, frame_sha256, redraw
from vigil.runner.workers.messages import FIRST_FRAME, Assignment, EncodedObservation, Fork, SimulatorFacts, WorkerPlan
from vigil.runner.workers.resimulation import ComparisonSettings, FactDifference, resimulate
from vigil.sim import make_simulator
from vigil.sim.privileged import PrivilegedSimulator
from vigil.sim.protocol import Simulator


def begin(
    env: Env, episode: Episode, fork: Fork | None, on_past: Callable[[Observation], None] = lambda _: None
) -> Observation | None:
    """Return the first observation of an episode that may continue another play; None if the simulator failed.

    `on_past` is called with each observation of the continued play before the returned one. Raises InputError, also
    when the play cannot be repeated exactly.
    """
    steps = () if fork is None else fork.steps
    observation = env.reset(episode, len(steps))
    for step in steps:
        if observation is not None:
            on_past(observation)
            observation = env.replay(step)
    return observation


def play(
    episode: Episode,
    env: Env,
    agent: Agent,
    *,
    fork: Fork | None = None,
    earlier: Sequence[Reply] | None = None,
    on_first_frame: Callable[[], None] = lambda: None,
    on_reply: Callable[[Observation, Reply], object] = lambda _observation, _reply: None,
) -> None:
    """Play `episode` to its end in `env`, which then has the record.

    The replies of `fork`, the play that the episode continues, are carried out first, then `earlier`: the agent's
    replies from a lost process (None: it has not begun). `on_first_frame` is called before the first frame is shown,
    `on_reply` before a reply is carried out. The agent sees only observations and the instruction. Failures of its
    program end the episode as `error`. Raises InputError.
    """
    observation = begin(env, episode, fork)
    try:
        for reply in earlier or ():
            if observation is not None:
                _ = observation.rgb  # so that the record says again that this frame was looked at
                observation = env.step(reply)
        if observation is not None:
            if earlier is not None and isinstance(agent, Resumable):
                agent.resume(episode.instruction)
            else:
                agent.start(episode.instruction)
            if earlier is None:
                on_first_frame()
        while observation is not None:
            reply = agent.act(observation)
            on_reply(observation, reply)
            observation = env.step(reply)
    except InputError:
        raise
    except InfrastructureError as error:
        env.fail("agent", str(error))
    except Exception:  # noqa: BLE001 - a fault in a program is not a result of the agent
        env.fail("worker", traceback.format_exc(limit=-8))


@dataclass(slots=True)
class EnvSlot:
    """Simulator with its Env and the episode that is being played in it."""

    simulator: Simulator
    env: Env
    assignment: Assignment | None = None
    observation: Observation | None = None


class EpisodeWorker:
    """The pack, the simulators, the live episodes, and the agents that play in the worker.

    The main process calls the public methods, which raise VigilError. A live episode is identified by the number of its
    session.
    """

    def __init__(self, plan: WorkerPlan) -> None:
        self._plan = plan
        redact = Secrets.of(command=plan.agent).redact
        self._program = ProgramSettings(plan.reply_seconds, plan.frame_interval_seconds, plan.hidden, redact)
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

    def facts(self, drawn: Assignment | None) -> SimulatorFacts:
        """Return the backend's facts.

        If `drawn` is given, first draw the first frame of its episode, to check that this machine can draw.
        """
        slot = self._take_slot() if drawn is None else self._slot_for(drawn)
        self._idle.append(slot)
        observation = None if drawn is None else slot.env.reset(drawn.episode)
        if observation is not None:
            _ = observation.rgb  # raises SimulatorError if the machine cannot draw
        return SimulatorFacts(slot.simulator.name, slot.simulator.renderer())

    def play(self, assignment: Assignment, earlier: tuple[Reply, ...] | None) -> EpisodeRecord:
        """Return the record of one episode, played by the agent in the worker.

        `earlier` has the replies that the agent gave in a lost worker, so that the agent continues after them. If
        `earlier` is None, the episode begins.
        """
        slot = self._slot_for(assignment)
        try:
            with self._agent_for(assignment, slot.simulator) as agent:
                play(
                    assignment.episode,
                    slot.env,
                    agent,
                    fork=assignment.fork,
                    earlier=earlier,
                    on_first_frame=partial(report, FIRST_FRAME, is_awaited=True),
                    on_reply=self._on_reply,
                )
            return self._record(slot)
        finally:
            self._release(slot)

    def _on_reply(self, observation: Observation, reply: Reply) -> None:
        report(reply)
        if self._frames is not None:
            self._frames.save(observation.rgb)

    def _as_profiled(self, agent: Agent) -> Agent:
        """Return an agent that ends episodes as the profile asks. A program knows the profile and is not changed."""
        has_own_end = self._plan.profile.row.has_report or is_exec(self._plan.agent)
        return agent if has_own_end else StoppingAgent(agent)

    @contextmanager
    def _agent_for(self, assignment: Assignment, simulator: Simulator) -> Generator[Agent, None, None]:
        """Yield the agent that plays an episode; afterwards end its program, unless one program plays all episodes."""
        plan = self._plan
        if plan.agent_factory is not None:
            if not isinstance(simulator, PrivilegedSimulator):
                raise SettingError(
                    f"Agent {plan.agent!r} needs the hidden state, which simulator {simulator.name!r} does not give."
                )
            yield self._as_profiled(plan.agent_factory(plan.agent, assignment.episode, simulator))
            return
        seed = 0 if is_exec(plan.agent) else _epoch_seed(plan.seed, assignment.epoch)
        if seed not in self._agents:
            self._agents[seed] = make_agent(plan.agent, plan.profile, seed, self._program)
        try:
            yield self._as_profiled(self._agents[seed])
        finally:
            if is_exec(plan.agent) and not plan.keep_program:
                self._close_agents()

    def begin(self, session: int, assignment: Assignment) -> EncodedObservation | EpisodeRecord:
        """Return the first observation of a live episode, or the record when the reset failed."""
        slot = self._slot_for(assignment)
        self._live[session] = slot
        past: list[EncodedFrame] = []
        profile = self._plan.profile

        def on_past(observation: Observation) -> None:
            if profile.row.images:
                past.append(encode_frame(observation.rgb, profile.image_format))

        slot.observation = begin(slot.env, assignment.episode, assignment.fork, on_past)
        view = self._view_or_record(slot)
        return replace(view, past=tuple(past)) if isinstance(view, EncodedObservation) else view

    def advance(self, session: int, reply: Reply) -> EncodedObservation | EpisodeRecord:
        """Return the observation after one reply, or the record when the reply ended the live episode."""
        slot = self._live_slot(session)
        slot.observation = slot.env.step(reply)
        return self._view_or_record(slot)

    def fail(self, session: int, boundary: Boundary, message: str) -> EpisodeRecord:
        """End a live episode as an error, and return its record."""
        slot = self._live_slot(session)
        slot.env.fail(boundary, message)
        return self._record(slot)

    def drop(self, session: int) -> None:
        """Remove a live episode, and release its simulator."""
        slot = self._live.pop(session, None)
        if slot is not None:
            self._release(slot)

    def resimulate(
        self, assignment: Assignment, record: EpisodeRecord, settings: ComparisonSettings
    ) -> list[FactDifference]:
        """Return the differences between a record and a new simulation of its actions."""
        slot = self._slot_for(assignment)
        try:
            return resimulate(assignment.episode, record, slot.env, settings)
        finally:
            self._release(slot)

    def frames(self, assignment: Assignment, record: EpisodeRecord, steps: tuple[int, ...]) -> dict[int, EncodedFrame]:
        """Return {step: frame} for `steps`: the frame that the agent got before the step's reply, drawn again.

        Raises RecordError when a frame differs from the recorded one.
        """
        slot = self._slot_for(assignment)
        found: dict[int, EncodedFrame] = {}
        try:
            for step, rgb in zip(sorted(steps), redraw(assignment.episode, record, slot.env, steps), strict=True):
                if frame_sha256(rgb) != record.steps[step - 1].frame_sha256:
                    raise RecordError(
                        f"Episode {record.episode_id!r}: the frame of step {step}, drawn again, differs from the one "
                        "that the agent got, because another renderer or graphics library draws it. Use the machine "
                        "of the run, or play with --save-frames."
                    )
                found[step] = encode_frame(rgb, self._plan.profile.image_format)
            return found
        finally:
            self._release(slot)

    def _live_slot(self, session: int) -> EnvSlot:
        """Return the slot of a live episode. Raises WorkerLost when the episode was lost with an earlier process."""
        if session not in self._live:
            raise WorkerLost("The simulator has been restarted; its live episodes are lost.")
        return self._live[session]

    def _view_or_record(self, slot: EnvSlot) -> EncodedObservation | EpisodeRecord:
        observation = slot.observation
        if observation is None:
            return self._record(slot)
        rgb = observation.rgb
        if self._frames is not None:
            self._frames.save(rgb)
        picture = encode_frame(rgb, self._plan.profile.image_format)
        return EncodedObservation(picture, observation.feedback, observation.cues)

    def _record(self, slot: EnvSlot) -> EpisodeRecord:
        assignment = slot.assignment
        assert assignment is not None
        record = slot.env.record(run_id=self._plan.run_id, epoch=assignment.epoch, attempt=assignment.attempt)
        fork = assignment.fork and assignment.fork.point
        return record.model_copy(update={"fork": fork, "started": assignment.started or record.started})

    def _release(self, slot: EnvSlot) -> None:
        """Keep a simulator for the next episode, or close it if it failed or if another simulator is kept already."""
        slot.observation = None
        if self._idle or slot.env.end in (None, "error"):
            slot.simulator.close()
            gc.collect()  # a simulator is part of reference cycles
            return_free_memory()
        else:
            self._idle.append(slot)

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
        """Return the simulator that was kept. If none was kept, build a new simulator, which takes time and memory."""
        if self._idle:
            return self._idle.pop()
        plan = self._plan
        if plan.simulator_factory is not None:
            simulator: Simulator = plan.simulator_factory(self._assets, plan.quality)
        else:
            simulator = make_simulator(plan.backend, assets=self._assets, quality=plan.quality)
        env = Env(simulator, self._house_of, plan.profile, recorded_profile=plan.recorded_profile)
        return EnvSlot(simulator, env)


def _epoch_seed(seed: int, epoch: int) -> int:
    """Return the seed of an epoch: the run's seed in the first epoch, a hash of seed and epoch in the others."""
    if epoch == 1:
        return seed
    return int.from_bytes(hashlib.sha256(f"{seed}:{epoch}".encode()).digest()[:4], "big")
