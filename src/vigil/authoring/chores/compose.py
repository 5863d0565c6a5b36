"""Composition of lists: chores of one home that do not contradict each other, in an order that does not help agents."""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice
from math import hypot

import numpy as np
from scipy.spatial.distance import cdist

from vigil.authoring.chores.budgets import MARGIN_OF_ESTIMATES, likely_steps, max_solver_steps, puts_of
from vigil.authoring.chores.pairs import by_the_way_pairs, order_pairs
from vigil.authoring.chores.placements import absent, hidden, no_room, put, put_away
from vigil.authoring.chores.proposed import Proposals, ProposedChore, names_other_drawers
from vigil.authoring.chores.remembered import remembered
from vigil.authoring.chores.rules import LONGER
from vigil.authoring.chores.sentences import OPENINGS
from vigil.authoring.chores.states import (
    acts,
    blocked,
    broken,
    conditional,
    every_drawer,
    locked,
    make_sure,
    questions,
    refused,
)
from vigil.authoring.drafting.drafts import Rejection
from vigil.authoring.drafting.house_context import HouseContext, TaskSpec
from vigil.authoring.solving.chore_order import Entanglement, length_of
from vigil.authoring.solving.chores import BLOCKER, OBSTACLE, PLACE, plan_chores
from vigil.authoring.solving.macro_actions import Unsolvable
from vigil.base.geometry import Pose, Vec3
from vigil.base.numbered_list import write_list
from vigil.packs.pack import CHORES_BUDGETS, invalid_limit
from vigil.protocol.episode import MAX_INSTRUCTION_CHARS, Episode
from vigil.protocol.goals import Chore, ChorePart, Chores
from vigil.protocol.world import ObjectSetup, Setup
from vigil.scoring.chore_answers import CHORE_KINDS, ChoreKind
from vigil.scoring.closure import Reason

SOURCES: tuple[tuple[Callable[[HouseContext], Proposals], int], ...] = (
    (put, 16),
    (every_drawer, 2),
    (acts, 10),
    (make_sure, 12),
    (put_away, 2),
    (hidden, 8),
    (questions, 8),
    (conditional, 6),
    (refused, 4),
    (blocked, 4),
    (absent, 5),
    (broken, 4),
    (locked, 2),
    (no_room, 2),
)
"""Functions that propose single chores, each with the maximum number of its chores in one home."""
MAX_PAIRS_OF_HOME = 6
"""Maximum number of pairs of kind `order` in one home, and also of each of the other kinds of pairs."""
_FIRST: tuple[tuple[ChoreKind, ...], ...] = (("order", "by_the_way"),)
_REMEMBERED: tuple[tuple[ChoreKind, ...], ...] = (("conditional",),)
_HIDDEN: tuple[tuple[ChoreKind, ...], ...] = (("hidden",),)
_LONG = _HIDDEN + _REMEMBERED + _FIRST
_MOST = _HIDDEN + _REMEMBERED + (("by_the_way",),) + _REMEMBERED
BEGUN = {5: _HIDDEN, 6: _HIDDEN + _FIRST, 7: _LONG, 8: _LONG, 9: _MOST, 10: _HIDDEN + _MOST}
"""Number of chores of a list -> kinds of the groups that are chosen for it before any single chores; each is of the
rarest of its kinds."""
LONG_FROM, LONGEST_FROM = 7, 9
"""Minimum numbers of chores of a list whose conditional chores come in pairs, and of one that begins with a group of
three. Chores of such lists are spread over more rooms."""
MAX_IMPOSSIBLE_SHARE, MAX_KIND_SHARE = 0.34, 0.4
"""Maximum share of a list's chores that cannot be met, and maximum share of each other kind of chore."""
HANDICAPS: dict[Reason, int] = {"broken": 3}
"""Reason why a chore cannot be met -> number of chores that each other reason gets in a home before this one gets any.
Almost every home has things that can be broken, but few have any of the other reasons."""
MAX_PUTS = {9: 3, 10: 3}
"""Number of chores of a list -> maximum number of objects that it asks to put somewhere; 2 for shorter lists. With more
of them, many lists would take too long."""
NEAR_M = 4.0
"""Chores at most this far (m) from those chosen count as equally near. The start is at most this far from a chore."""
MAX_USES = 3
"""Maximum number of lists of one home that contain the same chore."""
TRIED_CHORES = 60
"""Maximum number of attempts to add chores to one list."""
TRIED_TEXT_ORDERS = 40
NO_START = "there is no start with room to move"
START_HORIZON_DEG = 15.0
ROLES = {"place": PLACE, "blocker": BLOCKER, "obstacle": OBSTACLE}
"""Role in a proposed chore -> pattern of the role's name in an episode, into which the chore's number is put."""
ENTANGLED: frozenset[ChoreKind] = frozenset({"plain", "already"})
"""Kinds of chores that may concern the same things as other chores of the list."""


