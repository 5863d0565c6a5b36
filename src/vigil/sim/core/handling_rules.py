"""The rules for clicks: what the hand can reach, and why opening, switching, picking up or placing is refused.

The rules need only the scene and the held thing, and change nothing. Every backend applies them before it tries the
interaction, in the order that protocol.md (section 2.2) gives.
"""

from typing import assert_never

from vigil.assets.catalog import CATALOG
from vigil.base.geometry import Box, Vec3, floor_distance
from vigil.protocol.actions import REACH_HEIGHT_M, REACH_M, Intent
from vigil.protocol.world import CLOSED_BELOW, RefusalCode
from vigil.scene.supports import children, is_inside_closed
from vigil.scene.things import Scene, Thing
from vigil.sim.core.click_target import target_kind
from vigil.sim.core.opening import MOVED_WITHIN

REACH_SLACK_M = 1e-9


def can_reach(floor: Vec3, intent: Intent, box: Box, point: Vec3) -> bool:
    """Return whether the hand of a body at `floor` reaches a box or, if the intent is `place`, the clicked point."""
    if intent == "place":
        distance_m, height_m = floor_distance(floor, point), point.y - floor.y
    else:
        distance_m, height_m = box.floor_distance(floor), box.bottom - floor.y
    return distance_m <= REACH_M + REACH_SLACK_M and height_m <= REACH_HEIGHT_M + REACH_SLACK_M


def refusal_by_rule(scene: Scene, held: str | None, intent: Intent, thing: Thing, point: Vec3) -> RefusalCode | None:
    """Return the reason why the rules refuse an intent on a thing; None if the intent may be tried.

    The rules do not look at what is around the thing. `held` is the id of the thing in the hand. `point` is the clicked
    point on the thing (m, house's frame).
    """
    match intent:
        case "open_access" | "close_access":
            return opening_refusal(thing, float(intent == "open_access"))
        case "activate" | "deactivate":
            return _switching_refusal(thing, intent == "activate")
        case "pick":
            return _picking_refusal(scene, held, thing)
        case "place":
            return _placing_refusal(scene, held, thing, point)
        case "ground" | "drop":
            return None
        case _:
            assert_never(intent)


def opening_refusal(thing: Thing, target: float) -> RefusalCode | None:
    """Return the reason why opening or closing a thing to openness `target` is refused; None if it may be tried."""
    if not thing.is_openable:
        return "not_openable"
    if abs(thing.openness - target) < MOVED_WITHIN:
        return "already_so"
    if target > thing.openness and CATALOG[thing.category].runs_only_when_closed and thing.is_toggled:
        return "interlock"
    return None


def _switching_refusal(thing: Thing, target: bool) -> RefusalCode | None:
    if not thing.is_toggleable:
        return "not_toggleable"
    if thing.is_toggled == target:
        return "already_so"
    if target and thing.is_broken:
        return "out_of_order"
    if target and CATALOG[thing.category].runs_only_when_closed and thing.openness >= CLOSED_BELOW:
        return "interlock"
    return None


def _picking_refusal(scene: Scene, held: str | None, thing: Thing) -> RefusalCode | None:
    if not thing.is_pickupable or thing.is_structure:
        return "not_pickupable"
    if held is not None:
        return "hand_full"
    if is_inside_closed(scene, thing):
        return "receptacle_closed"
    if not thing.is_receptacle and children(scene, thing.id):
        return "object_occupied"
    return None


def _placing_refusal(scene: Scene, held: str | None, receptacle: Thing, point: Vec3) -> RefusalCode | None:
    if held is None:
        return "hand_empty"
    if not receptacle.is_receptacle or not CATALOG[receptacle.category].can_hold(CATALOG[scene.things[held].category]):
        return "not_a_receptacle"
    if is_inside_closed(scene, receptacle) or target_kind(receptacle, point) == "shut":
        return "receptacle_closed"
    return None
