"""The suites of episodes besides the families: how their drafts are made, and what their packs hold."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import AfterValidator

from vigil.authoring.chores.generation import CHORES_GRAMMAR, LIST_KINDS
from vigil.authoring.chores.measures import chore_facts
from vigil.authoring.closure.generation import CLOSURE_GRAMMAR
from vigil.authoring.closure.guessing import guessing, kind_counts
from vigil.authoring.drafting.generation import Grammar
from vigil.packs.pack import ANSWERS, CHORE_ANSWERS, CHORES_SUITE
from vigil.scoring.closure import KINDS, SUITE, ClosureAnswer, check_pairs

SuiteName = Literal["closure", "chores"]


@dataclass(frozen=True, slots=True)
class Suite:
    """A suite of episodes."""

    name: SuiteName
    grammar: Grammar
    kinds: tuple[str, ...]
    """Kinds of tasks, of which a pack holds a number each."""
    houses: tuple[str, ...]
    """Specs of the houses that `mixed` stands for."""
    description: str
    """Description of a pack without one of its own."""
    answers: str
    """File with the answers of a pack."""
    facts: Callable[[Sequence[Any]], dict[str, Any]]
    """Function from a pack's answers to its manifest's entries about the suite."""


def _closure_facts(answers: Sequence[ClosureAnswer]) -> dict[str, Any]:
    check_pairs(answers)
    return {"blind": guessing(answers), "kinds": kind_counts(answers)}


SUITES: dict[SuiteName, Suite] = {
    suite.name: suite
    for suite in (
        Suite(
            SUITE,
            CLOSURE_GRAMMAR,
            KINDS,
            ("2", "kitchen", "2", "bedroom", "2", "living-room"),
            "Closure stress: reaching is easy, knowing is hard; the measure is C.",
            ANSWERS,
            _closure_facts,
        ),
        Suite(
            CHORES_SUITE,
            CHORES_GRAMMAR,
            LIST_KINDS,
            ("3", "4", "5", "6", "3", "7", "4", "8", "5", "3", "6", "9", "4", "10", "5"),
            "Lists of chores: many goals, some of which cannot be met, and a claim for each.",
            CHORE_ANSWERS,
            chore_facts,
        ),
    )
}
"""Name -> suite."""


KINDS_IN_WORDS = "; ".join(f"{name}: {', '.join(suite.kinds)}" for name, suite in SUITES.items())
"""The kinds of each suite, for help texts."""


def suite_of_kind(kind: str) -> SuiteName:
    """Return the name of the suite to which a kind of tasks belongs. Raises ValueError for another name."""
    for name, suite in SUITES.items():
        if kind in suite.kinds:
            return name
    raise ValueError(f"there is no kind {kind!r}; the kinds are {KINDS_IN_WORDS}")


def _checked_kind(kind: str) -> str:
    suite_of_kind(kind)
    return kind


TaskKind = Annotated[str, AfterValidator(_checked_kind)]
"""Kind of tasks of a suite."""
