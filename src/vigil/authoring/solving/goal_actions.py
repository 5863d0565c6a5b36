"""The actions that reach each kind of goal or resolve a constraint, and the report that closes the episode.

`vigil.protocol.goals` defines the kinds of goals, checks them and describes them in words. To make packs with a new
kind, only this module and the negative controls in `vigil.authoring.review.goal_controls` must also be extended.
"""

from collections.abc import Callable, Iterator
from itertools import islice
from typing import assert_never

import numpy as np

from vigil.authoring.solving.look_targets import surface_points
from vigil.authoring.solving.macro_actions import MacroActions, Unsolvable
from vigil.authoring.solving.privileged_view import PrivilegedView
from vigil.authoring.solving.viewpoints import PositionCost, ViewpointQuery, viewpoints
from vigil.base.geometry import floor_distance
from vigil.protocol.actions import Action, Intent, Status
from vigil.protocol.goals import (
    STRICTLY_CLOSED,
    STRICTLY_OPEN,
    AgentNearTarget,
    AllOf,
    Chores,
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
from vigil.protocol.world import OPEN_ABOVE
from vigil.scene.geometry import body_box, box_distances
from vigil.scene.supports import is_shut, surface_named

NEAR_MARGIN_M = 0.06
"""Distance (m) by which the agent goes closer to a target than the goal requires."""
CLEAR_PX = 260
"""Minimum visible pixels of the target in the view at which a search ends."""
SEE_NEAR_M, SEE_FAR_M = 0.6, 4.5
"""Minimum and maximum distance (m) from the target of the views at which a search may end."""
MAX_LOOKS = 60
"""Maximum number of views that are rendered in a search."""
SEEN_POINTS = (16, 4)
"""Minimum numbers of the target's points that a view must show. They are tried one after the other."""

Steps = Iterator[Action]


def reach_goal(goal: Goal, macro_actions: MacroActions) -> Steps:
    """Yield the actions that reach a goal whose chain and constraint are done already. Raises Unsolvable."""
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
            yield from achieve_goal(goal, macro_actions)
        case AllOf():
            yield from _achieve_all(goal, macro_actions)
        case Chores():
            for part in (part for chore in goal.chores for part in chore.parts):
                yield from reach_goal(part, macro_actions)
        case _:
            assert_never(goal)


def expected_status(goal: Goal, view: PrivilegedView) -> Status:
    """Return the status that the report must have after the goal was reached."""
    if not isinstance(goal, ReportStatus):
        return "success"
    thing = view.scene.things[goal.object_id]
    return state_label(goal.state, is_toggled=thing.is_toggled, openness=thing.openness)


def report_summary(goal: Goal, name_of: Callable[[str], str], status: Status) -> str:
    """Return the summary of a report: what was done, or which state is observed.

    `name_of` takes a thing's id and returns the phrase for the thing.
    """
    target = name_of(goal.object_id)
    match goal:
        case TargetGrounded():
            return f"I pointed at {target}."
        case AgentNearTarget():
            return f"I am near {target}."
        case ReportStatus():
            return f"{target[0].upper()}{target[1:]} is {status}."
        case ObjectInState() if goal.state == "is_visible":
            return f"I see {target}."
        case ObjectInState():
            done = ("opened", "closed") if goal.state == "is_open" else ("turned on", "turned off")
            return f"I {done[0] if goal.value else done[1]} {target}."
        case ObjectHeld():
            return f"I picked up {target}."
        case ObjectAtReceptacle():
            return f"I put {target} {'in' if goal.inside else 'on'} {name_of(goal.receptacle_id)}."
        case AllOf():
            return " ".join(report_summary(part, name_of, status) for part in goal.parts)
        case Chores():
            return "I did the chores." if status == "success" else "I did what could be done."
        case _:
            assert_never(goal)


def achieve_goal(goal: Goal, macro_actions: MacroActions) -> Steps:
    """Yield the walks and interactions that reach a goal; nothing if the goal already holds.

    If an object must be picked up, closed containers around it are opened first. Raises Unsolvable if there is no way.
    """
    if holds(goal, macro_actions.view):
        return
    if isinstance(goal, ObjectAtReceptacle):
        yield from _pick_up_target(goal, macro_actions)
        yield from macro_actions.place(goal.receptacle_id, inside=goal.inside, is_thorough=not goal.chain)
        return
    if isinstance(goal, ObjectHeld):
        yield from _open_containers_around(goal.object_id, macro_actions)
    yield from macro_actions.act(_intent_of(goal), goal.object_id)


def perform_regardless(goal: Goal, macro_actions: MacroActions) -> Steps:
    """Yield the interactions that a goal requires, part by part, even if a part already holds.

    If a state already holds, the click for it is made from a place where the opposite click would work.
    """
    if isinstance(goal, AllOf):
        for part in goal.parts:
            yield from perform_regardless(part, macro_actions)
    elif isinstance(goal, ObjectInState) and goal.state != "is_visible" and holds(goal, macro_actions.view):
        undone = goal.model_copy(update={"value": not goal.value})
        viewpoint, pixel = macro_actions.find_click(_intent_of(undone), goal.object_id)
        yield from macro_actions.go(viewpoint)
        yield macro_actions.click(_intent_of(goal), macro_actions.view.click_pixel(goal.object_id) or pixel)
    else:
        yield from reach_goal(goal, macro_actions)


def closed_containers_around(view: PrivilegedView, object_id: str) -> list[str]:
    """Return the ids of the closed containers in which a thing lies."""
    around = [view.scene.things[name] for name in view.state_of(object_id).inside]
    return [thing.id for thing in around if thing.is_openable and thing.openness <= OPEN_ABOVE]


def _open_containers_around(object_id: str, macro_actions: MacroActions) -> Steps:
    """Yield the actions that open the closed containers in which a thing lies."""
    for container in closed_containers_around(macro_actions.view, object_id):
        yield from macro_actions.act("open_access", container)


def _pick_up_target(goal: ObjectAtReceptacle, macro_actions: MacroActions) -> Steps:
    """Yield the actions that pick up the target and open the receptacle. What is already done is left out."""
    view = macro_actions.view
    if view.held != goal.object_id:
        yield from _open_containers_around(goal.object_id, macro_actions)
        yield from macro_actions.act("pick", goal.object_id)
    if goal.inside and is_shut(view.scene.things[goal.receptacle_id]):
        yield from macro_actions.act("open_access", goal.receptacle_id)


def _achieve_all(goal: AllOf, macro_actions: MacroActions) -> Steps:
    """Yield the actions that reach all parts of a goal.

    If the goal has a chain, the parts come in order. Otherwise placements come first, then always the nearest remaining
    part.
    """
    things, left = macro_actions.view.scene.things, list(goal.parts)
    while left:
        here = macro_actions.view.agent.position
        placed = [part for part in left if isinstance(part, ObjectAtReceptacle)]
        if goal.chain or placed:
            part = left[0] if goal.chain else placed[0]
        else:
            part = min(left, key=lambda part: floor_distance(here, things[part.object_id].position))
        left.remove(part)
        yield from achieve_goal(part, macro_actions)


def is_doable(goal: Goal, macro_actions: MacroActions) -> bool:
    """Return whether the interaction that reaches the goal works from some reachable place in the current state.

    Raises Unsolvable for a goal that one interaction does not reach.
    """
    try:
        macro_actions.find_click(_intent_of(goal), goal.object_id)
    except Unsolvable:
        return False
    return True


def holds(goal: Goal, view: PrivilegedView) -> bool:
    """Return whether a goal that an interaction brings about holds strictly in the current state."""
    thing = view.scene.things[goal.object_id]
    if isinstance(goal, ObjectAtReceptacle):
        surface = surface_named(view.scene.things[goal.receptacle_id], thing.surface)
        is_there = thing.parent == goal.receptacle_id and view.held != thing.id
        is_inside, is_shut_off = (surface.is_inside, surface.needs_opening) if surface is not None else (False, False)
        return is_there and (is_inside if goal.inside else not is_shut_off)
    if isinstance(goal, ObjectHeld):
        return view.held == goal.object_id
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


def _ground(goal: TargetGrounded, macro_actions: MacroActions) -> Steps:
    pixel = macro_actions.view.click_pixel(goal.object_id)
    if pixel is None:
        raise Unsolvable(f"{goal.object_id!r} is not in the frame.")
    yield macro_actions.click("ground", pixel)


def _approach(goal: AgentNearTarget, macro_actions: MacroActions) -> Steps:
    view = macro_actions.view
    thing = view.scene.things[goal.object_id]
    walks = view.walks()
    for slack_m in macro_actions.reach_slacks_m:
        places = _near_target_cost(view, goal, NEAR_MARGIN_M + slack_m)
        query = ViewpointQuery(thing.id, surface_points(thing), places, least_seen=1)
        viewpoint = next(viewpoints(view, walks, query), None)
        if viewpoint is not None:
            yield from macro_actions.go(viewpoint)
            return
    raise Unsolvable(f"There is no reachable place near enough to {thing.id!r}.")


def _near_target_cost(view: PrivilegedView, goal: AgentNearTarget, margin_m: float) -> PositionCost:
    """Return the cost function of places: 0 where both distances to the target (box and centre) are below the goal's
    threshold minus a margin (m), inf elsewhere.
    """
    thing = view.scene.things[goal.object_id]
    box, most = body_box(thing), goal.threshold_m - margin_m

    def cost(places: np.ndarray) -> np.ndarray:
        edge = box_distances(box, places)
        centre = view.centre_distances(thing, places)
        return np.where((edge <= most) & (centre <= most), 0.0, np.inf)

    return cost


def _search(goal: ObjectInState, macro_actions: MacroActions) -> Steps:
    view = macro_actions.view
    thing = view.scene.things[goal.object_id]
    box = body_box(thing)

    def is_seen() -> bool:
        return is_observable(view.state_of(thing.id))

    def cost(places: np.ndarray) -> np.ndarray:
        distances = box_distances(box, places)
        return np.where((distances >= SEE_NEAR_M) & (distances <= SEE_FAR_M), 0.0, np.inf)

    for least in SEEN_POINTS:
        query = ViewpointQuery(
            thing.id, surface_points(thing), cost, may_tilt=True, least_seen=least, through_glass=True
        )
        for viewpoint in islice(viewpoints(view, view.walks(), query), MAX_LOOKS):
            with view.at_pose(viewpoint.pose):
                state = view.state_of(thing.id)
            if state.visible and state.visible_px >= CLEAR_PX and is_observable(state):
                yield from macro_actions.go(viewpoint, is_seen)
                if is_seen():
                    return
    raise Unsolvable(f"There is no reachable place from which {thing.id!r} is clearly seen.")


def resolve_constraint(constraint: Constraint, goal: Goal, macro_actions: MacroActions) -> Steps:
    """Yield the actions that resolve a constraint. If the goal needs the hand, the object in the hand is also put down.

    Raises Unsolvable if there is no way.
    """
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
