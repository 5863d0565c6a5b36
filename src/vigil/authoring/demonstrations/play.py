"""One episode of a stream as examples: each request that a model would have been sent, with the solver's answer.

The episode is played twice: first for what each action meets, then with pictures, each request made by the very class
that makes a model's (`vigil.agents.conversation.Conversation`). A false report is kept only when the scoring of any
run calls it false.
"""

import json
import zlib
from collections.abc import Container, Sequence
from dataclasses import dataclass, replace
from typing import Literal, get_args

from vigil.agents.conversation import Conversation, Message
from vigil.agents.frame_encoding import EncodedFrame, encode_frame
from vigil.assets.database import AssetDatabase
from vigil.authoring.demonstrations.utterances import GAVE_UP, phrases_mentioned, report_text, subject_in, thought_text
from vigil.authoring.language.referring import Phrase
from vigil.authoring.streaming.stream import StreamItem
from vigil.env import Env
from vigil.errors import SimulatorError
from vigil.protocol.actions import Action, Coordinates, InteractPixel, Look, Navigate, Reply, Report, Status
from vigil.protocol.goals import STATE_LABELS, ReportStatus
from vigil.protocol.observation import FRAME_HEIGHT, FRAME_WIDTH, Feedback, Quality
from vigil.protocol.profile import Profile
from vigil.records.record import EpisodeRecord
from vigil.scoring.outcomes import score
from vigil.sim import make_simulator

Fault = Literal["premature_success", "wrong_state", "false_fail"]
"""What is wrong with a false report: success before the goal holds, the other state, giving up when it is done."""
FAULTS: tuple[Fault, ...] = get_args(Fault)


@dataclass(frozen=True, slots=True)
class Example:
    """One request with the right answer; a correction has a false report besides, given to the same request."""

    episode_id: str
    family: str
    difficulty: str
    instruction: str
    step: int
    """From 1."""
    feedback: Feedback | None
    """On the action before; before the first, neither holds. None in a profile without feedback."""
    messages: tuple[Message, ...]
    """All that a model is sent; the last one carries the picture."""
    action: Action
    thought: str
    answer: str
    """Thought and action, as a model writes them."""
    is_privileged: bool
    """Whether the solver goes by hidden state here: it moves towards a thing of which no frame so far shows anything.
    """
    rejected: str | None = None
    fault: Fault | None = None

    @property
    def picture(self) -> EncodedFrame:
        """What is seen."""
        picture = self.messages[-1].picture
        assert picture is not None
        return picture


