"""Ablated solvers: agents that lack one ability of the solver. They measure how difficult episodes are, and are never
baselines of a table.

Like the solver, they know more than pixels show: the goal, whether the goal holds, what each thing in view is, the
exact floor plan, and where a click on a thing works. Unlike the solver, they do not know where a thing is before it was
in view. To find it, they turn on the spot, then walk to the next place, then open what is closed. `ABLATIONS` says what
else each of them lacks.
"""

import hashlib
import math
from collections.abc import Callable, Generator, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from vigil.authoring.language.referring import Phrase, items_of, referents
from vigil.authoring.solving import primitive_actions
from vigil.authoring.solving.goal_actions import Steps, achieve_goal, expected_status, reach_goal, resolve_constraint
from vigil.authoring.solving.macro_actions import MacroActions, Unsolvable
from vigil.authoring.solving.privileged_view import PrivilegedView
from vigil.protocol.actions import Action, Navigate, Report
from vigil.protocol.episode import Episode
from vigil.protocol.families import FAMILIES
from vigil.protocol.goals import OBSERVABLE_PX
from vigil.protocol.world import CLOSED_BELOW
from vigil.scene.floor import Point2

QUARTER_DEG = 90.0
LOOKED_AROUND_M = 2.0
"""Radius (m) around a place where the agent has looked around. Other places within this radius are not visited."""
InterruptibleSteps = Generator[Action, None, bool]
"""Generator of actions that returns whether all actions were carried out."""


@dataclass(frozen=True, slots=True)
class Ablation:
    """The limits of an ablated solver."""

    description: str
    """Text for readers that says what the solver lacks."""
    sight_m: float = math.inf
    """Maximum distance (m) from the camera at which the solver recognizes things."""
    has_memory: bool = True
    """Whether the solver remembers things that it saw and places that it visited."""
    takes_look_alikes: bool = False
    """Whether the solver takes the first thing in view that fits the target's bare name, even if it is a look-alike."""


ABLATIONS: dict[str, Ablation] = {
    "short_sighted": Ablation("recognizes things within 3 m only", sight_m=3.0),
    "memoryless": Ablation("knows only what is in the present frame, and walks to random places", has_memory=False),
    "greedy": Ablation("uses the first thing that the target's bare name may mean", takes_look_alikes=True),
    "searching": Ablation("has only the limit that all four share: it knows where a thing is only once it has seen it"),
}
"""Name of an ablated solver -> its limits."""


def ablated_solver(ablation: Ablation) -> Callable[[Episode, PrivilegedView], Steps]:
    """Return the script of a solver with these limits. The script raises Unsolvable if it finds no way."""

    def script(episode: Episode, view: PrivilegedView) -> Steps:
        return _AblatedSolver(episode, view, ablation).steps()

    return script


