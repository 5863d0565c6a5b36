"""What a click does: it opens, closes, switches, picks up, places or drops something, or is refused for a reason.

Source: protocol.md section 2.2. A refused click leaves the scene exactly as it was.
"""

from dataclasses import dataclass
from typing import assert_never

from vigil.base.geometry import Vec3
from vigil.protocol.actions import Intent
from vigil.protocol.world import RefusalCode
from vigil.scene.geometry import body_box
from vigil.scene.things import Thing
from vigil.sim.core.handling_rules import can_reach, opening_refusal, refusal_by_rule
from vigil.sim.core.opening import opening_blocker, set_openness
from vigil.sim.core.placing import FreeSpot, put_down, spot_below, spot_on
from vigil.sim.core.state import AGENT, SceneState


@dataclass(frozen=True, slots=True)
class InteractionResult:
    """What an interaction did: the things that it changed, or why it was refused."""

    refusal: RefusalCode | None = None
    """Reason why the interaction was refused; None when it was carried out."""
    blocked_by: str | None = None
    """Id of what stopped a moving leaf, lid or drawer; None if nothing stopped it."""
    changed: tuple[str, ...] = ()
    """Sorted ids of the things that changed."""


def interact(state: SceneState, intent: Intent, thing: Thing | None, point: Vec3 | None) -> InteractionResult:
    """Carry out or refuse one intent on the thing and the point (m) that a click's ray met first; see `Sight.click`."""
    if intent == "drop":
        return _drop(state)
    if thing is None or point is None:
        return InteractionResult("nothing_hit")
    if intent != "ground" and not can_reach(state.agent.position, intent, body_box(thing), point):
        return InteractionResult("too_far")
    return apply_intent(state, intent, thing, point)


def apply_intent(state: SceneState, intent: Intent, thing: Thing, point: Vec3) -> InteractionResult:
    """Carry out or refuse one intent on a thing at any distance: whether the hand reaches it is not checked."""
    if intent == "drop":
        return _drop(state)
    refusal = refusal_by_rule(state.scene, state.held, intent, thing, point)
    if refusal is not None:
        return InteractionResult(refusal)
    match intent:
        case "open_access" | "close_access":
            return _swing(state, thing, float(intent == "open_access"))
        case "activate" | "deactivate":
            thing.is_toggled = intent == "activate"
            state.mark_changed(thing)
            return _done([thing])
        case "pick":
            return _done(state.take(thing))
        case "place":
            return _put(state, spot_on(state, _held(state), thing, point))
        case "ground":
            return InteractionResult()
        case _:
            assert_never(intent)


def open_to(state: SceneState, thing: Thing, target: float) -> InteractionResult:
    """Open or close a thing to openness `target` (0 to 1), or refuse."""
    refusal = opening_refusal(thing, target)
    return _swing(state, thing, target) if refusal is None else InteractionResult(refusal)


def _swing(state: SceneState, thing: Thing, target: float) -> InteractionResult:
    blocker = opening_blocker(state, thing, target)
    if blocker is not None:
        return InteractionResult("blocked_by_agent" if blocker == AGENT else "blocked_by_object", blocker)
    return _done(set_openness(state, thing, target))


def _drop(state: SceneState) -> InteractionResult:
    return InteractionResult("hand_empty") if state.held is None else _put(state, spot_below(state, _held(state)))


def _held(state: SceneState) -> Thing:
    return state.scene.things[state.held or ""]


def _put(state: SceneState, spot: FreeSpot | None) -> InteractionResult:
    return InteractionResult("no_room") if spot is None else _done(put_down(state, spot))


def _done(changed: list[Thing]) -> InteractionResult:
    return InteractionResult(changed=tuple(sorted({thing.id for thing in changed})))
