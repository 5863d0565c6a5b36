"""Materials of floors, walls, ceilings and facades, named as in AI2-THOR, with tints for painted walls."""

from dataclasses import dataclass

import numpy as np

from vigil.assets.kernel.colours import Rgb
from vigil.housegen.base.randomness import chance, pick

_PLANKS = (
    "WoodFloorsCross",
    "WoodGrain_Tan",
    "WoodGrain_Brown",
    "BedroomFloor1",
    "TexturesCom_WoodFine0038_1_seamless_S_dark",
    "TexturesCom_WoodFine0031_1_seamless_S",
    "LightWoodCounters4",
    "WoodSlashhatch",
    "DarkWood2",
    "WhiteWoodClean",
)
_KITCHEN = (
    *_PLANKS[:6],
    "KitchenTiles4",
    "TexturesCom_Marble Floor Tiles 1_diffuse_S",
    "bathroomTilesTan",
    "GreyFloor 1",
)
_BATHROOM = ("bathroomTilesGrey 2", "HexTiles", "bathroomTilesBlue", "WhiteMarble3", "SmallTiles 1", "bathroomTilesTan")

FLOORS: dict[str, tuple[str, ...]] = {
    "Kitchen": _KITCHEN,
    "LivingRoom": _PLANKS,
    "Bedroom": _PLANKS,
    "Bathroom": _BATHROOM,
}
TILED_WALLS: dict[str, tuple[str, ...]] = {
    "Kitchen": ("KitchenTiles4", "bathroomTilesTan"),
    "Bathroom": ("bathroomTilesBlue", "bathroomTilesGrey 2", "SmallTiles 1", "HexTiles"),
    "LivingRoom": ("RedBricks", "ConcreteBoards1"),
    "Bedroom": ("Walldrywall4Tiled", "EggshellDrywall 3"),
}
TILED_SHARE = {"Kitchen": 0.2, "Bathroom": 0.5, "LivingRoom": 0.08, "Bedroom": 0.1}
PAINTS: tuple[Rgb, ...] = (
    (0.94, 0.93, 0.9),
    (0.91, 0.87, 0.79),
    (0.85, 0.88, 0.9),
    (0.8, 0.86, 0.81),
    (0.88, 0.82, 0.78),
    (0.76, 0.82, 0.88),
    (0.93, 0.88, 0.72),
    (0.83, 0.8, 0.85),
    (0.72, 0.76, 0.72),
    (0.86, 0.74, 0.66),
    (0.78, 0.78, 0.76),
    (0.65, 0.73, 0.79),
)
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
    common = pick(rng, _PLANKS)
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
