"""Every material name resolves to something plausible, the same each time."""

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest

from vigil.assets.kernel import pictures, textures
from vigil.assets.kernel.materials import material

OWN_KEYS = {
    "wood/oak": "wood", "wood/#6b4a2e": "wood", "metal/brushed": "brushed", "fabric/#aa3322": "weave",
    "plastic/red": None, "ceramic/#f0f0f0": None, "glass": None, "glow/#ffeecc": None, "screen/3": "screen/3",
    "leaf/2": "leaf", "picture/7": "picture/7", "print/news": "print/news", "carpet/#886644": "carpet",
}  # fmt: skip
THOR_NAMES = {
    "WoodFloorsCrossRED": "parquet", "DarkWoodPlanks": "planks", "bathroomTilesBlue": "small_tiles",
    "SubwayTilesRough 1": "subway", "RedBricks": "brick", "WhiteMarble2": "marble", "CreamMarbleTiles": "marble_tiles",
    "DarkGranite": "granite", "Walldrywall3Tiled": "plaster", "PureWhite": "plaster", "ConcreteFloor": "concrete",
    "HexTiles": "hexagons", "KitchenTilesCheckerboard": "checker", "Carpet3": "carpet", "Porcelain_Blue_Mat": None,
    "RobinEgg": "planks", "Microwave_Metal_Mat": "brushed", "Leather 2": "leather",
}  # fmt: skip


@pytest.mark.parametrize(("name", "texture"), [*OWN_KEYS.items(), *THOR_NAMES.items()])
def test_names_resolve_to_their_kind(name: str, texture: str | None) -> None:
    assert material(name).texture_name == texture


@pytest.mark.parametrize(
    ("name", "channel"), [("bathroomTilesBlue", 2), ("RedBricks", 0), ("DrywallGreen", 1), ("Porcelain_Red_Mat", 0)]
)
def test_colour_words_colour(name: str, channel: int) -> None:
    rgb = material(name).rgba[:3]
    assert rgb[channel] == max(rgb)
    assert max(rgb) - min(rgb) > 0.1


def test_dark_is_darker_than_white() -> None:
    assert sum(material("DarkWoodSmooth").rgba[:3]) < sum(material("WhiteWood").rgba[:3]) - 1.0


def test_tint_takes_the_place_of_the_colour() -> None:
    assert material("PureWhite", (0.2, 0.4, 0.6)).rgba == (0.2, 0.4, 0.6, 1.0)
    assert material("fabric/#ffffff", (0.2, 0.4, 0.6)).texture is material("fabric").texture


@pytest.mark.parametrize("name", ["", "/", "x/y/z", "wood/", "wood/no such", "fabric/#12", "screen/", "🙂", "a" * 500])
def test_any_string_resolves(name: str) -> None:
    found = material(name)
    assert all(0 <= part <= 1 for part in found.rgba)
    assert (found.texture is None) == (found.texture_name is None)


def test_textures_are_sound_and_repeatable() -> None:
    names = [*textures.PATTERNS, *(f"{kind}/{variant}" for kind, table in pictures.KINDS.items() for variant in table)]
    digests = {}
    for name in names:
        image = textures.texture(name)
        assert image.dtype == np.uint8, name
        assert image.ndim == 3, name
        assert image.shape[2] == 3, name
        assert not image.flags.writeable, name
        digests[name] = hashlib.sha256(image.tobytes()).digest()
    textures.texture.cache_clear()
    assert all(hashlib.sha256(textures.texture(name).tobytes()).digest() == digests[name] for name in names)
    assert len({digests[f"picture/{n}"] for n in range(24)}) == 24


@pytest.mark.parametrize("name", ["wood", "planks", "parquet", "weave", "brick", "tiles", "plaster", "carpet", "grass"])
def test_textures_tile(name: str) -> None:
    """The step across the border is no larger than steps inside."""
    image = textures.texture(name).astype(float).mean(2)
    for pixels in (image, image.T):
        inside = np.abs(np.diff(pixels, axis=0)).mean(1)
        border = np.abs(pixels[-1] - pixels[0]).mean()
        assert border <= inside.max() * 1.2 + 2


@pytest.mark.real_houses
def test_every_thor_material_resolves(thor_files: Path) -> None:
    database = json.loads((thor_files / "material-database.json").read_text())
    kinds = {category: {material(name).texture_name for name in names} for category, names in database.items()}
    assert None not in kinds["Wood"]
    assert kinds["Wood"] <= {"planks", "parquet", "wood", "wicker"}
    assert kinds["Wall"] <= {"planks", "brick", "plaster", "marble", "tiles", "concrete", "marble_tiles", "granite",
                             "hexagons", "small_tiles", "checker", "weave", "subway", None}  # fmt: skip
    assert kinds["Fabric"] <= {"carpet", "weave", "leather"}


@pytest.mark.real_houses
def test_solid_wall_colours_tint(thor_files: Path) -> None:
    for colour in json.loads((thor_files / "solid-wall-colors.json").read_text()):
        tint = (colour["r"], colour["g"], colour["b"])
        assert material("PureWhite", tint).rgba[:3] == tint
