"""Rows of a data set for TRL's trainers, and the environments that play the episodes which the rows name.

An environment is an object for each rollout, whose public methods are the tools of the model.

TRL calls `reset` with a row of the data set, calls the tool that the model asks for, shows the model what the tool
returns, and asks for the reward at the end. An environment is plain Python and does not need TRL.
"""

import json
from collections.abc import Sequence
from functools import partial
from typing import Any

from PIL import Image

from vigil.env import Env
from vigil.errors import PackMismatch, SimulatorError
from vigil.integrations.options import TrlOptions
from vigil.integrations.rewards import reward_parts, verdict_of
from vigil.integrations.sources import EpisodeSource, SampledEpisode, bounded_rows, row_source
from vigil.protocol.actions import Intent, LookDirection, NavigateMode, Reply, Status
from vigil.protocol.observation import Observation
from vigil.protocol.prompt import frame_stub, system_prompt
from vigil.records.record import EpisodeRecord, StepRecord

EPISODE_OVER = "The episode is over."
"""What a tool returns after the end of an episode."""
Content = list[dict[str, Any]]
"""Parts of a message: a text with `type` and `text`, a picture with `type` and `image`."""


class Environment:
    """Environment that plays one episode at a time.

    TRL takes every public method for a tool, except `reset` and `get_reward`. Subclasses define the tools.
    """

    def __init__(self, source: EpisodeSource, options: TrlOptions) -> None:
        self._source, self._options = source, options
        self._env = Env(options.make_simulator(), lambda _: self._now.house, options.condition)
        self._drawn: SampledEpisode | None = None
        self._turn = 0

    def reset(self, *, episode_id: str, house: int | None = None, source: str = "", **_row: Any) -> Content:
        """Start the episode that a row names, and return the first frame.

        Raises PackMismatch if the row is from another pack, SettingError if the source does not have the episode, or
        SimulatorError.
        """
        if source != self._source.name:
            raise PackMismatch(
                f"Episode {episode_id!r} is from {source!r}, but these environments play {self._source.name!r}. Make "
                "the data set and the environments from the same `Episodes`."
            )
        self._drawn = self._source.of_row(episode_id, house)
        self._turn = 1
        observation = self._env.reset(self._now.episode)
        if observation is None:
            raise SimulatorError(f"The simulator failed in episode {episode_id!r}: {_failure(self._env.record())}")
        return self._shown(observation)

    def get_reward(self) -> float | None:
        """Return the reward: 0 if the episode was cut off, None if the simulator failed."""
        if self._drawn is None or self._env.end is None:
            return 0.0
        record = self._env.record()
        if record.end == "error":
            return None
        verdict = verdict_of(record, self._now.episode, self._options.condition, self._now.answer)
        return sum(reward_parts(verdict, self._options).values())

    @property
    def episode(self) -> SampledEpisode:
        """The episode of the last reset, with its house."""
        return self._now

    @property
    def record(self) -> EpisodeRecord | None:
        """Record of the episode; None until it has ended."""
        return None if self._drawn is None or self._env.end is None else self._env.record()

    @property
    def steps(self) -> Sequence[StepRecord]:
        """Steps of the episode so far."""
        return self._env.steps

    @property
    def _now(self) -> SampledEpisode:
        assert self._drawn is not None
        return self._drawn

    def _step(self, text: str) -> Content:
        """Take a reply, and return the next frame, or a sentence that says that the episode is over. Raises
        SimulatorError."""
        if self._env.end is None:
            observation = self._env.step(Reply(text=text))
            self._turn += 1
            if observation is not None:
                return self._shown(observation)
        if self._env.end == "error":
            raise SimulatorError(f"The simulator failed: {_failure(self._env.record())}")
        return [{"type": "text", "text": EPISODE_OVER}]

    def _shown(self, observation: Observation) -> Content:
        stub = frame_stub("current", observation.feedback, observation.cues, self._turn)
        return [{"type": "text", "text": stub}, {"type": "image", "image": Image.fromarray(observation.rgb)}]


