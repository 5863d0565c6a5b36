"""Made-up files in the formats of AI2-THOR and ProcTHOR, with invented objects and numbers.

asset-database.json       THOR's list of assets with their bounding boxes
material-database.json    THOR's names of materials by kind
house_0.json ... 2        houses of one, two and four rooms made of those assets
one_room_train.jsonl.gz   more houses, one a line
"""

import gzip
import json
from pathlib import Path
from typing import Any

from vigil.assets.catalog import CATALOG
from vigil.assets.database import AssetDatabase
from vigil.housegen.base.spec import spec_for
from vigil.housegen.generate import generate
from vigil.housegen.thor_export import export_thor
from vigil.protocol.house import House

UNKNOWN_TO_THOR = {"Cabinet", "Drawer", "Shelf", "Stove", "Curtains", "Bathtub", "Mirror", "CeilingLamp", "Rug"}
"""Categories in our houses for which THOR's database has no asset."""
SCALES = (0.85, 1.0, 1.2)
COUNTERS_FT = {
    "I_3x2": (3, 2),
    "I_4x2": (4, 2),
    "I_5x2": (5, 2),
    "I_6x2": (6, 2),
    "I_8x2": (8, 2),
    "I_10x2": (10, 2),
    "L_6x6": (6, 6),
    "L_8x8": (8, 8),
}
"""Form of a counter, as named in its id -> width and depth (feet)."""
FOOT_M = 0.305
MATERIALS = {
    "Wood": ["LightWoodFloor", "DarkWoodPlanks", "WoodGrain_Oak"],
    "Wall": ["BrickSmall", "PlasterDrywall", "CeramicTiles"],
    "Fabric": ["CarpetBeige", "FabricWeave"],
}
HOUSES = {"house_0": ("bedroom", 3), "house_1": ("bedroom-living", 0), "house_2": ("4", 7)}
MORE_HOUSES = (("bathroom", 4), ("kitchen", 4), ("living-room", 2))


def write_thor_files(folder: Path) -> Path:
    """Write the files and return their folder."""
    assets = write_asset_database(folder)
    (folder / "material-database.json").write_text(json.dumps(MATERIALS))
    thor = AssetDatabase.load(assets)
    for name, (spec, seed) in HOUSES.items():
        _house(name, spec, seed, thor).save(folder / f"{name}.json")
    with gzip.open(folder / "one_room_train.jsonl.gz", "wt") as lines:
        for spec, seed in MORE_HOUSES:
            lines.write(json.dumps(_house(spec, spec, seed, thor).data) + "\n")
    return folder


def write_asset_database(folder: Path) -> Path:
    """Write only AI2-THOR's asset database, and return its path."""
    path = folder / "asset-database.json"
    path.write_text(json.dumps(_assets()))
    return path


def _assets() -> dict[str, list[dict[str, Any]]]:
    return {name: _rows(name) for name in CATALOG if name not in UNKNOWN_TO_THOR}


def _rows(category: str) -> list[dict[str, Any]]:
    size = CATALOG[category].typical_size
    boxes = [{axis: scale * side for axis, side in zip("xyz", size, strict=True)} for scale in SCALES]
    rows = [{"assetId": f"{category}_{number}", "boundingBox": box} for number, box in enumerate(boxes, start=1)]
    if category == "CounterTop":
        rows += [
            {"assetId": f"Countertop_{form}", "boundingBox": {"x": wide * FOOT_M, "y": size.y, "z": deep * FOOT_M}}
            for form, (wide, deep) in COUNTERS_FT.items()
        ]
    return rows


def _house(name: str, spec: str, seed: int, thor: AssetDatabase) -> House:
    return House(name, export_thor(generate(seed, spec_for(spec)), thor, MATERIALS).data)
