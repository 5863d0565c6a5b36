"""Live progress of a run: counts, time left, and W, B and T so far (computed by the same code as in reports)."""

import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from vigil.packs.pack import CHORES_SUITE
from vigil.protocol.actions import InteractPixel
from vigil.protocol.episode import Episode
from vigil.protocol.replies import looks_like_other_coordinates
from vigil.records.record import EpisodeRecord
from vigil.runner.models.context import CONTEXT_OPTIONS, find_shrunk_request
from vigil.runner.models.provider_errors import FIND_COORDINATES
from vigil.runner.plan import RunPlan
from vigil.scoring.chore_answers import answer_of, list_answers
from vigil.scoring.chores import score_list
from vigil.scoring.outcomes import Outcome, score


@dataclass(frozen=True, slots=True)
class RunProgress:
    """State of a run while it is played: counts, rates so far, time left and cost."""

    total: int
    """Number of planned plays: episodes times epochs."""
    done: int
    """Number of plays with a row that is not an error."""
    errors: int
    W: float | None
    """Rate of W over the finished plays; None before the first play is finished."""
    B: float | None
    """Rate of B over the finished plays; None before the first play is finished. For lists of chores, W and B are
    judged for each list, not for each chore."""
    steps: int
    """Number of replies in this session."""
    elapsed_s: float
    """Seconds since the simulators were ready in this session."""
    eta_s: float | None
    """Estimated seconds left; None before the first episode of this session has ended."""
    cost: float | None
    """Cost of all replies in the run's records, including earlier sessions; None if unknown."""
    latest: Outcome | None
    """Outcome of the episode that has just ended; None for an error, and before the first episode has ended."""
    retry_reason: str | None = None
    """Latest failure since the last finished episode that led to a retry; None if there was none."""
    T: float | None = None
    """Mean, over the finished lists, of the share of a list's chores whose claim is true; None without lists, claims or
    finished plays."""
    warning: str | None = None
    """Warning for the user, or None.

    There are four warnings, each given once: a first error, too many invalid replies, a server that seems to cut the
    dialogue, and a model that seems to use other coordinates.
    """


OnProgress = Callable[[RunProgress], None]
"""Function that is called with each new state of a run."""
EPISODES_BEFORE_WARNING = 10
"""Least number of episodes before a warning about invalid replies."""
WARNING_SHARE = 0.5
"""Share of invalid replies above which there is a warning."""
MAX_LISTED_REASONS = 3
"""Maximum number of reasons that the warning about invalid replies names."""
CLICKS_BEFORE_WARNING = 5
"""Least number of clicks outside the frame before a warning about coordinates."""
WARNING_OUT_OF_FRAME_SHARE = 0.2
"""Share of clicks outside the frame above which there is a warning."""


