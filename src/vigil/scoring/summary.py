"""Summary: the rates of a run with their intervals, for each family and overall, from its verdicts.

All rates are shares of the scored episodes. Episodes that ended as `error` are counted but not scored. Source:
`protocol.md` section 5.
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from vigil.errors import RecordError
from vigil.packs.pack import count_families
from vigil.protocol.episode import Episode
from vigil.protocol.families import FAMILIES, Family
from vigil.records.record import Boundary, EpisodeRecord, Key, effective_records
from vigil.scoring.outcomes import Outcome, Subtype, score
from vigil.scoring.rates import CREDITS, RATES, Columns, broken_identities, count, mean, outcome_columns, rows_where

MAX_ERROR_SHARE = 0.01
"""Limit on the share of episodes that ended as an error. Above this limit, a report begins with a note."""
MAX_REPEATED_SHARE = 0.01
"""Limit on the share of episodes that were started several times. Above this limit, a report begins with a note,
because the agent may have seen these episodes before."""
LIBRARY_REPLIES = (
    "replies were judged as a library returned them, not as the server sent them: text that the library removes, "
    "such as reasoning, was not seen"
)
"""Note on replies whose text comes from a library. The number of these replies stands before the note."""


NO_REPORTS = (
    "Its profile has no reports: only W is defined. B, FR, NR and everything else about reports is shown as a dash."
)
"""Sentence on a run of a profile without reports."""


def describe_invalid_replies(replies: int, reasons: Iterable[Mapping[str, int]], loose: int) -> str:
    """Return a sentence that says how many of `replies` replies were not actions, and why; empty if all were actions.

    `reasons` has one mapping per episode: reason -> number of invalid replies with this reason. `loose` is the number
    of invalid replies that the lenient grammar would accept.
    """
    none: Counter[str] = Counter()
    found = sum(map(Counter[str], reasons), none)
    if not found:
        return ""
    count = found.total()
    why = ", ".join(f"{number} {reason}" for reason, number in found.most_common())
    parse = "all" if loose == count else str(loose) if loose else "none"
    return f"{count / replies:.0%} of the replies are not actions ({why}); {parse} would parse leniently"


@dataclass(frozen=True, slots=True)
class Unscored:
    """An episode that ended as `error`: the infrastructure failed, not the agent."""

    episode_id: str
    epoch: int
    family: Family
    boundary: Boundary
    message: str
    attempt: int = 1


@dataclass(frozen=True, slots=True)
class RunScores:
    """All verdicts on a run, its episodes that ended as errors, and the number of planned plays in each family."""

    outcomes: tuple[Outcome, ...]
    errors: tuple[Unscored, ...] = ()
    planned: Mapping[Family, int] = field(default_factory=dict[Family, int])
    """Family -> number of its planned plays (episodes times epochs)."""

    @property
    def is_complete(self) -> bool:
        """Whether every planned episode is scored."""
        return len(self.outcomes) >= sum(self.planned.values())

    @property
    def library_replies(self) -> int:
        """Number of replies whose text comes from a library, because the server's own text was not available."""
        return sum(outcome.library_replies for outcome in self.outcomes)

    @property
    def invalid_replies(self) -> str:
        """Sentence that says how many replies were invalid, and why; empty if no reply was invalid."""
        replies = sum(outcome.steps for outcome in self.outcomes)
        loose = sum(outcome.would_parse_leniently for outcome in self.outcomes)
        return describe_invalid_replies(replies, (outcome.invalid_reasons for outcome in self.outcomes), loose)

    @property
    def subtypes(self) -> dict[Subtype, int]:
        """Subtype -> number of reports of this subtype, the most frequent first. Reports with B have no subtype."""
        counts: Counter[Subtype] = Counter(outcome.subtype for outcome in self.outcomes if outcome.subtype)
        return dict(counts.most_common())

    @property
    def has_many_errors(self) -> bool:
        """Whether more than 1 % of the attempted episodes ended as an error."""
        return has_many_errors(len(self.errors), len(self.outcomes))

    @property
    def attempts(self) -> tuple[int, ...]:
        """Number of attempts at each episode; attempts that ended as an error count too."""
        return tuple(row.attempt for row in (*self.outcomes, *self.errors))

    @property
    def repeats(self) -> str:
        """Return a sentence that says how many episodes were started more than once; empty if there were none."""
        return repeats(self.attempts)

    @property
    def has_many_repeats(self) -> bool:
        """Whether more than 1 % of the episodes were started more than once."""
        return _has_many_repeats(self.attempts)


def has_many_errors(errors: int, scored: int) -> bool:
    """Return whether more than 1 % of the attempted episodes ended as an error."""
    return errors > MAX_ERROR_SHARE * (errors + scored)


def repeats(attempts: Sequence[int]) -> str:
    """Return a sentence that says how many episodes were started more than once; empty if there were none.

    `attempts` has the number of attempts at each episode.
    """
    again = sum(count > 1 for count in attempts)
    if not again:
        return ""
    share = " (more than 1 %)" if _has_many_repeats(attempts) else ""
    return f"{again} of {len(attempts)} episodes were started more than once{share}, one of them {max(attempts)} times"


