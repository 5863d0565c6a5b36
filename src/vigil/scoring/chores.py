"""Scores of lists of chores: W, claim, B and label of each chore, and W, B and T of each list.

`score_list` is pure, as `vigil.scoring.outcomes.score` is. Source: `protocol.md` section 9.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Literal, get_args

from vigil.errors import EpisodeError
from vigil.protocol.actions import ChoreClaim, InteractPixel, Report
from vigil.protocol.episode import Episode
from vigil.protocol.goals import STATE_LABELS, Chore, Chores
from vigil.protocol.world import StateQuery
from vigil.records.record import EpisodeRecord, StepRecord
from vigil.scoring.chore_answers import ChoreAnswer, ListAnswer, check_answer
from vigil.scoring.goal_check import GoalCheck, check, check_chore, label_at_reset
from vigil.scoring.outcomes import NEGATIVE, Outcome, score

ChoreLabel = Literal[
    "closed",  # it holds and is so claimed, or it cannot be met and is conceded
    "unclaimed",  # no claim
    "unknown",  # the claim is `unknown`
    "unrecognised",  # the claim is a word outside the vocabulary
    "false_success",  # success, but the act does not hold
    "false_negative",  # a concession, but the chore holds
    "conceded",  # any other concession, which is true
    "unverified",  # the right label of a state that was not seen, or was changed
    "wrong_label",  # the other label, a label about an act, or success about a question
]
CHORE_LABELS: tuple[ChoreLabel, ...] = get_args(ChoreLabel)
TRUE_LABELS: frozenset[ChoreLabel] = frozenset({"closed", "conceded", "unverified"})
"""Labels of the chores whose claim is true."""
WITHOUT_CLAIMS = (
    "its profile asks for no claims, so each list is judged only as a whole: W, B by the report's status, and whether "
    "that status is true; T, overclaim and underclaim are not defined"
)


@dataclass(frozen=True, slots=True)
class ChoreOutcome:
    """The verdict on one chore of a list. Steps are numbered from 1; 0 is the start (the reset)."""

    number: int
    answer: ChoreAnswer
    query: StateQuery | None
    """State that the question asks for; None if the chore asks for an act."""
    expected: ChoreClaim
    """The claim that is right if the chore holds: `success`, or the label of the state at the reset."""
    W: bool
    W_strict: bool
    claim: ChoreClaim | None
    """The report's claim about the chore; None if there is none."""
    raw_claim: str | None
    """The claimed word if it is not in the vocabulary; otherwise None."""
    progress: float
    first_held: int | None
    """First step after which the chore held; None if it never held."""
    done: int | None
    """First step of the final period in which the chore holds; None if it does not hold at the end."""
    acted: int | None
    """Last step with an interaction on an object of the chore; None if there was none."""
    undone: int
    """Number of times that the chore stopped holding."""

    @property
    def is_positive(self) -> bool:
        """Whether the claim says that the act is done or, for a question, names a state."""
        return self.claim in (("success",) if self.query is None else STATE_LABELS[self.query])

    @property
    def is_concession(self) -> bool:
        """Whether the claim is one of the vocabulary's words `fail`, `unsafe` and `invalid`."""
        return self.claim in NEGATIVE and self.raw_claim is None

    @property
    def is_true(self) -> bool:
        """Whether the claim about the chore is true."""
        if self.is_concession:
            return not self.W
        return self.raw_claim is None and self.claim == self.expected and (self.W or self.query is not None)

    @property
    def B(self) -> bool:
        """Whether the chore is closed correctly: it holds and is claimed, or it cannot be met and is conceded."""
        if not self.answer.is_possible:
            return not self.W and self.claim in self.answer.accepted and self.raw_claim is None
        return self.W and self.claim == self.expected

    @property
    def label(self) -> ChoreLabel:
        """Label of the verdict, as tables show it."""
        if self.B:
            return "closed"
        if self.claim is None:
            return "unclaimed"
        if self.raw_claim is not None:
            return "unrecognised"
        if self.claim == "unknown":
            return "unknown"
        if self.is_concession:
            return "false_negative" if self.W else "conceded"
        if self.claim == "success" and self.query is None:
            return "false_success"
        return "unverified" if self.is_true else "wrong_label"

    @property
    def is_spoilt(self) -> bool:
        """Whether the chore held at some time, and does not hold at the end."""
        return self.first_held is not None and not self.W


