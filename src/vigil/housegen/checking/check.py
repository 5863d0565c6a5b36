"""Checks of a house, generated or real, by named rules. Violations are returned as `Fault`s, not raised."""

import itertools
import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

import shapely

from vigil.assets.catalog import CATALOG, CEILING, WALL
from vigil.assets.database import AssetDatabase
from vigil.errors import HouseError
from vigil.housegen.checking.leaf_collisions import LeafCollisions
from vigil.housegen.checking.overlaps import SolidOverlaps
from vigil.housegen.checking.walkable_grid import LEAST_SHARE, WalkableGrid, build_walkable_grid
from vigil.protocol.actions import REACH_M
from vigil.protocol.house import LEVEL_TOLERANCE_M, SCHEMA, House, is_outside
from vigil.scene.build import GUESSED_SIZE_SLACK_M, build_scene
from vigil.scene.geometry import bounding_box, is_upright
from vigil.scene.keys import unsupported_keys
from vigil.scene.outlines import floor_of, footprint
from vigil.scene.partitions import OPENNESS_SAMPLES, Partitions
from vigil.scene.things import Scene, Thing

HOVER_M = 0.02
"""Greatest height (m) of an object above its support, and greatest distance (m) of a drawer from its usual place."""
WALL_M = 0.1
"""A thing at most this far (m) from a wall counts as hanging on the wall."""
OUTSIDE_M = 0.02
"""How far (m) an object may stick out of its room."""
ALLOWED_ROOMS = {"Bed": ("Bedroom",), "Toilet": ("Bathroom",), "Bathtub": ("Bathroom",), "Stove": ("Kitchen",)}
"""Category of furniture -> the only kinds of rooms in which it may stand."""
UNLOADABLE_RULES = frozenset({"room-shape", "extent", "wall-shape"})
"""Rules that a house must satisfy before it can be loaded and checked further."""
FARTHEST_M = 200.0
"""Greatest coordinate (m) of anything in a house."""
MAX_OVERLAPS = 1000
"""Number of overlapping pairs of things at which the check of a house ends."""
REQUIRED_FURNITURE = {"Kitchen": "Fridge", "Bedroom": "Bed", "Bathroom": "Toilet"}
"""Kind of room -> category of furniture that every room of this kind must have."""


@dataclass(frozen=True, slots=True)
class Fault:
    """A violation of one rule by a house."""

    rule: str
    """Name of the rule."""
    subject: str
    """Id of the part of the house that has the fault, or the house's name."""
    message: str
    other: str | None = None
    """Id of the other object that is involved; None if there is none."""

    def __str__(self) -> str:
        return f"{self.rule}: {self.subject}: {self.message}"


def check_house(house: House, assets: AssetDatabase) -> list[Fault]:
    """Return the house's faults, in a fixed order."""
    faults = [*_keys(house), *_references(house), *_rooms(house), *_extent(house), *_holes(house)]
    if any(fault.rule in UNLOADABLE_RULES for fault in faults):
        return faults
    try:
        scene = build_scene(house, assets)
    except HouseError as error:
        return [*faults, Fault("load", house.name, str(error))]
    solid_overlaps, grid = SolidOverlaps(scene), build_walkable_grid(house, scene)
    faults += [*_assets(house, assets), *_hovering(house, scene, assets), *_outside(house, scene)]
    faults += _misplaced(house, scene)
    overlaps = [
        Fault("overlap", one.id, f"and {two.id!r} overlap by {depth:.3f} m in height", two.id)
        for one, two, depth in itertools.islice(solid_overlaps.overlaps(), MAX_OVERLAPS)
    ]
    if len(overlaps) == MAX_OVERLAPS:
        message = (
            f"{MAX_OVERLAPS} pairs of things overlap; further pairs and the space of openable things are not checked"
        )
        return [*faults, *overlaps, Fault("overlap", house.name, message)]
    return [*faults, *overlaps, *_walkability(house, grid), *_start(house, grid), *_access(scene, grid, solid_overlaps)]


def _keys(house: House) -> Iterator[Fault]:
    schema = house.document.metadata.get("schema")
    if schema != SCHEMA:
        yield Fault("schema", house.name, f"metadata.schema is {schema!r}, expected {SCHEMA!r}")
    for note in unsupported_keys(house):
        yield Fault("key", house.name, note)


def _references(house: House) -> Iterator[Fault]:
    document = house.document
    rooms, walls = {room.id for room in document.rooms}, {wall.id for wall in document.walls}
    for wall in document.walls:
        if wall.room_id not in rooms and not is_outside(wall.room_id):
            yield Fault("reference", wall.id, f"names room {wall.room_id!r}, which is not in the house")
    for opening in [*document.doors, *document.windows]:
        if opening.wall1 and opening.wall1 not in walls:
            yield Fault("reference", opening.id, f"names wall {opening.wall1!r}, which is not in the house")
    ids = [node.id for node in [*document.rooms, *document.walls, *document.doors, *document.windows]]
    for name in sorted(name for name, count in Counter(ids).items() if count > 1):
        yield Fault("reference", name, "two rooms, walls or openings have this id")


