"""Recorded steps as turns of a conversation."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from vigil.agents.conversation import Conversation
from vigil.agents.frame_encoding import EncodedFrame
from vigil.env import cues_after, feedback_after
from vigil.protocol.observation import Cues, Feedback
from vigil.protocol.profile import Profile
from vigil.records.record import StepRecord


@dataclass(frozen=True, slots=True)
class RecordedTurns:
    """Recorded steps of an episode, with the facts needed to show them to a model exactly as they were shown before."""

    steps: Sequence[StepRecord]
    profile: Profile
    max_steps: int
    """Budget of steps of the episode."""
    pictures: Mapping[int, EncodedFrame]
    """Frames by step; those that are not in the conversation may be missing."""

    def add_to(self, conversation: Conversation) -> Iterator[tuple[StepRecord, Feedback | None, Cues | None]]:
        """Yield each step with what was shown next to its frame; then the step becomes a turn of the conversation."""
        feedback, cues = None, cues_after(None, self.profile, self.max_steps)
        for step in self.steps:
            yield step, feedback, cues
            picture = self.pictures.get(step.index)
            conversation.add(feedback, step.reply.text, cues=cues, picture=picture)
            feedback = feedback_after(step.effect, self.profile)
            cues = cues_after(step, self.profile, self.max_steps)
