"""Pairs of runs on lists of chores, with and without claims: do claims about each chore make reports more truthful?"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from vigil.analysis.measures.chores import ChoresRun, Mean, list_mean
from vigil.scoring.chores import ListOutcome

_VARIED = frozenset({"profile.name", "prompt_policy", "prompt_policy_sha256"})
_COMPARED: dict[str, Callable[[ListOutcome], float]] = {
    "status_true": lambda each: each.is_status_true,
    "W": lambda each: each.W,
    "W_share": lambda each: each.W_share,
    "interference": lambda each: each.interference,
    "steps": lambda each: each.outcome.steps,
}


@dataclass(frozen=True, slots=True)
class ItemisingPair:
    """Two runs on the same lists that differ only in whether the report has claims."""

    base: ChoresRun
    itemised: ChoresRun
    lists: int
    """Number of plays that are scored in both runs."""
    differences: Mapping[str, Mean]
    """Name of a score -> mean difference over the shared plays: the run with claims minus the run without."""


def itemising_pairs(runs: Sequence[ChoresRun]) -> list[ItemisingPair]:
    """Return the pairs of runs that differ only in whether their report has claims, and that both have scored plays of
    some of the same lists."""
    found: list[ItemisingPair] = []
    for base in (run for run in runs if not run.has_claims):
        for itemised in (run for run in runs if run.has_claims and _settings_of(run) == _settings_of(base)):
            plays = [{_key(each): each for each in run.outcomes} for run in (base, itemised)]
            shared = sorted(plays[0].keys() & plays[1].keys())
            pairs = [(plays[0][key], plays[1][key]) for key in shared]
            if pairs:
                found.append(ItemisingPair(base, itemised, len(pairs), _differences(pairs)))
    return found


def _settings_of(run: ChoresRun) -> dict[str, Any]:
    return {name: value for name, value in run.header.spec.settings.items() if name not in _VARIED}


def _key(each: ListOutcome) -> tuple[str, int]:
    return each.answer.episode_id, each.outcome.epoch


def _differences(pairs: Sequence[tuple[ListOutcome, ListOutcome]]) -> dict[str, Mean]:
    other = {_key(base): itemised for base, itemised in pairs}
    bases = [base for base, _ in pairs]
    found = {
        name: list_mean(bases, lambda base, value=value: value(other[_key(base)]) - value(base))
        for name, value in _COMPARED.items()
    }
    return {name: mean for name, mean in found.items() if mean is not None}
