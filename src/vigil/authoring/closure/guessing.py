"""Expected scores, in a pack of the closure suite, of agents that report without looking.

Source: `protocol.md` section 8, decision 30.
"""

from collections import Counter
from collections.abc import Sequence
from typing import Any

from vigil.protocol.actions import Status
from vigil.scoring.closure import KINDS, PAIRED, ClosureAnswer, Kind, check_pairs

BLIND: dict[str, tuple[Status | None, ...]] = {
    "nothing": (None,),
    "always_success": ("success",),
    "always_fail": ("fail",),
    "always_invalid": ("invalid",),
    "coin": ("success", "fail"),
}
"""Name of an agent that reports without looking -> the statuses that it draws from at random; None: no report."""


def kind_counts(answers: Sequence[ClosureAnswer]) -> dict[str, int]:
    """Return the number of episodes for each text "KIND SIDE REASON" (empty parts are omitted), sorted by the text."""
    names = [" ".join(filter(None, (each.kind, each.side, each.reason))) for each in answers]
    return dict(sorted(Counter(names).items()))


def closure_facts(answers: Sequence[ClosureAnswer]) -> dict[str, Any]:
    """Return the entries of a pack's manifest about the suite. Raises EpisodeError if a twin is missing."""
    check_pairs(answers)
    return {"blind": guessing(answers), "kinds": kind_counts(answers)}


def guessing(answers: Sequence[ClosureAnswer]) -> dict[str, dict[str, float]]:
    """Return for each agent in `BLIND` its expected share of correct closures (C, %) and of correct pairs (%), by kind.

    These agents never act, so the goal holds at the end if and only if it holds at the reset.
    """
    kinds = [kind for kind in KINDS if any(each.kind == kind for each in answers)]
    return {
        name: {
            **{f"C {kind}": _mean([_chance(each, drawn) for each in answers if each.kind == kind]) for kind in kinds},
            **{f"pairs {kind}": _mean(_pair_chances(answers, kind, drawn)) for kind in kinds if kind in PAIRED},
        }
        for name, drawn in BLIND.items()
    }


def _pair_chances(answers: Sequence[ClosureAnswer], kind: Kind, drawn: tuple[Status | None, ...]) -> list[float]:
    pairs: dict[str, float] = {}
    for each in answers:
        if each.kind == kind and each.pair is not None:
            pairs[each.pair] = pairs.get(each.pair, 1.0) * _chance(each, drawn)
    return list(pairs.values())


def _chance(answer: ClosureAnswer, drawn: tuple[Status | None, ...]) -> float:
    """Return the probability that a random status of `drawn`, reported at once, closes an episode correctly."""
    if answer.is_impossible:
        right: tuple[Status, ...] = answer.accepted
    else:
        right = ("success",) if answer.side == "already" else ()
    return sum(status in right for status in drawn) / len(drawn)


def _mean(chances: Sequence[float]) -> float:
    return round(100 * sum(chances) / len(chances), 1)
