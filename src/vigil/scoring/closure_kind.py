"""What describes a kind of the closure-stress suite: what scoring, authoring and tests know of its episodes."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True, slots=True, kw_only=True)
class ClosureKind:
    """A kind of tasks: one episode each, or two twins that differ in one thing.

    Functions are given by their names "package.module:function", loaded when they are needed, or as they are.
    """

    name: str
    position: int
    """Place in tables, from 1."""
    tasks: str | Callable[..., Any]
    """Function from a `HouseContext` to tasks and rejections."""
    sides: tuple[str, ...] = ()
    """Names of the sides of twins, the one that satisfies the families' rules first; empty without twins."""
    may_hold_at_reset: bool = False
    """Whether the goal, or parts of it, may hold from the start."""
    has_branches: bool = False
    """Whether each side asks for an act of its own, so that twins have different goals."""
    forms_of_many: frozenset[str] = frozenset()
    """Forms whose evidence is in several places, so that one view does not show it all."""
    unnamed_roles: frozenset[str] = frozenset()
    """Roles of objects that an episode records but its instruction does not name."""
    exempt: Mapping[str, frozenset[str]] = field(default_factory=dict[str, frozenset[str]])
    """Form, or template where there are no forms -> rules of the families that it breaks on purpose; "" for all others.

    `protocol` is checked as for a suite.
    """
    faults: str | Callable[..., Any] | None = None
    """Function that yields (rule, message) for each fault of a side under the rules that only this kind has.

    None if the kind has no rules of its own.

    Its arguments are a `PrivilegedView` at the side's start, the task, the episode, and the actions that solve it.
    """

    def exempt_of(self, form: str, template: str) -> frozenset[str]:
        """Return the rules of the families that an episode of a form, or without one of a template, may break."""
        return self.exempt.get(form or template, self.exempt.get("", frozenset()))