class ProgressCounter:
    """Counter of finished episodes, which reports the run's progress after each."""

    def __init__(
        self,
        plan: RunPlan,
        records: Sequence[EpisodeRecord],
        on_progress: OnProgress,
        cost: Callable[[], float | None],
    ) -> None:
        """`records` are the rows so far that count; `cost` returns the cost so far."""
        by_id = {episode.id: episode for episode in plan.episodes}
        self._total = len(plan.episodes) * plan.spec.epochs
        self._profile = plan.spec.profile
        self._answers = list_answers(plan.pack.folder) if plan.pack.manifest.suite == CHORES_SUITE else {}
        self._on_progress = on_progress
        self._cost = cost
        self._done = self._with_goal = self._closed = 0
        self._truths: list[float] = []
        """T of each finished list with claims."""
        self._has_reports = True
        self._errors = self._played_now = self._steps = 0
        self.errors_in_a_row = 0
        self._retry_reason: str | None = None
        self._seen_episodes = self._seen_replies = 0
        self._reasons: Counter[str] = Counter()
        """Number of invalid replies for each reason, in all sessions of the run."""
        self._clicks = self._clicks_out_of_frame = 0
        """Number of all clicks, and number of clicks that are outside the frame or have fractions as coordinates."""
        self._warnings = [
            self._first_error_warning,
            self._invalid_replies_warning,
            self._cut_dialogue_warning,
            self._coordinates_warning,
        ]
        """Functions that return a warning about a record or the replies so far, or None; each warns once."""
        self._started = time.monotonic()
        for record in records:
            if record.end != "error":
                self._add(by_id[record.episode_id], record)
                self._count_replies(record)

    def start(self) -> None:
        """Start the clock and report progress."""
        self._started = time.monotonic()
        self._report(None)

    def count(self, episode: Episode, record: EpisodeRecord) -> None:
        """Count an episode that has just ended, and report progress."""
        self._retry_reason = None
        self._played_now += 1
        self._steps += len(record.steps)
        self._count_replies(record)
        outcome = None
        if record.end == "error":
            self._errors += 1
            self.errors_in_a_row += 1
        else:
            self.errors_in_a_row = 0
            outcome = self._add(episode, record)
        self._report(outcome, self._warning(record))

    def note_retry(self, retry_reason: str) -> None:
        """Report that a request or episode is tried again, and why."""
        self._retry_reason = retry_reason
        self._report(None)

    def _warning(self, record: EpisodeRecord) -> str | None:
        for find in self._warnings:
            if (warning := find(record)) is not None:
                self._warnings.remove(find)
                return warning
        return None

    def _first_error_warning(self, record: EpisodeRecord) -> str | None:
        if record.error is None:
            return None
        where, message = record.error.boundary, record.error.message
        return f"Episode {record.episode_id!r} ended as an error at the {where}: {message}"

    def _invalid_replies_warning(self, _: EpisodeRecord) -> str | None:
        """Return the warning that more than half of the replies are invalid, or None."""
        invalid = self._reasons.total()
        if self._seen_episodes < EPISODES_BEFORE_WARNING or invalid <= WARNING_SHARE * self._seen_replies:
            return None
        reasons = ", ".join(f"{count} {reason}" for reason, count in self._reasons.most_common(MAX_LISTED_REASONS))
        share = f"{100 * invalid / self._seen_replies:.0f} %"
        return (
            f"{invalid} of {self._seen_replies} replies ({share}) are invalid after {self._seen_episodes} episodes; "
            f"most frequent: {reasons}. The run measures mostly this: `vigil prompt` shows the replies that are asked "
            "for, and docs/models.md says what may help."
        )

    def _cut_dialogue_warning(self, record: EpisodeRecord) -> str | None:
        """Return the warning that the server cuts dialogues, or None."""
        found = find_shrunk_request(record, self._profile)
        if found is None:
            return None
        return (
            f"In episode {record.episode_id!r} the server counted {found[0]:,} input tokens, and {found[1]:,} for the "
            "next request, although a dialogue only grows. The server seems to cut what its context does not hold "
            f"(or does not count what it has cached). Start it with a larger context: {CONTEXT_OPTIONS}."
        )

    def _coordinates_warning(self, _: EpisodeRecord) -> str | None:
        """Return the warning that the model uses other coordinates, or None."""
        outside = self._clicks_out_of_frame
        if outside < CLICKS_BEFORE_WARNING or outside <= WARNING_OUT_OF_FRAME_SHARE * self._clicks:
            return None
        return (
            f"{outside} of {self._clicks} clicks are in fractions or outside the frame: the model "
            f"seems to use other coordinates than it was asked for. {FIND_COORDINATES}"
        )

    def _count_replies(self, record: EpisodeRecord) -> None:
        """Count the replies, invalid replies and clicks of an episode, for the warnings about them."""
        out_of_frame = sum(
            step.invalid is not None and looks_like_other_coordinates(step.invalid) for step in record.steps
        )
        self._clicks_out_of_frame += out_of_frame
        self._clicks += out_of_frame + sum(isinstance(step.action, InteractPixel) for step in record.steps)
        self._seen_episodes += 1
        self._seen_replies += len(record.steps)
        self._reasons.update(step.invalid.reason for step in record.steps if step.invalid is not None)

    def _add(self, episode: Episode, record: EpisodeRecord) -> Outcome:
        """Count a finished play, and return its outcome."""
        of_list, outcome = None, score(episode, record)
        if self._answers:
            answer = answer_of(episode, self._answers)
            of_list = score_list(answer, episode, record, has_claims=self._profile.has_claims)
        judged = of_list or outcome
        self._done += 1
        self._with_goal += judged.W
        self._closed += judged.B
        if of_list is not None and of_list.T is not None:
            self._truths.append(of_list.T)
        self._has_reports = outcome.has_report
        return outcome

    def _report(self, latest: Outcome | None, warning: str | None = None) -> None:
        elapsed = time.monotonic() - self._started
        left = self._total - self._done - self._errors
        self._on_progress(
            RunProgress(
                total=self._total,
                done=self._done,
                errors=self._errors,
                W=self._with_goal / self._done if self._done else None,
                B=self._closed / self._done if self._done and self._has_reports else None,
                steps=self._steps,
                elapsed_s=elapsed,
                eta_s=elapsed / self._played_now * left if self._played_now else None,
                cost=self._cost(),
                latest=latest,
                retry_reason=self._retry_reason,
                T=sum(self._truths) / len(self._truths) if self._truths else None,
                warning=warning,
            )
        )
