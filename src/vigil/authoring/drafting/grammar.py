"""The kinds of episodes of each family, with the functions that draft them in a house."""

from collections.abc import Callable
from functools import partial
from pkgutil import resolve_name
from typing import Any

from vigil.authoring.drafting.house_context import HouseContext
from vigil.authoring.drafting.proposals import Drafts
from vigil.protocol.families import FAMILIES, Family
from vigil.protocol.family import DraftKind

Proposals = Callable[[HouseContext], Drafts]


def kinds_of(family: Family) -> dict[str, Proposals]:
    """Return the kinds of a family with what drafts them; empty for a registered family that nothing drafts."""
    return {name: _proposals(kind) for name, kind in FAMILIES[family].kinds.items()}


def _proposals(kind: DraftKind) -> Proposals:
    function: Callable[..., Drafts] = resolve_name(kind.drafts) if isinstance(kind.drafts, str) else kind.drafts
    arguments: dict[str, Any] = {
        name: _proposals(value) if isinstance(value, DraftKind) else value for name, value in kind.arguments.items()
    }
    return partial(function, **arguments) if arguments else function


for _family in FAMILIES:
    kinds_of(_family)  # a name that does not exist fails here, and not in the middle of a pack
