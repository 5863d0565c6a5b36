"""The world that actions change: a house on a stage, the settings, and the cameras besides the agent's."""

import math
from dataclasses import dataclass, field

from vigil.base.geometry import EYE_HEIGHT_M, Pose, Vec3
from vigil.scene.things import Thing
from vigil.sim.scene_editor import CameraView, SceneEditor
from vigil.sim.thor.units import BODY_HEIGHT_M
from vigil.thor.base.errors import bad_argument, invalid_operation
from vigil.thor.base.settings import Settings

PROCEDURAL = "Procedural"
OFF_GRID_M = 1e-3


@dataclass(frozen=True, slots=True)
class ThirdPartyCamera:
    """A camera that a program added."""

    position: Vec3
    rotation: Vec3
    field_of_view: float
    orthographic_size: float | None = None
    """Half of the height (m) that it shows; None for a camera with perspective."""


@dataclass(slots=True)
class World:
    """All that the engine knows."""

    editor: SceneEditor
    settings: Settings = field(default_factory=Settings)
    has_house: bool = False
    cameras: list[ThirdPartyCamera] = field(default_factory=list)
    assets: dict[str, str] = field(default_factory=dict)
    """The asset that the house names for each of its objects, doors and windows."""
    shown: frozenset[str] | None = None
    """Ids of the objects that metadata are confined to; None for all."""
    serves_patches: bool = True
    """Whether the wire can send an answer without pictures."""

    @property
    def agent(self) -> Pose:
        """Where the agent stands. Raises ActionFailed before `CreateHouse`."""
        self.need_house()
        return self.editor.world([]).agent

    def need_house(self) -> None:
        """Raises ActionFailed before `CreateHouse`."""
        if not self.has_house:
            raise invalid_operation("There is no house yet: call CreateHouse, or give the Controller a house as scene")

    def on_grid(self, place: Vec3) -> Vec3:
        """Return the nearest place of the grid through the agent; without snapToGrid, the place itself."""
        if not self.settings.snap_to_grid:
            return place
        (x, _, z), size = self.agent.position, self.settings.grid_size
        return Vec3(x + round((place.x - x) / size) * size, place.y, z + round((place.z - z) / size) * size)

    def is_on_grid(self, place: Vec3) -> bool:
        """Whether a place is of the grid that snapToGrid holds to."""
        return math.dist(self.on_grid(place), place) <= OFF_GRID_M

    def can_be_at(self, place: Vec3) -> bool:
        """Whether the agent's body fits at a place on the floor, or is there already."""
        here = self.agent.position
        return math.hypot(place.x - here.x, place.z - here.z) <= OFF_GRID_M or self.editor.can_stand(place)

    def thing(self, object_id: str) -> Thing:
        """Return a thing that is in the house. Raises ActionFailed."""
        self.need_house()
        found = self.editor.scene().things.get(object_id)
        if found is None or not found.is_present:
            raise bad_argument(f"objectId: {object_id} is not the objectId on any object in the scene!")
        return found

    def things(self) -> list[Thing]:
        """Return what is in the house, in the document's order."""
        return [thing for thing in self.editor.scene().things.values() if thing.is_present] if self.has_house else []

    @property
    def held(self) -> str | None:
        """Id of what is in the hand."""
        return self.editor.world([]).held if self.has_house else None

    def view(self, agent: Pose | None = None) -> CameraView:
        """Return the camera of the agent, or of one at another pose."""
        pose = agent or self.agent
        settings = self.settings
        return CameraView(
            eye_of(pose),
            pose.rotation,
            pose.horizon,
            settings.field_of_view,
            settings.screen_width,
            settings.screen_height,
        )


def eye_of(pose: Pose) -> Vec3:
    """Return where the eye is, standing or crouching."""
    x, y, z = pose.position
    return Vec3(x, y + (EYE_HEIGHT_M if pose.standing else BODY_HEIGHT_M), z)


def body_of(pose: Pose) -> Vec3:
    """Return what THOR calls the agent's position."""
    x, y, z = pose.position
    return Vec3(x, y + BODY_HEIGHT_M, z)
