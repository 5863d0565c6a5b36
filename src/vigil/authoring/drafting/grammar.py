"""The grammar's table: the kinds of episodes of each family, and what proposes them in a house.

The kinds are also the strata that a pack is balanced over (`vigil.authoring.packing.assemble`).
"""

from collections.abc import Callable
from functools import partial
from typing import Literal

from vigil.authoring.drafting import (
    chains,
    constraints,
    hidden_targets,
    leaves,
    look_alike_targets,
    proposals,
    sequences,
)
from vigil.authoring.drafting.house_context import HouseContext
from vigil.authoring.drafting.implicit_constraint_drafts import with_implicit_constraint
from vigil.authoring.drafting.proposals import Drafts
from vigil.authoring.language.implicit_constraints import implicit_kind
from vigil.authoring.review.rules import INSIDE_TEMPLATE, LOOK_ALIKE_TEMPLATE
from vigil.protocol.episode import Family, TargetSize
from vigil.protocol.goals import STATE_LABELS, StateLabel

Proposals = Callable[[HouseContext], Drafts]

_SIZES: tuple[TargetSize, ...] = ("large", "medium", "small")
_LABELS: tuple[StateLabel, ...] = tuple(label for pair in STATE_LABELS.values() for label in pair)
_ACTS: tuple[Literal["open", "close", "turn_on", "turn_off", "pick"], ...] = (
    *("open", "close", "turn_on", "turn_off", "pick"),
)

_TOLD: dict[str, Proposals] = {
    "obstacle": constraints.obstacle_blocked,
    "leaf": leaves.leaf_in_the_way,
    "swing": constraints.swing_blocked,
    "interlock": constraints.interlocked,
    "hand": constraints.hand_full,
}

GRAMMAR: dict[Family, dict[str, Proposals]] = {
    "PG": {
        **{size: partial(proposals.pointing, size=size) for size in _SIZES},
        LOOK_ALIKE_TEMPLATE: look_alike_targets.pointing_among_look_alikes,
    },
    "DA": {"approach": proposals.approaching, LOOK_ALIKE_TEMPLATE: look_alike_targets.approaching_among_look_alikes},
    "VS": {
        "walk": partial(proposals.searching, by_turning=False),
        "turn": partial(proposals.searching, by_turning=True),
        LOOK_ALIKE_TEMPLATE: look_alike_targets.searching_among_look_alikes,
    },
    "SV": {label: partial(proposals.verifying, label=label) for label in _LABELS},
    "AI": {
        **{act: partial(proposals.acting, act=act) for act in _ACTS},
        LOOK_ALIKE_TEMPLATE: look_alike_targets.acting_among_look_alikes,
    },
    "SI": {
        **{act: partial(proposals.seeking, act=act) for act in _ACTS},
        **{f"{act}_afar": partial(proposals.seeking, act=act, by_turning=False) for act in _ACTS},
        INSIDE_TEMPLATE: hidden_targets.picking_from_inside,
        LOOK_ALIKE_TEMPLATE: look_alike_targets.seeking_among_look_alikes,
    },
    "SM": {
        "reveal_pick": sequences.revealing,
        "put_into": sequences.putting_in,
        "rearrange": sequences.rearranging,
        "open_pick_place": sequences.emptying,
        "two_to_one": chains.two_to_one,
        "put_and_close": chains.put_and_close,
        "take_and_close": chains.take_and_close,
        "swap": chains.swapping,
        "out_of_into": chains.from_one_into_another,
        "three_acts": chains.three_acts,
    },
    "CR": {**_TOLD, **{implicit_kind(kind): with_implicit_constraint(told) for kind, told in _TOLD.items()}},
}
"""Family -> kind -> proposals."""
