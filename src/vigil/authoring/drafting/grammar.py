"""The grammar's table: the kinds of episodes of each family, and what proposes them in a house.

The kinds are also the strata that a pack is balanced over (`vigil.authoring.packing.assemble`).
"""

from collections.abc import Callable
from functools import partial
from typing import Literal

from vigil.authoring.drafting import constraints, leaves, proposals, sequences
from vigil.authoring.drafting.house_context import HouseContext
from vigil.authoring.drafting.proposals import Drafts
from vigil.episode import Family, Size
from vigil.goals import STATE_LABELS, StateLabel

Proposals = Callable[[HouseContext], Drafts]

_SIZES: tuple[Size, ...] = ("large", "medium", "small")
_LABELS: tuple[StateLabel, ...] = tuple(label for pair in STATE_LABELS.values() for label in pair)
_ACTS: tuple[Literal["open", "close", "turn_on", "turn_off", "pick"], ...] = (
    *("open", "close", "turn_on", "turn_off", "pick"),
)

GRAMMAR: dict[Family, dict[str, Proposals]] = {
    "PG": {size: partial(proposals.pointing, size=size) for size in _SIZES},
    "DA": {"approach": proposals.approaching},
    "VS": {
        "walk": partial(proposals.searching, by_turning=False),
        "turn": partial(proposals.searching, by_turning=True),
    },
    "SV": {label: partial(proposals.verifying, label=label) for label in _LABELS},
    "AI": {act: partial(proposals.acting, act=act) for act in _ACTS},
    "SI": {
        **{act: partial(proposals.seeking, act=act) for act in _ACTS},
        **{f"{act}_afar": partial(proposals.seeking, act=act, by_turning=False) for act in _ACTS},
    },
    "SM": {
        "reveal_pick": sequences.revealing,
        "put_into": sequences.putting_in,
        "rearrange": sequences.rearranging,
        "open_pick_place": sequences.emptying,
    },
    "CR": {
        "obstacle": constraints.in_the_way,
        "leaf": leaves.leaf_in_the_way,
        "swing": constraints.swing_blocked,
        "interlock": constraints.interlocked,
        "hand": constraints.full_handed,
    },
}
"""Family -> kind -> proposals."""
