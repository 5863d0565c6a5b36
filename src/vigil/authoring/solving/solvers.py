"""Solvers: one way of bringing about each kind of goal, through the same four skills and pixel clicks as any agent.

They see the hidden world (`vigil.authoring.solving.oracle`), plan with it and act like anybody else; each uses only the
skills that its family expects. `privileged_agent` makes agents of them that the runner can play; its reports mark
those.
"""

from collections.abc import Callable, Iterator
from itertools import islice
from typing import assert_never

import numpy as np

from vigil.actions import Action, Intent, InteractPixel, Reply, Report, Status
from vigil.authoring.solving import moves
from vigil.authoring.solving.aim import surface_points
from vigil.authoring.solving.macro_actions import MacroActions, Unsolvable
from vigil.authoring.solving.oracle import Oracle
from vigil.authoring.solving.viewpoints import Places, ViewpointQuery, viewpoints
from vigil.episode import FAMILIES, Episode
from vigil.errors import SettingError
from vigil.goals import (
    STRICTLY_CLOSED,
    STRICTLY_OPEN,
    AgentNearTarget,
    Constraint,
    Goal,
    ObjectAtReceptacle,
    ObjectHeld,
    ObjectInState,
    ReportStatus,
    TargetGrounded,
    is_observable,
    state_label,
)
from vigil.observation import FRAME_HEIGHT, FRAME_WIDTH, Observation
from vigil.scene.geometry import box_distances, box_of
from vigil.sim.privileged import PrivilegedSimulator

NEAR_MARGIN_M = 0.06
CLEAR_PX = 260
SEE_NEAR_M, SEE_FAR_M = 0.6, 4.5
MOST_LOOKS = 60
SEEN_POINTS = (16, 4)

Steps = Iterator[Action]


def solve(episode: Episode, oracle: Oracle) -> Steps:
    """Yields the actions that solve an episode, each after the one before has been carried out.

    Raises Unsolvable where there is no way.
    """
    macro_actions = MacroActions(oracle, may_tilt="look" in FAMILIES[episode.family].skills)
    goal = episode.goal
    for link in goal.chain:
        yield from _achieve(link, macro_actions)
    if goal.constraint is not None:
        yield from _lift(goal.constraint, goal, macro_actions)
    yield from _reach(goal, macro_actions)
    yield Report(status=_closing_status(episode, oracle), summary="Done.")


def _reach(goal: Goal, macro_actions: MacroActions) -> Steps:
    """Yields what brings a goal about, once nothing stands in its way."""
    match goal:
        case TargetGrounded():
            yield from _ground(goal, macro_actions)
        case AgentNearTarget():
            yield from _approach(goal, macro_actions)
        case ObjectInState() if goal.state == "is_visible":
            yield from _search(goal, macro_actions)
        case ReportStatus():
            pass  # the state is in view at the start
        case ObjectInState() | ObjectHeld() | ObjectAtReceptacle():
            yield from _achieve(goal, macro_actions)
        case _:
            assert_never(goal)


def _closing_status(episode: Episode, oracle: Oracle) -> Status:
    if not isinstance(episode.goal, ReportStatus):
        return "success"
    thing = oracle.scene.things[episode.goal.object_id]
    return state_label(episode.goal.state, is_toggled=thing.is_toggled, openness=thing.openness)


def _ground(goal: TargetGrounded, macro_actions: MacroActions) -> Steps:
    pixel = macro_actions.oracle.clickable(goal.object_id)
    if pixel is None:
        raise Unsolvable(f"{goal.object_id!r} is not in the frame.")
    yield moves.click("ground", pixel)


def _approach(goal: AgentNearTarget, macro_actions: MacroActions) -> Steps:
    oracle = macro_actions.oracle
    thing = oracle.scene.things[goal.object_id]
    walks = oracle.walks()
    query = ViewpointQuery(thing.id, surface_points(thing), _beside(oracle, goal), least_seen=1)
    view = next(viewpoints(oracle, walks, query), None)
    if view is None:
        raise Unsolvable(f"No reachable place near enough to {thing.id!r}.")
    yield from macro_actions.go(view)


def _beside(oracle: Oracle, goal: AgentNearTarget) -> Places:
    """Returns the places that are near enough to a target by both distances, with a margin."""
    thing = oracle.scene.things[goal.object_id]
    box, most = box_of(thing), goal.threshold_m - NEAR_MARGIN_M

    def cost(places: np.ndarray) -> np.ndarray:
        edge = box_distances(box, places)
        centre = oracle.centre_distances(thing, places)
        return np.where((edge <= most) & (centre <= most), 0.0, np.inf)

    return cost


def _search(goal: ObjectInState, macro_actions: MacroActions) -> Steps:
    oracle = macro_actions.oracle
    thing = oracle.scene.things[goal.object_id]
    box = box_of(thing)

    def cost(places: np.ndarray) -> np.ndarray:
        distances = box_distances(box, places)
        return np.where((distances >= SEE_NEAR_M) & (distances <= SEE_FAR_M), 0.0, np.inf)

    for least in SEEN_POINTS:
        query = ViewpointQuery(
            thing.id, surface_points(thing), cost, may_tilt=True, least_seen=least, through_glass=True
        )
        for view in islice(viewpoints(oracle, oracle.walks(), query), MOST_LOOKS):
            with oracle.standing_at(view.pose):
                state = oracle.state_of(thing.id)
            if state.visible and state.visible_px >= CLEAR_PX and is_observable(state):
                yield from macro_actions.go(view)
                return
    raise Unsolvable(f"No reachable place from which {thing.id!r} is clearly seen.")


