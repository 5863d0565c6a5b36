"""Actions on the whole scene: start, settings, cameras, and actions that only let time pass."""

from typing import Any

from vigil.base.geometry import Vec3
from vigil.thor.actions.action import Action
from vigil.thor.base.agents import place_agents
from vigil.thor.base.errors import bad_argument
from vigil.thor.base.settings import settings_of
from vigil.thor.base.world import ThirdPartyCamera, World

MOST_PIXELS = 4096
"""Greatest width and greatest height (pixels) of an image."""


def _initialize(world: World, **sent: Any) -> dict[str, float]:
    world.settings = settings_of(sent, world.settings.screen_width, world.settings.screen_height)
    if world.has_house:
        place_agents(world)
    settings = world.settings
    return {"cameraNearPlane": settings.camera_near_plane, "cameraFarPlane": settings.camera_far_plane}


def _resolution(world: World, x: int, y: int) -> None:
    if not (0 < x <= MOST_PIXELS and 0 < y <= MOST_PIXELS):
        raise bad_argument(f"a picture of {x} x {y} pixels is not possible: both must be in 1 .. {MOST_PIXELS}")
    world.settings = world.settings.model_copy(update={"screen_width": x, "screen_height": y})


def _nothing(world: World, **_: object) -> None:
    del world


def _unbreakable(world: World) -> None:
    world.unbreakable = {thing.id for thing in world.things()}


def _add_camera(
    world: World,
    position: Vec3,
    rotation: Vec3,
    fieldOfView: float = 90.0,
    orthographic: bool = False,
    orthographicSize: float | None = None,
    **_: object,
) -> None:
    world.cameras.append(_camera(position, rotation, fieldOfView, orthographic, orthographicSize))


def _camera(
    position: Vec3, rotation: Vec3, field_of_view: float, orthographic: bool, size: float | None
) -> ThirdPartyCamera:
    if not 0.0 < field_of_view < 180.0:
        raise bad_argument("fov must be set to (0, 180) noninclusive.")
    if orthographic and (size is None or size <= 0.0):
        raise bad_argument("orthographicSize must be set, and be above 0, for an orthographic camera")
    return ThirdPartyCamera(position, rotation, field_of_view, size if orthographic else None)


def _update_camera(
    world: World,
    thirdPartyCameraId: int = 0,
    position: dict[str, float] | None = None,
    rotation: dict[str, float] | None = None,
    fieldOfView: float | None = None,
    orthographic: bool | None = None,
    orthographicSize: float | None = None,
    **_: object,
) -> None:
    if not 0 <= thirdPartyCameraId < len(world.cameras):
        raise bad_argument(f"thirdPartyCameraId {thirdPartyCameraId}: there are {len(world.cameras)} cameras")
    old = world.cameras[thirdPartyCameraId]
    flat = old.orthographic_size is not None if orthographic is None else orthographic
    world.cameras[thirdPartyCameraId] = _camera(
        old.position._replace(**position or {}),
        old.rotation._replace(**rotation or {}),
        old.field_of_view if fieldOfView is None else fieldOfView,
        flat,
        old.orthographic_size if orthographicSize is None else orthographicSize,
    )


def _filter_objects(world: World, objectIds: list[str] | None = None) -> None:
    world.shown = None if objectIds is None else frozenset(objectIds)


def _emphasize(world: World, objectId: str | None = None) -> None:
    world.emphasized = None if objectId is None else world.thing(objectId).id


_CAMERA = (
    "float fieldOfView, float orthographicSize, float nearClippingPlane, float farClippingPlane, bool orthographic, "
    "any skyboxColor, any antiAliasing"
)
_ADDED = f"Vector3 position, Vector3 rotation, {_CAMERA}"
_UPDATED = f"OptionalVector3 position, OptionalVector3 rotation, {_CAMERA}, int thirdPartyCameraId"
_NO_CAMERA = (
    "no sky colours or clipping planes; orthographic images are drawn from 40 m away, so that objects far above "
    "the floor look a little larger"
)
_STILL_COVERED = "the rest of the image is black, and what is in front of the object still covers it"
_AT_REST = "nothing moves by itself: everything is always at rest"
_ONE_AGENT = "agentMode default or locobot; no normals and no flow; settings of physics and light do nothing"

ACTIONS = (
    Action("Initialize", _initialize, takes_anything=True, lacks=_ONE_AGENT),
    Action("ChangeResolution", _resolution, "int x, int y", "x y"),
    Action("ChangeQuality", _nothing, "string quality", lacks="the engine's option `--render-quality` decides"),
    Action("ChangeOpenSpeed", _nothing, "float x", "x", lacks="objects open at once, whatever the speed"),
    Action("AddThirdPartyCamera", _add_camera, _ADDED, "position rotation", lacks=_NO_CAMERA),
    Action("UpdateThirdPartyCamera", _update_camera, _UPDATED, lacks=_NO_CAMERA),
    Action("SetObjectFilter", _filter_objects, "list objectIds", "objectIds"),
    Action("ResetObjectFilter", _filter_objects),
    Action("EmphasizeObject", _emphasize, "string objectId", "objectId", lacks=_STILL_COVERED),
    Action("UnemphasizeAll", _emphasize),
    Action("Pass", _nothing),
    Action("Done", _nothing),
    Action("PausePhysicsAutoSim", _nothing, takes_anything=True, lacks=_AT_REST),
    Action("UnpausePhysicsAutoSim", _nothing, takes_anything=True, lacks=_AT_REST),
    Action("AdvancePhysicsStep", _nothing, takes_anything=True, lacks=_AT_REST),
    Action("MakeAllObjectsUnbreakable", _unbreakable),
)
