"""A tiny pack: one small room with a few things, and an episode of several families; quick on the `fake` backend."""

import hashlib
import json
from pathlib import Path
from typing import Any

from vigil.base.geometry import Pose, Vec3
from vigil.packs.freeze import freeze
from vigil.packs.pack import Pack
from vigil.protocol.actions import Report
from vigil.protocol.episode import Episode, HouseRef, Solution
from vigil.protocol.families import FAMILIES, Family
from vigil.protocol.goals import AgentNearTarget, Goal, ObjectInState, ReportStatus, TargetGrounded
from vigil.protocol.house import House, canonical_json

SIDE = 5.0
TABLE, MUG, FRIDGE = "DiningTable|1|0", "Mug|1|1", "Fridge|1|2"
HERE = Pose(position=Vec3(2.5, 0.0, 1.0), rotation=0.0, horizon=30.0)


def tiny_house(name: str = "tiny", **renamed: str) -> House:
    """Return a room of 5 x 5 m with a table, a mug on it, and a fridge; object ids may be given by category."""
    ids = {"DiningTable": TABLE, "Mug": MUG, "Fridge": FRIDGE, **renamed}
    mug = _thing(ids["Mug"], "Mug_1", 2.5, 0.85, 3.0)
    table = _thing(ids["DiningTable"], "Dining_Table_16_1", 2.5, 0.4, 3.0) | {"children": [mug]}
    fridge = _thing(ids["Fridge"], "Fridge_1", 4.4, 0.9, 3.0) | {"openness": 0.0}
    corners = [(0.0, 0.0), (0.0, SIDE), (SIDE, SIDE), (SIDE, 0.0)]
    walls = [_wall(corners[index], corners[(index + 1) % 4]) for index in range(4)]
    data = {
        "rooms": [
            {
                "id": "room|1",
                "roomType": "Kitchen",
                "floorPolygon": [_point(x, 0.0, z) for x, z in corners],
                "floorMaterial": {"name": "wood/oak"},
                "ceilings": [],
                "children": [],
            }
        ],
        "walls": walls,
        "doors": [],
        "windows": [],
        "objects": [table, fridge],
        "proceduralParameters": {"lights": [], "ceilingMaterial": {"name": "plaster"}, "skyboxId": "SkyAlbany"},
        "metadata": {"schema": "1.0.0"},
    }
    return House(name, json.loads(json.dumps(data)))


def tiny_episode(number: int, family: Family = "DA", house: House | None = None, **changes: Any) -> Episode:
    """Return one episode in the tiny house."""
    spec = FAMILIES[family]
    house = house or tiny_house()
    fields: dict[str, Any] = {
        "id": f"tiny-{family}-{number:03d}",
        "family": family,
        "house": HouseRef(name=house.name, sha256=house.sha256),
        "start": HERE,
        "instruction": f"Go to the table, to within about one and a half metres of it ({number}).",
        "goal": _goal(family),
        "bindings": {"target": _goal(family).object_id},
        "max_steps": spec.max_steps,
        "max_invalid": spec.max_invalid,
    }
    return Episode.model_validate({**fields, **changes})


def tiny_pack(folder: Path, count: int = 4, families: tuple[Family, ...] = ("DA", "PG", "SV", "AI")) -> Pack:
    """Freeze a pack of `count` episodes into `folder`, the families in turn."""
    episodes = [tiny_episode(number, families[number % len(families)]) for number in range(count)]
    return freeze(folder, episodes, _solutions(episodes), [tiny_house()], name="tiny")


def loose_pack(folder: Path, episodes: list[Episode], houses: list[House]) -> Pack:
    """Write a pack without the checks of `freeze`: budgets may be anything."""
    contents = {
        "episodes.jsonl": b"".join(canonical_json(episode.model_dump(mode="json")) + b"\n" for episode in episodes),
        "solutions.jsonl": b"".join(
            canonical_json(solution.model_dump(mode="json")) + b"\n" for solution in _solutions(episodes)
        ),
        **{f"houses/{house.name}.json": canonical_json(house.data) + b"\n" for house in houses},
    }
    families: dict[str, int] = {}
    for episode in episodes:
        families[episode.family] = families.get(episode.family, 0) + 1
    manifest = {
        "name": "loose",
        "episodes": len(episodes),
        "houses": len(houses),
        "families": families,
        "files": {name: hashlib.sha256(data).hexdigest() for name, data in contents.items()},
    }
    for name, data in {**contents, "manifest.json": json.dumps(manifest).encode()}.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
    return Pack.load(folder)


def _solutions(episodes: list[Episode]) -> list[Solution]:
    return [Solution(episode_id=episode.id, actions=(Report(status="success", summary=""),)) for episode in episodes]


def _goal(family: Family) -> Goal:
    match family:
        case "PG":
            return TargetGrounded(object_id=MUG)
        case "SV":
            return ReportStatus(object_id=FRIDGE, state="is_open")
        case "AI":
            return ObjectInState(object_id=FRIDGE, state="is_open")
        case "VS":
            return ObjectInState(object_id=MUG, state="is_visible")
        case _:
            return AgentNearTarget(object_id=TABLE)


def _point(x: float, y: float, z: float) -> dict[str, float]:
    return {"x": x, "y": y, "z": z}


def _thing(object_id: str, asset_id: str, x: float, y: float, z: float) -> dict[str, Any]:
    return {
        "id": object_id,
        "assetId": asset_id,
        "position": _point(x, y, z),
        "rotation": _point(0.0, 0.0, 0.0),
        "kinematic": True,
        "children": [],
    }


def _wall(start: tuple[float, float], end: tuple[float, float]) -> dict[str, Any]:
    name = "|".join(f"{value:.2f}" for value in (*start, *end))
    points = [_point(x, y, z) for y in (0.0, 2.8) for x, z in (start, end)]
    return {"id": f"wall|1|{name}", "roomId": "room|1", "polygon": points, "material": {"name": "plaster"}}
