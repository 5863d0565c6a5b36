"""The suites of episodes besides the families: how their drafts are made, and what their packs hold."""

from collections.abc import Iterable
from dataclasses import dataclass
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import AfterValidator

from vigil.base.exported import loaded
from vigil.packs.freeze import dump_rows
from vigil.packs.pack import ANSWERS, CHORE_ANSWERS, CHORES_SUITE
from vigil.protocol.goals import MAX_CHORES, MIN_CHORES
from vigil.scoring.chore_answers import ListAnswer, list_kind
from vigil.scoring.closure import KINDS, SUITE, ClosureAnswer

if TYPE_CHECKING:
    from vigil.authoring.drafting.generation import Grammar

SuiteName = Literal["closure", "chores"]


@dataclass(frozen=True, slots=True)
class Suite:
    """A suite of episodes."""

    name: SuiteName
    grammar_place: str
    """Where the grammar is, as "module:name". It is loaded at its first use, because it imports much code."""
    kinds: tuple[str, ...]
    """Kinds of tasks. A pack has a certain number of tasks of each kind."""
    houses: tuple[str, ...]
    """Specs of the houses that `mixed` stands for."""
    description: str
    """Description of a pack for which the user gave none."""
    answers: str
    """File with the answers of a pack."""
    facts_place: str
    """Where the function is that takes a pack's answers and returns the manifest's entries about them."""

    @property
    def grammar(self) -> "Grammar":
        """The grammar that makes the suite's drafts."""
        return resolve_name(self.grammar_place)

    def contents(self, answers: Iterable[ClosureAnswer | ListAnswer]) -> tuple[dict[str, Any], dict[str, bytes]]:
        """Return the manifest's entries about the suite, and the files of the suite, for a pack with these answers."""
        ordered = sorted(answers, key=lambda answer: answer.episode_id)
        return {"suite": self.name, **loaded(self.facts_place)(ordered)}, {self.answers: dump_rows(ordered)}


SUITES: dict[SuiteName, Suite] = {
    suite.name: suite
    for suite in (
        Suite(
            SUITE,
            "vigil.authoring.closure.generation:CLOSURE_GRAMMAR",
            KINDS,
            ("2", "kitchen", "2", "bedroom", "2", "living-room"),
            "Closure stress: reaching is easy, knowing is hard; the measure is C.",
            ANSWERS,
            "vigil.authoring.closure.guessing:closure_facts",
        ),
        Suite(
            CHORES_SUITE,
            "vigil.authoring.chores.generation:CHORES_GRAMMAR",
            tuple(list_kind(count) for count in range(MIN_CHORES, MAX_CHORES + 1)),
            ("3", "4", "5", "6", "3", "7", "4", "8", "5", "3", "6", "9", "4", "10", "5"),
            "Lists of chores: many goals, some of which cannot be met, and a claim for each.",
            CHORE_ANSWERS,
            "vigil.authoring.chores.measures:chore_facts",
        ),
    )
}
"""Name -> suite."""


KINDS_IN_WORDS = "; ".join(f"{name}: {', '.join(suite.kinds)}" for name, suite in SUITES.items())
"""The kinds of each suite, for help texts."""


def suite_of_kind(kind: str) -> SuiteName:
    """Return the name of the suite to which a kind of tasks belongs. Raises ValueError for an unknown kind."""
    for name, suite in SUITES.items():
        if kind in suite.kinds:
            return name
    raise ValueError(f"there is no kind {kind!r}; the kinds are {KINDS_IN_WORDS}")


def _checked_kind(kind: str) -> str:
    suite_of_kind(kind)
    return kind


TaskKind = Annotated[str, AfterValidator(_checked_kind)]
"""Kind of tasks of a suite."""
