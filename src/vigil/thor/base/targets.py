"""The object that an action means, and whether the agent can reach it, by THOR's rules and with THOR's messages."""

import numpy as np

from vigil.base.geometry import Vec3
from vigil.scene.things import Thing
from vigil.sim.core.views import directions_at
from vigil.thor.base.errors import ActionFailed, invalid_operation, null_reference
from vigil.thor.base.floors import AT_FLOOR_M
from vigil.thor.base.sight import visibility_of
from vigil.thor.base.world import World


def target(
    world: World, object_id: str | None, x: float | None, y: float | None, *, forced: bool
) -> tuple[Thing, Vec3]:
    """Return the object that an action means, and a point on it.

    The object is given by its id, or by a place in the image (x and y in 0..1 from the top left). Raises ActionFailed
    when there is no object, or when it is out of sight and the action is not forced.
    """
    if object_id is None:
        assert x is not None
        assert y is not None
        return _at(world, x, y, forced=forced)
    thing = world.thing(object_id)
    if not forced:
        need_interactable(world, thing)
    return thing, thing.position


def need_interactable(world: World, thing: Thing) -> None:
    """Raise ActionFailed when the agent cannot interact with a thing, by AI2-THOR's rules."""
    seen = visibility_of(world, [thing])[thing.id]
    if not seen.visible:
        raise null_reference("Target object not found within the specified visibility.")
    if not seen.interactable:
        raise null_reference(
            "Target object is visible but not interactable. It is likely obstructed by some clear object like glass."
        )


def cast_ray(world: World, x: float, y: float) -> tuple[Thing | None, Vec3 | None]:
    """Return the thing that the ray through a place in the image hits, and the point of the hit (m).

    Glass stops the ray. Raises ActionFailed.
    """
    if not (0.0 <= x <= 1.0 and 0.0 <= y <= 1.0):
        raise ActionFailed("x/y must be in [0:1]", thrown="ArgumentOutOfRangeException")
    world.need_house()
    view = world.view()
    rays, _ = directions_at(view, np.array([[x * view.width, y * view.height]]))
    return first_met(world, view.eye, rays)


def first_met(world: World, origin: Vec3, rays: np.ndarray) -> tuple[Thing | None, Vec3 | None]:
    """Return the thing that the first of the unit directions `rays` (n, 3) meets, and the point of the hit (m).

    The thing is None for structure other than floors; both are None if the ray hits nothing.
    """
    indices, distances = world.editor.meets(origin, rays)
    if not np.isfinite(distances[0]):
        return None, None
    point = Vec3(*(np.array(origin) + float(distances[0]) * rays[0]).tolist())
    if indices[0] < 0:  # structure: only floors are objects
        return (world.floors.get(world.editor.room_at(point) or "") if point.y < AT_FLOOR_M else None), point
    return list(world.editor.scene().things.values())[int(indices[0])], point


def _at(world: World, x: float, y: float, *, forced: bool) -> tuple[Thing, Vec3]:
    thing, point = cast_ray(world, x, y)
    if thing is None or point is None:
        raise invalid_operation(f"No SimObject found at (x: {x}, y: {y})")
    eye, limit = world.view().eye, world.settings.visibility_distance
    if not forced and np.hypot(point.x - eye.x, point.z - eye.z) > limit:
        raise invalid_operation(
            f"Target sim object: ({thing.id}) at screen coordinate: ({x}, {y}) is beyond your visibilityDistance: "
            f"{limit:g}!\nHint: Ignore this check by passing in forceAction=True or update visibility distance, call "
            "controller.reset(visibilityDistance=<new visibility distance>)."
        )
    return thing, point
