"""Actions that move the agent: walking, turning, looking, teleporting and crouching."""

import math
from functools import partial

from vigil.base.geometry import Pose, Vec3, rotate_floor, wrap_deg
from vigil.sim.thor.units import BODY_HEIGHT_M
from vigil.thor.actions.action import Action
from vigil.thor.base.agents import agent_between
from vigil.thor.base.errors import ActionFailed, invalid_operation
from vigil.thor.base.settings import RIGHT_ANGLE
from vigil.thor.base.world import World, agent_position

OFF_FLOOR_M = 0.05
"""The target of a teleport is on the floor if its height differs from the floor's by at most this (m)."""
FREE_LOOK_DEG = 30.0
"""Angle (deg) by which LookUp and LookDown tilt the camera if `degrees` is not given."""


def _walk(world: World, right: float, ahead: float) -> None:
    """Move the agent by `right` and `ahead` (m) in its own frame, all the way or not at all. Raises ActionFailed."""
    pose = world.agent
    x, z = rotate_floor(right, ahead, pose.rotation)
    end = world.on_grid(Vec3(pose.position.x + x, pose.position.y, pose.position.z + z))
    blocker = world.editor.blocker(pose.position, end)
    if blocker == "exterior":
        raise invalid_operation(f"Scene bounds do not contain target position ({end.x:.4f}, {end.y:.4f}, {end.z:.4f})")
    other = agent_between(world, pose.position, end)
    if blocker is not None or other is not None:
        what = blocker or f"Agent {other}"
        raise ActionFailed(f"{what} is blocking Agent {world.active} from moving by ({x:.4f}, 0.0000, {z:.4f}).")
    world.editor.stand(pose.model_copy(update={"position": end}))


def _move(right: float, ahead: float, world: World, moveMagnitude: float | None = None, **_: object) -> None:
    length = world.settings.grid_size if moveMagnitude is None else moveMagnitude
    if length <= 0.0:
        raise invalid_operation("moveMagnitude must be > 0")
    _walk(world, right * length, ahead * length)


def _move_agent(world: World, ahead: float = 0.0, right: float = 0.0, **_: object) -> None:
    if ahead == 0.0 and right == 0.0:
        raise invalid_operation("ahead and right cannot both be 0")
    _walk(world, right, ahead)


def _turn(sign: float, world: World, degrees: float | None = None, **_: object) -> None:
    turn_deg = sign * (world.settings.rotate_step_degrees if degrees is None else degrees)
    if turn_deg == 0.0:
        raise invalid_operation("Rotate action requires degrees to be set to a number other than 0")
    pose = world.agent
    turned = wrap_deg(pose.rotation + turn_deg)
    if world.settings.snap_to_grid:
        turned = wrap_deg(round(turned / RIGHT_ANGLE) * RIGHT_ANGLE)
    world.editor.stand(pose.model_copy(update={"rotation": turned}))


def _look(sign: float, world: World, degrees: float = 0.0, **_: object) -> None:
    if degrees < 0.0:
        raise invalid_operation(f"{degrees} is not valid, degrees must be >= 0")
    if not math.isclose(degrees * 10, round(degrees * 10), abs_tol=1e-6):
        raise invalid_operation(f"{degrees} is not valid, degrees must be a multiple of 0.1")
    pose, settings = world.agent, world.settings
    horizon = round(pose.horizon + sign * (degrees or FREE_LOOK_DEG), 6)
    if sign > 0.0 and horizon > settings.looks_down:
        raise ActionFailed(f"can't look down beyond {settings.looks_down:g} degrees below the forward horizon")
    if sign < 0.0 and horizon < -settings.looks_up:
        raise ActionFailed(f"can't look up beyond {settings.looks_up:g} degrees above the forward horizon")
    world.editor.stand(pose.model_copy(update={"horizon": horizon}))


def _rotate_look(world: World, rotation: Vec3 | None = None, horizon: float = 0.0, **_: object) -> None:
    turned = wrap_deg(0.0 if rotation is None else rotation.y)
    world.editor.stand(world.agent.model_copy(update={"rotation": turned, "horizon": horizon}))


