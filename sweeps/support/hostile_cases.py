"""Hostile packs and houses, made from a small good pack by seeded mutations."""

import contextlib
import copy
import hashlib
import json
import os
import random
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

from sweeps.support.json_mutations import mutated, nested
from vigil.errors import VigilError
from vigil.packs.files import EPISODES, MANIFEST, SOLUTIONS
from vigil.packs.pack import Pack
from vigil.protocol.episode import Episode, HouseRef, Solution
from vigil.protocol.house import House

EPISODES_TAKEN = 3
SPARSE_BYTES = 3 * 2**30
UNREADABLE = (VigilError, ValueError, TypeError, KeyError, AttributeError, RecursionError)
NAMES = (
    "../outside.json", "/etc/passwd", "houses/../episodes.jsonl", "houses/../../x", "", ".", "houses", "a\x00b",
    "x" * 300, "\ud800", "houses/no such.json", "C:\\x", "~/x", "manifest.json", "houses//x.json", "./episodes.jsonl",
)  # fmt: skip

Files = dict[str, bytes]


@lru_cache(maxsize=8)
def base_pack(number: int) -> Files:
    """Return the files of a small good pack: a house of one room of the starter pack, and episodes in it."""
    starter = Pack.load("starter")
    houses = sorted({episode.house.name for episode in starter.episodes})
    small = [name for name in houses if name.startswith(("bathroom", "bedroom_", "kitchen_"))] or houses
    name = small[number % len(small)]
    episodes = [episode for episode in starter.episodes if episode.house.name == name][:EPISODES_TAKEN]
    house = starter.house_of(episodes[0])
    return _packed(house.data, episodes, [starter.solutions[episode.id] for episode in episodes], starter)


def _packed(house: dict[str, Any], episodes: list[Episode], solutions: list[Solution], like: Pack) -> Files:
    name = episodes[0].house.name
    files = {
        EPISODES: b"".join(_line(episode.model_dump(mode="json")) for episode in episodes),
        SOLUTIONS: b"".join(_line(solution.model_dump(mode="json")) for solution in solutions),
        f"houses/{name}.json": _line(house),
    }
    families: dict[str, int] = {}
    for episode in episodes:
        families[episode.family] = families.get(episode.family, 0) + 1
    counts = {"name": "hostile", "episodes": len(episodes), "houses": 1, "families": families, "files": {}, "meta": {}}
    files[MANIFEST] = _line({**like.manifest.model_dump(mode="json"), **counts})
    return rehashed(files)


def _line(document: Any) -> bytes:
    text = json.dumps(document, sort_keys=True, separators=(",", ":"))
    return text.encode("utf-8", "surrogatepass") + b"\n"


def house_file(files: Files) -> str:
    """Return the path of the pack's house."""
    return next(name for name in files if name.startswith("houses/"))


def rehashed(files: Files) -> Files:
    """Return the files with all hashes corrected, as far as the files can be read."""
    files = dict(files)
    name = house_file(files)
    with contextlib.suppress(*UNREADABLE):  # a house that cannot be read keeps its hash
        house = House(Path(name).stem, json.loads(files[name]))
        ref = HouseRef(name=house.name, sha256=house.sha256).model_dump()
        lines = [json.loads(line) for line in files[EPISODES].splitlines()]
        files[EPISODES] = b"".join(_line({**line, "house": ref} if isinstance(line, dict) else line) for line in lines)
    with contextlib.suppress(*UNREADABLE):  # a manifest that cannot be read stays as it is
        manifest = json.loads(files[MANIFEST])
        hashes = {name: hashlib.sha256(data).hexdigest() for name, data in files.items() if name != MANIFEST}
        files[MANIFEST] = _line({**manifest, "files": {**manifest["files"], **hashes}})
    return files


def write(folder: Path, files: Files) -> None:
    """Write the files of a pack."""
    for name, data in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)


# --- packs ------------------------------------------------------------------------------------------------------------


