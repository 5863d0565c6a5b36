"""What a click does: reach, opening, switching, picking up, placing and dropping, or the reason why not.

Source: protocol.md section 2.2. Every refusal leaves the scene exactly as it was.
"""

from collections.abc import Callable
from dataclasses import dataclass

from vigil.actions import REACH_HEIGHT_M, REACH_M, Intent
from vigil.assets.catalog import CATALOG
from vigil.pose import Box, Vec3, floor_distance
from vigil.scene.geometry import box_of
from vigil.scene.supports import children, is_shut_in
from vigil.scene.things import Thing
from vigil.sim.core.click_target import kind_meant
from vigil.sim.core.opening import MOVED_WITHIN, set_openness, swing_blocker
from vigil.sim.core.placing import put_down, spot_below, spot_on
from vigil.sim.core.state import AGENT, SceneState
from vigil.world import CLOSED_BELOW, RefusalCode

REACH_SLACK_M = 1e-9


@dataclass(frozen=True, slots=True)
class Click:
    """What the ray of a click met."""

    thing: Thing | None
    point: Vec3 | None
    """None when it met nothing at all."""


@dataclass(frozen=True, slots=True)
class Result:
    """What an interaction came to."""

    refusal: RefusalCode | None = None
    blocked_by: str | None = None
    changed: tuple[str, ...] = ()


def interact(state: SceneState, intent: Intent, click: Click) -> Result:
    """Carries out one intent, or refuses it."""
    if intent == "drop":
        return _drop(state)
    if click.thing is None or click.point is None:
        return Result("nothing_hit")
    if intent == "ground":
        return Result()
    if not is_in_reach(state, intent, click.thing, click.point):
        return Result("too_far")
    return _DEEDS[intent](state, click.thing, click.point)


def is_in_reach(state: SceneState, intent: Intent, thing: Thing, point: Vec3) -> bool:
    """Whether the hand gets to the thing, or for `place` to the clicked point."""
    return gets_to(state.agent.position, intent, box_of(thing), point)


def gets_to(floor: Vec3, intent: Intent, box: Box, point: Vec3) -> bool:
    """Whether the hand of a body that stands at `floor` gets to a box, or for `place` to the clicked point."""
    if intent == "place":
        distance_m, height_m = floor_distance(floor, point), point.y - floor.y
    else:
        distance_m, height_m = box.floor_distance(floor), box.bottom - floor.y
    return distance_m <= REACH_M + REACH_SLACK_M and height_m <= REACH_HEIGHT_M + REACH_SLACK_M


def handle(state: SceneState, intent: Intent, thing: Thing, point: Vec3) -> Result:
    """Carries out one intent on a thing, or refuses it, without asking whether the hand gets there."""
    return Result() if intent == "ground" else _drop(state) if intent == "drop" else _DEEDS[intent](state, thing, point)


def _open(state: SceneState, thing: Thing, _: Vec3) -> Result:
    return open_to(state, thing, 1.0)


def _close(state: SceneState, thing: Thing, _: Vec3) -> Result:
    return open_to(state, thing, 0.0)


def open_to(state: SceneState, thing: Thing, target: float) -> Result:
    """Opens or closes a thing to an openness, or refuses it."""
    if not thing.is_openable:
        return Result("not_openable")
    if abs(thing.openness - target) < MOVED_WITHIN:
        return Result("already_so")
    if target > thing.openness and CATALOG[thing.category].runs_only_when_closed and thing.is_toggled:
        return Result("interlock")
    blocker = swing_blocker(state, thing, target)
    if blocker is not None:
        return Result("blocked_by_agent" if blocker == AGENT else "blocked_by_object", blocker)
    return _done(set_openness(state, thing, target))


def _activate(state: SceneState, thing: Thing, _: Vec3) -> Result:
    return _toggle(state, thing, True)


def _deactivate(state: SceneState, thing: Thing, _: Vec3) -> Result:
    return _toggle(state, thing, False)


def _toggle(state: SceneState, thing: Thing, target: bool) -> Result:
    if not thing.is_toggleable:
        return Result("not_toggleable")
    if thing.is_toggled == target:
        return Result("already_so")
    if target and CATALOG[thing.category].runs_only_when_closed and thing.openness >= CLOSED_BELOW:
        return Result("interlock")
    thing.is_toggled = target
    state.mark(thing)
    return _done([thing])


def _pick(state: SceneState, thing: Thing, _: Vec3) -> Result:
    if not thing.is_pickupable or thing.is_structure:
        return Result("not_pickupable")
    if state.held is not None:
        return Result("hand_full")
    if is_shut_in(state.scene, thing):
        return Result("receptacle_closed")
    if not thing.is_receptacle and children(state.scene, thing.id):
        return Result("object_occupied")
    return _done(state.take(thing))


def _place(state: SceneState, receptacle: Thing, point: Vec3) -> Result:
    if state.held is None:
        return Result("hand_empty")
    held = state.scene.things[state.held]
    if not receptacle.is_receptacle or not CATALOG[receptacle.category].takes(CATALOG[held.category]):
        return Result("not_a_receptacle")
    if is_shut_in(state.scene, receptacle):
        return Result("receptacle_closed")
    if kind_meant(receptacle, point) == "shut":
        return Result("receptacle_closed")
    spot = spot_on(state, held, receptacle, point)
    return Result("no_room") if spot is None else _done(put_down(state, spot))


def _drop(state: SceneState) -> Result:
    if state.held is None:
        return Result("hand_empty")
    spot = spot_below(state, state.scene.things[state.held])
    return Result("no_room") if spot is None else _done(put_down(state, spot))


def _done(changed: list[Thing]) -> Result:
    return Result(changed=tuple(sorted({thing.id for thing in changed})))


_DEEDS: dict[str, Callable[[SceneState, Thing, Vec3], Result]] = {
    "open_access": _open,
    "close_access": _close,
    "activate": _activate,
    "deactivate": _deactivate,
    "pick": _pick,
    "place": _place,
}
