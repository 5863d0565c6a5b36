"""What an agent was told with a frame, and what the action is that it answered with."""

from collections.abc import Iterator

from vigil.protocol.actions import Action
from vigil.protocol.observation import Feedback
from vigil.protocol.profile import Profile
from vigil.records.record import EpisodeRecord, StepRecord


def steps_with_feedback(record: EpisodeRecord, profile: Profile) -> Iterator[tuple[Feedback | None, StepRecord]]:
    """Yield each step with the feedback that its frame was shown with; None where there was none."""
    before: StepRecord | None = None
    for step in record.steps:
        yield None if before is None or not profile.has_feedback else _feedback(before), step
        before = step


def arguments_of(action: Action) -> dict[str, object]:
    """Return the arguments of an action as it was understood: clicks in pixels of the frame."""
    return action.model_dump(exclude={"skill_name"}, exclude_none=True)


def _feedback(step: StepRecord) -> Feedback:
    effect = step.effect
    return Feedback(
        too_far=effect is not None and effect.too_far, path_blocked=effect is not None and effect.path_blocked
    )