def hostile_pack(rng: random.Random, folder: Path) -> str:
    """Write a hostile pack into a folder. Return a description of what is hostile about it."""
    files = base_pack(rng.randrange(8))
    kind = rng.choices(("json", "text", "names", "house", "things"), (45, 15, 10, 20, 10))[0]
    name = rng.choice([MANIFEST, EPISODES, EPISODES, SOLUTIONS, house_file(files)])
    is_rehashed = rng.random() < 0.85
    if kind == "json":
        files = {**files, name: _mutated_lines(rng, files[name])}
    elif kind == "text":
        files = {**files, name: _mutated_text(rng, files[name])}
    elif kind == "names":
        files = {**files, MANIFEST: _with_names(rng, files[MANIFEST])}
    elif kind == "house":
        name = house_file(files)
        changed, description = hostile_house(rng, json.loads(files[name]))
        files, name = {**files, name: _line(changed)}, f"{name} ({description})"
    write(folder, rehashed(files) if is_rehashed else files)
    if kind == "things":
        name = f"{name} is {_odd_file(rng, folder / name)}"
    return f"{kind}: {name}{', with hashes that fit' if is_rehashed else ''}"


def _mutated_lines(rng: random.Random, data: bytes) -> bytes:
    lines = data.splitlines()
    index = rng.randrange(len(lines))
    lines[index] = _line(mutated(rng, json.loads(lines[index]))).rstrip(b"\n")
    if rng.random() < 0.1:
        lines.insert(0, rng.choice(lines))
    return b"\n".join(lines) + b"\n"


def _mutated_text(rng: random.Random, data: bytes) -> bytes:
    kind, place = rng.randrange(9), rng.randrange(len(data))
    if kind == 0:
        return data[:place]
    if kind == 1:
        return b""
    if kind == 2:
        return data[:place] + bytes([rng.randrange(256)]) + data[place + 1 :]
    if kind == 3:
        return rng.randbytes(1000)
    if kind == 4:
        return nested(rng.choice([100, 5000, 200_000]))
    if kind == 5:
        return b"\xef\xbb\xbf" + data
    if kind == 6:
        return b"1" * rng.choice([10, 5000, 1_000_000])
    if kind == 7:
        return data.replace(b"\n", rng.choice([b"\r\n", b"\r", b"\n\n\n", b"\x00\n", "\u2028".encode()]))
    return data.replace(b":", b':{"a":' * 5000, 1)


def _with_names(rng: random.Random, data: bytes) -> bytes:
    manifest = json.loads(data)
    files, name = manifest["files"], rng.choice(NAMES)
    old = rng.choice(list(files))
    files[name] = files.pop(old) if rng.random() < 0.5 else files[old]
    return _line(manifest)


def _odd_file(rng: random.Random, path: Path) -> str:
    """Replace a file by something that is not a plain file of its size. Return a description."""
    kind = rng.choice(("absent", "folder", "fifo", "loop", "zero", "outside", "sparse"))
    path.unlink()
    if kind == "folder":
        path.mkdir()
    elif kind == "fifo":
        os.mkfifo(path)
    elif kind == "loop":
        path.symlink_to(path)
    elif kind == "zero":
        path.symlink_to("/dev/zero")
    elif kind == "outside":
        path.symlink_to("/etc/passwd")
    elif kind == "sparse":
        with path.open("wb") as file:
            file.truncate(SPARSE_BYTES)
    return kind


# --- houses -----------------------------------------------------------------------------------------------------------


def hostile_house(rng: random.Random, house: dict[str, Any]) -> tuple[Any, str]:
    """Return a hostile house document and a description of what is hostile about it."""
    if rng.random() < 0.5:
        return mutated(rng, house), "mutated"
    changed = copy.deepcopy(house)
    kind = rng.choice(_HOUSE_KINDS)
    kind(rng, changed)
    return changed, kind.__name__.strip("_").replace("_", " ")


def _point(x: float, y: float, z: float) -> dict[str, float]:
    return {"x": x, "y": y, "z": z}


def _crossing_floor(rng: random.Random, house: dict[str, Any]) -> None:
    rng.shuffle(rng.choice(house["rooms"])["floorPolygon"])


def _flat_floor(rng: random.Random, house: dict[str, Any]) -> None:
    for point in rng.choice(house["rooms"])["floorPolygon"]:
        point[rng.choice("xz")] = rng.choice([0.0, 1.0, 1e-9])


def _far_floor(rng: random.Random, house: dict[str, Any]) -> None:
    rng.choice(rng.choice(house["rooms"])["floorPolygon"])["x"] = rng.choice([9999.0, -9999.0, 1e4, 500.0])


def _no_walls(rng: random.Random, house: dict[str, Any]) -> None:
    house["walls"] = [] if rng.random() < 0.5 else house["walls"][:1]


def _stretched_wall(rng: random.Random, house: dict[str, Any]) -> None:
    for point in rng.choice(house["walls"])["polygon"]:
        point["y"] *= rng.choice([0, -1, 100, 3000])


