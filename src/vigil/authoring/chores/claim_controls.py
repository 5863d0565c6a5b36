"""Negative controls of claims: reports with false claims, which must never close a list correctly."""

from collections.abc import Iterator, Mapping
from dataclasses import replace

from vigil.authoring.review.synthetic_records import record_of
from vigil.protocol.actions import ChoreClaim
from vigil.protocol.episode import Episode
from vigil.protocol.goals import OTHER_LABEL
from vigil.records.record import EpisodeRecord
from vigil.scoring.chores import ListOutcome, score_list

Claims = Mapping[int, ChoreClaim]


def false_claims(solved: ListOutcome, episode: Episode, record: EpisodeRecord) -> Iterator[str]:
    """Yield the names of false claims that wrongly close a list; `solved` is the verdict of the solution's record."""
    true: dict[int, ChoreClaim] = {chore.number: chore.claim for chore in solved.chores if chore.claim is not None}
    for name, claims in wrong_claims(true):
        if verdict_with_claims(solved, claims).B:
            yield name
    idle = score_list(solved.answer, episode, record_of(record, (), "success"), has_claims=True)
    if verdict_with_claims(idle, true).B:
        yield "the solution's claims, and nothing done"


def verdict_with_claims(outcome: ListOutcome, claims: Claims) -> ListOutcome:
    """Return the verdict for the same final world, but with other claims."""
    chores = tuple(replace(chore, claim=claims.get(chore.number), raw_claim=None) for chore in outcome.chores)
    return replace(outcome, chores=chores)


def wrong_claims(true: Claims) -> Iterator[tuple[str, Claims]]:
    """Yield (name, claims), where the claims differ from the true claims."""
    for number, claim in true.items():
        yield f"chore {number}: the opposite", {**true, number: _opposite(claim)}
        yield f"chore {number}: no claim", {other: each for other, each in true.items() if other != number}
        yield f"chore {number}: unknown", {**true, number: "unknown"}
    numbers, claims = list(true), list(true.values())
    everything: dict[str, Claims] = {
        "all succeeded": dict.fromkeys(numbers, "success"),
        "all failed": dict.fromkeys(numbers, "fail"),
        "no claims": {},
        "claims of the next chore": dict(zip(numbers, [*claims[1:], claims[0]], strict=True)),
    }
    yield from ((name, each) for name, each in everything.items() if _differs(each, true))


def _opposite(claim: ChoreClaim) -> ChoreClaim:
    return OTHER_LABEL.get(claim, "fail" if claim == "success" else "success")


def _differs(claims: Claims, true: Claims) -> bool:
    """Return whether claims differ from the true claims. All concessions ("cannot be done") count as equal."""
    return any(_conceded(claims.get(number)) != _conceded(claim) for number, claim in true.items())


def _conceded(claim: ChoreClaim | None) -> ChoreClaim | None:
    return "fail" if claim == "invalid" else claim
