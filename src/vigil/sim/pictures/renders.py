"""Pictures that no agent sees: one asset on a plain stage, or a whole house from above."""

import numpy as np

from vigil.assets.kernel.asset import Asset
from vigil.base.geometry import Vec3
from vigil.protocol.house import MaterialRef
from vigil.protocol.observation import FRAME_HEIGHT, FRAME_WIDTH, Quality
from vigil.rendering.viewer import Viewer
from vigil.scene.things import RoomShape, Scene, Thing
from vigil.sim.engines.mujoco.camera import Camera
from vigil.sim.engines.mujoco.compiled import frames
from vigil.sim.engines.mujoco.compiled.builder import HIDDEN
from vigil.sim.engines.mujoco.compiled.model import build

STAGE_FOVY_DEG = 32.0
BIRD_FOVY_DEG = 40.0
BIRD_MARGIN = 1.06
"""Factor by which the sides of the area in a picture from above are longer than the sides of the house."""
_PAPER = MaterialRef(name="plastic/#c3c6c8")


def render_asset(
    asset: Asset, *, openness: float = 0.0, is_toggled: bool = False, yaw: float = 30.0, pitch: float = 22.0
) -> np.ndarray:
    """Return a picture (480, 640, 3) of one asset, seen from `yaw` degrees off its front and `pitch` degrees up."""
    size = np.array(asset.size, dtype=float)
    radius = float(np.linalg.norm(size)) / 2
    thing = Thing(
        "asset", asset.category, asset, Vec3(0.0, size[1] / 2, 0.0), Vec3(0.0, 0.0, 0.0),
        openness=openness, is_toggled=is_toggled,
    )  # fmt: skip
    scene = Scene(rooms=[_floor(radius)], panels=[], things={thing.id: thing})
    middle = frames.points(np.array([0.0, size[1] / 2, 0.0]))
    back = frames.points(_direction(yaw, pitch))
    distance = 1.25 * radius / np.sin(np.radians(STAGE_FOVY_DEG / 2))
    return _picture(scene, _looking_back(middle + distance * back, back, STAGE_FOVY_DEG), "default")


def render_birdseye(scene: Scene, quality: Quality = "default") -> np.ndarray:
    """Return a picture (480, width, 3) of a house from above, without ceilings; +z of THOR's frame points up.

    The width depends on the house's shape; it is at most 640.
    """
    corners = np.concatenate([room.polygon for room in scene.rooms])
    low, high = corners.min(axis=0), corners.max(axis=0)
    (x, z), extent = (low + high) / 2, high - low
    height = max(room.height for room in scene.rooms)
    half = BIRD_MARGIN / 2 * max(extent[1], extent[0] * FRAME_HEIGHT / FRAME_WIDTH)
    width = round(FRAME_HEIGHT * BIRD_MARGIN * extent[0] / (2 * half))
    back = frames.points(_direction(180.0, 82.0))
    eye = frames.points(np.array([x, height, z])) + back * half / np.tan(np.radians(BIRD_FOVY_DEG / 2))
    return _picture(scene, _looking_back(eye, back, BIRD_FOVY_DEG, width), quality)


def _looking_back(eye: np.ndarray, back: np.ndarray, fovy_deg: float, width: int = FRAME_WIDTH) -> Viewer:
    """Return a camera; the unit vector `back` (MuJoCo's frame) points from what it looks at to the camera."""
    right = np.cross([0.0, 0.0, 1.0], back)
    right /= np.linalg.norm(right)
    return Viewer(eye, np.stack([right, np.cross(back, right), back], axis=1), fovy_deg, width, FRAME_HEIGHT)


def _picture(scene: Scene, viewer: Viewer, quality: Quality) -> np.ndarray:
    model = build(scene)
    unwanted = [geom for geom, kind in enumerate(model.render_scene.structure_kinds) if kind in ("ceiling", "ground")]
    model.groups[unwanted] = HIDDEN
    camera = Camera(model, quality)
    try:
        return camera.draw_from(viewer)
    finally:
        camera.close()


def _direction(yaw: float, pitch: float) -> np.ndarray:
    """Return the unit vector (THOR's frame) towards an eye `yaw` degrees off the front and `pitch` degrees up."""
    level = np.cos(np.radians(pitch))
    return np.array([level * np.sin(np.radians(yaw)), np.sin(np.radians(pitch)), level * np.cos(np.radians(yaw))])


def _floor(radius: float) -> RoomShape:
    reach = max(6.0, 8.0 * radius)
    return RoomShape(
        id="stage",
        room_type="Stage",
        polygon=np.array([(-reach, -reach), (reach, -reach), (reach, reach), (-reach, reach)]),
        height=reach,
        floor_material=_PAPER,
        ceiling_material=None,
        light=Vec3(0.0, reach, 0.0),
        light_rgb=(1.0, 1.0, 1.0),
    )
