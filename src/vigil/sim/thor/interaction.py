"""What a click does in AI2-THOR. The protocol's rules are applied first. If THOR then refuses, its message is
translated to a refusal of the protocol.

Source: protocol.md section 2.2.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from vigil.base.geometry import Vec3, floor_distance
from vigil.protocol.actions import Intent
from vigil.scene.supports import containers_of
from vigil.scene.things import Thing
from vigil.sim.core.click_target import target_kind
from vigil.sim.core.handling import InteractionResult
from vigil.sim.core.handling_rules import can_reach, refusal_by_rule
from vigil.sim.core.placing import SPOT_WITHIN_M
from vigil.sim.core.sight import HEIGHT, WIDTH
from vigil.sim.thor.engine_session import ActionOutcome, EngineSession
from vigil.sim.thor.refusals import is_out_of_sight, refusal_of

SPOT_SLACK_M = 0.02
"""Tolerance (m) in the check whether THOR has put an object near the click."""
MOVED_M = 1e-6
"""An object counts as unchanged if no coordinate, angle or openness differs by more than this."""


@dataclass(frozen=True, slots=True)
class ObjectClick:
    """A click on an object: the pixel (x, y), and the object and the point that it hits."""

    thing: Thing
    point: Vec3
    """Point (m) on the object that the pixel's ray meets."""
    x: int
    y: int


def place_of_pixel(x: int, y: int) -> dict[str, float]:
    """Return the middle of a pixel in THOR's form: x and y in 0..1 from the top left corner."""
    return {"x": (x + 0.5) / WIDTH, "y": (y + 0.5) / HEIGHT}


def interact_in_thor(session: EngineSession, intent: Intent, click: ObjectClick) -> InteractionResult:
    """Carry out one intent on a clicked object, or refuse it."""
    if intent == "ground":
        return InteractionResult()
    scene_sync = session.scene_sync
    if not can_reach(scene_sync.agent.position, intent, scene_sync.box(click.thing), click.point):
        return InteractionResult("too_far")
    refusal = refusal_by_rule(scene_sync.scene, scene_sync.held, intent, click.thing, click.point)
    if refusal is not None:
        return InteractionResult(refusal)
    if intent == "place":
        return _place(session, click)
    return _attempt(session, lambda: _act_on_object(session, click, _ACTIONS[intent]))


def drop_in_thor(session: EngineSession) -> InteractionResult:
    """Drop the held object, or refuse."""
    if session.scene_sync.held is None:
        return InteractionResult("hand_empty")
    return _attempt(session, lambda: session.do("DropHandObject"))


def _place(session: EngineSession, click: ObjectClick) -> InteractionResult:
    held = session.scene_sync.scene.things[session.scene_sync.held or ""]
    wanted_kind = target_kind(click.thing, click.point)  # before THOR changes anything
    place = {**place_of_pixel(click.x, click.y), "putNearXY": True, "placeStationary": True, "forceAction": False}
    result = _attempt(session, lambda: session.do("PutObject", **place))
    if result.refusal is not None or _is_where_wanted(session, held, click, wanted_kind):
        return result
    session.do("PickupObject", objectId=held.id, forceAction=True)  # THOR put it where the protocol does not allow it
    return InteractionResult("no_room")


def _is_where_wanted(session: EngineSession, held: Thing, click: ObjectClick, wanted_kind: str) -> bool:
    """Return whether THOR put the held thing near the click, and inside or on the clicked thing as intended."""
    is_inside = any(each is click.thing for each in containers_of(session.scene_sync.scene, held))
    is_near = floor_distance(held.position, click.point) <= SPOT_WITHIN_M + SPOT_SLACK_M
    return is_near and held.parent == click.thing.id and is_inside == (wanted_kind == "inside")


def _act_on_object(session: EngineSession, click: ObjectClick, action: str) -> ActionOutcome:
    """Act on the clicked object by its id. If THOR finds no point of the object in view, act on the clicked pixel."""
    outcome = session.do(action, objectId=click.thing.id)
    if outcome.is_done or not is_out_of_sight(outcome.message):
        return outcome
    under = session.query("GetObjectInFrame", **place_of_pixel(click.x, click.y), checkVisible=False)
    if under.returned != click.thing.id:
        return outcome
    return session.do(action, **place_of_pixel(click.x, click.y))


def _attempt(session: EngineSession, act: Callable[[], ActionOutcome]) -> InteractionResult:
    before = _facts(session)
    outcome = act()
    if not outcome.is_done:
        return refusal_of(outcome.message)
    session.wait_until_at_rest()
    after = _facts(session)
    changed = []
    for name, (numbers, marks) in after.items():
        earlier, earlier_marks = before[name]
        moved = any(abs(a - b) > MOVED_M for a, b in zip(numbers, earlier, strict=True))
        if moved or marks != earlier_marks:
            changed.append(name)
    return InteractionResult(changed=tuple(sorted(changed)))


def _facts(session: EngineSession) -> dict[str, tuple[Any, ...]]:
    things = session.scene_sync.scene.things.values()
    return {
        thing.id: ((*thing.position, *thing.rotation, thing.openness), (thing.is_toggled, thing.is_held, thing.parent))
        for thing in things
    }


_ACTIONS: dict[Intent, str] = {
    "open_access": "OpenObject",
    "close_access": "CloseObject",
    "activate": "ToggleObjectOn",
    "deactivate": "ToggleObjectOff",
    "pick": "PickupObject",
}
"""THOR's action for each intent. The action is sent with the object's id or with a pixel of the object."""
