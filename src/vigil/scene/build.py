"""Builds the scene of a house: gives objects their assets, lays children on their carriers, and puts doors and windows
into the holes of walls.

A child is an object that the house document lists under another object, its parent. The document gives the centre of
each object's bounding box. In ProcTHOR's houses, children hover a few centimetres above their carriers. Children can
also rest inside their parent's box (on a fridge's shelf, on a seat). The maker of the parent's asset is given the
heights of these children, and puts surfaces there.
"""

import math
import re

import numpy as np

from vigil.assets.catalog import CATALOG, FLOOR
from vigil.assets.database import AssetDatabase, AssetEntry
from vigil.assets.drawers import body_of, drawer_names
from vigil.assets.kernel.asset import Asset, Surface
from vigil.base.geometry import Vec3, wrap_deg
from vigil.errors import HouseError
from vigil.protocol.house import Door, House, HouseObject, Opening
from vigil.protocol.world import OPEN_ABOVE
from vigil.scene.chests import drawers_in, named_drawers
from vigil.scene.geometry import Motion, bounding_box, rotation_matrix
from vigil.scene.keys import unsupported_keys
from vigil.scene.loose import with_implied_parents
from vigil.scene.partitions import Partitions
from vigil.scene.supports import level_surfaces, offset_from
from vigil.scene.things import Scene, Thing, WallPanel
from vigil.scene.walls import panels_of, place_of_opening, rooms_of

ON_BY_DEFAULT = frozenset({"LightSwitch"})
"""Categories that are switched on unless the house says otherwise, so that rooms are lit."""
HOVER_M = 0.07
"""Children whose heights differ by less than this (m) rest on one level, such as a shelf; some hover up to 6 cm."""
ADAPT_M, FALL_M = 0.25, 2.0
"""Greatest distances (m) by which a child may be moved up and moved down so that it rests on a surface.

The surface of the parent's asset can be higher or lower than the house says.
"""
GUESSED_SIZE_SLACK_M = 0.5
"""Greatest distance (m) by which a thing that belongs on the floor is moved to the floor, if its size is guessed."""
SURFACE_EDGE_M = 0.1
"""A child can rest on a surface if the child's middle is at most this far (m) outside the surface's rectangle."""
OVERHANG_M = 0.01
"""How far (m) a thing behind a door or in a drawer may reach over the edge of the surface that it lies on."""
LEVEL_STEP_M = 0.005
"""Step (m) to which heights of levels (shelves) are rounded, and least distance (m) of a level from the asset's top."""
OPENNESS_STEP = 0.02
"""A door, lid or drawer that reaches through a wall is closed in steps of this openness until it no longer does."""


def build_scene(house: House, assets: AssetDatabase) -> Scene:
    """Return the scene of a house. `Scene.notes` lists what was guessed, and what in the document was ignored.

    Raises HouseError on a duplicate id, a drawer that its furniture does not have, or an invalid floor or wall.
    """
    scene = Scene(rooms=rooms_of(house), panels=panels_of(house), notes=unsupported_keys(house))
    panels = {panel.id: panel for panel in [*scene.panels, *panels_of(house, empty=True)]}
    openings = [_opening_thing(house, each, panels) for each in [*house.document.doors, *house.document.windows]]
    shell = Scene(rooms=scene.rooms, panels=scene.panels, things={thing.id: thing for thing in openings})
    partitions = Partitions(shell)
    for opening in openings:
        scene.notes += _close_until_clear(opening, partitions)
    nodes, guesses = with_implied_parents(house.document.objects, assets)
    scene.notes += guesses
    for node in nodes:
        _add(scene, node, [], assets, partitions)
    for opening in openings:
        if opening.id in scene.things:
            raise HouseError(
                f"House {house.name!r}: two of its doors, windows and objects have the same id {opening.id!r}; ids "
                "must be unique."
            )
        scene.things[opening.id] = opening
    return scene


