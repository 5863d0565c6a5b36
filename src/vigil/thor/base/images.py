"""Images in AI2-THOR's form (raw bytes, the bottom row first), and the colours of objects and classes."""

import hashlib
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from vigil.base.geometry import Vec3, heading
from vigil.sim.core.views import directions_at
from vigil.sim.scene_editor import STRUCTURES, CameraImage, CameraView, Layer
from vigil.thor.base.floors import rooms_at
from vigil.thor.base.world import ThirdPartyCamera, World

Wanted = Literal["all", "without colours", "none"]
"""The images that an answer should have: all, all except colour images ("rgb"), or none."""
OPAQUE = 255
MAGENTA = np.array([255, 0, 255], np.uint8)
"""Colour in which `EmphasizeObject` shows the object."""
FAR_AWAY_M = 40.0
"""Distance (m) from which a camera imitates an orthographic camera. From there, farther things hardly look smaller."""
NUMBER_OF_FLOOR = -2 - STRUCTURES.index("floor")
"""Value of the pixels of floors in an image of things' numbers."""
_THINGS: frozenset[Layer] = frozenset({"things"})
_STRUCTURE_CLASSES = {"wall": "Wall", "floor": "Floor", "ceiling": "Ceiling"}


@dataclass(frozen=True, slots=True)
class Image:
    """One image of an answer."""

    kind: str
    """Kind of the image: "image", "depth", "ids" or "classes"."""
    is_third_party: bool
    """Whether the image is of a camera that the client added."""
    data: bytes


def camera_images(world: World, wanted: Wanted) -> Iterator[Image]:
    """Yield the images of the cameras that the client added; `wanted` says which."""
    for camera in world.cameras if world.has_house else ():
        yield from _of(world, _third_party_view(world, camera), _layers(world, wanted), is_third_party=True)


def agent_images(world: World, wanted: Wanted) -> Iterator[Image]:
    """Yield the images of the agent that acts; `wanted` says which."""
    layers = _layers(world, wanted)
    if world.has_house:
        yield from _of(world, world.view(), layers, is_third_party=False)
        return
    width, height = world.settings.screen_width, world.settings.screen_height
    nothing = np.full((height, width), -1, dtype=np.int32)
    black = CameraImage(np.zeros((height, width, 3), np.uint8), np.full((height, width), np.inf, np.float32), nothing)
    yield from _encoded(world, black, layers, is_third_party=False)


def with_floors(world: World, view: CameraView, things: np.ndarray) -> np.ndarray:
    """Return an image (height, width) of things' numbers; floors have the numbers after that of the last thing."""
    rows, columns = np.nonzero(things == NUMBER_OF_FLOOR)
    rays, _ = directions_at(view, np.column_stack([columns, rows]) + 0.5)
    reach = -view.eye.y / np.minimum(rays[:, 1], -1e-9)
    places = np.column_stack([view.eye.x + reach * rays[:, 0], view.eye.z + reach * rays[:, 2]])
    scene = world.editor.scene()
    rooms = rooms_at(scene.rooms, places)
    numbered = things.copy()
    numbered[rows, columns] = np.where(rooms < 0, NUMBER_OF_FLOOR, len(scene.things) + rooms)
    return numbered


def _layers(world: World, wanted: Wanted) -> frozenset[Layer]:
    """Return the layers that both the settings and `wanted` ask for."""
    settings = world.settings
    is_drawn: dict[Layer, bool] = {
        "rgb": settings.render_image and wanted == "all",
        "depth": settings.render_depth_image,
        "things": settings.render_instance_segmentation or settings.render_semantic_segmentation,
    }
    return frozenset(layer for layer, drawn in is_drawn.items() if drawn and wanted != "none")


def _of(world: World, view: CameraView, layers: frozenset[Layer], *, is_third_party: bool) -> Iterator[Image]:
    drawn = layers | _THINGS if world.emphasized and "rgb" in layers else layers
    picture = world.editor.render_view(view, drawn, with_hand=not is_third_party) if drawn else CameraImage()
    if picture.things is not None:
        things = with_floors(world, view, picture.things)
        picture = replace(picture, things=things)
        if world.emphasized:
            number = [*world.editor.scene().things, *world.floors].index(world.emphasized)
            picture = replace(picture, rgb=np.where(things[..., None] == number, MAGENTA, np.uint8(0)))
    yield from _encoded(world, picture, layers, is_third_party=is_third_party)


def _encoded(world: World, picture: CameraImage, layers: frozenset[Layer], *, is_third_party: bool) -> Iterator[Image]:
    if picture.rgb is not None and "rgb" in layers:
        yield Image("image", is_third_party, picture.rgb[::-1].tobytes())
    if picture.depth is not None and "depth" in layers:
        metres = np.minimum(picture.depth, np.float32(world.settings.camera_far_plane))
        yield Image("depth", is_third_party, metres[::-1].astype("<f4").tobytes())
    if picture.things is not None and "things" in layers:
        things = {**world.editor.scene().things, **world.floors} if world.has_house else {}
        if world.settings.render_instance_segmentation:
            yield Image("ids", is_third_party, _painted(picture.things, _palette(list(things))))
        if world.settings.render_semantic_segmentation:
            palette = _palette([thing.category for thing in things.values()])
            yield Image("classes", is_third_party, _painted(picture.things, palette))


def _painted(things: np.ndarray, palette: np.ndarray) -> bytes:
    """Return the bytes of an image in which thing i has colour i of a palette (n, 3).

    The last rows of the palette are the colours of negative numbers, which stand for structure and sky.
    """
    opaque = np.concatenate([palette, np.full((len(palette), 1), OPAQUE, np.uint8)], axis=1)
    return opaque[things[::-1]].tobytes()


def colour_of(name: str) -> list[int]:
    """Return the colour (3 bytes) of an object or class; it depends only on the name and is never black."""
    return [byte | 1 for byte in hashlib.sha256(name.encode()).digest()[:3]]


def colours(world: World) -> list[dict[str, object]]:
    """Return the metadata that say which colour each object and each class has."""
    things = [*world.things(), *world.floors.values()]
    classes = sorted({*(thing.category for thing in things), *_STRUCTURE_CLASSES.values()})
    return [{"name": name, "color": colour_of(name)} for name in [*(thing.id for thing in things), *classes]]


def _palette(names: list[str]) -> np.ndarray:
    structure = [_STRUCTURE_CLASSES[kind] for kind in reversed(STRUCTURES)]
    rows = [colour_of(name) for name in [*names, *structure]]
    return np.array([*rows, [0, 0, 0]], dtype=np.uint8)


def _third_party_view(world: World, camera: ThirdPartyCamera) -> CameraView:
    settings = world.settings
    yaw, pitch, fovy, eye = camera.rotation.y, camera.rotation.x, camera.field_of_view, camera.position
    pitch = (pitch + 180.0) % 360.0 - 180.0
    if camera.orthographic_size is not None:
        ahead_x, ahead_z = heading(yaw)
        level, down = math.cos(math.radians(pitch)), math.sin(math.radians(pitch))
        to_floor = eye.y / down if down > 1e-3 else 0.0
        back = FAR_AWAY_M - to_floor
        eye = Vec3(eye.x - back * ahead_x * level, eye.y + back * down, eye.z - back * ahead_z * level)
        fovy = 2 * math.degrees(math.atan(camera.orthographic_size / FAR_AWAY_M))
    return CameraView(eye, yaw, pitch, fovy, settings.screen_width, settings.screen_height, camera.rotation.z)
