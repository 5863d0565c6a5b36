"""Statistics of a pack's solutions: their lengths and the skills that they use."""

from collections import Counter
from collections.abc import Callable
from typing import TypeVar

from vigil.packs.pack import Pack
from vigil.protocol.episode import Solution
from vigil.protocol.families import FAMILIES, Family

_Value = TypeVar("_Value")


def steps_of(pack: Pack) -> dict[Family, dict[str, float]]:
    """Return for each family the mean and the maximum number of steps of its solutions, and its step budget."""
    lengths = _by_family(pack, lambda solution: len(solution.actions))
    return {
        family: {
            "mean": round(sum(steps) / len(steps), 2),
            "max": max(steps),
            "budget": FAMILIES[family].max_steps,
        }
        for family, steps in lengths.items()
    }


def skill_shares(pack: Pack) -> dict[Family, dict[str, float]]:
    """Return family -> skill -> share of the family's episodes whose solution uses the skill."""
    used = _by_family(pack, lambda solution: {action.skill_name for action in solution.actions})
    found: dict[Family, dict[str, float]] = {}
    for family, sets in used.items():
        counts = Counter(skill for skills in sets for skill in skills)
        found[family] = {skill: round(counts[skill] / len(sets), 4) for skill in sorted(counts)}
    return found


def _by_family(pack: Pack, value_of: Callable[[Solution], _Value]) -> dict[Family, list[_Value]]:
    """Return family -> the values of `value_of` for its solutions, in the usual order of families."""
    found: dict[Family, list[_Value]] = {family: [] for family in FAMILIES}
    for episode in pack.episodes:
        found[episode.family].append(value_of(pack.solutions[episode.id]))
    return {family: listed for family, listed in found.items() if listed}
