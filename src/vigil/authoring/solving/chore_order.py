"""Order of chores: which chores of a list do or undo one another, and which possible order has the shortest walk.

The simulator is not used to try orders. Chores that concern the same things are tried in all orders on a model with a
few facts (`ChoreModel`). The shortest walk in a possible order is then found by dynamic programming over sets of
chores.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import permutations

import numpy as np

from vigil.assets.catalog import CATALOG
from vigil.authoring.solving.privileged_view import PrivilegedView
from vigil.base.geometry import Box
from vigil.protocol.actions import REACH_M
from vigil.protocol.goals import (
    STRICTLY_CLOSED,
    STRICTLY_OPEN,
    Chore,
    ChorePart,
    ObjectAtReceptacle,
    ObjectInState,
    ReportStatus,
)
from vigil.scene.floor import WalkableMap
from vigil.scene.geometry import body_box, box_distances
from vigil.scene.supports import furniture_of, surface_named
from vigil.scene.things import Scene, Thing

MAX_ENTANGLED = 6
"""Maximum number of chores that concern the same things; trying all orders of more chores would take too long."""
TOUR_CELL_M, FAR_M = 0.2, 1000.0
"""Size (m) of the cells on which walks between chores are measured, and length (m) of a walk to unreachable things."""
Fact = tuple[str, str]
"""A changeable fact: "open", "on" or "at", with the id of the thing."""
Facts = Mapping[Fact, object]


class Refused(Exception):
    """Error for an act that the simulator would refuse while the given facts hold."""


class ChoreModel:
    """The facts about a scene's things that chores change, and the acts that change them."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self.initial: Facts = dict(self._facts())
        """The facts in the scene's current state."""

    def _facts(self) -> Iterator[tuple[Fact, object]]:
        for thing in self._scene.things.values():
            if not thing.is_present:
                continue
            if thing.is_openable:
                yield ("open", thing.id), _openness(thing)
            if thing.is_toggleable:
                yield ("on", thing.id), thing.is_toggled
            if thing.is_pickupable:
                surface = surface_named(self._scene.things.get(thing.parent or "", thing), thing.surface)
                yield ("at", thing.id), (thing.parent, surface is not None and surface.is_inside)

    def holds(self, part: ChorePart, facts: Facts) -> bool:
        """Return whether a part of a chore holds; a part that is a question always holds."""
        if isinstance(part, ReportStatus):
            return True
        if isinstance(part, ObjectAtReceptacle):
            return facts.get(("at", part.object_id)) == (part.receptacle_id, part.inside)
        name, value = ("open", "open" if part.value else "closed") if part.state == "is_open" else ("on", part.value)
        return facts.get((name, part.object_id)) == value

    def is_done(self, chore: Chore, facts: Facts) -> bool:
        """Return whether all parts of a chore hold."""
        return all(self.holds(part, facts) for part in chore.parts)

    def after(self, chore: Chore, facts: Facts) -> Facts:
        """Return the facts after a chore was done. Raises Refused."""
        changed = dict(facts)
        for part in sorted(chore.parts, key=lambda part: isinstance(part, ObjectInState)):  # places come first
            if not self.holds(part, changed):
                self._do(part, changed)
        return changed

    def _do(self, part: ChorePart, facts: dict[Fact, object]) -> None:
        """Change the facts so that a part of a chore holds. Raises Refused."""
        if isinstance(part, ObjectAtReceptacle):
            if any(fact[0] == "at" and isinstance(at, tuple) and at[0] == part.object_id for fact, at in facts.items()):
                raise Refused(part.object_id)
            self._open_around(part.object_id, facts)
            if part.inside:
                self._open(part.receptacle_id, facts)
            facts["at", part.object_id] = (part.receptacle_id, part.inside)
        elif isinstance(part, ObjectInState) and part.state == "is_open":
            if part.value:
                self._open(part.object_id, facts)
            else:
                facts["open", part.object_id] = "closed"
        elif isinstance(part, ObjectInState):
            if part.value and self._is_interlocked(part.object_id):
                facts["open", part.object_id] = "closed"
            facts["on", part.object_id] = part.value

    def _open_around(self, thing_id: str, facts: dict[Fact, object]) -> None:
        """Open the closed containers in which a thing lies."""
        at = facts.get(("at", thing_id))
        while isinstance(at, tuple) and at[0] is not None:
            parent, is_inside = at
            container = self._scene.things[parent]
            if is_inside and ("open", parent) in facts:
                self._open(parent, facts)
            below = furniture_of(self._scene, container)
            at = facts.get(("at", parent if below is None else below.id))

    def _open(self, thing_id: str, facts: dict[Fact, object]) -> None:
        if ("open", thing_id) in facts:
            if self._is_interlocked(thing_id):
                facts["on", thing_id] = False
            facts["open", thing_id] = "open"

    def _is_interlocked(self, thing_id: str) -> bool:
        return CATALOG[self._scene.things[thing_id].category].runs_only_when_closed