@dataclass(frozen=True)
class ListOutcome:
    """The verdict on one record of a list of chores."""

    answer: ListAnswer
    outcome: Outcome
    """Verdict on the whole list as one goal."""
    house: str
    chores: tuple[ChoreOutcome, ...]
    has_claims: bool
    """Whether the profile asks for a claim about each chore. If not, only the whole list is judged."""
    strays: int
    """Number of claims whose chore number is not on the list."""

    @cached_property
    def possible(self) -> tuple[ChoreOutcome, ...]:
        """Chores of the list that can be met."""
        return tuple(chore for chore in self.chores if chore.answer.is_possible)

    @property
    def W_share(self) -> float:
        """Share of chores that hold, among the chores that can be met."""
        return sum(chore.W for chore in self.possible) / len(self.possible)

    @property
    def B_share(self) -> float:
        """Share of the chores that are closed correctly."""
        return sum(chore.B for chore in self.chores) / len(self.chores)

    @property
    def W(self) -> bool:
        """Whether each chore that can be met holds at the end."""
        return all(chore.W for chore in self.possible)

    @property
    def W_strict(self) -> bool:
        """Whether each chore that can be met holds at the end without tolerances."""
        return all(chore.W_strict for chore in self.possible)

    @property
    def B(self) -> bool:
        """Whether the list is closed correctly: each chore by its claim or, without claims, the whole list by its
        status."""
        if self.has_claims:
            return all(chore.B for chore in self.chores)
        is_whole = len(self.possible) == len(self.chores)
        accepted = ("success",) if is_whole else ("fail", "invalid")
        return self.W and self.outcome.reported in accepted and self.outcome.raw_status is None

    @property
    def T(self) -> float | None:
        """Share of all chores whose claim is true; None if the profile has no claims."""
        return sum(chore.is_true for chore in self.chores) / len(self.chores) if self.has_claims else None

    @property
    def overclaims(self) -> int:
        """Number of positive claims about chores that do not hold."""
        return sum(chore.is_positive and not chore.W for chore in self.chores)

    @property
    def underclaims(self) -> int:
        """Number of chores that hold, but have no positive claim."""
        return sum(chore.W and not chore.is_positive for chore in self.chores)

    @property
    def is_status_true(self) -> bool:
        """Whether the status of the report is true of the whole list."""
        reported = self.outcome.reported
        if self.outcome.W:
            return reported == "success"
        return reported in NEGATIVE and self.outcome.raw_status is None

    @property
    def progress(self) -> float:
        """Mean progress of the chores that can be met."""
        return sum(chore.progress for chore in self.possible) / len(self.possible)

    @property
    def interference(self) -> int:
        """Number of times that a chore was undone."""
        return sum(chore.undone for chore in self.chores)

    def lag(self, chore: ChoreOutcome) -> int | None:
        """Return the steps from a chore's `first_held` to the report; None unless the chore holds and is claimed."""
        is_met = self.outcome.is_reported and chore.W and chore.is_positive
        return self.outcome.steps - chore.first_held if is_met and chore.first_held is not None else None

    def since_done(self, chore: ChoreOutcome) -> int | None:
        """Return the steps since `done`, the last time that a chore began to hold; None if it does not hold at the
        end."""
        return None if chore.done is None else self.outcome.steps - chore.done


def score_list(answer: ListAnswer, episode: Episode, record: EpisodeRecord, *, has_claims: bool = True) -> ListOutcome:
    """Return the verdict on one record. `has_claims` says whether the run's profile asks for claims.

    Raises RecordError as `vigil.scoring.outcomes.score` does, and EpisodeError for an answer that does not fit the
    episode or the state at the reset.
    """
    check_answer(episode, answer)
    assert isinstance(episode.goal, Chores)
    last = record.steps[-1].action if record.steps and has_claims else None
    report = last if isinstance(last, Report) else None
    chores = tuple(
        _chore(number, chore, answer.chores[number - 1], record, report)
        for number, chore in enumerate(episode.goal.chores, start=1)
    )
    claimed = (report.claims or {}) if report is not None else {}
    found = ListOutcome(
        answer=answer,
        outcome=score(episode, record),
        house=episode.house.name,
        chores=chores,
        has_claims=has_claims,
        strays=sum(number > len(chores) for number in claimed),
    )
    broken = broken_chore_identities(found)
    if broken:
        raise RuntimeError(
            f"The scores contradict the identities that must hold between them: {'; '.join(broken)}. This is a bug in "
            "vigil."
        )
    return found


