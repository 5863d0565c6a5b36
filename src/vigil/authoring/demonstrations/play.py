"""One episode of a stream as examples: each request that a model would get, with the solver's answer.

The episode is played twice: first to find the effect of each action, then with pictures. The requests are made by the
same class that makes requests to models (`vigil.agents.conversation.Conversation`). A report is used as a false report
only if scoring finds it false.
"""

import json
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

from vigil.agents.conversation import Conversation, Message
from vigil.agents.frame_encoding import EncodedFrame, encode_frame
from vigil.assets.database import AssetDatabase
from vigil.authoring.demonstrations.utterances import GAVE_UP, phrases_mentioned, report_text, subject_in, thought_text
from vigil.authoring.language.referring import Phrase
from vigil.authoring.streaming.stream import StreamItem
from vigil.env import Env
from vigil.errors import SimulatorError
from vigil.protocol.actions import Action, InteractPixel, Look, Navigate, Reply, Report, Status
from vigil.protocol.goals import OTHER_LABEL, ReportStatus
from vigil.protocol.observation import FRAME_HEIGHT, FRAME_WIDTH, Feedback, Quality
from vigil.protocol.profile import Profile
from vigil.records.record import EpisodeRecord
from vigil.scoring.outcomes import score
from vigil.sim import make_simulator

Fault = Literal["premature_success", "wrong_state", "false_fail"]
"""What is wrong with a false report: success before the goal holds, the wrong state, or giving up a reached goal."""


@dataclass(frozen=True, slots=True)
class Example:
    """One request with the correct answer. If the example is a correction, it also has a false report to reject."""

    episode_id: str
    family: str
    difficulty: str
    instruction: str
    step: int
    """Number of the step, counted from 1."""
    feedback: Feedback | None
    """Feedback on the previous action (all False at the first step); None if the profile has no feedback."""
    messages: tuple[Message, ...]
    """Messages of the request. The last has the current picture; earlier ones have pictures that the profile keeps."""
    action: Action
    thought: str
    answer: str
    """The correct answer, with thought and action, in the form of a model's reply."""
    is_privileged: bool
    """Whether the solver uses hidden state at this step: it moves towards a thing that no frame has shown yet."""
    rejected: str | None = None
    """The false report of a correction; None for a demonstration."""
    fault: Fault | None = None
    """What is wrong with the false report; None for a demonstration."""

    @property
    def pictures(self) -> list[EncodedFrame]:
        """All frames of the request in order; the last is the current one."""
        return [message.picture for message in self.messages if message.picture is not None]

    @property
    def picture(self) -> EncodedFrame:
        """The current frame."""
        return self.pictures[-1]


