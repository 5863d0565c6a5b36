"""Facts of a step: the feedback shown with its frame, and the arguments of the action."""

from collections.abc import Iterator

from vigil.protocol.actions import Action
from vigil.protocol.observation import Feedback
from vigil.protocol.profile import Profile
from vigil.records.record import EpisodeRecord, StepRecord


def steps_with_feedback(record: EpisodeRecord, profile: Profile) -> Iterator[tuple[Feedback | None, StepRecord]]:
    """Yield each step with the feedback shown with its frame; None if there was no feedback."""
    before: StepRecord | None = None
    for step in record.steps:
        yield None if before is None or not profile.has_feedback else _feedback(before), step
        before = step


def arguments_of(action: Action) -> dict[str, object]:
    """Return the arguments of a parsed action; clicks are in pixels of the frame."""
    return action.model_dump(exclude={"skill_name"}, exclude_none=True)


def _feedback(step: StepRecord) -> Feedback:
    effect = step.effect
    return Feedback(
        too_far=effect is not None and effect.too_far, path_blocked=effect is not None and effect.path_blocked
    )
