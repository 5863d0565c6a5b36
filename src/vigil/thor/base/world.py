"""The world that actions change: a house in a simulator, the settings, and the cameras that the client adds."""

import math
from dataclasses import dataclass, field
from random import Random
from typing import Any

from vigil.base.geometry import EYE_HEIGHT_M, Pose, Vec3
from vigil.errors import EpisodeError
from vigil.protocol.house import House
from vigil.protocol.world import ObjectSetup, Setup
from vigil.scene.things import Thing
from vigil.sim.scene_editor import CameraView, SceneEditor
from vigil.sim.thor.units import BODY_HEIGHT_M
from vigil.thor.base.errors import bad_argument, invalid_operation
from vigil.thor.base.settings import Settings

PROCEDURAL = "Procedural"
"""Name of the scene for all houses that are given to `CreateHouse`."""
LOCOBOT_CAMERA_M = 0.0312
"""The position that AI2-THOR reports for a LoCoBot is this far (m) above the LoCoBot's camera."""
NO_TURN = Vec3(0.0, 0.0, 0.0)
OFF_GRID_M = 1e-3
"""A place at most this far (m) from a point of the grid counts as on the grid."""


@dataclass(frozen=True, slots=True)
class ThirdPartyCamera:
    """A camera that the client added."""

    position: Vec3
    rotation: Vec3
    """Rotation in degrees: x is the pitch, y the yaw, z the roll."""
    field_of_view: float
    """Vertical field of view in degrees."""
    orthographic_size: float | None = None
    """Half of the height (m) that an orthographic camera shows; None for a camera with perspective."""


@dataclass(frozen=True, slots=True)
class Waiting:
    """An agent that does not act now."""

    pose: Pose
    held: str | None = None
    """Id of the object in its hand; None when the hand is empty."""
    place: Vec3 = NO_TURN
    """Position (m) of the held object."""
    rotation: Vec3 = NO_TURN
    """Rotation (deg) of the held object."""
    hand_turn: Vec3 = NO_TURN


@dataclass(slots=True)
class World:
    """The state of the engine: the open house, the settings, and what the client's actions have changed."""

    editor: SceneEditor
    settings: Settings = field(default_factory=Settings)
    has_house: bool = False
    house: House | None = None
    """The document of the house that was opened last."""
    first_house: House | None = None
    """The document of the opened house, as it was before actions changed its materials and lights."""
    random: Random = field(default_factory=lambda: Random(0))
    """Random numbers for actions that do not take a seed; `SetRandomSeed` starts the sequence again."""
    scene_name: str = PROCEDURAL
    """Name of the scene as the client gave it; "Procedural" for a house given to `CreateHouse`."""
    notes: list[str] = field(default_factory=list)
    """Notes of what the engine guessed or left out when it opened the house."""
    knows_sizes: bool = False
    """Whether the engine has the sizes of AI2-THOR's assets."""
    cameras: list[ThirdPartyCamera] = field(default_factory=list)
    assets: dict[str, str] = field(default_factory=dict)
    """Id of an object, door or window -> id of its asset in the house document."""
    floors: dict[str, Thing] = field(default_factory=dict)
    """The floors of the rooms as things, by the room's id."""
    flags: dict[str, dict[str, Any]] = field(default_factory=dict)
    """Id of an object -> flags that have been set since the house was created, e.g. `isSliced`."""
    unbreakable: set[str] = field(default_factory=set)
    """Ids of the objects that cannot break."""
    hand_turn: Vec3 = NO_TURN
    """Rotation (deg) of the hand relative to the agent since the held object was picked up."""
    active: int = 0
    """Number of the agent that acts, which is the simulator's agent."""
    waiting: dict[int, Waiting] = field(default_factory=dict)
    """The other agents, by number."""
    emphasized: str | None = None
    """Id of the object that images show in one colour, with everything else black; None if images are as usual."""
    shown: frozenset[str] | None = None
    """Ids of the objects that the metadata may include; None if all objects are included."""
    serves_patches: bool = True
    """Whether the connection can send the client an answer without images (a patch)."""

    @property
    def agent(self) -> Pose:
        """Pose of the agent. Raises ActionFailed before `CreateHouse`."""
        self.need_house()
        return self.editor.world([]).agent

    def need_house(self) -> None:
        """Raise ActionFailed if no house has been opened yet."""
        if not self.has_house:
            raise invalid_operation("There is no house yet: call CreateHouse, or give the Controller a house as scene")

    def on_grid(self, place: Vec3) -> Vec3:
        """Return the nearest point of the grid through the agent's position; without `snapToGrid`, the place itself."""
        if not self.settings.snap_to_grid:
            return place
        (x, _, z), size = self.agent.position, self.settings.grid_size
        return Vec3(x + round((place.x - x) / size) * size, place.y, z + round((place.z - z) / size) * size)

    def is_on_grid(self, place: Vec3) -> bool:
        """Return whether a place is on the grid through the agent's position; True without `snapToGrid`."""
        return math.dist(self.on_grid(place), place) <= OFF_GRID_M

    def can_be_at(self, place: Vec3) -> bool:
        """Return whether the agent's body fits at a place on the floor; True also for the agent's own place."""
        here = self.agent.position
        return math.hypot(place.x - here.x, place.z - here.z) <= OFF_GRID_M or self.editor.can_stand(place)

    def thing(self, object_id: str) -> Thing:
        """Return the thing with an id. Raises ActionFailed when it is not in the house."""
        self.need_house()
        found = self.editor.scene().things.get(object_id) or self.floors.get(object_id)
        if found is None or not found.is_present:
            raise bad_argument(f"objectId: {object_id} is not the objectId on any object in the scene!")
        return found

    def things(self) -> list[Thing]:
        """Return the things that are in the house, in the scene's order; none before `CreateHouse`."""
        return [thing for thing in self.editor.scene().things.values() if thing.is_present] if self.has_house else []

    def apply_changes(self, objects: dict[str, ObjectSetup], held: str | None = None) -> None:
        """Change objects as an episode's setup does, and put the object `held` into the hand. Raises ActionFailed."""
        try:
            self.editor.apply_changes(Setup(objects=objects, held=held))
        except EpisodeError as error:
            raise bad_argument(str(error)) from None
        except ValueError as error:
            raise bad_argument(f"these changes contradict each other: {error}") from None

    @property
    def held(self) -> str | None:
        """Id of the object in the hand; None when the hand is empty."""
        return self.editor.world([]).held if self.has_house else None

    def eye_of(self, pose: Pose) -> Vec3:
        """Return the position of the camera of the agent at a pose, standing or crouching."""
        x, y, z = pose.position
        if self.settings.is_locobot:
            return Vec3(x, y + BODY_HEIGHT_M - LOCOBOT_CAMERA_M, z)
        return Vec3(x, y + (EYE_HEIGHT_M if pose.standing else BODY_HEIGHT_M), z)

    def view(self, agent: Pose | None = None) -> CameraView:
        """Return the agent's camera at its current pose, or at the pose `agent`."""
        pose = agent or self.agent
        settings = self.settings
        return CameraView(
            self.eye_of(pose),
            pose.rotation,
            pose.horizon,
            settings.field_of_view,
            settings.screen_width,
            settings.screen_height,
        )


def agent_position(pose: Pose) -> Vec3:
    """Return the position that AI2-THOR reports for an agent at a pose."""
    x, y, z = pose.position
    return Vec3(x, y + BODY_HEIGHT_M, z)
