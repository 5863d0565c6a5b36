"""Portraits: pictures of single things as an agent sees them. People look at them to judge whether a thing and its
state can be recognised."""

import zlib
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from vigil.assets.catalog import CATALOG
from vigil.base.geometry import EYE_HEIGHT_M, Pose, Vec3
from vigil.protocol.observation import Quality
from vigil.scene.geometry import box_corners, place_of
from vigil.scene.things import Scene, Thing
from vigil.sim.core.sight import project
from vigil.sim.engines.mujoco.engine import MujocoEngine
from vigil.sim.pictures.staged_scenes import SUBJECT, SceneSubject, staged_scene, states_of

SPAN_PX = 120
NEAREST_M, FARTHEST_M = 0.3, 1.5
STEEPEST_DOWN_DEG, STEEPEST_UP_DEG = 48.0, 30.0
SIDEWAYS_DEG = 25.0
_STEP_M, _REACH_M = 0.01, 9.0
CELL_PX = (192, 144)
"""Width and height (pixels) of one picture in a contact sheet. The picture is the middle part of a frame."""
COLUMNS, LINE_PX = 8, 16


@dataclass(frozen=True, slots=True)
class CameraPlacement:
    """The camera's pose in a portrait, and where the thing's box is in the frame."""

    agent: Pose
    distance_m: float
    """Distance (m) from the eye to the nearest point of the thing's box."""
    box_px: tuple[float, float, float, float]
    """Left, top, right and bottom (pixels) of the thing's box in the frame."""

    @property
    def span_px(self) -> float:
        """Length (pixels) of the longer side of the thing's box in the frame."""
        left, top, right, bottom = self.box_px
        return max(right - left, bottom - top)


def render_object(
    subject: SceneSubject, seed: int, distance_m: float | None = None, quality: Quality = "default"
) -> np.ndarray:
    """Return a frame (480, 640, 3) that shows a subject at a typical place for its category.

    `distance_m` is the camera's distance. By default it is the least distance from 0.3 to 1.5 m at which the subject is
    at most `SPAN_PX` large.
    """
    return render_with_placement(subject, seed, distance_m, quality)[0]


def stage_subject(subject: SceneSubject, seed: int, distance_m: float | None) -> tuple[Scene, CameraPlacement]:
    """Return the scene of a subject's portrait, and the camera's placement. Raises ValueError like `view_of`."""
    rng = np.random.default_rng([seed, subject.variant, zlib.crc32(subject.category.encode())])
    scene = staged_scene(subject, rng)
    return scene, view_of(scene.things[SUBJECT], float(rng.uniform(-SIDEWAYS_DEG, SIDEWAYS_DEG)), distance_m)


def render_with_placement(
    subject: SceneSubject, seed: int, distance_m: float | None, quality: Quality
) -> tuple[np.ndarray, CameraPlacement]:
    """Return a subject's portrait, and the placement of the camera."""
    scene, view = stage_subject(subject, seed, distance_m)
    engine = MujocoEngine(quality)
    engine.load(scene)
    try:
        return engine.draw(view.agent, None), view
    finally:
        engine.close()


def view_of(thing: Thing, sideways_deg: float, distance_m: float | None = None) -> CameraPlacement:
    """Return the placement of a camera that looks at the middle of a thing that faces +z.

    The camera is `sideways_deg` off the thing's front. Raises ValueError if the whole thing is not visible from
    anywhere.
    """
    half = np.array(thing.asset.size) / 2
    place = place_of(thing)
    corners = place(box_corners(-half, half))
    for reach in np.arange(_STEP_M, _REACH_M, _STEP_M):
        agent = _towards(np.array(thing.position), float(reach), sideways_deg)
        local = place.inverse()(np.array(agent.eye)[None])[0]
        near = float(np.linalg.norm(np.maximum(np.abs(local) - half, 0.0)))
        if near < (NEAREST_M if distance_m is None else distance_m):
            continue
        view = CameraPlacement(agent, near, _bounds(project(agent, corners)))
        if distance_m is not None or view.span_px <= SPAN_PX or near >= FARTHEST_M:
            return view
    raise ValueError(
        f"There is no place in the room from which a whole {thing.category} of size {thing.asset.size} is in view."
    )


