"""Negative controls of claims: reports that are not true of the world, and must never close a list correctly."""

from collections.abc import Iterator, Mapping

from vigil.authoring.review.synthetic_records import record_of
from vigil.protocol.actions import ChoreClaim, Report
from vigil.protocol.episode import Episode
from vigil.records.record import EpisodeRecord
from vigil.scoring.chore_answers import ListAnswer
from vigil.scoring.chores import score_list

Claims = Mapping[int, ChoreClaim]
OTHER: dict[ChoreClaim, ChoreClaim] = {"on": "off", "off": "on", "open": "closed", "closed": "open"}
"""Label of a state -> the label of the opposite state."""


def false_claims(answer: ListAnswer, episode: Episode, record: EpisodeRecord) -> Iterator[str]:
    """Yield the names of the controls that close a list correctly, given the record of its solution."""
    report = record.steps[-1].action
    assert isinstance(report, Report)
    for name, claims in _wrong_claims(report.claims or {}):
        if closes(answer, episode, with_claims(record, claims)):
            yield name
    idle = record_of(record, (), report.status)
    if closes(answer, episode, with_claims(idle, report.claims or {})):
        yield "the solution's claims, and nothing done"


def closes(answer: ListAnswer, episode: Episode, record: EpisodeRecord) -> bool:
    """Return whether a record closes every chore of a list correctly."""
    return all(chore.B for chore in score_list(answer, episode, record).chores)


def with_claims(record: EpisodeRecord, claims: Claims) -> EpisodeRecord:
    """Return a record that ends by a report, with other claims."""
    *before, last = record.steps
    assert isinstance(last.action, Report)
    reported = last.action.model_copy(update={"claims": dict(claims)})
    return record.model_copy(update={"steps": (*before, last.model_copy(update={"action": reported}))})


def _wrong_claims(true: Claims) -> Iterator[tuple[str, Claims]]:
    """Yield named claims that differ from the true ones."""
    for number, claim in true.items():
        yield f"the opposite about chore {number}", {**true, number: _opposite(claim)}
        yield f"nothing about chore {number}", {other: each for other, each in true.items() if other != number}
        yield f"unknown for chore {number}", {**true, number: "unknown"}
    numbers, claims = list(true), list(true.values())
    everything: dict[str, Claims] = {
        "all succeeded": dict.fromkeys(numbers, "success"),
        "all failed": dict.fromkeys(numbers, "fail"),
        "no claims": {},
        "claims of the next chore": dict(zip(numbers, [*claims[1:], claims[0]], strict=True)),
    }
    yield from ((name, each) for name, each in everything.items() if _differs(each, true))


def _opposite(claim: ChoreClaim) -> ChoreClaim:
    return OTHER.get(claim, "fail" if claim == "success" else "success")


def _differs(claims: Claims, true: Claims) -> bool:
    """Return whether claims differ from the true ones, where all concessions are alike."""
    return any(_conceded(claims.get(number)) != _conceded(claim) for number, claim in true.items())


def _conceded(claim: ChoreClaim | None) -> ChoreClaim | None:
    return "fail" if claim == "invalid" else claim
