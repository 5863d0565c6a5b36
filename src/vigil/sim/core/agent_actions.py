"""What is the same in every simulator: how an agent walks and looks, and what is recorded of an object's state."""

import math
from collections.abc import Callable
from typing import Any, Protocol

from vigil.base.geometry import Box, Pose, distance
from vigil.protocol.actions import HORIZON_DOWN_DEG, HORIZON_UP_DEG, MAX_STEPS_PER_ACTION, STEP_M, Look, Navigate
from vigil.protocol.world import Effect, ObjectState
from vigil.scene.supports import ancestors, containers_of, receptacles_below, supports_not_lain_on
from vigil.scene.things import Scene, Thing
from vigil.sim.core.handling import InteractionResult
from vigil.sim.core.sight import ObjectVisibility


class AgentInScene(Protocol):
    """A scene, the pose of the agent in it, and the thing in the agent's hand."""

    scene: Scene
    agent: Pose
    held: str | None
    """Id of the thing in the hand; None when the hand is empty."""


def walk(action: Navigate, step: Callable[[float], InteractionResult]) -> Effect:
    """Walk the whole steps, then the fraction of a step; stop at the first refusal. Return the effect.

    `step` moves the agent by a length (m; negative means backward), or refuses to move it at all.
    """
    sign = 1.0 if action.mode == "forward" else -1.0
    magnitude = min(action.magnitude, float(MAX_STEPS_PER_ACTION))
    whole = math.floor(magnitude + 1e-9)
    rest = magnitude - whole
    moved_m, result = 0.0, InteractionResult()
    for length_m in [STEP_M] * whole + ([rest * STEP_M] if rest > 1e-9 else []):
        result = step(sign * length_m)
        if result.refusal is not None:
            break
        moved_m += length_m
    is_blocked = result.refusal is not None
    return Effect(
        moved_m=moved_m,
        path_blocked=is_blocked,
        blocked_by=result.blocked_by,
        refusal="path_blocked" if is_blocked and moved_m == 0.0 else None,
        capped=action.magnitude > MAX_STEPS_PER_ACTION,
    )


def horizon_after(action: Look, horizon: float) -> float:
    """Return the camera's pitch (deg) after a look action that begins at pitch `horizon`, within the limits."""
    wanted = horizon + action.magnitude * (1.0 if action.direction == "down" else -1.0)
    return max(HORIZON_UP_DEG, min(HORIZON_DOWN_DEG, wanted))


def support_facts(scene: Scene, thing: Thing, asked: list[Thing]) -> dict[str, Any]:
    """Return those fields of a thing's hidden state that say what it rests on.

    `asked` has all things whose state is requested. Only things in `asked` are reported as receptacles of the thing.
    """
    over, over_inside = receptacles_below(thing, asked)
    return {
        "support_chain": tuple(below.id for below in ancestors(scene, thing)),
        "inside": tuple(other.id for other in containers_of(scene, thing)),
        "not_on": supports_not_lain_on(scene, thing, asked),
        "over": over,
        "over_inside": over_inside,
    }


def object_state(
    world: AgentInScene, thing: Thing, box: Box, seen: ObjectVisibility, supports: dict[str, Any]
) -> ObjectState:
    """Return the hidden state of a thing. `box` is the thing's box, `seen` says what the camera sees of the thing, and
    `supports` are its `support_facts`."""
    return ObjectState(
        category=thing.category,
        position=thing.position,
        box=box,
        openness=thing.openness if thing.is_openable else None,
        is_toggled=thing.is_toggled if thing.is_toggleable else None,
        is_held=world.held == thing.id,
        visible=seen.visible,
        visible_px=seen.visible_px,
        open_px=seen.open_px,
        toggle_px=seen.toggle_px,
        nearest_visible_m=seen.nearest_m,
        box_distance_m=box.floor_distance(world.agent.position),
        center_distance_m=distance(world.agent.position, thing.position),
        parent=thing.parent,
        **supports,
    )