@dataclass(frozen=True, slots=True)
class ListTask:
    """A composed list of chores, in the order of its text."""

    episode: Episode
    chores: tuple[ProposedChore, ...]
    entanglement: Entanglement
    faulty: set[ChorePart] = field(default_factory=set, compare=False, repr=False)
    """Goal parts of chores that broke a rule. All lists of the home share this set; later lists avoid these parts."""
    seen: set[Chore] = field(default_factory=set, compare=False, repr=False)
    """Chores of the home for which a place with a clear view was already found."""

    @property
    def instruction(self) -> str:
        """The instruction."""
        return self.episode.instruction


@dataclass
class HomePool:
    """The single chores and pairs that were proposed in a home, and how often lists have used each of them."""

    offers: Mapping[ChoreKind, Sequence[tuple[ProposedChore, ...]]]
    """Kind of chore -> the single chores or pairs from which a list can get a chore of this kind."""
    uses: Counter[int] = field(default_factory=Counter)
    """Python's id of a chore or pair -> number of lists that contain it."""
    of_kind: Counter[str] = field(default_factory=Counter)
    """Kind of chore, or reason why it cannot be met -> number of such chores in lists of the home."""
    faulty: set[ChorePart] = field(default_factory=set)
    """Goal parts of chores that broke a rule in a list."""
    seen: set[Chore] = field(default_factory=set)
    """Chores for which a place with a clear view was already found."""

    def rank_of(self, reason: Reason | None) -> int:
        """Return how late a chore that cannot be met for a reason is chosen: 0 for a chore that can be met."""
        return self.of_kind[reason] + HANDICAPS.get(reason, 0) if reason else 0


def pool_of(context: HouseContext) -> HomePool:
    """Return the chores that are proposed in a home."""
    found: dict[ChoreKind, list[tuple[ProposedChore, ...]]] = {kind: [] for kind in CHORE_KINDS}
    for source, most in SOURCES:
        for chore in islice(source(context), most):
            found[chore.kind].append((chore,))
    found["order"] += islice(order_pairs(context), MAX_PAIRS_OF_HOME)
    found["by_the_way"] += islice(by_the_way_pairs(context), MAX_PAIRS_OF_HOME)
    found["conditional"] += islice(remembered(context), MAX_PAIRS_OF_HOME)
    return HomePool(
        {
            kind: [each for each in offers if not any(names_other_drawers(context, chore) for chore in each)]
            for kind, offers in found.items()
        }
    )


def compositions(context: HouseContext, pool: HomePool, count: int) -> Iterator[ListTask | Rejection]:
    """Yield lists of `count` chores, and a rejection for each attempt that failed."""
    while True:
        chosen = _chosen(context, pool, count)
        found = "too few chores go together" if chosen is None else _composed(context, chosen[0])
        context.begin(Setup())
        if isinstance(found, str):
            yield Rejection(family="SI", kind=str(count), house=context.house.name, rule="composed", message=found)
            if chosen is None:
                return
            if found == NO_START:
                pool.faulty.update(part for each in chosen[0] if _moves(each) for part in each.chore.parts)
            continue
        pool.uses.update(chosen[1] if chosen else ())
        pool.of_kind.update(each for chore in found.chores for each in (chore.kind, chore.reason) if each)
        yield replace(found, faulty=pool.faulty, seen=pool.seen)


def _chosen(context: HouseContext, pool: HomePool, count: int) -> tuple[list[ProposedChore], list[int]] | None:
    """Return chores that can be in one list, preferring the least used, and the keys of `pool.uses` for them.

    None if there are too few.
    """
    chosen, used, kinds = list[ProposedChore](), list[int](), Counter[ChoreKind]()
    for number in range(TRIED_CHORES):
        if len(chosen) == count:
            return chosen, used
        begun = BEGUN.get(count, ())
        is_pair = number < len(begun)
        wanted = begun[number] if is_pair else CHORE_KINDS
        found = _next(context, pool, (chosen, kinds, count), wanted)
        if found is None and not is_pair:
            return None
        if found is not None:
            kind, chores = found
            chosen += chores
            kinds.update(_planned(kind, chores))
            used.append(id(chores))
    return None


def _planned(kind: ChoreKind, chores: Sequence[ProposedChore]) -> list[ChoreKind]:
    """Return the kinds that a single chore, or both chores of a pair, will have in a list."""
    return [kind] * len(chores) if kind == "order" else [*(each.kind for each in chores[:-1]), kind]