def _rooms(house: House) -> Iterator[Fault]:
    is_any_bad = False
    floors = {room.id: floor_of(room) for room in house.document.rooms}
    for room_id, floor in floors.items():
        if not floor.is_valid or floor.area < 1.0:
            is_any_bad = True
            message = (
                f"floor of {floor.area:.2f} m2; a room has at least 1 m2"
                if floor.is_valid
                else f"floor is not a simple polygon: {shapely.is_valid_reason(floor)}"
            )
            yield Fault("room-shape", room_id, message)
    for first, second in () if is_any_bad else itertools.combinations(floors, 2):
        shared = floors[first].intersection(floors[second]).area
        if shared > 0.01:
            yield Fault("rooms-overlap", first, f"shares {shared:.2f} m2 of floor with {second!r}")


def _extent(house: House) -> Iterator[Fault]:
    """Yield faults: things far from the origin, walls without length or height, and openness outside 0..1."""
    document = house.document
    named = [(room.id, point) for room in document.rooms for point in room.floor_polygon]
    named += [(wall.id, point) for wall in document.walls for point in wall.polygon]
    named += [(opening.id, point) for opening in (*document.doors, *document.windows) for point in opening.hole_polygon]
    named += [(node.id, node.position) for node, _ in house.objects()]
    for name in sorted({name for name, at in named if max(abs(at.x), abs(at.y), abs(at.z)) > FARTHEST_M}):
        yield Fault("extent", name, f"reaches over {FARTHEST_M:g} m from the origin")
    for wall in document.walls:
        bottom = min(point.y for point in wall.polygon)
        low = {(point.x, point.z) for point in wall.polygon if point.y <= bottom + LEVEL_TOLERANCE_M}
        high = {(point.x, point.z) for point in wall.polygon if point.y > bottom + LEVEL_TOLERANCE_M}
        if wall.empty:
            continue
        if len(low) < 2 or not high:
            yield Fault("wall-shape", wall.id, "has no length or no height")
        elif low != high:
            yield Fault("wall-outline", wall.id, "is not an upright rectangle, but is treated as an upright rectangle")
    for node in (*document.doors, *(node for node, _ in house.objects())):
        if node.openness is not None and not 0.0 <= node.openness <= 1.0:
            yield Fault("state", node.id, f"openness {node.openness} is not within 0 and 1")


def _holes(house: House) -> Iterator[Fault]:
    walls = {wall.id: wall for wall in house.document.walls}
    spans: dict[str, list[tuple[float, float, float, float, str]]] = {}
    for opening in [*house.document.doors, *house.document.windows]:
        heights = [point.y for point in walls[opening.wall0].polygon]
        height, length = max(heights) - min(heights), math.dist(*walls[opening.wall0].ends)
        xs, ys = [point.x for point in opening.hole_polygon], [point.y for point in opening.hole_polygon]
        if min(xs) < -1e-3 or max(xs) > length + 1e-3 or min(ys) < -1e-3 or max(ys) > height + 1e-3:
            size = f"{min(xs):.2f}..{max(xs):.2f} x {min(ys):.2f}..{max(ys):.2f}"
            yield Fault("hole", opening.id, f"hole {size} is outside its wall of {length:.2f} x {height:.2f} m")
        if max(xs) - min(xs) < 0.01 or max(ys) - min(ys) < 0.01:
            yield Fault("hole", opening.id, "hole has no width or no height")
        for left, right, low, high, other in spans.get(opening.wall0, []):
            if min(right, max(xs)) - max(left, min(xs)) > 1e-3 and min(high, max(ys)) - max(low, min(ys)) > 1e-3:
                yield Fault("hole", opening.id, f"hole overlaps that of {other!r}")
        spans.setdefault(opening.wall0, []).append((min(xs), max(xs), min(ys), max(ys), opening.id))


def _assets(house: House, assets: AssetDatabase) -> list[Fault]:
    notes = ((node.id, assets.look_up(node.asset_id, node.name_in_house).note) for node, _ in house.objects())
    return [Fault("asset", house.name, f"{name}: {note}") for name, note in notes if note is not None]


def _hovering(house: House, scene: Scene, assets: AssetDatabase) -> Iterator[Fault]:
    ceiling = max((point.y for wall in house.document.walls for point in wall.polygon), default=0.0)
    lines = [floor_of(room).exterior for room in house.document.rooms]
    for node, _ in house.objects():
        thing = scene.things[node.id]
        if thing.is_drawer:
            away = math.dist(thing.position, node.position.vec)
            if away > HOVER_M:
                yield Fault("hovering", thing.id, f"it is {away:.3f} m from its place in {thing.parent!r}")
            continue
        if not is_upright(thing) or _is_mounted(thing, scene, lines, ceiling):
            continue
        under, bottom = "the floor" if thing.parent is None else repr(thing.parent), bounding_box(thing).bottom
        gap = node.position.y - thing.position.y + (bottom if thing.parent is None else 0.0)
        is_measured = assets.look_up(node.asset_id, node.name_in_house).is_measured
        if thing.parent is not None and thing.surface is None:
            yield Fault("hovering", thing.id, f"its bottom at {bottom:.3f} m is on no surface of {under}")
        elif abs(gap) > (HOVER_M if is_measured else GUESSED_SIZE_SLACK_M):
            yield Fault("hovering", thing.id, f"its bottom is {gap:.3f} m above {under}")