def _close_until_clear(thing: Thing, partitions: Partitions) -> list[str]:
    """Close a leaf (door, lid or drawer) that reaches through a wall; return a note (in a list) if this was needed.

    The leaf gets the largest openness at which it is clear of walls, or 0 if this openness is not above `OPEN_ABOVE`.
    """
    wanted = thing.openness
    if wanted == 0.0 or partitions.reaches_through(thing, wanted) is None:
        return []
    steps = [round(wanted - OPENNESS_STEP * step, 4) for step in range(1, int(1 / OPENNESS_STEP))]
    fitting = (step for step in steps if step > OPEN_ABOVE and partitions.reaches_through(thing, step) is None)
    thing.openness = next(fitting, 0.0)
    return [f"{thing.id}: openness {wanted:g} reaches into the next room; it is reduced to {thing.openness:g}"]


def _add(scene: Scene, node: HouseObject, carriers: list[Thing], assets: AssetDatabase, partitions: Partitions) -> None:
    """Add an object, and everything on and in it, to the scene.

    `carriers` are the things that may carry the object; the first is the object's parent in the document.
    """
    from vigil.assets.making import make  # noqa: PLC0415 - reads the descriptions of all shapes

    if node.id in scene.things:
        raise HouseError(
            f"Object {node.id!r} has the same id as a drawer of {scene.things[node.id].parent!r}. If the object is "
            "this drawer, give it an asset id that begins with the furniture's asset id; otherwise give the "
            "object another id."
        )
    entry = assets.look_up(node.asset_id, node.name_in_house)
    if entry.note is not None:
        scene.notes.append(f"{node.id}: {entry.note}")
    asset = make(entry.category, entry.size, entry.variant, _levels(node, entry, assets))
    thing = _thing(node, body_of(asset) if drawer_names(asset) else asset, entry.category)
    if carriers:
        thing.parent = carriers[0].id
        rest_on_surface(thing, *carriers)
    surfaces = [float(frame.shift[1]) for _, frame in level_surfaces(carriers[0])] if carriers else []
    bottom = bounding_box(thing).bottom
    is_under = bool(surfaces) and bottom < min(surfaces) - ADAPT_M  # as under a table in some of ProcTHOR's houses
    if thing.surface is None and (not carriers or is_under):
        thing.parent = None
        # The house gives the object's middle for the object's true size, which is not known where it is guessed.
        slack = GUESSED_SIZE_SLACK_M if not entry.is_measured and FLOOR in CATALOG[entry.category].rests_on else 0.0
        if -slack < bottom < (FALL_M if carriers else max(HOVER_M, slack)):
            thing.position = Vec3(thing.position.x, thing.position.y - bottom, thing.position.z)
    scene.notes += _close_until_clear(thing, partitions)
    scene.things[thing.id] = thing
    named, drawers = named_drawers(node), drawers_in(node, thing, asset)
    for name, drawer in drawers.items():
        scene.notes += _close_until_clear(drawer, partitions)
        scene.things[drawer.id] = drawer
        for child in named[name].children if name in named else ():
            _add(scene, child, [drawer], assets, partitions)
    for child in node.children:
        if all(child is not drawer for drawer in named.values()):
            _add(scene, child, [thing, *drawers.values()], assets, partitions)


def _thing(node: HouseObject, asset: Asset, category: str) -> Thing:
    kind = CATALOG[category]
    openable = kind.is_openable and asset.can_open
    return Thing(
        id=node.id,
        category=category,
        asset=asset,
        position=node.position.vec,
        rotation=Vec3(node.rotation.x, wrap_deg(node.rotation.y), node.rotation.z),
        is_pickupable=kind.is_pickupable,
        is_openable=openable,
        is_toggleable=kind.is_toggleable,
        is_receptacle=kind.is_receptacle and bool(asset.surfaces),
        openness=min(1.0, max(0.0, node.openness or 0.0)) if openable else 0.0,
        is_toggled=kind.is_toggleable and (category in ON_BY_DEFAULT if node.is_on is None else node.is_on),
    )


