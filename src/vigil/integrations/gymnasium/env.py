"""The Gymnasium environment: episodes of a pack or a stream, played through `vigil.env`.

Observations contain only what an agent may see; the reward and, in evaluator mode, `info` at the end of an episode
come from the hidden world.
"""

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor, wait
from functools import partial
from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box, Dict, MultiBinary, Space

from vigil.env import Env
from vigil.errors import SettingError, SimulatorError
from vigil.integrations.gymnasium.spaces import InstructionText, StructuredActions, TextActions
from vigil.integrations.options import GymnasiumOptions, check_names
from vigil.integrations.rewards import ListRates, reward_parts, verdict_of
from vigil.integrations.sources import EpisodeSource, SampledEpisode, source_of
from vigil.protocol.house import House
from vigil.protocol.observation import FRAME_HEIGHT, FRAME_WIDTH, Feedback, Observation
from vigil.records.record import EpisodeRecord

FRAME_SHAPE = (FRAME_HEIGHT, FRAME_WIDTH, 3)
INSTRUCTION_BLOCK = 256
"""The space of instructions allows a multiple of this number of characters, so that most packs have equal spaces."""
RESET_OPTIONS = ("episode_id",)
OUTCOME_KEYS = (
    *("episode_id", "family", "end", "W", "W_strict", "B", "label", "subtype", "category", "steps", "lag", "progress"),
)
"""Fields of the outcome in `info` in evaluator mode. A field that is None is left out, because a vector stores each
field in an array of one type."""