def _openness(thing: Thing) -> str:
    if thing.openness >= STRICTLY_OPEN:
        return "open"
    return "closed" if thing.openness <= STRICTLY_CLOSED else "partly open"


@dataclass(frozen=True, slots=True)
class Entanglement:
    """Which chores of a list do or undo one another."""

    before: frozenset[tuple[int, int]]
    """Pairs of indices in the list: the first chore must be done before the second, because it undoes the second."""
    by_the_way: frozenset[tuple[int, int]]
    """Pairs (a, b) of indices: chore a does not hold at the start, but holds once chore b is done."""


def entanglement(model: ChoreModel, chores: Sequence[Chore], doable: Sequence[int]) -> Entanglement | None:
    """Return which of the chores with the indices `doable` do or undo one another; None if no order does them all."""
    before: set[tuple[int, int]] = set()
    by_the_way: set[tuple[int, int]] = set()
    for group in _groups(model, chores, doable):
        if len(group) > MAX_ENTANGLED:
            return None
        orders = [order for order in permutations(group) if _does_all(model, chores, order)]
        if not orders:
            return None
        pairs = permutations(group, 2)
        before |= {(a, b) for a, b in pairs if all(order.index(a) < order.index(b) for order in orders)}
        by_the_way |= set(_done_by_others(model, chores, group))
    return Entanglement(frozenset(before), frozenset(by_the_way))


def _groups(model: ChoreModel, chores: Sequence[Chore], doable: Sequence[int]) -> list[list[int]]:
    """Return the indices of chores, grouped so that chores of two groups have no thing in common."""
    groups: list[tuple[set[str], list[int]]] = []
    for place in doable:
        ids, members = _concerned(model, chores[place]), [place]
        for other in [each for each in groups if each[0] & ids]:
            groups.remove(other)
            ids, members = ids | other[0], [*other[1], *members]
        groups.append((ids, members))
    return [sorted(members) for _, members in groups]


def _concerned(model: ChoreModel, chore: Chore) -> set[str]:
    """Return the ids of the things that a chore needs or changes, including the closed containers around its objects.

    A receptacle on which something is only put is left out, unless the receptacle can be moved.
    """
    found: set[str] = set()
    for part in chore.parts:
        found.add(part.object_id)
        if isinstance(part, ObjectAtReceptacle):
            found.add(part.receptacle_id)
            at = model.initial.get(("at", part.object_id))
            if isinstance(at, tuple) and at[0] is not None:
                found.add(at[0])
    return {each for each in found if any((name, each) in model.initial for name in ("open", "on", "at"))}


def _does_all(model: ChoreModel, chores: Sequence[Chore], order: Sequence[int]) -> bool:
    """Return whether all chores hold if they are done in this order. States that questions ask for must not change."""
    facts = model.initial
    asked = [_queried(chores[place].question) for place in order]
    for place in order:
        try:
            facts = model.after(chores[place], facts)
        except Refused:
            return False
        if any(fact is not None and facts.get(fact) != model.initial.get(fact) for fact in asked):
            return False
    return all(model.is_done(chores[place], facts) for place in order)


def _queried(question: ReportStatus | None) -> Fact | None:
    if question is None:
        return None
    return ("open" if question.state == "is_open" else "on"), question.object_id


