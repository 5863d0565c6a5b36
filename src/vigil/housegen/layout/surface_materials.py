"""Materials of floors, walls, ceilings and facades, named as in AI2-THOR, with tints for painted walls."""

from dataclasses import dataclass

import numpy as np

from vigil.assets.kernel.palette import Rgb
from vigil.housegen.base.randomness import chance, pick
from vigil.housegen.base.tables import TABLES, names_in

FLOORS = names_in(TABLES["floors"])
"""Kind of room -> materials of its floor."""
TILED_WALLS: dict[str, list[str]] = TABLES["walls"]["tiled"]
"""Kind of room -> materials of its walls if they are not painted."""
TILED_SHARE = {"Kitchen": 0.2, "Bathroom": 0.5, "LivingRoom": 0.08, "Bedroom": 0.1}
PAINTS: list[Rgb] = [(red, green, blue) for red, green, blue in TABLES["walls"]["paints"]]
FACADES = ("WhiteGraniteClean", "RedBricks", "ConcreteBoards1", "Walldrywall4")
SKIES = ("SkyTropical", "Sky1", "Sky2", "SkyAlbany")


@dataclass(frozen=True, slots=True)
class RoomFinish:
    """The materials of a room's floor and walls."""

    floor: str
    wall: str
    paint: Rgb | None
    """Tint of the walls; None if their material has its own colour."""


def finishes(kinds: dict[int, str], rng: np.random.Generator) -> dict[int, RoomFinish]:
    """Return the finish of each room, by room number. Rooms other than bathrooms mostly share one floor material."""
    common = pick(rng, FLOORS["LivingRoom"])
    found: dict[int, RoomFinish] = {}
    for number, kind in kinds.items():
        shares = kind != "Bathroom" and chance(rng, 0.4 if kind == "Kitchen" else 0.75)
        floor = common if shares else pick(rng, FLOORS[kind])
        if chance(rng, TILED_SHARE[kind]):
            found[number] = RoomFinish(floor, pick(rng, TILED_WALLS[kind]), None)
        else:
            found[number] = RoomFinish(floor, "PureWhite", pick(rng, PAINTS))
    return found


def material_reference(name: str, tint: Rgb | None = None) -> dict[str, object]:
    """Return a reference to a material, as written in the house document."""
    if tint is None:
        return {"name": name}
    return {"name": name, "color": {"r": tint[0], "g": tint[1], "b": tint[2]}}
