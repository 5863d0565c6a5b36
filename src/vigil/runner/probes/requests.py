"""The messages of each step of a recorded episode, as they were sent when it was played."""

from collections.abc import Iterator, Mapping

from vigil.agents.conversation import Conversation, Message
from vigil.agents.frame_encoding import EncodedFrame
from vigil.env import feedback_after
from vigil.protocol.profile import Profile
from vigil.records.record import EpisodeRecord


def step_messages(
    record: EpisodeRecord, instruction: str, profile: Profile, pictures: Mapping[int, EncodedFrame]
) -> Iterator[tuple[int, list[Message]]]:
    """Yield each step in `pictures` with its messages. `pictures` has the frame that the step's reply answered."""
    conversation = Conversation(profile, instruction)
    effect, is_first = None, True
    for step in record.steps:
        feedback = None if is_first else feedback_after(effect, profile)
        if step.index in pictures:
            yield step.index, conversation.messages(pictures[step.index], feedback)
        conversation.add(feedback, step.reply.text)
        effect, is_first = step.effect, False
