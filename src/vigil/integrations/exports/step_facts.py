"""Facts of a step: the feedback that was shown with its frame, and the arguments of its action."""

from collections.abc import Iterator

from vigil.protocol.actions import AnyAction
from vigil.protocol.observation import Feedback
from vigil.protocol.profile import Profile
from vigil.protocol.world import Effect
from vigil.records.record import EpisodeRecord, StepRecord


def steps_with_feedback(record: EpisodeRecord, profile: Profile) -> Iterator[tuple[Feedback | None, StepRecord]]:
    """Yield each step with the feedback that was shown with its frame; the feedback is None if the profile has none."""
    for before, step in zip([None, *record.steps], record.steps, strict=False):
        shown = None
        if before is not None and profile.has_feedback:
            effect = before.effect or Effect()
            shown = Feedback(too_far=effect.too_far, path_blocked=effect.path_blocked)
        yield shown, step


def arguments_of(action: AnyAction) -> dict[str, object]:
    """Return the arguments of a parsed action. The coordinates of clicks are in pixels of the frame."""
    return action.model_dump(exclude={"skill_name"}, exclude_none=True)