def _is_mounted(thing: Thing, scene: Scene, lines: list[shapely.LinearRing], ceiling: float) -> bool:
    """Return whether a thing hangs on a wall or from the ceiling, or rests on a thing that hangs on a wall."""
    places, box = CATALOG[thing.category].rests_on, bounding_box(thing)
    if CEILING in places and abs(box.top - ceiling) < WALL_M:
        return True
    if WALL not in places:
        return False
    shape, parent = footprint(box), scene.things.get(thing.parent or "")
    return any(shape.distance(line) < WALL_M for line in lines) or (
        parent is not None and _is_mounted(parent, scene, lines, ceiling)
    )


def _outside(house: House, scene: Scene) -> Iterator[Fault]:
    floors = [floor_of(room) for room in house.document.rooms]
    grown = [floor.buffer(OUTSIDE_M, join_style="mitre") for floor in floors]
    shapely.prepare(grown)
    for thing in scene.things.values():
        shape = footprint(bounding_box(thing))
        if not thing.is_structure and not any(floor.contains(shape) for floor in grown):
            inside = max(floor.intersection(shape).area for floor in floors) / max(shape.area, 1e-9)
            yield Fault("outside-room", thing.id, f"{100 * (1 - inside):.0f} % of its box is outside its room")


def _misplaced(house: House, scene: Scene) -> Iterator[Fault]:
    kinds = {room.id: room.kind for room in house.document.rooms}
    floors = {room.id: floor_of(room) for room in house.document.rooms}
    present: dict[str, set[str]] = {room_id: set() for room_id in kinds}
    for thing in scene.things.values():
        x, _, z = thing.position
        room = next((key for key, floor in floors.items() if shapely.contains_xy(floor, x, z)), None)
        if room is None:
            continue
        present[room].add(thing.category)
        if thing.category in ALLOWED_ROOMS and kinds[room] not in ALLOWED_ROOMS[thing.category]:
            yield Fault("misplaced", thing.id, f"a {CATALOG[thing.category].display_name} in a {kinds[room]}")
    for room_id, kind in kinds.items():
        if kind in REQUIRED_FURNITURE and REQUIRED_FURNITURE[kind] not in present[room_id]:
            yield Fault("room-lacks", room_id, f"a {kind} without a {REQUIRED_FURNITURE[kind]}")


def _walkability(house: House, grid: WalkableGrid) -> Iterator[Fault]:
    for room in house.document.rooms:
        if not grid.reaches(floor_of(room)):
            yield Fault("unreachable-room", room.id, "it cannot be reached on foot from the rest of the house")
    if grid.share < LEAST_SHARE:
        shares = f"{100 * grid.share:.0f} % of the free floor is connected, expected at least {100 * LEAST_SHARE:.0f} %"
        yield Fault("free-floor", house.name, shares)


def _start(house: House, grid: WalkableGrid) -> Iterator[Fault]:
    try:
        start = house.start
    except HouseError as error:
        yield Fault("start", house.name, str(error))
        return
    if start is None:
        yield Fault("start", house.name, "metadata.agent does not have a start")
    elif not grid.is_free_start(start.position.x, start.position.z):
        place = f"{start.position.x:.2f}, {start.position.z:.2f}"
        yield Fault("start", house.name, f"the agent's start at {place} is not free")


def _access(scene: Scene, grid: WalkableGrid, solid_overlaps: SolidOverlaps) -> Iterator[Fault]:
    """Yield the faults of things that can be opened.

    These are leaves that are blocked, leaves that cut through another thing, and furniture without a place in front of
    it where an agent can stand.
    """
    partitions, path, leaf_collisions = Partitions(scene), OPENNESS_SAMPLES.tolist(), LeafCollisions(scene)
    for thing in scene.things.values():
        if not thing.is_openable or not is_upright(thing):
            continue
        pierced, obstacle = partitions.blocker(thing, path), solid_overlaps.first_obstacle(thing)
        if pierced is not None:
            yield Fault("blocked-opening", thing.id, f"cannot open: it would reach through {pierced!r}")
        elif obstacle is not None:
            yield Fault("blocked-opening", thing.id, f"cannot open: {obstacle.id!r} is in the way", obstacle.id)
        elif (cut := leaf_collisions.first_pierced(thing)) is not None:
            yield Fault("leaf-cuts", thing.id, f"a part of it passes through {cut.id!r} as it opens", cut.id)
        elif not thing.is_pickupable and not grid.can_be_reached(thing, REACH_M):
            yield Fault("no-access", thing.id, "an agent cannot stand within reach of it and clear of its leaf")