class VigilEnv(gymnasium.Env[dict[str, Any], Any]):
    """A Gymnasium environment that plays the episodes of a pack or a stream.

    A report terminates an episode; the step budget and the limit of invalid replies truncate it. A pickled or copied
    environment has the same options, but has not begun an episode.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 4}  # noqa: RUF012 - as Gymnasium declares it

    def __init__(self, render_mode: str | None = None, **options: Any) -> None:
        """Take the fields of GymnasiumOptions as `options`. Raises SettingError or PackMismatch if they are invalid."""
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise SettingError(f"Vigil-v0: render_mode is {render_mode!r}; it must be 'rgb_array' or None.")
        self.render_mode = render_mode
        self._made = partial(type(self), render_mode, **options)
        self._options = GymnasiumOptions.of(options)
        self._source = source_of(self._options, self._options.workers)
        self._simulator = self._options.make_simulator()
        self._ahead = Prefetcher(self._source, self._simulator.prepare)
        self._drawn: SampledEpisode | None = None
        self._env = Env(self._simulator, lambda _: self._now.house, self._options.condition)
        is_text = self._options.actions == "text"
        self._actions = TextActions() if is_text else StructuredActions(self._options.coordinates)
        self.action_space: Space[Any] = self._actions.space
        self.observation_space: Space[Any] = self._observations()
        self._observation: Observation | None = None

    def __reduce__(self) -> tuple[Any, ...]:
        return self._made, (), {"spec": self.spec}

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Start an episode: the next of a stream, a random episode of a pack, or the episode `options["episode_id"]`.

        Raises SettingError if an option or id is unknown, SimulatorError if the simulator failed.
        """
        super().reset(seed=seed)
        if seed is not None:
            self._ahead.discard()
        self._drawn = self._choose_episode(options or {}, is_seeded=seed is not None)
        self._observation = self._env.reset(self._drawn.episode)
        if self._observation is None:
            raise _failure(self._env.record())
        return self._to_space(self._observation), {}

    def step(self, action: Any) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Take one reply. Only the last step has a reward and, in evaluator mode, a non-empty `info`.

        Raises SettingError if the action is not in the action space, SimulatorError if the simulator failed.
        """
        before = self._observation
        self._observation = self._env.step(self._actions.reply(action))
        if self._observation is not None:
            return self._to_space(self._observation), 0.0, False, False, {}
        record = self._env.record()
        if record.end == "error":
            raise _failure(record)
        self._observation = self._final_observation(before, record)
        verdict = verdict_of(record, self._now.episode, self._options.condition, self._now.answer)
        outcome, of_list = verdict.outcome, verdict.of_list
        facts = {key: value for key in OUTCOME_KEYS if (value := getattr(outcome, key)) is not None}
        facts |= {} if of_list is None else _facts_of_list(of_list)
        info = {"outcome": facts} if self._options.evaluator else {}
        reward, is_reported = sum(reward_parts(verdict, self._options).values()), outcome.is_reported
        return self._to_space(self._observation), reward, is_reported, not is_reported, info

    def render(self) -> np.ndarray | None:
        """Return the current frame, and draw it first if necessary; None without a render mode."""
        if self.render_mode is None:
            gymnasium.logger.warn("render() draws only in an environment made with render_mode='rgb_array'.")
            return None
        if self._observation is None:
            raise gymnasium.error.ResetNeeded("Vigil-v0: call reset() before render().")
        return self._frame(self._observation)

    def close(self) -> None:
        """Close the simulator, and end the background processes of a stream."""
        self._ahead.close()
        self._env.close()
        self._source.close()

    @property
    def _now(self) -> SampledEpisode:
        assert self._drawn is not None
        return self._drawn

    def _observations(self) -> Dict:
        longest, charset = self._source.longest_instruction()
        blocks = -(-longest // INSTRUCTION_BLOCK)
        spaces: dict[str, Space[Any]] = {"instruction": InstructionText(blocks * INSTRUCTION_BLOCK, charset=charset)}
        if self._options.frames:
            spaces["frame"] = Box(0, 255, FRAME_SHAPE, np.uint8)
        if self._options.condition.has_feedback:
            spaces["feedback"] = MultiBinary(len(Feedback.model_fields))
        return Dict(spaces)

    def _to_space(self, observation: Observation) -> dict[str, Any]:
        """Return an observation as an element of the observation space; before the first action, feedback is 0."""
        seen: dict[str, Any] = {"instruction": self._now.episode.instruction}
        if self._options.frames:
            seen["frame"] = self._frame(observation)
        if self._options.condition.has_feedback:
            feedback = observation.feedback or Feedback(too_far=False, path_blocked=False)
            seen["feedback"] = np.array([feedback.too_far, feedback.path_blocked], np.int8)
        return seen

    def _frame(self, observation: Observation) -> np.ndarray:
        """Return a copy of the frame that the caller may keep and change. Raises SimulatorError."""
        try:
            return observation.rgb.copy()
        except SimulatorError as error:
            self._env.fail("simulator", str(error))
            raise

    def _final_observation(self, before: Observation | None, record: EpisodeRecord) -> Observation:
        """Return the observation after the last reply. Gymnasium requires it, but the agent cannot answer it."""
        effect = record.steps[-1].effect
        feedback = None if effect is None else Feedback(too_far=effect.too_far, path_blocked=effect.path_blocked)
        if effect is None and before is not None and before.is_drawn:
            return Observation(lambda: before.rgb, feedback)
        return Observation(self._simulator.frame, feedback)

    def _choose_episode(self, options: dict[str, Any], *, is_seeded: bool) -> SampledEpisode:
        check_names(options, RESET_OPTIONS, "reset() of Vigil-v0")
        if "episode_id" not in options:
            return self._ahead.next_episode(self.np_random, is_seeded=is_seeded)
        episode_id = str(options["episode_id"])
        if self._drawn is not None and self._drawn.episode.id == episode_id:
            return self._drawn
        return self._source.by_id(episode_id)


def _facts_of_list(outcome: ListRates) -> dict[str, float]:
    """Return the scores of a list of chores, such as the share of its chores that are closed correctly."""
    truth = {} if outcome.T is None else {"T": outcome.T}
    return {"list_W": outcome.W, "list_B": outcome.B, "W_share": outcome.W_share, "B_share": outcome.B_share, **truth}


def _failure(record: EpisodeRecord) -> SimulatorError:
    """Return the error to raise for an episode that the simulator could not play."""
    message = record.error.message if record.error else ""
    return SimulatorError(f"The simulator failed in episode {record.episode_id!r}; call reset(). The cause: {message}")


class Prefetcher:
    """A thread that chooses the next episode and builds its house while the current episode is played.

    A vector steps its environments together. If an environment built a house during a step, all others would wait. The
    choice of episodes depends only on the seed, not on the speed of the thread.
    """

    def __init__(self, source: EpisodeSource, prepare: Callable[[House], None]) -> None:
        """Take episodes from `source`. Another thread calls `prepare` with each house, so that the house loads faster
        later."""
        self._source, self._prepare = source, prepare
        self._thread = ThreadPoolExecutor(1, "next-episode")
        self._next: Future[SampledEpisode] | None = None

    def next_episode(self, rng: np.random.Generator, *, is_seeded: bool) -> SampledEpisode:
        """Return the next episode, and start preparing the episode after it.

        `is_seeded` says whether `rng` was just seeded. If an error occurred while the episode that is now due was
        prepared, raises this error.
        """
        pending, self._next = self._next or self._start_next(rng, is_seeded=is_seeded), None
        found = pending.result()
        self._next = self._start_next(rng, is_seeded=False)
        return found

    def discard(self) -> None:
        """Wait until the next episode is prepared, and discard it."""
        if self._next is not None and not self._next.cancel():
            wait([self._next])
        self._next = None

    def close(self) -> None:
        """End the thread."""
        self.discard()
        self._thread.shutdown()

    def _start_next(self, rng: np.random.Generator, *, is_seeded: bool) -> Future[SampledEpisode]:
        return self._thread.submit(self._prepared, self._source.draw(rng, is_seeded=is_seeded))

    def _prepared(self, wanted: Callable[[], SampledEpisode]) -> SampledEpisode:
        sampled = wanted()
        self._prepare(sampled.house)
        return sampled
