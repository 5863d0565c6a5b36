"""Generates a house: `generate(seed, spec)` runs the stages of the generator, and repeats them until a house passes the
checks."""

import numpy as np

from vigil.assets.database import AssetDatabase
from vigil.assets.drawers import drawer_names
from vigil.base.geometry import Pose, Vec3, heading
from vigil.errors import SettingError
from vigil.housegen import document
from vigil.housegen.base.models import PlacedObject
from vigil.housegen.base.randomness import GENERATOR_VERSION, generator, pick, shuffled
from vigil.housegen.base.spec import HouseSpec
from vigil.housegen.checking.check import Fault, check_house
from vigil.housegen.furnishing import states
from vigil.housegen.furnishing.floor import Floor
from vigil.housegen.furnishing.furnish import ESSENTIAL, Furnisher
from vigil.housegen.furnishing.inventory import Inventory
from vigil.housegen.furnishing.small_objects import SmallObjectPlacer
from vigil.housegen.furnishing.wall_objects import WallObjectPlacer
from vigil.housegen.layout import appearance
from vigil.housegen.layout.floorplan import RoomLayout, plan_rooms
from vigil.housegen.layout.openings import PlannedOpening, cut_openings
from vigil.protocol.house import House, drawer_id
from vigil.scene.floor import largest_part

__all__ = ["GENERATOR_VERSION", "generate"]

MAX_ATTEMPTS = 40
"""Greatest number of attempts to generate a house that passes the checks."""
MAX_ROOM_ATTEMPTS = 3
"""Greatest number of attempts at furnishing a room."""
NEVER_REMOVED = frozenset({category for needed in ESSENTIAL.values() for category in needed} | {"Faucet"})
"""Categories of objects that are never removed to repair a house."""
START_HORIZON = 30.0
"""Pitch (deg) of the agent at the start."""
MAX_REPAIRS = 4
"""Greatest number of rounds in which objects are removed because they cause faults."""


def generate(seed: int, spec: HouseSpec) -> House:
    """Return the house of a seed and spec, with the same bytes in every process. Raises SettingError on failure."""
    name = f"{spec.name}_{seed}"
    faults: list[Fault] = []
    for attempt in range(MAX_ATTEMPTS):
        parts = _house_parts(seed, spec, attempt)
        if parts is None:
            continue
        house, faults = _repaired(name, parts)
        if not faults:
            return house
    found = f" The last attempt's first fault: {faults[0]}" if faults else ""
    raise SettingError(
        f"House {name!r}: no valid house in {MAX_ATTEMPTS} attempts; try another seed or more area.{found}"
    )


def _repaired(name: str, parts: document.HouseParts) -> tuple[House, list[Fault]]:
    """Return the house without the objects that cause faults, and the faults that remain."""
    assets = AssetDatabase.default()
    house = House(name, document.write_document(parts))
    faults = check_house(house, assets)
    for _ in range(MAX_REPAIRS):
        pieces = {piece.id: piece for top in parts.pieces for piece in top.with_contents()}
        for key, piece in list(pieces.items()):  # a drawer stands for its furniture
            for drawer in drawer_names(piece.model.asset):
                pieces.setdefault(drawer_id(key, drawer), piece)
        culprits = [_culprit(fault, pieces) for fault in faults]
        if not faults or any(piece is None for piece in culprits):
            break
        _remove(parts.pieces, {id(piece) for piece in culprits})
        house = House(name, document.write_document(parts))
        faults = check_house(house, assets)
    return house, faults


def _culprit(fault: Fault, pieces: dict[str, PlacedObject]) -> PlacedObject | None:
    """Return the smallest object whose removal ends a fault; None if no object may be removed for this."""
    concerned = [pieces[name] for name in (fault.subject, fault.other) if name in pieces]
    free = [
        piece
        for piece in concerned
        if piece.category not in NEVER_REMOVED and not any(c.category in NEVER_REMOVED for c in piece.with_contents())
    ]
    return min(free, key=lambda piece: piece.model.size.x * piece.model.size.y * piece.model.size.z, default=None)


def _remove(pieces: list[PlacedObject], unwanted: set[int]) -> None:
    pieces[:] = [piece for piece in pieces if id(piece) not in unwanted]
    for piece in pieces:
        _remove(piece.children, unwanted)


