"""Recorded steps as turns of a conversation."""

from collections.abc import Iterable, Iterator

from vigil.agents.conversation import Conversation
from vigil.env import feedback_after
from vigil.protocol.observation import Feedback
from vigil.protocol.profile import Profile
from vigil.records.record import StepRecord


def add_turns(
    conversation: Conversation, steps: Iterable[StepRecord], profile: Profile
) -> Iterator[tuple[StepRecord, Feedback | None]]:
    """Yield each step, which then becomes a turn of `conversation`, with the feedback that it was shown with."""
    feedback = None
    for step in steps:
        yield step, feedback
        conversation.add(feedback, step.reply.text)
        feedback = feedback_after(step.effect, profile)