def _shrunken_wall(rng: random.Random, house: dict[str, Any]) -> None:
    polygon = rng.choice(house["walls"])["polygon"]
    for point in polygon:
        point.update(rng.choice([polygon[0], {"x": 0.0, "z": 0.0}]))


def _odd_hole(rng: random.Random, house: dict[str, Any]) -> None:
    openings = [*house["doors"], *house["windows"]]
    if openings:
        opening = rng.choice(openings)
        factor = rng.choice([-1, 0, 50, 1e-6, 1000])
        opening["holePolygon"] = [_point(p["x"] * factor, p["y"] * factor, 0.0) for p in opening["holePolygon"]]
        opening["wall1"] = rng.choice([opening.get("wall1"), "no such wall", opening["wall0"], None])


def _many_doors(rng: random.Random, house: dict[str, Any]) -> None:
    if house["doors"]:
        for number in range(rng.choice([2, 100, 2000])):
            house["doors"].append({**house["doors"][0], "id": f"door|{number}"})


def _inside_itself(rng: random.Random, house: dict[str, Any]) -> None:
    thing = rng.choice(house["objects"])
    thing["children"] = [copy.deepcopy(thing)]


def _deep_things(rng: random.Random, house: dict[str, Any]) -> None:
    """Build a tower of nested things, each with its own id."""
    thing: dict[str, Any] = {**copy.deepcopy(rng.choice(house["objects"])), "id": "Bowl|deep", "children": []}
    for level in range(rng.choice([10, 80, 150, 250])):
        thing = {**thing, "id": f"Bowl|deep|{level}", "children": [thing]}
    house["objects"].append(thing)


def _many_things(rng: random.Random, house: dict[str, Any]) -> None:
    model = rng.choice(house["objects"])
    for number in range(rng.choice([500, 4900, 5100])):
        place = _point(rng.uniform(0, 4), rng.uniform(0, 2), rng.uniform(0, 4))
        house["objects"].append({**model, "id": f"Copy|{number}", "position": place, "children": []})


def _odd_asset(rng: random.Random, house: dict[str, Any]) -> None:
    names = ["", "no such thing", "Fridge_1", "x" * 10_000, "vigil_Apple_99999999999999999999", "../Apple", "\x00", "é"]
    rng.choice(house["objects"])["assetId"] = rng.choice(names)


def _odd_place(rng: random.Random, house: dict[str, Any]) -> None:
    thing = rng.choice(house["objects"])
    key = rng.choice(["position", "rotation"])
    thing[key] = _point(*(rng.choice([0.0, 9999.0, -9999.0, 1e-12, 90.0, 45.0, 359.9999]) for _ in range(3)))


def _odd_state(rng: random.Random, house: dict[str, Any]) -> None:
    for thing in house["objects"]:
        thing["openness"] = rng.choice([-1, 2, 1e300, 0.5, None])
        thing["isOn"] = rng.choice([True, False, None])


def _odd_start(rng: random.Random, house: dict[str, Any]) -> None:
    pose = {
        "position": _point(rng.choice([1e4, 0.0, 1e9]), 500.0, 1.0),
        "rotation": rng.choice([1e9, 720.0]),
        "horizon": 1e9,
    }
    house.setdefault("metadata", {})["agent"] = pose


def _odd_light(rng: random.Random, house: dict[str, Any]) -> None:
    light = {"id": "light", "type": rng.choice(["point", "directional", "x"]), "position": _point(0, 9999, 0)}
    light |= {"intensity": rng.choice([1e308, -1, 0]), "rgb": {"r": -1, "g": 1e9, "b": 0}}
    house["proceduralParameters"]["lights"] = [light] * rng.choice([1, 500])


def _same_ids(rng: random.Random, house: dict[str, Any]) -> None:
    first = rng.choice(house["objects"])["id"]
    kind = rng.choice(["objects", "walls", "rooms", "doors", "windows"])
    if house[kind]:
        rng.choice(house[kind])["id"] = rng.choice([first, "", "agent", "exterior", house["rooms"][0]["id"]])


_HOUSE_KINDS: tuple[Callable[[random.Random, dict[str, Any]], None], ...] = (
    _crossing_floor, _flat_floor, _far_floor, _no_walls, _stretched_wall, _shrunken_wall, _odd_hole, _many_doors,
    _inside_itself, _deep_things, _many_things, _odd_asset, _odd_place, _odd_state, _odd_start, _odd_light, _same_ids,
)  # fmt: skip
