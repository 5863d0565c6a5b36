"""Summary: many outcomes -> rates per family and overall, with intervals, and the identities they must obey.

All rates are fractions of the scored episodes; episodes that ended as `error` are counted, never scored. Source:
`protocol.md` section 5.
"""

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from vigil.episode import FAMILIES, Episode, Family
from vigil.errors import RecordError
from vigil.pack import count_families
from vigil.record import Boundary, EpisodeRecord, Key, standing
from vigil.scoring import REPORT_POLICIES, Outcome, credit, settle

Z_95 = 1.959963984540054
SCEPTICISM = 5
"""Hits for which plays of one episode are taken to be wholly alike, beside those that were seen."""
MAX_ERROR_SHARE = 0.01
"""A report over more errors than this says so at its top."""
MAX_REPEATED_SHARE = 0.01
"""And one over more episodes that were begun more than once: what began them anew may have seen them before."""
LIBRARY_REPLIES = (
    "replies were judged as a library gave them back, not as the server sent them: what it cuts, as reasoning "
    "anywhere in a text, was not seen"
)
"""What a run with such replies is said to have, after their number."""
RATES = ("W", "W_strict", "B", "Delta", "FR", "NR", "IL", "Other", "NoRep", "Stop")


@dataclass(frozen=True, slots=True)
class Unscored:
    """An episode that ended as `error`: the infrastructure's failure, never the agent's."""

    episode_id: str
    epoch: int
    family: Family
    boundary: Boundary
    message: str
    attempt: int = 1


@dataclass(frozen=True, slots=True)
class Settlement:
    """All verdicts on a run, with what is missing."""

    outcomes: tuple[Outcome, ...]
    errors: tuple[Unscored, ...] = ()
    planned: Mapping[Family, int] = field(default_factory=dict)
    """Episodes (times epochs) that the run is meant to have."""

    @property
    def is_complete(self) -> bool:
        """Whether every planned episode is scored."""
        return len(self.outcomes) >= sum(self.planned.values())

    @property
    def library_replies(self) -> int:
        """Replies that were taken from a library, because the server's own text could not be had."""
        return sum(outcome.library_replies for outcome in self.outcomes)

    @property
    def has_many_errors(self) -> bool:
        """Whether more than 1 % of what was attempted ended as an error."""
        attempted = len(self.outcomes) + len(self.errors)
        return len(self.errors) > MAX_ERROR_SHARE * attempted

    @property
    def attempts(self) -> tuple[int, ...]:
        """How often each episode was begun, those that ended as an error included."""
        return tuple(row.attempt for row in (*self.outcomes, *self.errors))

    @property
    def repeats(self) -> str:
        """Says how many episodes were begun more than once; empty when none was."""
        return repeats(self.attempts)

    @property
    def has_many_repeats(self) -> bool:
        """Whether more than 1 % of the episodes were begun more than once."""
        return is_repeated_often(self.attempts)


def repeats(attempts: Sequence[int]) -> str:
    """Says how many of the episodes, each begun so often, were begun more than once; empty when none was."""
    again = sum(count > 1 for count in attempts)
    if not again:
        return ""
    share = " (more than 1 %)" if is_repeated_often(attempts) else ""
    return f"{again} of {len(attempts)} episodes were begun more than once{share}, one of them {max(attempts)} times"


def is_repeated_often(attempts: Sequence[int]) -> bool:
    """Whether more than 1 % of the episodes, each begun so often, were begun more than once."""
    return sum(count > 1 for count in attempts) > MAX_REPEATED_SHARE * len(attempts)


def verdict_on(episode: Episode, record: EpisodeRecord) -> Outcome | Unscored:
    """Returns the verdict on a record that stands. Raises RecordError when it is another episode's."""
    if record.end != "error":
        return settle(episode, record)
    boundary, message = (record.error.boundary, record.error.message) if record.error else ("runner", "")
    return Unscored(record.episode_id, record.epoch, episode.family, boundary, message, record.attempt)