def _next(
    context: HouseContext,
    pool: HomePool,
    begun: tuple[Sequence[ProposedChore], Mapping[ChoreKind, int], int],
    wanted: Sequence[ChoreKind],
) -> tuple[ChoreKind, tuple[ProposedChore, ...]] | None:
    """Return a chore or pair that can be added to a list, preferring rare kinds and little used chores; or None.

    `begun` has the list's chores so far, their number by kind, and the final number of chores.
    """
    chosen, kinds, count = begun
    noise = context.rng.random(len(wanted)).tolist()
    uses = [pool.of_kind[kind] + 3 * kinds.get(kind, 0) for kind in wanted]
    for _, _, kind in sorted(zip(uses, noise, wanted, strict=True)):
        share = MAX_IMPOSSIBLE_SHARE if kind == "impossible" else MAX_KIND_SHARE
        offers = pool.offers[kind]
        offered = [offers[index] for index in context.rng.permutation(len(offers))]
        places = {id(each): _place(context, pool, each, (chosen, count)) for each in offered}
        for chores in sorted(offered, key=lambda each, places=places: places[id(each)]):
            number = _planned(kind, chores).count(kind)
            is_fit = len(chosen) + len(chores) <= count and kinds.get(kind, 0) + number <= max(number, share * count)
            parts, strictly = [part for each in chores for part in each.chore.parts], kind not in ENTANGLED
            can_be_done = pool.uses[id(chores)] < MAX_USES and pool.faulty.isdisjoint(parts)
            can_be_done &= _puts([*chosen, *chores]) <= MAX_PUTS.get(count, 2)
            if is_fit and can_be_done and all(_goes_with(each, chosen, strictly=strictly) for each in chores):
                return kind, chores
    return None


def _place(
    context: HouseContext,
    pool: HomePool,
    chores: tuple[ProposedChore, ...],
    begun: tuple[Sequence[ProposedChore], int],
) -> tuple[float, ...]:
    """Return the sort key of an offered chore or pair: which of those of its kind are tried first.

    `begun` has the list's chores so far, and the final number of chores. A long list prefers groups, in which a state
    has to be remembered, and chores in rooms that it does not have yet.
    """
    chosen, count = begun
    away = _away_m(context, chores, chosen)
    is_far, is_long = away > NEAR_M, count >= LONG_FROM
    has_group = any(each.kind != "hidden" for each in chosen)
    size = 1 if not is_long else 2 if has_group or count < LONGEST_FROM else 3
    here = _rooms(context, chosen) if is_long else set[str | None]()
    is_here = not is_far and is_long and _rooms(context, chores) <= here
    uses = pool.uses[id(chores)]
    return pool.rank_of(chores[0].reason), abs(len(chores) - size), is_far, is_here, uses, away if is_far else 0.0


def _rooms(context: HouseContext, chores: Sequence[ProposedChore]) -> set[str | None]:
    """Return the ids of the rooms of the things that chores are about."""
    items = context.items
    return {items[name].room_id for each in chores for name in each.chore.ids() if name in items}


def _away_m(context: HouseContext, chores: Sequence[ProposedChore], chosen: Sequence[ProposedChore]) -> float:
    """Return the greatest distance (m) of the chores' things from the nearest thing of those chosen; 0 without any."""
    here, there = (
        [context.thing(name).position for each in group for name in sorted(each.chore.ids())]
        for group in (chores, chosen)
    )
    return max((min(hypot(a.x - b.x, a.z - b.z) for b in there) for a in here), default=0.0) if there else 0.0


def _puts(chores: Sequence[ProposedChore]) -> int:
    """Return the number of objects that an agent has to put somewhere: none for chores that cannot be met."""
    return puts_of(each.chore for each in chores if each.reason is None)


def _moves(chore: ProposedChore) -> bool:
    """Return whether a chore's start moves something, which may bar the way."""
    return any(change.placement is not None for change in chore.changes.values())


def _goes_with(chore: ProposedChore, chosen: Sequence[ProposedChore], *, strictly: bool) -> bool:
    """Return whether a chore can be in a list with the chosen chores: they share only furniture to put things on.

    Unless `strictly`, they may also share a container or a machine, if both need it in the same state at the start.
    """
    for other in chosen:
        shared = chore.ids & other.ids
        furniture = (chore.receptacle_ids & other.receptacle_ids) - {*chore.changes, *other.changes}
        if shared <= furniture:
            continue
        if strictly or other.kind not in ENTANGLED or chore.sentence == other.sentence:
            return False
        moved = {part.object_id for each in (chore, other) for part in each.chore.parts}
        if len(moved) < len(chore.chore.parts) + len(other.chore.parts):
            return False
        if any(chore.changes.get(each) != other.changes.get(each) for each in shared):
            return False
    return True


