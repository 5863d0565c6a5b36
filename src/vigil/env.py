"""Env: runs the protocol between an agent and the hidden world, for every front end (CLI, API, training).

This is the only place that enforces budgets, counts invalid actions, ends an episode and decides what feedback is
shown. It computes no verdict: whether a goal holds follows from the record (`vigil.protocol.goals`,
`vigil.scoring.outcomes`).
Source: `protocol.md` sections 2.1 to 2.4.
"""

import hashlib
from collections.abc import Callable, Generator
from contextlib import contextmanager
from datetime import UTC, datetime

import numpy as np
from pydantic import ValidationError

from vigil.base.versions import Versions
from vigil.errors import SimulatorError, first_error
from vigil.protocol.actions import Action, Reply, Report
from vigil.protocol.episode import Episode
from vigil.protocol.house import House
from vigil.protocol.observation import Feedback, Observation
from vigil.protocol.profile import Profile
from vigil.protocol.prompt import is_truncated_in_history, rendered_sha256
from vigil.protocol.replies import read_reply, truncate_for_record
from vigil.protocol.world import Effect, WorldState
from vigil.records.record import Boundary, End, EpisodeRecord, ErrorFact, StepRecord
from vigil.sim.protocol import Simulator


class Env:
    """An environment that plays episodes on a simulator, one at a time.

    `reset` and `step` return None when the episode is over; `record` then returns what happened. No reply of an agent
    raises an exception; a failing simulator ends the episode as `error`.
    """

    def __init__(
        self,
        simulator: Simulator,
        house_of: Callable[[Episode], House],
        profile: Profile,
        clock: Callable[[], datetime] = lambda: datetime.now(UTC),
    ) -> None:
        """Play on `simulator`, in the houses that `house_of` returns for episodes; `clock` gives the times in records.

        If two episodes in a row have the same house, the simulator loads the house only once.
        """
        self.profile = profile
        self._simulator = simulator
        self._house_of = house_of
        self._clock = clock
        self._loaded: str | None = None
        self._episode: Episode | None = None
        self._end: End | None = None

    def __enter__(self) -> "Env":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the simulator."""
        self._simulator.close()

    @property
    def simulator_name(self) -> str:
        """Name and version of the simulator, for run headers."""
        return self._simulator.name

    @property
    def end(self) -> End | None:
        """How the episode ended; None while it is in progress."""
        return self._end

    def reset(self, episode: Episode) -> Observation | None:
        """Start `episode` and return the first observation; None if the simulator failed.

        Raises HouseError or EpisodeError for an invalid house or episode.
        """
        self._episode = episode
        self._prompt_sha256 = rendered_sha256(episode.instruction, self.profile)
        self._started = self._ended = self._clock()
        self._steps: list[StepRecord] = []
        self._invalid = 0
        self._initial: WorldState | None = None
        self._end: End | None = None
        self._error: ErrorFact | None = None
        self._observation: Observation | None = None
        house = self._house_of(episode)
        try:
            self._start(episode, house)
        except SimulatorError as error:
            self.fail("simulator", str(error))
        return self._observe(None)

    def step(self, reply: Reply) -> Observation | None:
        """Execute one reply and return the next observation; None when the episode is over.

        Raises RuntimeError if no episode is in progress.
        """
        if self._episode is None or self._initial is None or self._end is not None:
            raise RuntimeError("Env.step: no episode has been started. Call reset first.")
        read = read_reply(reply, self.profile)
        try:
            frame_sha256 = self._frame_sha256()
            effect, world = self._execute(read.action)
        except SimulatorError as error:
            self.fail("simulator", str(error))
            return None
        self._invalid += read.invalid is not None
        recorded = truncate_for_record(reply, read.answer)
        answer = read.answer if recorded is reply else read_reply(recorded, self.profile).answer
        step = StepRecord(
            index=len(self._steps) + 1,
            frame_sha256=frame_sha256,
            reply=recorded,
            history_cut=is_truncated_in_history(answer, self.profile),
            action=read.action,
            invalid=read.invalid,
            ignored_keys=read.ignored_keys,
            effect=effect,
            world=world,
        )
        self._steps.append(step)
        self._finish(self._end_after(step, self._episode))
        return self._observe(effect)

    def fail(self, boundary: Boundary, message: str) -> None:
        """End the episode as `error`, because of a failure that the agent did not cause.

        An episode that has already ended is left unchanged.
        """
        if self._end is not None:
            return
        self._error = ErrorFact(boundary=boundary, message=message)
        if boundary != "model":
            self._loaded = None  # the scene may be broken: load the house again
        self._finish("error")

    def record(self, *, run_id: str = "", epoch: int = 1, attempt: int = 1) -> EpisodeRecord:
        """Return the record of the episode that has ended. Raises RuntimeError while it is in progress."""
        if self._episode is None or self._end is None:
            raise RuntimeError("Env.record: the episode has not ended yet.")
        return EpisodeRecord(
            versions=Versions.current(),
            run_id=run_id,
            episode_id=self._episode.id,
            epoch=epoch,
            attempt=attempt,
            prompt_sha256=self._prompt_sha256,
            started=self._started,
            ended=self._ended,
            initial=self._initial,
            steps=tuple(self._steps),
            end=self._end,
            error=self._error,
        )

    @staticmethod
    @contextmanager
    def _reject_invalid_facts() -> Generator[None, None, None]:
        """Raise SimulatorError if the simulator returns invalid state: non-finite numbers must not enter a record."""
        try:
            yield
        except ValidationError as error:
            raise SimulatorError(f"The simulator returned invalid state: {error.title}.{first_error(error)}.") from None

    def _start(self, episode: Episode, house: House) -> None:
        if self._loaded != house.sha256:
            self._loaded = None
            self._simulator.load(house)
            self._loaded = house.sha256
        self._simulator.reset(episode.start, episode.setup)
        self._bound = episode.bound_ids()
        with self._reject_invalid_facts():
            self._initial = self._simulator.world(self._bound)

    def _execute(self, action: Action | None) -> tuple[Effect | None, WorldState]:
        if action is None or isinstance(action, Report):
            return None, self._world()
        with self._reject_invalid_facts():
            effect = self._simulator.step(action)
            return effect, self._simulator.world(self._bound)

    def _world(self) -> WorldState:
        world = self._steps[-1].world if self._steps else self._initial
        assert world is not None
        return world

    def _end_after(self, step: StepRecord, episode: Episode) -> End | None:
        if isinstance(step.action, Report):
            return "report"
        if self._invalid > episode.max_invalid:
            return "invalid_action_limit_exceeded"
        return "fail_no_report" if step.index >= episode.max_steps else None

    def _finish(self, end: End | None) -> None:
        if end is not None:
            self._end = end
            self._ended = self._clock()
            self._observation = None

    def _observe(self, effect: Effect | None) -> Observation | None:
        if self._end is not None:
            return None
        feedback = None
        if self.profile.has_feedback and self._steps:
            feedback = Feedback(
                too_far=effect is not None and effect.too_far,
                path_blocked=effect is not None and effect.path_blocked,
            )
        self._observation = Observation(self._frame_source(len(self._steps)), feedback)
        return self._observation

    def _frame_source(self, moment: int) -> Callable[[], np.ndarray]:
        episode = self._episode

        def draw() -> np.ndarray:
            if self._episode is not episode or self._end is not None or len(self._steps) != moment:
                raise RuntimeError(
                    "Observation.rgb: the world has changed since this observation. Read `rgb` before the next `step`."
                )
            return self._simulator.frame()

        return draw

    def _frame_sha256(self) -> str | None:
        observation = self._observation
        if observation is None or not observation.is_drawn:
            return None
        return hashlib.sha256(observation.rgb.tobytes()).hexdigest()