class _AblatedSolver:
    """One play of an episode by a solver with limits."""

    def __init__(self, episode: Episode, view: PrivilegedView, ablation: Ablation) -> None:
        self._goal = episode.goal
        self._view = view
        self._ablation = ablation
        self._macro = MacroActions(view, may_tilt="look" in FAMILIES[episode.family].skills)
        self._known: set[str] = set()
        self._visited: list[Point2] = []
        self._opened: set[str] = set()
        digest = hashlib.sha256(episode.id.encode()).digest()
        self._rng = np.random.default_rng(int.from_bytes(digest[:8], "big"))

    def steps(self) -> Steps:
        """Yield all actions of the play, including the report."""
        if self._ablation.takes_look_alikes:
            look_alike = yield from self._find_first_look_alike(self._goal.object_id)
            self._goal = self._goal.model_copy(update={"object_id": look_alike})
        goal = self._goal
        for link in goal.chain:
            yield from self._find_then_do(link.ids(), lambda link=link: achieve_goal(link, self._macro))
        constraint = goal.constraint
        if constraint is not None:
            yield from self._find_then_do(
                {constraint.object_id}, lambda: resolve_constraint(constraint, goal, self._macro)
            )
        own = goal.model_copy(update={"constraint": None, "chain": ()})
        yield from self._find_then_do(own.ids(), lambda: reach_goal(goal, self._macro))
        yield Report(status=expected_status(goal, self._view), summary="Done.")

    def _find_then_do(self, thing_ids: set[str], steps_of: Callable[[], Steps]) -> Steps:
        """Yield a search for the things, then the steps. Repeat both until all steps were carried out."""
        is_done = False
        while not is_done:
            yield from self._find(thing_ids)
            is_done = yield from self._attempt(steps_of(), thing_ids)

    def _attempt(self, steps: Steps, thing_ids: set[str]) -> InterruptibleSteps:
        for action in steps:
            yield action
            self._update_known()
            is_walk = isinstance(action, Navigate)
            if is_walk and not self._ablation.has_memory and not self._sees_all(thing_ids):
                return False
        return True

    def _find(self, thing_ids: set[str]) -> Steps:
        """Yield a search until all of the things are known. Raises Unsolvable if no place is left to search."""
        self._update_known()
        search = self._search()
        while not (self._known >= thing_ids if self._ablation.has_memory else self._sees_all(thing_ids)):
            yield next(search)
            self._update_known()

    def _find_first_look_alike(self, target_id: str) -> Generator[Action, None, str]:
        """Yield a search until something is in view that the target's bare name may mean, and return its id."""
        items = items_of(self._view.scene)
        named = referents(Phrase(items[target_id].name), items.values()) if target_id in items else []
        wanted = {target_id, *(item.id for item in named)}
        search = self._search()
        while not (seen := self._in_view(wanted)):
            yield next(search)
        return seen[0]

    def _update_known(self) -> None:
        self._known |= set(self._in_view(self._goal.ids()))

    def _sees_all(self, thing_ids: set[str]) -> bool:
        return set(self._in_view(thing_ids)) == thing_ids

    def _in_view(self, thing_ids: set[str]) -> list[str]:
        """Return, the nearest first, the ids of the things that are in the hand or recognized in the frame."""
        states = self._view.world(sorted(thing_ids)).objects
        seen = {
            name: 0.0 if state.is_held else state.nearest_visible_m or 0.0
            for name, state in states.items()
            if state.is_held or state.visible_px >= OBSERVABLE_PX
        }
        return [
            name for name in sorted(seen, key=lambda name: (seen[name], name)) if seen[name] <= self._ablation.sight_m
        ]

    def _search(self) -> Iterator[Action]:
        """Yield a turn on the spot, then walks to places with a turn at each, then the opening of closed containers.

        Raises Unsolvable at the end. Without memory, the walks never end.
        """
        yield from self._look_around()
        while (place := self._next_place()) is not None:
            for corner in place:
                yield from primitive_actions.towards(self._view.agent, corner)
            yield from self._look_around()
        for name in self._closed():
            self._opened.add(name)
            yield from self._open(name)
            yield from self._look_around()
        raise Unsolvable("The agent searched everywhere and did not find what the task is about.")

    def _open(self, name: str) -> Iterator[Action]:
        """Yield the actions that open a thing; nothing if it cannot be opened from any place."""
        try:
            yield from self._macro.act("open_access", name)
        except Unsolvable:
            return

    def _look_around(self) -> Iterator[Action]:
        position = self._view.agent.position
        self._visited.append((position.x, position.z))
        for _ in range(3):
            yield Navigate(mode="turn_right", magnitude=QUARTER_DEG)

    def _next_place(self) -> Sequence[Point2] | None:
        """Return the corners of the walk to the nearest place where the agent has not looked around yet.

        Without memory, the place is random. None if there is no such place.
        """
        walks = self._view.walks()
        can_go = np.isfinite(walks.lengths)
        if self._ablation.has_memory:
            for x, z in self._visited:
                can_go &= np.hypot(walks.plan.cells[:, 0] - x, walks.plan.cells[:, 1] - z) >= LOOKED_AROUND_M
        cells = np.flatnonzero(can_go)
        if not len(cells):
            return None
        cell = cells[np.argmin(walks.lengths[cells])] if self._ablation.has_memory else self._rng.choice(cells)
        return walks.corners_to(int(cell))

    def _closed(self) -> Iterator[str]:
        """Yield, sorted, the ids of the closed containers that the agent has not opened yet."""
        for name, thing in sorted(self._view.scene.things.items()):
            is_container = thing.is_openable and not thing.is_structure and thing.is_present
            if is_container and thing.openness < CLOSED_BELOW and name not in self._opened:
                yield name