def _house_parts(seed: int, spec: HouseSpec, attempt: int) -> document.HouseParts | None:
    """Return the parts of the house of one attempt; None if it fails, e.g. because essential furniture does not fit."""
    key = (spec.model_dump_json(), seed, attempt)
    plan = plan_rooms(spec, generator(*key, "plan"))
    openings = cut_openings(plan, generator(*key, "openings"))
    if openings is None:
        return None
    floors: dict[int, Floor] = {}
    pieces = _furnish(plan, openings, floors, spec, key)
    if pieces is None:
        return None
    start = _free_start(plan, floors, pieces, generator(*key, "start"))
    if start is None:
        return None
    look = generator(*key, "look")
    return document.HouseParts(
        plan=plan,
        openings=openings,
        pieces=pieces,
        finishes=appearance.finishes({room.number: room.kind for room in plan.rooms}, look),
        lights=appearance.lights_of(plan, look),
        facade=pick(look, appearance.FACADES),
        ceiling=pick(look, appearance.PAINTS[:4]),
        sky=pick(look, appearance.SKIES),
        start=start,
        spec_name=spec.name,
        seed=seed,
    )


def _furnish(
    plan: RoomLayout,
    openings: list[PlannedOpening],
    floors: dict[int, Floor],
    spec: HouseSpec,
    key: tuple[str, int, int],
) -> list[PlacedObject] | None:
    """Return all objects of the rooms, and store each room's floor in `floors`.

    Return None if essential furniture does not fit.
    """
    inventory = Inventory()
    standing: dict[int, list[PlacedObject]] = {}
    for room in plan.rooms:
        for again in range(MAX_ROOM_ATTEMPTS):
            trial = inventory.copy()
            furnisher = Furnisher(Floor(room, openings), trial, generator(*key, "furnish", room.number, again))
            pieces = furnisher.furnish()
            if all(furnisher.has(category) for category in ESSENTIAL[room.kind]):
                inventory, floors[room.number], standing[room.number] = trial, furnisher.floor, pieces
                break
        else:
            return None
    hanging = {
        room.number: WallObjectPlacer(
            floors[room.number], standing[room.number], plan.height_m, inventory, generator(*key, "hang", room.number)
        ).hang()
        for room in plan.rooms
    }
    for room in shuffled(generator(*key, "order"), plan.rooms):
        pieces = [*standing[room.number], *hanging[room.number]]
        SmallObjectPlacer(floors[room.number], pieces, inventory, generator(*key, "tidy", room.number)).fill(
            spec.clutter
        )
    everything = [piece for room in plan.rooms for piece in [*standing[room.number], *hanging[room.number]]]
    states.set_states(everything, generator(*key, "states"))
    return everything


def _free_start(
    plan: RoomLayout, floors: dict[int, Floor], pieces: list[PlacedObject], rng: np.random.Generator
) -> Pose | None:
    """Return a pose at a random free place in a random room; None if there is no free place.

    Of four directions, the pose looks in the one in which the most pieces of furniture are in view.
    """
    from scipy import ndimage  # noqa: PLC0415 - loads over 200 modules

    floor = floors[pick(rng, plan.rooms).number]
    free = floor.free_grid([])
    for rect in floor.clear:
        free &= ~(
            (floor.grid_x > rect[0]) & (floor.grid_x < rect[2]) & (floor.grid_z > rect[1]) & (floor.grid_z < rect[3])
        )
    main = largest_part(free)
    if not main.any():
        return None
    roomy = ndimage.binary_erosion(main)
    rows, columns = np.nonzero(roomy if roomy.any() else main)
    index = int(rng.integers(len(rows)))
    row, column = int(rows[index]), int(columns[index])
    x, z = float(floor.grid_x[row, column]), float(floor.grid_z[row, column])
    here = [piece for piece in pieces if piece.room == floor.room.number]
    yaw = max((0.0, 90.0, 180.0, 270.0), key=lambda turn: (_in_view(here, x, z, turn), turn))
    return Pose(position=Vec3(round(x, 3), 0.0, round(z, 3)), rotation=yaw, horizon=START_HORIZON)


def _in_view(pieces: list[PlacedObject], x: float, z: float, yaw: float) -> int:
    """Return how many pieces of furniture are in view and near enough to be recognised."""
    dx, dz = heading(yaw)
    seen = 0
    for piece in pieces:
        ahead = (piece.position.x - x) * dx + (piece.position.z - z) * dz
        aside = abs((piece.position.x - x) * dz - (piece.position.z - z) * dx)
        seen += 1.0 < ahead < 4.0 and aside < ahead
    return seen
