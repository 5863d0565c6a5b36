"""Description of a kind of the closure-stress suite: the facts that scoring, authoring and tests need."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True, slots=True, kw_only=True)
class ClosureKind:
    """A kind of tasks. A task is one episode, or two twins (a pair of episodes whose houses differ in one object).

    A field for a function holds the function itself or its name "package.module:function", which is loaded at first
    use.
    """

    name: str
    position: int
    """Position in tables, counted from 1."""
    tasks: str | Callable[..., Any]
    """Function that yields tasks, or the reasons why proposed tasks were rejected, for a `HouseContext`."""
    sides: tuple[str, ...] = ()
    """Names of the two sides (twins), e.g. `possible` and `impossible`; empty without twins. The first side satisfies
    the families' rules."""
    may_hold_at_reset: bool = False
    """Whether the goal, or a part of it, may already hold at the reset."""
    has_branches: bool = False
    """Whether the two sides require different acts, so that twins have different goals."""
    forms_of_many: frozenset[str] = frozenset()
    """Forms whose evidence is in several places, so that no single view shows all the evidence."""
    unnamed_roles: frozenset[str] = frozenset()
    """Roles of objects that an episode records but its instruction does not name."""
    exempt: Mapping[str, frozenset[str]] = field(default_factory=dict[str, frozenset[str]])
    """Form -> names of the families' rules that episodes of this form break on purpose. If the kind does not have
    forms, the key is a template. The key "" is for all forms and templates that are not listed.

    If the rule `protocol` is listed, the episodes must still pass the checks of `protocol_faults` for packs of the
    suite.
    """
    faults: str | Callable[..., Any] | None = None
    """Function that yields (rule, message) for each rule that only this kind has and that an episode breaks.

    None if the kind does not have such rules. The arguments of the function are a `PrivilegedView` at the episode's
    start, the task, the episode, and the actions that solve the episode.
    """

    def exempt_of(self, form: str, template: str) -> frozenset[str]:
        """Return the families' rules that an episode may break, by its form or, if it has no form, its template."""
        return self.exempt.get(form or template, self.exempt.get("", frozenset()))