def _teleport(  # takes both of THOR's forms: position, or x, y and z
    world: World,
    position: Vec3 | None = None,
    x: float | None = None,
    y: float | None = None,
    z: float | None = None,
    rotation: Vec3 | None = None,
    horizon: float | None = None,
    standing: bool | None = None,
    forceAction: bool = False,
) -> None:
    if standing is not None and world.settings.is_locobot:
        raise ActionFailed("A locobot cannot stand or crouch: leave `standing` out", code="InvalidArgument")
    pose = world.agent
    here = agent_position(pose)
    place = position or Vec3(here.x if x is None else x, here.y if y is None else y, here.z if z is None else z)
    wanted = Pose(
        position=Vec3(place.x, place.y - BODY_HEIGHT_M, place.z),
        rotation=pose.rotation if rotation is None else wrap_deg(rotation.y),
        horizon=pose.horizon if horizon is None else horizon,
        standing=pose.standing if standing is None else standing,
    )
    if not forceAction:
        _check_pose(world, wanted)
        wanted = wanted.model_copy(update={"position": wanted.position._replace(y=0.0)})
    world.editor.stand(wanted)


def _check_pose(world: World, pose: Pose) -> None:
    settings, (x, y, z) = world.settings, pose.position
    if not -settings.looks_up <= pose.horizon <= settings.looks_down:
        raise invalid_operation(
            f"Each horizon must be in [{-settings.looks_up:g}:{settings.looks_down:g}]. You gave {pose.horizon:g}."
        )
    if abs(y) > OFF_FLOOR_M:
        raise invalid_operation(
            f"y={y + BODY_HEIGHT_M:.4f} is not on the floor, where the agent's position has y={BODY_HEIGHT_M:.4f}"
        )
    if not world.is_on_grid(pose.position):
        here = world.agent.position
        raise invalid_operation(
            f"({x:.4f}, {z:.4f}) is off the grid of {settings.grid_size:g} m through the agent at "
            f"({here.x:.4f}, {here.z:.4f}), but snapToGrid allows only points of the grid"
        )
    if not world.can_be_at(pose.position) or agent_between(world, pose.position, pose.position) is not None:
        raise invalid_operation(f"Collided with something, or outside of the rooms, at ({x:.4f}, {z:.4f})")


def _stand(world: World, *, standing: bool) -> None:
    pose = world.agent
    if world.settings.is_locobot:
        raise ActionFailed("A locobot cannot stand or crouch")
    if pose.standing == standing:
        raise ActionFailed(f"Already {'standing' if standing else 'crouching'}")
    world.editor.stand(pose.model_copy(update={"standing": standing}))


_MOVE = "float moveMagnitude, float noise, bool forceAction, bool snapToGrid, bool manualInteract"
_MOVE_AGENT = "float ahead, float right, float speed, bool returnToStart, bool disableRendering"
_TURN = "float degrees, bool manualInteract, bool forceAction, float speed"
_LOOK = "float degrees, bool manualInteract"
_POSE = "Vector3 position, float x, float y, float z, Vector3 rotation, float horizon, bool standing, bool forceAction"
_NO_NOISE = "noise and forceAction do nothing; the held object never collides"
_NO_HAND = "the held object never collides"
_NO_LIMITS = "the limits of the head's pitch are not checked"
_POSTURE_STAYS = "without `standing` the agent stands or crouches as before"

ACTIONS = (
    Action("MoveAhead", partial(_move, 0.0, 1.0), _MOVE, lacks=_NO_NOISE),
    Action("MoveBack", partial(_move, 0.0, -1.0), _MOVE, lacks=_NO_NOISE),
    Action("MoveRight", partial(_move, 1.0, 0.0), _MOVE, lacks=_NO_NOISE),
    Action("MoveLeft", partial(_move, -1.0, 0.0), _MOVE, lacks=_NO_NOISE),
    Action("MoveAgent", _move_agent, _MOVE_AGENT, lacks="the agent arrives at once, whatever the speed"),
    Action("RotateRight", partial(_turn, 1.0), _TURN, lacks=_NO_HAND),
    Action("RotateLeft", partial(_turn, -1.0), _TURN, lacks=_NO_HAND),
    Action("RotateAgent", partial(_turn, 1.0), _TURN, "degrees", lacks=_NO_HAND),
    Action("LookUp", partial(_look, -1.0), _LOOK),
    Action("LookDown", partial(_look, 1.0), _LOOK),
    Action("RotateLook", _rotate_look, "Vector3 rotation, float horizon", takes_anything=True, lacks=_NO_LIMITS),
    Action("Teleport", _teleport, _POSE, lacks=_NO_HAND),
    Action(
        "TeleportFull", _teleport, _POSE, "position rotation horizon | x y z rotation horizon", lacks=_POSTURE_STAYS
    ),
    Action("Crouch", partial(_stand, standing=False)),
    Action("Stand", partial(_stand, standing=True)),
)