def _has_many_repeats(attempts: Sequence[int]) -> bool:
    return sum(count > 1 for count in attempts) > MAX_REPEATED_SHARE * len(attempts)


def score_or_error(episode: Episode, record: EpisodeRecord) -> Outcome | Unscored:
    """Return the verdict on a record; Unscored for an error row. Raises RecordError if it is of another episode."""
    if record.end != "error":
        return score(episode, record)
    boundary, message = (record.error.boundary, record.error.message) if record.error else ("runner", "")
    return Unscored(record.episode_id, record.epoch, episode.family, boundary, message, record.attempt)


def run_scores(verdicts: Mapping[Key, Outcome | Unscored], episodes: Iterable[Episode], epochs: int = 1) -> RunScores:
    """Return a run's scores from its verdicts, sorted by episode and epoch. `episodes` are all planned episodes."""
    found = [verdict for _, verdict in sorted(verdicts.items())]
    planned: dict[Family, int] = {family: count * epochs for family, count in count_families(episodes).items()}
    return RunScores(
        tuple(verdict for verdict in found if isinstance(verdict, Outcome)),
        tuple(verdict for verdict in found if isinstance(verdict, Unscored)),
        planned,
    )


def score_run(episodes: Iterable[Episode], records: Iterable[EpisodeRecord], epochs: int = 1) -> RunScores:
    """Return the verdicts on the records that count, sorted by episode and epoch.

    `episodes` are the planned episodes. Raises RecordError for a record of any other episode.
    """
    by_id = {episode.id: episode for episode in episodes}
    verdicts: dict[Key, Outcome | Unscored] = {}
    for key, record in effective_records(records).items():
        if record.episode_id not in by_id:
            raise RecordError(
                f"Record of episode {record.episode_id!r} is not one of the {len(by_id)} episodes of this run. Was it "
                "recorded with another pack?"
            )
        verdicts[key] = score_or_error(by_id[record.episode_id], record)
    return run_scores(verdicts, by_id.values(), epochs)


def summarise(scores: RunScores) -> dict[str, Any]:
    """Return `{"overall": rates, "families": {family: rates}}`. If families have different numbers of episodes,
    `macro` has the mean over families.

    A rate over an empty set of episodes is None. Raises RuntimeError if an identity of the protocol does not hold.
    """
    outcomes = scores.outcomes
    columns = _check_identities(outcome_columns(outcomes))
    families: dict[Family, dict[str, Any]] = {}
    for family in FAMILIES:
        mine = [outcome for outcome in outcomes if outcome.family == family]
        if mine or family in scores.planned:
            errors = [error for error in scores.errors if error.family == family]
            part = rows_where(columns, columns["family"] == family)
            families[family] = _rates(part, mine, errors, scores.planned.get(family, 0))
    overall = _rates(columns, outcomes, scores.errors, sum(scores.planned.values()))
    overall["report_policies"] = {
        policy: mean(columns[column].tolist() if count(columns).has_reports else [])
        for policy, column in CREDITS.items()
    }
    summary: dict[str, Any] = {"overall": overall, "families": families}
    if len({rates["episodes"] for rates in families.values()}) > 1:
        summary["macro"] = _macro(list(families.values()))
    return summary


def assert_identities(outcomes: Sequence[Outcome]) -> None:
    """Raise RuntimeError if an identity of protocol.md section 5 does not hold; the message names the identity."""
    _check_identities(outcome_columns(outcomes))


def _check_identities(columns: Columns) -> Columns:
    broken = broken_identities(columns)
    if broken:
        raise RuntimeError(
            f"The scores contradict the identities that must hold between them: {'; '.join(broken)}. This is a bug in "
            "vigil."
        )
    return columns


def _rates(columns: Columns, outcomes: Sequence[Outcome], errors: Sequence[Unscored], planned: int) -> dict[str, Any]:
    n, counts = len(outcomes), count(columns)
    attempts = [row.attempt for row in (*outcomes, *errors)]
    rates = {name: counts.rate(name) for name in RATES}
    return {
        "episodes": n,
        "errors": len(errors),
        "repeated": sum(number > 1 for number in attempts),
        "most_attempts": max(attempts, default=0),
        **{name: rate.value for name, rate in rates.items()},
        "mean_steps": mean([outcome.steps for outcome in outcomes]),
        "complete": f"{n}/{max(planned, n)}",
        "intervals": {name: None if rate.interval is None else list(rate.interval) for name, rate in rates.items()},
    }


def _macro(families: Sequence[dict[str, Any]]) -> dict[str, float | None]:
    """Return the unweighted mean over the families that have scored episodes."""
    scored = [rates for rates in families if rates["episodes"]]
    return {rate: mean([rates[rate] for rates in scored]) for rate in (*RATES, "mean_steps")}
