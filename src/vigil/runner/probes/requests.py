"""The messages of each step of a recorded episode, as they were sent when it was played."""

from collections.abc import Iterator, Mapping

from vigil.agents.conversation import Conversation, Message
from vigil.agents.frame_encoding import EncodedFrame
from vigil.protocol.profile import Profile
from vigil.records.record import EpisodeRecord
from vigil.runner.workers.history import add_turns


def step_messages(
    record: EpisodeRecord, instruction: str, profile: Profile, pictures: Mapping[int, EncodedFrame]
) -> Iterator[tuple[int, list[Message]]]:
    """Yield each step in `pictures` with its messages. `pictures` has the frame that the step's reply answered."""
    conversation = Conversation(profile, instruction)
    for step, feedback in add_turns(conversation, record.steps, profile):
        if step.index in pictures:
            yield step.index, conversation.messages(pictures[step.index], feedback)