def _bounds(flat: np.ndarray) -> tuple[float, float, float, float]:
    """Return left, top, right and bottom (pixels) of projected points (n, 3); infinite if a point is behind the eye."""
    if (flat[:, 2] <= 0).any():
        return -np.inf, -np.inf, np.inf, np.inf
    (left, top), (right, bottom) = flat[:, :2].min(axis=0), flat[:, :2].max(axis=0)
    return float(left), float(top), float(right), float(bottom)


def _towards(middle: np.ndarray, reach: float, sideways_deg: float) -> Pose:
    """Return a pose that looks at `middle` from `reach` metres away. The eye is at standing height, unless it would
    then look too steeply up or down."""
    steepest = np.sin(np.radians([-STEEPEST_UP_DEG, STEEPEST_DOWN_DEG]))
    sine = float(np.clip((EYE_HEIGHT_M - middle[1]) / reach, *steepest))
    level, yaw = reach * np.sqrt(1.0 - sine**2), np.radians(sideways_deg)
    x, y, z = middle + np.array([level * np.sin(yaw), reach * sine, level * np.cos(yaw)])
    return Pose(
        position=Vec3(float(x), float(y) - EYE_HEIGHT_M, float(z)),
        rotation=(180.0 + sideways_deg) % 360.0,
        horizon=float(np.degrees(np.arcsin(sine))),
    )


def write_catalog(folder: Path, variants: int, seed: int, distance_m: float | None = None) -> list[Path]:
    """Write contact sheets with pictures of every category's variants and states; return the paths of the sheets."""
    folder.mkdir(parents=True, exist_ok=True)
    subjects = iter(catalogue(variants))
    paths: list[Path] = []
    while batch := list(islice(subjects, COLUMNS * COLUMNS)):
        paths.append(folder / f"catalog_{len(paths) + 1:02}.jpg")
        pictures = [render_object(subject, seed, distance_m) for subject in batch]
        contact_sheet(pictures, [label_of(subject) for subject in batch]).save(paths[-1], quality=78)
    return paths


def catalogue(variants: int) -> list[SceneSubject]:
    """Return subjects of every category: the first variant in all its states, and each other variant in one state."""
    subjects = []
    for name in sorted(CATALOG):
        for variant in range(variants):
            states = states_of(SceneSubject(name, variant).asset)
            shown = states if variant == 0 else (states[variant % len(states)],)
            subjects += [SceneSubject(name, variant, state) for state in shown]
    return subjects


def label_of(subject: SceneSubject) -> str:
    """Return the line under a subject's picture."""
    return f"{subject.category} {subject.variant} {subject.state or ''}".rstrip()


def contact_sheet(pictures: list[np.ndarray], labels: list[str]) -> Image.Image:
    """Return one picture with rows of `pictures`. Only the middle of each picture is shown, with its label below."""
    width, height = CELL_PX
    rows = -(-len(pictures) // COLUMNS)
    sheet = Image.new("RGB", (COLUMNS * width, rows * (height + LINE_PX)), "white")
    pen, font = ImageDraw.Draw(sheet), ImageFont.load_default(11)
    for number, (picture, label) in enumerate(zip(pictures, labels, strict=True)):
        left, top = number % COLUMNS * width, number // COLUMNS * (height + LINE_PX)
        sheet.paste(_middle(picture), (left, top))
        pen.text((left + 3, top + height + 1), label, fill="black", font=font)
    return sheet


def _middle(picture: np.ndarray) -> Image.Image:
    width, height = CELL_PX
    image = Image.fromarray(picture)
    wide, high = 2 * width, 2 * height
    left, top = (image.width - wide) // 2, (image.height - high) // 2
    return image.crop((left, top, left + wide, top + high)).resize(CELL_PX, Image.Resampling.LANCZOS)