def merged(chores: Sequence[ProposedChore]) -> Setup:
    """Return the setup of a list, which has the changes of all its chores."""
    objects: dict[str, ObjectSetup] = {}
    for chore in chores:
        objects |= chore.changes
    return Setup(objects=objects)


def _composed(context: HouseContext, chosen: Sequence[ProposedChore]) -> ListTask | str:
    """Return the list of the chosen chores, or the reason why they do not make a list."""
    setup = merged(chosen)
    if not context.can_begin(setup):
        return "the simulator cannot set up the start"
    start = _start(context, [context.view.scene.things[name].position for each in chosen for name in each.chore.ids()])
    if start is None:
        return NO_START
    context.simulator.reset(start, context.with_open_doors(setup))
    return _in_text_order(context, chosen, start, setup)


def _start(context: HouseContext, things: Sequence[Vec3]) -> Pose | None:
    """Return a random start pose with room to move, near one of the things; None if none is found."""
    near = np.array([(each.x, each.z) for each in things])
    for place in context.starts(lambda cells: cdist(cells, near).min(axis=1) <= NEAR_M):
        heading = float(context.rng.integers(360))
        pose = Pose(position=place, rotation=heading, horizon=START_HORIZON_DEG)
        if context.has_room_to_move(pose):
            return pose
    return None


def _in_text_order(context: HouseContext, chosen: Sequence[ProposedChore], start: Pose, setup: Setup) -> ListTask | str:
    """Return the list with its chores in a random order in the text, or the reason why no order fits.

    So that the order of the text does not help agents, it must be wrong for at least half of the pairs of chores that
    undo one another, and a walk in this order must be clearly longer than the shortest walk. The simulator must have
    just been reset to the list's start.
    """
    draft = _draft(context, chosen, start, setup)
    if draft is None:
        return "the instruction is too long"
    try:
        plan = plan_chores(draft, context.view, {place for place, each in enumerate(chosen) if each.reason})
    except Unsolvable as error:
        return str(error)
    most = max_solver_steps(len(context.view.scene.rooms)) - MARGIN_OF_ESTIMATES
    if likely_steps(plan.walk_m, _puts(chosen)) > most:
        return "the walk is too long"
    found = plan.entanglement
    entangled = {place for pair in found.before for place in pair} | {place for place, _ in found.by_the_way}
    if any(chosen[place].kind in ("question", "conditional") for place in entangled):
        return "another chore undoes or does what a question or a condition is about"
    for _ in range(TRIED_TEXT_ORDERS):
        text = [int(place) for place in context.rng.permutation(len(chosen))]
        places = {place: number for number, place in enumerate(text)}
        before = frozenset((places[a], places[b]) for a, b in found.before)
        broken = sum(a > b for a, b in before)
        is_long = length_of(plan.lengths, text) >= LONGER * plan.walk_m
        if 2 * broken >= len(before) and (broken or not before) and is_long:
            in_text = [chosen[place] for place in text]
            moved = Entanglement(before, frozenset((places[a], places[b]) for a, b in found.by_the_way))
            episode = _draft(context, in_text, start, setup)
            assert episode is not None
            return ListTask(episode, _with_kinds(in_text, moved), moved)
    return "every order of the text is almost the shortest one, or works"


def _with_kinds(chores: Sequence[ProposedChore], found: Entanglement) -> tuple[ProposedChore, ...]:
    """Return the chores with their kinds in the list: `order` or `by_the_way` if another chore undoes or does them."""
    ordered = {place for pair in found.before for place in pair}
    done = {place for place, _ in found.by_the_way}
    return tuple(
        replace(chore, kind="order", form=f"order_{chore.form}")
        if place in ordered
        else replace(chore, kind="by_the_way")
        if place in done
        else chore
        for place, chore in enumerate(chores)
    )


def _draft(context: HouseContext, chores: Sequence[ProposedChore], start: Pose, setup: Setup) -> Episode | None:
    """Return the episode of chores, in text order and with the largest budget; None if its text is too long."""
    sentences = [chore.sentence for chore in chores]
    text = write_list(context.say(OPENINGS), sentences)
    if len(text) > MAX_INSTRUCTION_CHARS:
        return None
    goal = Chores(object_id=chores[0].chore.parts[0].object_id, chores=tuple(each.chore for each in chores))
    bindings = {"target": goal.object_id}
    for number, chore in enumerate(chores, start=1):
        bindings |= {ROLES[role].format(number): object_id for role, object_id in chore.roles.items()}
        if chore.distractor is not None:
            bindings[f"distractor_{number}"] = chore.distractor
    task = TaskSpec(start, text, goal, bindings, setup=setup, template="chores")
    draft = context.draft("SI", task)
    most = CHORES_BUDGETS[1]
    return draft.model_copy(update={"instruction": text, "max_steps": most, "max_invalid": invalid_limit(most)})