def _lift(constraint: Constraint, goal: Goal, macro_actions: MacroActions) -> Steps:
    """Yields what resolves a constraint, so that the goal can be gone for with what is then in the hand."""
    intents: dict[str, Intent] = {
        "object_open": "open_access",
        "object_closed": "close_access",
        "object_on": "activate",
        "object_off": "deactivate",
        "object_moved": "pick",
    }
    if constraint.kind in intents:
        yield from macro_actions.act(intents[constraint.kind], constraint.object_id)
    if constraint.kind == "object_released" or (constraint.kind == "object_moved" and isinstance(goal, ObjectHeld)):
        yield from macro_actions.put_down(lambda: is_doable(goal, macro_actions))


def _achieve(goal: Goal, macro_actions: MacroActions) -> Steps:
    if isinstance(goal, ObjectAtReceptacle):
        yield from macro_actions.place(goal.receptacle_id, inside=goal.inside)
    elif not _holds(goal, macro_actions.oracle):
        yield from macro_actions.act(_intent_of(goal), goal.object_id)


def is_doable(goal: Goal, macro_actions: MacroActions) -> bool:
    """Whether the goal's own interaction works from some reachable place as things stand now."""
    try:
        macro_actions.find(_intent_of(goal), goal.object_id)
    except Unsolvable:
        return False
    return True


def _holds(goal: Goal, oracle: Oracle) -> bool:
    thing = oracle.scene.things[goal.object_id]
    if isinstance(goal, ObjectHeld):
        return oracle.held == goal.object_id
    if isinstance(goal, ObjectInState) and goal.state == "is_open":
        return thing.openness >= STRICTLY_OPEN if goal.value else thing.openness <= STRICTLY_CLOSED
    return isinstance(goal, ObjectInState) and goal.state == "is_toggled" and thing.is_toggled == goal.value


def _intent_of(goal: Goal) -> Intent:
    if isinstance(goal, ObjectHeld):
        return "pick"
    if isinstance(goal, ObjectInState) and goal.state == "is_open":
        return "open_access" if goal.value else "close_access"
    if isinstance(goal, ObjectInState) and goal.state == "is_toggled":
        return "activate" if goal.value else "deactivate"
    raise Unsolvable(f"No interaction brings about a goal of kind {goal.kind!r}.")


def solution(episode: Episode, oracle: Oracle) -> tuple[Action, ...]:
    """Returns the whole solution from the stage's present state, which it leaves as it was. Raises Unsolvable."""
    actions: list[Action] = []
    with oracle.rehearsal():
        for action in solve(episode, oracle):
            actions.append(action)
            if not isinstance(action, Report):
                oracle.step(action)
            if len(actions) > episode.max_steps:
                raise Unsolvable(f"Episode {episode.id!r}: more than the {episode.max_steps} steps of its budget.")
    return tuple(actions)


PrivilegedScript = Callable[[Episode, Oracle], Steps]


def _premature(episode: Episode, oracle: Oracle) -> Steps:
    actions = solution(episode, oracle)[:-1]
    yield from actions[: len(actions) // 2]
    yield Report(status="success", summary="Done.")


def _never_report(episode: Episode, oracle: Oracle) -> Steps:
    last: InteractPixel | None = None
    for action in solve(episode, oracle):
        if not isinstance(action, Report):
            last = action if isinstance(action, InteractPixel) and action.intent == "ground" else last
            yield action
    while True:
        yield last or InteractPixel(intent="ground", x=FRAME_WIDTH // 2, y=FRAME_HEIGHT // 2)


PRIVILEGED: dict[str, PrivilegedScript] = {"solver": solve, "never_report": _never_report, "premature": _premature}
"""Agents with privileged sight, by name."""


class PrivilegedAgent:
    """Plays one episode with sight of the hidden world, synchronously beside its simulator."""

    def __init__(self, name: str, episode: Episode, simulator: PrivilegedSimulator) -> None:
        self.name = name
        self._script = PRIVILEGED[name]
        self._episode = episode
        self._simulator = simulator
        self._actions: Steps = iter(())

    def start(self, instruction: str) -> None:
        """Starts the script anew; the instruction is not needed."""
        del instruction
        self._actions = self._script(self._episode, Oracle(self._simulator))

    def act(self, observation: Observation) -> Reply:
        """Returns the script's next reply; where the solver finds no way, an honest failure."""
        del observation
        try:
            action = next(self._actions)
        except Unsolvable as error:
            action = Report(status="fail", summary=str(error))
        return moves.reply_of(action)


def privileged_agent(name: str, episode: Episode, simulator: PrivilegedSimulator) -> PrivilegedAgent:
    """Returns an agent with privileged sight. Raises SettingError on an unknown name."""
    if name not in PRIVILEGED:
        raise SettingError(f"Privileged agent {name!r} does not exist. Choose one of: {', '.join(PRIVILEGED)}.")
    return PrivilegedAgent(name, episode, simulator)