def _opening_thing(house: House, opening: Opening, panels: dict[str, WallPanel]) -> Thing:
    from vigil.assets.making import make  # noqa: PLC0415 - reads the descriptions of all shapes

    position, yaw, size = place_of_opening(house, opening, panels)
    category = _opening_category(opening)
    number = re.search(r"(\d+)$", opening.asset_id)
    asset = make(category, size, int(number[1]) if number else 0)
    leaf = opening if isinstance(opening, Door) and asset.can_open else None
    return Thing(
        id=opening.id,
        category=category,
        asset=asset,
        position=position,
        rotation=Vec3(0.0, yaw, 0.0),
        is_openable=leaf is not None and bool(leaf.openable),
        openness=min(1.0, max(0.0, leaf.openness or 0.0)) if leaf else 0.0,
        is_structure=True,
    )


def _opening_category(opening: Opening) -> str:
    if not isinstance(opening, Door):
        return "Window"
    return "Doorframe" if opening.asset_id.lower().startswith("doorframe") or opening.openable is None else "Doorway"


def _levels(node: HouseObject, entry: AssetEntry, assets: AssetDatabase) -> tuple[float, ...]:
    """Return the heights (m above the asset's bottom) at which children rest inside the asset's box.

    Heights that differ by at most `HOVER_M` count as the same height.
    """
    base = node.position.y - entry.size.y / 2
    drawers = list(named_drawers(node).values())
    resting = [child for child in node.children if all(child is not drawer for drawer in drawers)]
    resting += [child for drawer in drawers for child in drawer.children]
    bottoms: list[float] = []
    for child in resting:
        size = assets.look_up(child.asset_id, child.name_in_house).size
        turn = rotation_matrix(Vec3(child.rotation.x, child.rotation.y, child.rotation.z))
        bottoms.append(child.position.y - float(np.abs(turn[1]) @ np.array(size)) / 2 - base)
    levels: list[float] = []
    for height in sorted(bottoms):
        is_new = not levels or height > levels[-1] + HOVER_M
        if is_new and 0.0 <= height < entry.size.y - LEVEL_STEP_M:
            levels.append(round(round(height / LEVEL_STEP_M) * LEVEL_STEP_M, 4))
    return tuple(levels)


def rest_on_surface(thing: Thing, *carriers: Thing) -> None:
    """Move `thing` onto the surface of a carrier: the surface whose height is nearest to the thing's bottom.

    The thing's parent, surface and joint are set. If no surface is near enough, nothing changes.
    """
    bottom = bounding_box(thing).bottom
    low = Vec3(thing.position.x, bottom, thing.position.z)
    best: tuple[float, float, Surface, Motion, Thing] | None = None
    for carrier, surface, frame in ((each, *level) for each in carriers for level in level_surfaces(each)):
        x, height, z = offset_from(frame, low)
        within = abs(x) <= surface.size_x / 2 + SURFACE_EDGE_M and abs(z) <= surface.size_z / 2 + SURFACE_EDGE_M
        if within and -ADAPT_M < height < FALL_M and (best is None or abs(height) < best[0]):
            best = (abs(height), height, surface, frame, carrier)
    if best is not None:
        _, height, surface, frame, carrier = best
        thing.parent, thing.surface, thing.parent_joint = carrier.id, surface.name, surface.joint
        thing.position = Vec3(thing.position.x, thing.position.y - height, thing.position.z)
        if surface.needs_opening:
            _push_inside(thing, surface, frame)


def _push_inside(thing: Thing, surface: Surface, frame: Motion) -> None:
    """Move a thing that would stick out of its closed drawer or door, so that it sticks out as little as possible."""
    box, local = bounding_box(thing), offset_from(frame, thing.position)
    turn = math.radians(box.yaw) - math.atan2(frame.turn[0, 2], frame.turn[2, 2])
    cos, sin = abs(math.cos(turn)), abs(math.sin(turn))
    reach = (box.size.x * cos + box.size.z * sin) / 2, (box.size.x * sin + box.size.z * cos) / 2
    shift = np.zeros(3)
    for axis, side, length in ((0, surface.size_x, reach[0]), (2, surface.size_z, reach[1])):
        room = max(0.0, side / 2 - length)
        if abs(local[axis]) > room + OVERHANG_M:
            shift[axis] = math.copysign(room, local[axis]) - local[axis]
    if shift.any():
        thing.position = Vec3(*(float(value) for value in np.array(thing.position) + frame.turn @ shift))
