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
from vigil.errors import RecordError, SettingError, SimulatorError, first_error
from vigil.protocol.actions import AnyAction, ClosingAction, InteractPixel, Reply, Report, Stop
from vigil.protocol.episode import Episode
from vigil.protocol.house import House
from vigil.protocol.observation import Cues, Feedback, Observation
from vigil.protocol.profile import Profile
from vigil.protocol.profiles.click_mark import with_click_mark
from vigil.protocol.profiles.rows import LOOK_AGAIN, unnameable
from vigil.protocol.prompt import is_truncated_in_history, rendered_sha256
from vigil.protocol.replies import read_reply
from vigil.protocol.world import Effect, WorldState
from vigil.records.record import Boundary, End, EpisodeRecord, ErrorFact, StepRecord
from vigil.records.reply_truncation import truncate_for_record
from vigil.sim.protocol import NamesObjects, Simulator


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
        *,
        recorded_profile: Profile | None = None,
    ) -> None:
        """Play on `simulator`, in the houses that `house_of` returns for episodes; `clock` gives the times in records.

        A house that is already loaded is not loaded again. `recorded_profile` is the profile of the steps that are
        repeated from an earlier play at the start of an episode; by default, `profile`. Raises SettingError if the
        profile names objects and the simulator cannot find objects by their names.
        """
        self._simulator = simulator
        self._names = simulator if isinstance(simulator, NamesObjects) else None
        self.use_profile(profile, recorded_profile)
        self._house_of = house_of
        self._clock = clock
        self._loaded: str | None = None
        self._episode: Episode | None = None
        self._steps: list[StepRecord] = []
        self._end: End | None = None

    def __enter__(self) -> "Env":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the simulator."""
        self._simulator.close()

    def use_profile(self, profile: Profile, recorded_profile: Profile | None = None) -> None:
        """Play the next episodes under another profile; see `__init__`. The house stays loaded. Raises SettingError."""
        if self._names is None and not profile.row.has_pixels:
            raise SettingError(unnameable(profile.row, self._simulator.name))
        self.profile, self._recorded_profile = profile, recorded_profile or profile

    @property
    def simulator_name(self) -> str:
        """Name and version of the simulator, for run headers."""
        return self._simulator.name

    @property
    def end(self) -> End | None:
        """How the episode ended; None while it is in progress."""
        return self._end

    @property
    def steps(self) -> tuple[StepRecord, ...]:
        """Steps of the episode so far; empty before the first episode."""
        return tuple(self._steps)

    def reset(self, episode: Episode, recorded_steps: int = 0) -> Observation | None:
        """Start `episode` and return the first observation; None if the simulator failed.

        The first `recorded_steps` steps repeat an earlier play, so the profile of that play (`recorded_profile`) holds
        for them. Raises HouseError or EpisodeError for an invalid house or episode.
        """
        self._episode = episode
        self._recorded_steps = recorded_steps
        self._prompt_sha256 = rendered_sha256(episode.instruction, self.profile)
        self._started = self._ended = self._clock()
        self._steps = []
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
        return self._step(reply)

    def replay(self, recorded: StepRecord) -> Observation | None:
        """Carry out a step of another play again and return the next observation; None when the episode is over.

        The recorded step is added unchanged to this episode. Raises RecordError if its outcome now differs from the
        record; if the agent had looked at the frame, the frame's pixels are compared, too.
        """
        observation = self._step(recorded.reply, is_drawn=recorded.frame_sha256 is not None)
        if self._end == "error":
            return None
        found = self._steps[-1].model_copy(update={"history_cut": recorded.history_cut})
        facts = [name for name in StepRecord.model_fields if getattr(found, name) != getattr(recorded, name)]
        if facts:
            raise RecordError(
                f"Step {recorded.index} of the record was carried out again, but differs in {', '.join(facts)}. "
                "If the run itself continues a run with another profile, continue that run instead. Otherwise the "
                "simulator, the renderer or the machine is not that of the run: use the same ones. `vigil verify` "
                "shows the values."
            )
        self._steps[-1] = recorded
        return observation

    def _step(self, reply: Reply, *, is_drawn: bool = False) -> Observation | None:
        """Execute one reply. If `is_drawn`, first draw the frame that the reply answers."""
        if self._episode is None or self._initial is None or self._end is not None:
            raise RuntimeError("Env.step: no episode has been started. Call reset first.")
        profile = self._profile_now()
        read = read_reply(reply, profile)
        try:
            if is_drawn and self._observation is not None:
                _ = self._observation.rgb
            frame_sha256 = self._frame_sha256()
            action = self._with_pixel(read.action)
            effect, world = self._execute(action)
        except SimulatorError as error:
            self.fail("simulator", str(error))
            return None
        self._invalid += read.invalid is not None
        recorded = truncate_for_record(reply, read.answer)
        answer = read.answer if recorded is reply else read_reply(recorded, profile).answer
        step = StepRecord(
            index=len(self._steps) + 1,
            frame_sha256=frame_sha256,
            reply=recorded,
            history_cut=is_truncated_in_history(answer, self.profile),
            action=action,
            invalid=read.invalid,
            ignored_keys=read.ignored_keys,
            effect=effect,
            world=world,
            is_unconfirmed=self._is_unconfirmed(read.action, profile, self._episode),
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
            has_report=self.profile.row.has_report,
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

    def _with_pixel(self, action: AnyAction | None) -> AnyAction | None:
        """Return an action. If it names an object, and only one object in view has this name, add one of its pixels."""
        if not isinstance(action, InteractPixel) or action.object is None:
            return action
        pixel = self._names.pixel_of_named(action.object) if self._names is not None else None
        return action if pixel is None else action.model_copy(update={"x": pixel[0], "y": pixel[1]})

    def _execute(self, action: AnyAction | None) -> tuple[Effect | None, WorldState]:
        if action is None or isinstance(action, ClosingAction):
            return None, self._world()
        if isinstance(action, InteractPixel) and action.object is not None and action.x is None:
            return Effect(refusal="nothing_hit"), self._world()  # whatever the reason is
        with self._reject_invalid_facts():
            effect = self._simulator.step(action)
            return effect, self._simulator.world(self._bound)

    def _world(self) -> WorldState:
        world = self._steps[-1].world if self._steps else self._initial
        assert world is not None
        return world

    def _profile_now(self) -> Profile:
        """Return the profile of the current step: `recorded_profile` for repeated steps, otherwise the Env's
        profile."""
        return self._recorded_profile if len(self._steps) < self._recorded_steps else self.profile

    def _is_unconfirmed(self, action: AnyAction | None, profile: Profile, episode: Episode) -> bool:
        """Return whether an action is a report that does not end the play, but leads to a request to look again."""
        is_first = not any(step.is_unconfirmed for step in self._steps)
        has_steps = len(self._steps) + 1 < episode.max_steps
        return profile.row.looks_again and isinstance(action, Report) and is_first and has_steps

    def _end_after(self, step: StepRecord, episode: Episode) -> End | None:
        if isinstance(step.action, Stop):
            return "stop"
        if isinstance(step.action, Report) and not step.is_unconfirmed:
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
        profile, last = self._profile_now(), self._steps[-1] if self._steps else None
        feedback = feedback_after(effect, profile) if last else None
        assert self._episode is not None
        cues = cues_after(last, profile, self._episode.max_steps)
        self._observation = Observation(self._frame_source(len(self._steps)), feedback, cues)
        return self._observation

    def _frame_source(self, moment: int) -> Callable[[], np.ndarray]:
        episode = self._episode

        def draw() -> np.ndarray:
            if self._episode is not episode or self._end is not None or len(self._steps) != moment:
                raise RuntimeError(
                    "Observation.rgb: the world has changed since this observation. Read `rgb` before the next `step`."
                )
            frame = self._simulator.frame()
            click = self._steps[-1].action if self._steps and self._profile_now().row.marks_click else None
            if isinstance(click, InteractPixel) and click.x is not None and click.y is not None:
                return with_click_mark(frame, click.x, click.y)
            return frame

        return draw

    def _frame_sha256(self) -> str | None:
        observation = self._observation
        if observation is None or not observation.is_drawn:
            return None
        return hashlib.sha256(np.ascontiguousarray(observation.rgb).data).hexdigest()


def feedback_after(effect: Effect | None, profile: Profile) -> Feedback | None:
    """Return the feedback that an agent gets about its last action; None if the profile does not show feedback.

    `effect` is the action's effect in the world; None if it was not an act in the world, e.g. invalid or a report.
    """
    if not profile.has_feedback:
        return None
    is_act = effect is not None
    return Feedback(too_far=is_act and effect.too_far, path_blocked=is_act and effect.path_blocked)


def cues_after(last: StepRecord | None, profile: Profile, max_steps: int) -> Cues | None:
    """Return what is shown next to the frame after step `last` (None at the start): the number of remaining steps, and
    a request to look again. None if nothing is shown."""
    row = profile.row
    if not row.shows_remaining_steps and not row.looks_again:
        return None
    left = max_steps - (0 if last is None else last.index) if row.shows_remaining_steps else None
    request = LOOK_AGAIN if row.looks_again and last is not None and last.is_unconfirmed else None
    return None if left is None and request is None else Cues(remaining_steps=left, request=request)
