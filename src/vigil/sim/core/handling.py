"""What a click does: opening, switching, picking up, placing and dropping, or the reason why not.

Source: protocol.md section 2.2. Every refusal leaves the scene exactly as it was.
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
class ClickHit:
    """What the ray of a click met."""

    thing: Thing | None
    point: Vec3 | None
    """None when it met nothing at all."""


@dataclass(frozen=True, slots=True)
class InteractionResult:
    """What an interaction came to."""

    refusal: RefusalCode | None = None
    blocked_by: str | None = None
    changed: tuple[str, ...] = ()


def interact(state: SceneState, intent: Intent, click: ClickHit) -> InteractionResult:
    """Carries out one intent, or refuses it."""
    if intent == "drop":
        return _drop(state)
    if click.thing is None or click.point is None:
        return InteractionResult("nothing_hit")
    if intent != "ground" and not can_reach(state.agent.position, intent, body_box(click.thing), click.point):
        return InteractionResult("too_far")
    return apply_intent(state, intent, click.thing, click.point)


def apply_intent(state: SceneState, intent: Intent, thing: Thing, point: Vec3) -> InteractionResult:
    """Carries out one intent on a thing, or refuses it, without asking whether the hand gets there."""
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
    """Opens or closes a thing to an openness of 0 to 1, or refuses it."""
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
