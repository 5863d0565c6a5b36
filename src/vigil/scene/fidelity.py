"""Fidelity: whether the things of a scene have the shapes, places and states that their house asks for.

Each rule has a name. No thing may be drawn as a plain box (a stand-in), shapes must fill their boxes, and nothing may
hover above its carrier or sink into it. Parts must show whether a thing is open or switched on.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from vigil.assets.catalog import CATALOG, CEILING, WALL
from vigil.assets.database import AssetDatabase
from vigil.assets.kernel.asset import Asset
from vigil.assets.making import MAKERS
from vigil.base.geometry import Vec3
from vigil.protocol.house import House
from vigil.scene.geometry import bounding_box, joint_motion, joint_of
from vigil.scene.supports import drawers_of, surface_frame, surface_named
from vigil.scene.things import Scene, Thing

BOX_SHARE, BOX_M = 0.02, 0.001
"""Greatest deviation of a shape from the size that the house asks for: this share of the size plus this length (m). A
deviation this small is not visible."""
GAP_M = 0.002
MOST_TRIANGLES_ONE_ROOM, MOST_TRIANGLES = 30_000, 100_000


@dataclass(frozen=True, slots=True)
class Mismatch:
    """A thing that breaks a rule; `message` says how."""

    rule: str
    thing: str
    message: str

    def __str__(self) -> str:
        return f"{self.rule}: {self.thing}: {self.message}"


def mismatches_of(scene: Scene, house: House, assets: AssetDatabase) -> list[Mismatch]:
    """Return the mismatches between a newly built scene and its house, in the order of the scene's things.

    Furniture whose drawers are separate things does not have to fill its box, because the drawers are missing from it.
    Each of these drawers must fill its own box.
    """
    asked = {node.id: assets.look_up(node.asset_id, node.name_in_house).size for node, _ in house.objects()}
    return [
        Mismatch(rule, thing.id, message)
        for thing in scene.things.values()
        for rule, message in (
            *_shape(thing, None if drawers_of(scene, thing) else asked.get(thing.id, thing.asset.size)),
            *_gap(thing, scene),
            *_state(thing),
        )
    ]


def too_many_triangles(house: str, triangles: int, rooms: int) -> list[Mismatch]:
    """Return a mismatch when a house with this number of rooms is drawn with too many triangles; else an empty list."""
    most = MOST_TRIANGLES_ONE_ROOM if rooms == 1 else MOST_TRIANGLES
    found = Mismatch("triangles", house, f"{triangles} triangles, at most {most} are allowed")
    return [found] if triangles > most else []


def _shape(thing: Thing, asked: Vec3 | None) -> Iterator[tuple[str, str]]:
    """Yield a mismatch if a thing is a stand-in, and one if its size differs from the size that the house asks for.

    The thing is measured both shut and open, because AI2-THOR measures laptops open. One of the two sizes must fit.
    """
    if thing.asset.category not in MAKERS:
        yield "stand-in", f"{thing.category} has no maker: it is drawn as a plain box"
    if asked is None:
        return
    want = np.array(asked)
    sizes = [_extent(thing.asset, openness) for openness in ((0.0, 1.0) if thing.asset.joints else (0.0,))]
    if not any((np.abs(size - want) <= BOX_SHARE * want + BOX_M).all() for size in sizes):
        yield "box", f"its shape is {_metres(sizes[0])} m, but the house asks for {_metres(want)} m"


def _extent(asset: Asset, openness: float) -> np.ndarray:
    """Return the size (3,) of an asset at an openness, without the parts that are drawn only while it is on."""
    meshes = []
    for part in asset.parts:
        joint = joint_of(asset, part.joint)
        if part.shown != "on":
            vertices = part.mesh.vertices
            meshes.append(joint_motion(joint, openness)(vertices) if joint and openness else vertices)
    return np.max([mesh.max(axis=0) for mesh in meshes], axis=0) - np.min([mesh.min(axis=0) for mesh in meshes], axis=0)


def _metres(size: np.ndarray) -> str:
    return " x ".join(f"{length:.3f}" for length in size)


def _gap(thing: Thing, scene: Scene) -> Iterator[tuple[str, str]]:
    """Yield a mismatch if a thing hovers above its carrier or sinks into it.

    A thing on a rail, or on a thing without surfaces, is not checked, because it stays where the house puts it.
    """
    if thing.is_structure or thing.is_drawer:
        return
    bottom = bounding_box(thing).bottom
    parent = scene.things.get(thing.parent or "")
    surface = surface_named(parent, thing.surface) if parent else None
    if parent and surface:
        gap = bottom - float(surface_frame(parent, surface).shift[1])
        if abs(gap) > GAP_M:
            yield "gap", f"{1000 * gap:+.0f} mm above the surface {surface.name!r} of {parent.id}"
    elif parent and parent.asset.surfaces:
        yield "gap", f"lies in or on {parent.id}, but on none of its surfaces"
    elif not parent and abs(bottom) > GAP_M and not {WALL, CEILING} & set(CATALOG[thing.category].rests_on):
        yield "gap", f"{1000 * bottom:+.0f} mm above the floor"


def _state(thing: Thing) -> Iterator[tuple[str, str]]:
    parts = thing.asset.parts
    if thing.is_openable and not any(part.bears_open and part.joint for part in parts):
        yield "state", "can be opened, but no part shows whether it is open"
    if thing.is_toggleable and not any(
        part.bears_toggle and (part.material_on is not None or part.shown != "always") for part in parts
    ):
        yield "state", "can be switched, but no part shows whether it is on"