class VigilReplies(Environment):
    """Environment for `actions="text"`: the model answers as in `vigil run`, and its whole answer is the reply."""

    def reply(self, text: str) -> Content:
        """
        Take one reply of the agent.

        Args:
            text: The reply: one JSON object with skill_name and arguments.

        Returns:
            The next frame.
        """
        return self._step(text)


class VigilSkills(Environment):
    """Environment whose model calls the four skills as tools."""

    def navigate(self, mode: NavigateMode, magnitude: float) -> Content:
        """
        Walk or turn.

        Args:
            mode: The direction.
            magnitude: Number of steps to walk, or degrees to turn.

        Returns:
            The next frame.
        """
        return self._call("navigate", mode=mode, magnitude=magnitude)

    def look(self, direction: LookDirection, magnitude: float) -> Content:
        """
        Tilt the camera.

        Args:
            direction: The direction.
            magnitude: Degrees.

        Returns:
            The next frame.
        """
        return self._call("look", direction=direction, magnitude=magnitude)

    def interact_pixel(self, intent: Intent, x: int | None = None, y: int | None = None) -> Content:
        """
        Act on the object under a pixel of the current frame.

        Args:
            intent: What to do.
            x: Horizontal coordinate; not needed for drop.
            y: Vertical coordinate; not needed for drop.

        Returns:
            The next frame.
        """
        pixel = {name: value for name, value in (("x", x), ("y", y)) if value is not None}
        return self._call("interact_pixel", intent=intent, **pixel)

    def report(self, status: Status, summary: str) -> Content:
        """
        End the episode with a report.

        Args:
            status: What is reported.
            summary: Brief justification.

        Returns:
            A sentence that the episode is over.
        """
        return self._call("report", status=status, summary=summary)

    def _call(self, skill: str, **arguments: Any) -> Content:
        return self._step(json.dumps({"skill_name": skill, "arguments": arguments}))


class Episodes:
    """Episodes of a stream or a pack: rows that name episodes, and environments that play them.

    All rollouts of a group get the same row, so they play the same episode.
    """

    def __init__(self, **options: Any) -> None:
        """Take the fields of `TrlOptions` as `options`. Raises SettingError or PackMismatch if they are invalid."""
        self.options = TrlOptions.of(options)
        self.source = row_source(self.options, self.options.workers, by="reveal_private_pack=True")

    def rows(self) -> list[dict[str, Any]]:
        """Return one row for each episode, with the prompt and the episode's id. A row does not contain the goal.

        Raises SettingError if the stream is endless.
        """
        prompt_of = partial(system_prompt, profile=self.options.condition)
        return [
            {
                # The first frame is added to the last message when an environment is reset.
                "prompt": [
                    {"role": "system", "content": [{"type": "text", "text": prompt_of(episode.instruction)}]},
                    {"role": "user", "content": []},
                ],
                "episode_id": episode.id,
                "house": house,
                "source": self.source.name,
            }
            for episode, house in bounded_rows(self.source)
        ]

    def environment(self) -> Environment:
        """Return a new environment. Give this method to a trainer as its `environment_factory`."""
        kind = VigilReplies if self.options.actions == "text" else VigilSkills
        return kind(self.source, self.options)

    def close(self) -> None:
        """End the background processes of a stream."""
        self.source.close()


def valid_replies(completions: Sequence[Any], environments: Sequence[Environment], **_: Any) -> list[float]:
    """Return the share of valid replies of each rollout, as a reward function of TRL. Give it the weight 0.

    The trainer needs this function: under `actions="text"`, a report ends the conversation without a call of a tool, so
    this function passes the report to the environment.
    """
    for messages, environment in zip(completions, environments, strict=True):
        last = messages[-1]
        if last["role"] == "assistant" and not last.get("tool_calls") and environment.record is None:
            content = last["content"]
            text = content if isinstance(content, str) else "".join(part.get("text") or "" for part in content)
            environment._step(text)
    valid = [[step.invalid is None for step in environment.steps] for environment in environments]
    return [sum(each) / len(each) if each else 0.0 for each in valid]


def _failure(record: EpisodeRecord) -> str:
    return record.error.message if record.error else ""