class Demonstrator:
    """Plays solutions on a simulator of its own, under one profile."""

    def __init__(self, profile: Profile, quality: Quality = "default") -> None:
        self._profile = profile
        self._simulator = make_simulator("mujoco", assets=AssetDatabase.default(), quality=quality)
        self._item: StreamItem | None = None
        self._phrases: dict[str, Phrase] = {}
        """What the instruction calls its things."""
        self._env = Env(self._simulator, lambda episode: self._now().house, profile)

    def close(self) -> None:
        """Closes the simulator."""
        self._env.close()

    def examples(self, item: StreamItem, *, with_corrections: bool = True) -> list[Example]:
        """Return the examples of an episode, step by step, then its corrections. Raises SimulatorError."""
        self._item = item
        actions = item.draft.actions
        record = self._record([self._answer(action, "") for action in actions])
        if not score(item.episode, record).B:
            raise SimulatorError(f"Episode {item.episode.id!r}: its solution, played again, does not solve it.")
        shown = self._shown(actions, record)
        return [*shown, *self._corrections(shown, record)] if with_corrections else shown

    def _now(self) -> StreamItem:
        assert self._item is not None
        return self._item

    def _record(self, answers: Sequence[str]) -> EpisodeRecord:
        """Return the record of answers; nothing is drawn."""
        self._env.reset(self._now().episode)
        for answer in answers:
            self._env.step(Reply(text=answer))
        if self._env.end is None:
            raise SimulatorError(f"Episode {self._now().episode.id!r}: its solution does not end it.")
        return self._env.record()

    def _shown(self, actions: Sequence[Action], record: EpisodeRecord) -> list[Example]:
        """Return an example for each action, with what is seen before it."""
        episode, found = self._now().episode, list[Example]()
        conversation = Conversation(self._profile, episode.instruction)
        observation = self._env.reset(episode)
        at_first = Feedback(too_far=False, path_blocked=False) if self._profile.has_feedback else None
        self._phrases = phrases_mentioned(episode.instruction, self._simulator.scene(), episode.setup.held)
        for index, action in enumerate(actions):
            if observation is None:
                raise SimulatorError(f"Episode {episode.id!r}: the simulator failed.")
            feedback = observation.feedback
            messages = conversation.messages(encode_frame(observation.rgb, self._profile.image_format), feedback)
            said, thought = self._worded(action, index, record)
            example = Example(
                episode_id=episode.id,
                family=episode.family,
                difficulty=self._now().difficulty,
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
            conversation.add(feedback, example.answer)
            observation = self._env.step(Reply(text=example.answer))
        return found

    def _has_been_seen(self, index: int, record: EpisodeRecord) -> bool:
        """Whether the frames up to a step's show, or the hand holds, what its action is about."""
        about = self._about(index, record)
        states = [world.objects[about] for world in record.worlds[: index + 1]]
        return any(state.visible_px or state.is_held for state in states)

    def _about(self, index: int, record: EpisodeRecord) -> str:
        return _subject_id(record, index, self._phrases, self._now().episode.goal.object_id)

    def _worded(self, action: Action, index: int, record: EpisodeRecord) -> tuple[Action, str]:
        """Return an action, a report with what it says, and a thought, from what the frame before it shows."""
        world, goal = record.worlds[index], self._now().episode.goal
        about = self._about(index, record)
        pixels = self._simulator.pixels_of(about)
        x = float(pixels[:, 0].mean()) if len(pixels) else None
        subject = subject_in(world.objects[about], self._phrases[about], x)
        if not isinstance(action, Report):
            return action, thought_text(action, subject, "")
        said = report_text(goal, self._phrases, action.status)
        return action.model_copy(update={"summary": said}), thought_text(action, subject, said)

    def _corrections(self, shown: Sequence[Example], record: EpisodeRecord) -> list[Example]:
        """Return requests at which a false report may be given, each with that report and the right answer."""
        goal, last = self._now().episode.goal, shown[-1]
        closing = record.steps[-1].action
        assert isinstance(closing, Report)
        if isinstance(goal, ReportStatus):
            positive, negative = STATE_LABELS[goal.state]
            other = negative if closing.status == positive else positive
            false = self._report(other, report_text(goal, self._phrases, other))
            return self._kept(shown, [(last, "wrong_state", false)])
        early = shown[zlib.crc32(last.episode_id.encode()) % (len(shown) - 1)]
        claim = self._report("success", report_text(goal, self._phrases, "success"))
        return self._kept(
            shown, [(early, "premature_success", claim), (last, "false_fail", self._report("fail", GAVE_UP))]
        )

    def _kept(self, shown: Sequence[Example], wanted: Sequence[tuple[Example, Fault, str]]) -> list[Example]:
        """Return the corrections of reports that are false indeed: a claim may come after the goal was reached."""
        found: list[Example] = []
        for example, fault, false in wanted:
            before = [each.answer for each in shown[: example.step - 1]]
            if not score(self._now().episode, self._record([*before, false])).B:
                found.append(replace(example, rejected=false, fault=fault))
        return found

    def _report(self, status: Status, said: str) -> str:
        return self._answer(Report(status=status, summary=said), said)

    def _answer(self, action: Action, thought: str) -> str:
        """Return an action as a model writes it under the profile."""
        arguments = action.model_dump(exclude={"skill_name", "raw_status"}, exclude_none=True)
        if isinstance(action, InteractPixel):
            sizes = {"x": FRAME_WIDTH, "y": FRAME_HEIGHT}
            arguments |= {
                name: _pointed(arguments[name], size, self._profile.coordinates)
                for name, size in sizes.items()
                if name in arguments
            }
        said = {"thought": thought} if thought else {}
        return json.dumps({**said, "skill_name": action.skill_name, "arguments": arguments})


def _pointed(pixel: int, size: int, coordinates: Coordinates) -> int:
    """Return a pixel's coordinate in the profile's mode: the least number that is read as that very pixel."""
    return pixel if coordinates == "pixel" else -(-pixel * 1000 // size)


def _subject_id(record: EpisodeRecord, index: int, named: Container[str], target_id: str) -> str:
    """Return which thing an action is about: what the next click meets that the instruction names, else the target."""
    for step in record.steps[index:]:
        hit = step.effect.hit if step.effect is not None else None
        if isinstance(step.action, InteractPixel) and hit is not None and hit in named:
            return hit
    return target_id