def settlement_of(
    verdicts: Mapping[Key, Outcome | Unscored], episodes: Iterable[Episode], epochs: int = 1
) -> Settlement:
    """Returns the verdicts of a run, sorted by episode and epoch; `episodes` are those that it is meant to play."""
    found = [verdict for _, verdict in sorted(verdicts.items())]
    planned: dict[Family, int] = {family: count * epochs for family, count in count_families(episodes).items()}
    return Settlement(
        tuple(verdict for verdict in found if isinstance(verdict, Outcome)),
        tuple(verdict for verdict in found if isinstance(verdict, Unscored)),
        planned,
    )


def settle_run(episodes: Iterable[Episode], records: Iterable[EpisodeRecord], epochs: int = 1) -> Settlement:
    """Returns the verdicts on the records that stand, sorted by episode and epoch.

    `episodes` are those that the run is meant to play. Raises RecordError on a record of any other episode.
    """
    by_id = {episode.id: episode for episode in episodes}
    verdicts: dict[Key, Outcome | Unscored] = {}
    for key, record in standing(records).items():
        if record.episode_id not in by_id:
            raise RecordError(
                f"Record of episode {record.episode_id!r}: not one of the {len(by_id)} episodes of this run. Was it "
                "recorded with another pack?"
            )
        verdicts[key] = verdict_on(by_id[record.episode_id], record)
    return settlement_of(verdicts, by_id.values(), epochs)


def summarise(settlement: Settlement) -> dict:
    """Returns `{"overall": rates, "families": {family: rates}}`, and `macro` when families are unequal.

    Rates over no episodes are None. Raises RuntimeError when an identity of the protocol is broken.
    """
    outcomes = settlement.outcomes
    assert_identities(outcomes)
    families = {
        family: _rates(
            [outcome for outcome in outcomes if outcome.family == family],
            errors=[error for error in settlement.errors if error.family == family],
            planned=settlement.planned.get(family, 0),
        )
        for family in FAMILIES
        if family in settlement.planned or any(outcome.family == family for outcome in outcomes)
    }
    overall = _rates(outcomes, errors=settlement.errors, planned=sum(settlement.planned.values()))
    overall["report_policies"] = {
        policy: _mean([credit(outcome, policy) for outcome in outcomes]) for policy in REPORT_POLICIES
    }
    summary = {"overall": overall, "families": families}
    if len({rates["episodes"] for rates in families.values()}) > 1:
        summary["macro"] = _macro(list(families.values()))
    return summary


def independent_trials(hits: Sequence[int], trials: Sequence[int]) -> float:
    """Returns how many independent trials tell as much of a rate as those of episodes that were played repeatedly.

    `hits` and `trials` are counts by episode. Plays of one episode are alike, so they tell less than as many plays of
    different ones: n divided by the design effect 1 + (plays of an episode - 1) x (how alike they are). How alike is
    estimated from the hits' variance between episodes, and drawn towards wholly alike as far as hits (or misses) are
    few: those tell little of it. Source: Dean and Pagano, "Evaluating confidence interval methods for binomial
    proportions in clustered surveys", 2015; Kish, "Survey sampling", 1965, for unequal numbers of plays.
    """
    n = sum(trials)
    plays = sum(count * count for count in trials) / max(n, 1)
    if plays <= 1:
        return float(n)
    rare = min(sum(hits), n - sum(hits))
    alike = (rare * _alike(hits, trials, plays) + SCEPTICISM) / (rare + SCEPTICISM)
    return n / (1 + (plays - 1) * alike)


def _alike(hits: Sequence[int], trials: Sequence[int], plays: float) -> float:
    """Returns how alike the plays of one episode are, from 0 (as any two) to 1 (all the same)."""
    n, episodes = sum(trials), sum(count > 0 for count in trials)
    rate = sum(hits) / n
    if episodes < 2 or not 0 < rate < 1:
        return 1.0
    spread = sum((hit - rate * count) ** 2 for hit, count in zip(hits, trials, strict=True)) / (n * rate * (1 - rate))
    return min(1.0, max(0.0, (spread * episodes / (episodes - 1) - 1) / (plays - 1)))


def wilson(hits: float, n: float) -> tuple[float, float]:
    """Returns the 95 % Wilson score interval of a rate; (0, 1) over no trials."""
    if n == 0:
        return 0.0, 1.0
    rate, z2 = hits / n, Z_95**2
    middle = (rate + z2 / (2 * n)) / (1 + z2 / n)
    half = Z_95 / (1 + z2 / n) * math.sqrt(rate * (1 - rate) / n + z2 / (4 * n * n))
    return max(0.0, min(middle - half, rate)), min(1.0, max(middle + half, rate))


