"""The grammar's table: the kinds of episodes of each family, and what proposes them in a house.

The kinds are also the strata that a pack is balanced over (`vigil.authoring.assemble`).
"""

from collections.abc import Callable
from functools import partial
from typing import Literal

from vigil.authoring import constraints, leaves, propose, sequences
from vigil.authoring.propose import Drafts
from vigil.authoring.workshop import Workshop
from vigil.episode import Family, Size

Proposals = Callable[[Workshop], Drafts]

_SIZES: tuple[Size, ...] = ("large", "medium", "small")
_LABELS: tuple[propose.Label, ...] = ("on", "off", "open", "closed")
_ACTS: tuple[Literal["open", "close", "turn_on", "turn_off", "pick"], ...] = (
    *("open", "close", "turn_on", "turn_off", "pick"),
)

GRAMMAR: dict[Family, dict[str, Proposals]] = {
    "PG": {size: partial(propose.pointing, size=size) for size in _SIZES},
    "DA": {"approach": propose.approaching},
    "VS": {
        "walk": partial(propose.searching, by_turning=False),
        "turn": partial(propose.searching, by_turning=True),
    },
    "SV": {label: partial(propose.verifying, label=label) for label in _LABELS},
    "AI": {act: partial(propose.acting, act=act) for act in _ACTS},
    "SI": {
        **{act: partial(propose.seeking, act=act) for act in _ACTS},
        **{f"{act}_afar": partial(propose.seeking, act=act, by_turning=False) for act in _ACTS},
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