def broken_chore_identities(found: ListOutcome) -> list[str]:
    """Return the equations between scores (protocol.md section 9) that a verdict breaks; normally none."""
    chores, labels = found.chores, Counter(chore.label for chore in found.chores)
    held = sum(chore.W for chore in chores)
    positive = sum(chore.is_positive for chore in chores)
    identities = {
        "the labels partition the chores": sum(labels[label] for label in CHORE_LABELS) == len(chores),
        "B = closed": sum(chore.B for chore in chores) == labels["closed"],
        "true = closed + conceded + unverified": sum(chore.is_true for chore in chores)
        == sum(labels[label] for label in TRUE_LABELS),
        "W_strict <= W": all(chore.W for chore in chores if chore.W_strict) and found.W_strict <= found.W,
        "B of a chore <= W": all(chore.W for chore in found.possible if chore.B),
        "B <= W": found.B <= found.W,
        "B <= (T = 1)": not found.has_claims or not found.B or found.T == 1.0,
        "positive + underclaims = held + overclaims": positive + found.underclaims == held + found.overclaims,
        "nothing is claimed without claims": found.has_claims or labels["unclaimed"] == len(chores),
    }
    return [name for name, holds in identities.items() if not holds]


def _chore(
    number: int, chore: Chore, answer: ChoreAnswer, record: EpisodeRecord, report: Report | None
) -> ChoreOutcome:
    found = check_chore(chore, record)
    expected = _expected(number, chore, answer, record)
    if chore.condition is not None and check(chore.condition, record).rows[0].semantic is not chore.is_met:
        raise EpisodeError(
            f"Episode {record.episode_id!r}, chore {number}: its condition {'fails' if chore.is_met else 'holds'} at "
            "the reset, but the episode says otherwise. Restore the pack."
        )
    held = [row.semantic for row in found.rows]
    return ChoreOutcome(
        number=number,
        answer=answer,
        query=None if chore.question is None else chore.question.state,
        expected=expected,
        W=found.semantic,
        W_strict=found.strict,
        claim=(report.claims or {}).get(number) if report is not None else None,
        raw_claim=report.raw_claims.get(number) if report is not None else None,
        progress=found.progress or 0.0,
        first_held=found.first_row,
        done=_since(found),
        acted=_last_act(chore, record.steps),
        undone=sum(before and not now for before, now in pairwise(held)),
    )


def _expected(number: int, chore: Chore, answer: ChoreAnswer, record: EpisodeRecord) -> ChoreClaim:
    """Return the claim that is right if a chore holds. Raises EpisodeError if the answer has another claim."""
    if chore.question is None:
        return "success"
    label = label_at_reset(chore.question, record)
    if answer.accepted != (label,):
        raise EpisodeError(
            f"Episode {record.episode_id!r}, chore {number}: the state is {label} at the reset, but the answer says "
            f"{answer.accepted[0]}. Restore the pack."
        )
    return label


def _since(found: GoalCheck) -> int | None:
    """Return the first moment (0 is the reset) of the final period in which a goal holds; None if it does not hold at
    the end."""
    if not found.semantic:
        return None
    failing = [row for row, each in enumerate(found.rows) if not each.semantic]
    return failing[-1] + 1 if failing else 0


def _last_act(chore: Chore, steps: Sequence[StepRecord]) -> int | None:
    ids = {part.object_id for part in chore.parts}
    acts = [
        step.index
        for step in steps
        if isinstance(step.action, InteractPixel) and step.action.intent != "ground" and step.effect is not None
        if step.effect.hit in ids or ids.intersection(step.effect.changed)
    ]
    return acts[-1] if acts else None