def assert_identities(outcomes: Sequence[Outcome]) -> None:
    """Checks the identities of protocol.md section 5. Raises RuntimeError, naming the broken one."""
    n = len(outcomes)
    labels = {name: sum(outcome.label == name for outcome in outcomes) for name in ("B", "FR", "NR", "IL", "Other")}
    stop = sum(outcome.is_reported for outcome in outcomes)
    w, b = sum(outcome.W for outcome in outcomes), sum(outcome.B for outcome in outcomes)
    unreported = sum(outcome.W and not outcome.is_reported for outcome in outcomes)
    mismatched = sum(outcome.W and outcome.label == "FR" for outcome in outcomes)
    in_sv = sum(outcome.W and outcome.expected is not None for outcome in outcomes)
    credits = {policy: sum(credit(outcome, policy) for outcome in outcomes) for policy in REPORT_POLICIES}
    identities = {
        "B + FR + NR + IL + Other = all": sum(labels.values()) == n,
        "Stop + NR + IL = all": stop + labels["NR"] + labels["IL"] == n,
        "Stop = B + FR + Other": stop == labels["B"] + labels["FR"] + labels["Other"],
        "B = label B": b == labels["B"],
        "W - B = no report given W=1 + mismatched reports given W=1": w - b == unreported + mismatched,
        "Always = W minus SV's share": credits["always_success"] == w - in_sv,
        "Random = W/2": credits["random"] == w / 2,
        "Oracle = W": credits["oracle"] == w,
        "B <= W on every episode": all(outcome.W or not outcome.B for outcome in outcomes),
        "W_strict <= W on every episode": all(outcome.W or not outcome.W_strict for outcome in outcomes),
    }
    broken = [name for name, holds in identities.items() if not holds]
    if broken:
        raise RuntimeError(f"Scoring broke its own identities: {'; '.join(broken)}. This is a fault of vigil.")


def _rates(outcomes: Sequence[Outcome], *, errors: Sequence[Unscored], planned: int) -> dict:
    n = len(outcomes)
    attempts = [row.attempt for row in (*outcomes, *errors)]
    hits = {rate: [_is_hit(outcome, rate) for outcome in outcomes] for rate in RATES}
    episodes = [outcome.episode_id for outcome in outcomes]
    return {
        "episodes": n,
        "errors": len(errors),
        "repeated": sum(count > 1 for count in attempts),
        "most_attempts": max(attempts, default=0),
        **{rate: _mean(hits[rate]) for rate in RATES},
        "mean_steps": _mean([outcome.steps for outcome in outcomes]),
        "complete": f"{n}/{max(planned, n)}",
        "intervals": {rate: list(_interval(hits[rate], episodes)) for rate in RATES},
    }


def _interval(hits: Sequence[bool], episodes: Sequence[str]) -> tuple[float, float]:
    """Returns the Wilson interval of a rate over plays of the named episodes, some perhaps played repeatedly."""
    played = Counter(episodes)
    hit = Counter(episode for episode, is_hit in zip(episodes, hits, strict=True) if is_hit)
    n = independent_trials([hit[episode] for episode in played], list(played.values()))
    return wilson(n * hit.total() / max(len(hits), 1), n)


def _is_hit(outcome: Outcome, rate: str) -> bool:
    match rate:
        case "W" | "W_strict" | "B":
            return getattr(outcome, rate)
        case "Delta":
            return outcome.W and not outcome.B
        case "NoRep":
            return not outcome.is_reported
        case "Stop":
            return outcome.is_reported
        case _:
            return outcome.label == rate


def _macro(families: Sequence[dict]) -> dict:
    """Returns the unweighted mean over the families that have scored episodes."""
    scored = [rates for rates in families if rates["episodes"]]
    return {rate: _mean([rates[rate] for rates in scored]) for rate in (*RATES, "mean_steps")}


def _mean(values: Sequence[float]) -> float | None:
    return sum(values) / len(values) if values else None
