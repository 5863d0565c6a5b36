"""The lamps and light switches that affect a picture: only those that are visible in the picture.

A picture must not reveal what is outside it, so a lamp behind the camera or behind a wall does not light it. Rays
through the middles of pixels decide what is visible, as for everything that is scored.
"""

import itertools
import math

import numpy as np

from vigil.base.geometry import Pose, floor_distance
from vigil.rendering.scene import MAX_POINT_LIGHTS, PointLight
from vigil.scene.things import Scene, Thing
from vigil.sim.core.sight import Lens, boxes_of, camera_axes, directions, farthest_m, window_of
from vigil.sim.engines.mujoco import rays
from vigil.sim.engines.mujoco.compiled.lights import point_light_of
from vigil.sim.engines.mujoco.compiled.model import CompiledModel

MOST_RAYS = 32
"""Greatest number of pixels that are tested to find whether an object is visible."""
REACH = 1.5
"""A thing and its opened parts are within this multiple of the diagonal of its size, measured from its middle."""
EDGE_PX = 2.0
"""Width (pixels) of the margin around a picture in which things still count as in view."""
_GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0


def update_room_lamps(model: CompiledModel, scene: Scene, looker: Pose, lens: Lens) -> None:
    """Set the lamps of rooms from the visible light switches only."""
    switches = _near_picture([scene.things[thing_id] for thing_id in model.lamps.switches], looker, lens)
    model.lamps.update_switches(switches, lambda switch: is_seen(model, switch, looker, lens))


def point_lights_of(
    model: CompiledModel, scene: Scene, looker: Pose, lens: Lens, in_hand: list[Thing]
) -> list[PointLight]:
    """Return the lights of at most `MAX_POINT_LIGHTS` lamps.

    These are the lamps nearest to the eye among those that are on and are visible or in the hand.
    """
    glowing = [thing for thing in scene.things.values() if thing.is_toggled and thing.asset.glow is not None]
    glowing.sort(key=lambda thing: floor_distance(thing.position, looker.position))
    held, near = ({thing.id for thing in each} for each in (in_hand, _near_picture(glowing, looker, lens)))
    seen = (
        thing for thing in glowing if thing.id in held or (thing.id in near and is_seen(model, thing, looker, lens))
    )
    return [point_light_of(thing) for thing in itertools.islice(seen, MAX_POINT_LIGHTS)]


def is_seen(model: CompiledModel, thing: Thing, looker: Pose, lens: Lens) -> bool:
    """Return whether any tested pixel shows an object, directly or through glass; False for a held or absent object."""
    if not thing.is_present or thing.is_held:
        return False
    boxes = boxes_of([thing])
    window = window_of(looker, boxes, lens)
    if window is None or _is_behind_walls(model, boxes, looker):
        return False
    pixels = window.pixels()
    if len(pixels) > MOST_RAYS:  # spread evenly over rows and columns
        pixels = pixels[(np.arange(MOST_RAYS) * _GOLDEN % 1.0 * len(pixels)).astype(int)]
    within_m = farthest_m(looker.eye, boxes)
    ways = directions(looker, pixels, lens)
    hits = rays.cast(model, looker.eye, ways, through_glass=True, within_m=within_m)
    return bool((hits.things == model.things[thing.id].index).any())


def _near_picture(things: list[Thing], looker: Pose, lens: Lens) -> list[Thing]:
    """Return the things around which a sphere, which also contains their opened parts, may reach into the picture."""
    if not things:
        return []
    away = np.array([thing.position for thing in things]) - np.array(looker.eye)
    right, up, ahead = camera_axes(looker) @ away.T
    reach_m = REACH * np.linalg.norm(np.array([thing.asset.size for thing in things]), axis=1)
    is_near = ahead >= -reach_m
    for aside, side in ((right, lens.width), (up, lens.height)):
        slope = (side / 2 + EDGE_PX) / lens.focal_px
        is_near &= np.abs(aside) - slope * ahead <= reach_m * math.hypot(1.0, slope)
    return list(itertools.compress(things, is_near))


def _is_behind_walls(model: CompiledModel, boxes: list[np.ndarray], looker: Pose) -> bool:
    """Return whether walls hide boxes (corners (8, 3) each) from `looker`. This is faster than casting rays."""
    corners, eye = np.concatenate(boxes)[:, [0, 2, 1]], looker.eye
    portals = model.render_scene.portals
    extent = portals.extent(corners.min(axis=0).tolist(), corners.max(axis=0).tolist())
    return not portals.may_see((eye.x, eye.z, eye.y), extent)
