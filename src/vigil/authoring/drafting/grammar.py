"""The grammar: the kinds of episodes of each family, with the functions that propose them in a house.

A pack is balanced over these kinds, too (`vigil.authoring.packing.selection`).
"""

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

from vigil.authoring.drafting.house_context import HouseContext
from vigil.base.exported import loaded
from vigil.protocol.families import FAMILIES, Family
from vigil.protocol.family import DraftKind

Proposals = Callable[[HouseContext], Iterator[Any]]


def kinds_of(family: Family) -> dict[str, Proposals]:
    """Return kind -> the function that proposes episodes of this kind; empty for a registered family without kinds."""
    return {name: _proposals(kind) for name, kind in FAMILIES[family].kinds.items()}


def _proposals(kind: DraftKind) -> Proposals:
    function = loaded(kind.drafts)
    arguments: dict[str, Any] = {
        name: _proposals(value) if isinstance(value, DraftKind) else value for name, value in kind.arguments.items()
    }
    return partial(function, **arguments) if arguments else function


for _family in FAMILIES:
    kinds_of(_family)  # so that the name of a function that does not exist fails at import
