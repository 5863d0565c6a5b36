"""Houses that stand for the named scenes of iTHOR and RoboTHOR, which exist only in Unity's build.

The environment variable `VIGIL_THOR_SCENES` names a house file, a `.jsonl` or `.jsonl.gz` file with a house on each
line, or a folder of such files. If it is unset, the houses are generated.
"""

import gzip
import os
import re
from functools import lru_cache
from pathlib import Path

from vigil.base.files import read_file
from vigil.errors import HouseError, SettingError
from vigil.protocol.house import MAX_HOUSE_BYTES, House

VARIABLE = "VIGIL_THOR_SCENES"
"""Environment variable that names the houses."""
KINDS = {
    0: ("Kitchen", "kitchen"),
    2: ("LivingRoom", "living-room"),
    3: ("Bedroom", "bedroom"),
    4: ("Bathroom", "bathroom"),
}
"""Hundreds digit of an iTHOR scene's number -> room type in house documents, and name of the generator's house spec."""
PER_KIND = 30
"""Number of scenes of iTHOR for each kind of room."""
ROBOTHOR = {"Train": (12, 5), "Val": (3, 5)}
"""Split of RoboTHOR -> number of layouts, and of scenes for each layout."""
ROBOTHOR_ROOMS = "3"
_ITHOR_NAME = re.compile(r"FloorPlan(\d{1,3})(?:_physics)?")
_ROBOTHOR_NAME = re.compile(r"FloorPlan_(Train|Val)(\d+)_(\d+)")


def scene_names() -> list[str]:
    """Return the names of the scenes for which there are houses, in the form in which the client asks for them."""
    ithor = [f"FloorPlan{100 * hundreds + n}_physics" for hundreds in KINDS for n in range(1, PER_KIND + 1)]
    robothor = [
        f"FloorPlan_{split}{layout}_{number}"
        for split, (layouts, scenes) in ROBOTHOR.items()
        for layout in range(1, layouts + 1)
        for number in range(1, scenes + 1)
    ]
    return ithor + robothor


def house_for(scene: str) -> House | None:
    """Return the house that stands for a named scene; None for an unknown name.

    The house has a room of the scene's kind, and equal names give equal houses. Raises HouseError on an invalid house,
    and SettingError when `VIGIL_THOR_SCENES` has no house with such a room.
    """
    ithor, robothor = _ITHOR_NAME.fullmatch(scene), _ROBOTHOR_NAME.fullmatch(scene)
    hundreds, rest = divmod(int(ithor[1]), 100) if ithor is not None else (0, 0)
    if hundreds in KINDS and 1 <= rest <= PER_KIND:
        return _house(*KINDS[hundreds], 100 * hundreds + rest)
    if robothor is None:
        return None
    layouts, scenes = ROBOTHOR[robothor[1]]
    layout, number = int(robothor[2]), int(robothor[3])
    if not (1 <= layout <= layouts and 1 <= number <= scenes):
        return None
    return _house(None, ROBOTHOR_ROOMS, 1000 * (1 + list(ROBOTHOR).index(robothor[1])) + scenes * layout + number)


def _house(kind: str | None, spec: str, number: int) -> House:
    place = os.environ.get(VARIABLE, "").strip()
    if not place:
        from vigil.housegen.base.spec import spec_for  # noqa: PLC0415 - loads the generator
        from vigil.housegen.generate import generate  # noqa: PLC0415 - the same

        return generate(number, spec_for(spec))
    houses = [each for each in _documents(Path(place)) if kind is None or f'"{kind}"'.encode() in each[1]]
    alone = [each for each in houses if kind is None or each[1].count(b'"roomType"') == 1]
    if not houses:
        raise SettingError(f"{VARIABLE}={place}: no house has a room of type {kind}. Add one, or unset the variable.")
    name, text = (alone or houses)[(number - 1) % len(alone or houses)]
    return House.from_json(name, text, name)


@lru_cache(maxsize=1)
def _documents(place: Path) -> list[tuple[str, bytes]]:
    """Return the name and JSON of each house in a file, or in the files of a folder. Raises HouseError."""
    if not place.exists():
        raise HouseError(f"{VARIABLE}={place} does not exist. Give a folder or a file of houses.")
    files = sorted(place.iterdir()) if place.is_dir() else [place]
    found: list[tuple[str, bytes]] = []
    for file in files:
        if not file.name.endswith((".json", ".jsonl", ".jsonl.gz")):
            continue
        if file.suffix == ".json":
            text = read_file(file, f"House file {str(file)!r}", HouseError, MAX_HOUSE_BYTES)
            found += [(file.name, text)] if b'"floorPolygon"' in text else []
            continue
        with gzip.open(file) if file.suffix == ".gz" else file.open("rb") as lines:
            found += [(f"{file.name}:{number}", line) for number, line in enumerate(lines, 1) if line.strip()]
    if not found:
        raise HouseError(
            f"{VARIABLE}={place} does not contain a house: add a .json, .jsonl or .jsonl.gz file with a house."
        )
    return found