class Demonstrator:
    """Plays solutions under one profile, on its own simulator."""

    def __init__(self, profile: Profile, quality: Quality = "default") -> None:
        self._profile = profile
        self._simulator = make_simulator("mujoco", assets=AssetDatabase.default(), quality=quality)
        self._item: StreamItem
        self._phrases: dict[str, Phrase] = {}
        """Thing id -> the phrase for this thing in the instruction of the current episode."""
        self._env = Env(self._simulator, lambda episode: self._item.house, profile)

    def close(self) -> None:
        """Close the simulator."""
        self._env.close()

    def examples(self, item: StreamItem, *, with_corrections: bool = True) -> list[Example]:
        """Return the examples of an episode: first its demonstrations, step by step, then its corrections.

        Raises SimulatorError if the simulator fails or the solution does not solve the episode.
        """
        self._item = item
        actions = item.draft.actions
        record = self._record([self._answer(action, "") for action in actions])
        if not score(item.episode, record).B:
            raise SimulatorError(
                f"Episode {item.episode.id!r}: the recorded solution, played again, does not solve the episode."
            )
        shown = self._demonstrations(actions, record)
        return [*shown, *self._corrections(shown, record)] if with_corrections else shown

    def _record(self, answers: Sequence[str]) -> EpisodeRecord:
        """Play these answers without drawing frames, and return the record."""
        self._env.reset(self._item.episode)
        for answer in answers:
            self._env.step(Reply(text=answer))
        if self._env.end is None:
            raise SimulatorError(f"Episode {self._item.episode.id!r}: the recorded solution does not end the episode.")
        return self._env.record()

    def _demonstrations(self, actions: Sequence[Action], record: EpisodeRecord) -> list[Example]:
        """Return one example for each action. Its picture is the frame before the action."""
        episode, found = self._item.episode, list[Example]()
        conversation = Conversation(self._profile, episode.instruction)
        observation = self._env.reset(episode)
        at_first = Feedback(too_far=False, path_blocked=False) if self._profile.has_feedback else None
        self._phrases = phrases_mentioned(episode.instruction, self._simulator.scene(), episode.setup.held)
        for index, action in enumerate(actions):
            if observation is None:
                raise SimulatorError(f"Episode {episode.id!r}: the simulator failed.")
            feedback, cues = observation.feedback, observation.cues
            picture = encode_frame(observation.rgb, self._profile.image_format)
            messages = conversation.messages(picture, feedback, cues)
            said, thought = self._worded(action, index, record)
            example = Example(
                episode_id=episode.id,
                family=episode.family,
                difficulty=self._item.difficulty,
                instruction=episode.instruction,
                step=index + 1,
                feedback=feedback or at_first,
                messages=tuple(messages),
                action=said,
                thought=thought,
                answer=self._answer(said, thought),
                is_privileged=isinstance(said, Navigate | Look) and not self._has_been_seen(index, record),
            )
            found.append(example)
            conversation.add(feedback, example.answer, cues=cues, picture=picture)
            observation = self._env.step(Reply(text=example.answer))
        return found

    def _has_been_seen(self, index: int, record: EpisodeRecord) -> bool:
        """Return whether the subject of a step's action was in a frame, or in the hand, at this step or before."""
        about = self._subject_id(index, record)
        states = [world.objects[about] for world in record.worlds[: index + 1]]
        return any(state.visible_px or state.is_held for state in states)

    def _subject_id(self, index: int, record: EpisodeRecord) -> str:
        """Return the id of an action's subject: the next clicked thing that the instruction names, else the target."""
        for step in record.steps[index:]:
            hit = step.effect.hit if step.effect is not None else None
            if isinstance(step.action, InteractPixel) and hit is not None and hit in self._phrases:
                return hit
        return self._item.episode.goal.object_id

    def _worded(self, action: Action, index: int, record: EpisodeRecord) -> tuple[Action, str]:
        """Return the action (a report gets a summary), and the thought before it, which follows from the frame."""
        world, goal = record.worlds[index], self._item.episode.goal
        about = self._subject_id(index, record)
        pixels = self._simulator.pixels_of(about)
        x = float(pixels[:, 0].mean()) if len(pixels) else None
        subject = subject_in(world.objects[about], self._phrases[about], x)
        if not isinstance(action, Report):
            return action, thought_text(action, subject, "")
        said = report_text(goal, self._phrases, action.status)
        return action.model_copy(update={"summary": said}), thought_text(action, subject, said)

    def _corrections(self, shown: Sequence[Example], record: EpisodeRecord) -> list[Example]:
        """Return the corrections of an episode: requests with a false report in addition to the correct answer."""
        goal, last = self._item.episode.goal, shown[-1]
        closing = record.steps[-1].action
        assert isinstance(closing, Report)
        if isinstance(goal, ReportStatus):
            other = OTHER_LABEL[closing.status]
            false = self._report(other, report_text(goal, self._phrases, other))
            return self._false_ones(shown, [(last, "wrong_state", false)])
        early = shown[zlib.crc32(last.episode_id.encode()) % (len(shown) - 1)]
        claim = self._report("success", report_text(goal, self._phrases, "success"))
        return self._false_ones(
            shown, [(early, "premature_success", claim), (last, "false_fail", self._report("fail", GAVE_UP))]
        )

    def _false_ones(self, shown: Sequence[Example], wanted: Sequence[tuple[Example, Fault, str]]) -> list[Example]:
        """Return those corrections in `wanted` whose report is false. (Success may be true if the goal holds early.)"""
        found: list[Example] = []
        for example, fault, false in wanted:
            before = [each.answer for each in shown[: example.step - 1]]
            if not score(self._item.episode, self._record([*before, false])).B:
                found.append(replace(example, rejected=false, fault=fault))
        return found

    def _report(self, status: Status, said: str) -> str:
        return self._answer(Report(status=status, summary=said), said)

    def _answer(self, action: Action, thought: str) -> str:
        """Return the reply with this action and thought, in the form that the profile requires."""
        arguments = action.model_dump(exclude={"skill_name", "raw_status"}, exclude_none=True)
        if self._profile.coordinates != "pixel":  # the smallest numbers that are read back as the same pixel
            sizes = {"x": FRAME_WIDTH, "y": FRAME_HEIGHT}
            arguments |= {name: -(-arguments[name] * 1000 // size) for name, size in sizes.items() if name in arguments}
        said = {"thought": thought} if thought else {}
        return json.dumps({**said, "skill_name": action.skill_name, "arguments": arguments})