def _done_by_others(model: ChoreModel, chores: Sequence[Chore], group: Sequence[int]) -> Iterator[tuple[int, int]]:
    """Yield pairs (a, b) of indices: chore a does not hold at the start, but holds once chore b is done."""
    for place in group:
        if model.is_done(chores[place], model.initial):
            continue
        for other in group:
            try:
                if other != place and model.is_done(chores[place], model.after(chores[other], model.initial)):
                    yield place, other
            except Refused:
                continue


def shortest_order(lengths: np.ndarray, before: frozenset[tuple[int, int]]) -> tuple[list[int], float]:
    """Return the order of n chores with the shortest walk, and its length (m).

    Row i of `lengths` (n + 1, n) has the walks from the end of chore i to each chore; the last row has those from the
    start. For each pair in `before`, the first chore comes before the second.
    """
    count = lengths.shape[1]
    first = [sum(1 << a for a, b in before if b == place) for place in range(count)]
    best: dict[tuple[int, int], tuple[float, int]] = {(0, count): (0.0, -1)}
    layer = [(0, count)]
    for _ in range(count):
        following: dict[tuple[int, int], tuple[float, int]] = {}
        for done, last in layer:
            walked = best[done, last][0]
            for place in range(count):
                if done >> place & 1 or first[place] & ~done:
                    continue
                key, length = (done | 1 << place, place), walked + float(lengths[last, place])
                if key not in following or length < following[key][0]:
                    following[key] = length, last
        best |= following
        layer = list(following)
    key = min(layer, key=lambda each: (best[each][0], each))
    length, order = best[key][0], list[int]()
    while key[0]:
        order.append(key[1])
        key = key[0] & ~(1 << key[1]), best[key][1]
    return order[::-1], length


def length_of(lengths: np.ndarray, order: Sequence[int]) -> float:
    """Return the length (m) of the walk through chores in an order; `lengths` as for `shortest_order`."""
    stops = [lengths.shape[1], *order]
    return sum(float(lengths[a, b]) for a, b in zip(stops, order, strict=False))


def walk_lengths(view: PrivilegedView, stops: Sequence[tuple[str, str]]) -> np.ndarray:
    """Return the lengths (n + 1, n) in metres of the walks between chores, as `shortest_order` needs them.

    `stops` are the ids of the things at which each chore begins and ends. Walks are measured on a coarse grid. A walk
    to a thing ends at a reachable place within reach of the thing; if there is none, at the nearest reachable place.
    """
    things, plan = view.scene.things, view.plan()
    coarse = WalkableMap(plan.roomy, plan.tight, TOUR_CELL_M)
    cells, here = coarse.cells, view.agent.position
    from_start = coarse.walks_from((here.x, here.z)).lengths
    reachable = np.isfinite(from_start)
    near = {each: _near(body_box(things[each]), cells, reachable) for pair in stops for each in pair}

    def row(lengths: np.ndarray) -> list[float]:
        return [float(lengths[near[begin]].min(initial=FAR_M)) for begin, _ in stops]

    def row_from(thing_id: str) -> list[float]:
        """Return the lengths (m) of the walks to all places, from the reachable place that is nearest to a thing."""
        position, mask = things[thing_id].position, near[thing_id]
        if not mask.any():
            return row(from_start)
        away = np.where(mask, np.hypot(cells[:, 0] - position.x, cells[:, 1] - position.z), np.inf)
        x, z = cells[int(away.argmin())].tolist()
        return row(coarse.walks_from((x, z)).lengths)

    rows = {end: row_from(end) for end in sorted({end for _, end in stops})}
    return np.array([*(rows[end] for _, end in stops), row(from_start)])


def _near(box: Box, cells: np.ndarray, reachable: np.ndarray) -> np.ndarray:
    """Return the mask (n,) of the reachable cells (n, 2) within reach of a box, or else of those nearest to it."""
    away = np.where(reachable, box_distances(box, cells), np.inf)
    return reachable & (away <= max(REACH_M, float(away.min(initial=np.inf)) + TOUR_CELL_M))
