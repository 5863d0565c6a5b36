"""The messages of the steps of a recorded episode, exactly as they were sent when the episode was played."""

from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace

from vigil.agents.conversation import Conversation, Message
from vigil.agents.frame_encoding import EncodedFrame
from vigil.protocol.episode import Episode
from vigil.protocol.profile import Profile
from vigil.records.probe import QUESTIONS, Framing
from vigil.records.record import EpisodeRecord
from vigil.runner.workers.history import RecordedTurns

Frames = Mapping[int, EncodedFrame]
"""Number of a step -> the frame that the agent saw before its reply of this step."""


def step_messages(
    episode: Episode, record: EpisodeRecord, profile: Profile, steps: Container[int], pictures: Frames
) -> Iterator[tuple[int, list[Message]]]:
    """Yield the number and the messages of each of `steps`. `pictures` must have the frames of `needed_frames`."""
    conversation = Conversation(profile, episode.instruction)
    if record.criteria is not None:
        conversation.declare(record.criteria.text)
    turns = RecordedTurns(record.steps, profile, episode.max_steps, pictures)
    for step, feedback, cues in turns.add_to(conversation):
        if step.index in steps:
            yield step.index, conversation.messages(pictures[step.index], feedback, cues)


def needed_frames(profile: Profile, steps: Iterable[int]) -> set[int]:
    """Return the steps whose frames are in the messages of `steps`."""
    return {frame for step in steps for frame in range(max(1, step - profile.row.images), step + 1)}


def with_question(messages: Sequence[Message], framing: Framing) -> list[Message]:
    """Return the messages of a step, with a probe's question added after the frame of the last message."""
    *earlier, last = messages
    return [*earlier, replace(last, question=QUESTIONS[framing])]
