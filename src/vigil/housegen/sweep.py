"""Sweeps over seeds: generates houses, checks each, counts what is in them and how long they take."""

import hashlib
import time
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from vigil.assets.catalog import CATALOG
from vigil.assets.sizes import AssetDatabase
from vigil.errors import HouseError, SettingError
from vigil.house import House, canonical_json
from vigil.housegen.check import check_house
from vigil.housegen.generate import generate
from vigil.housegen.spec import spec_for

PARTS = frozenset({"Drawer", "StoveBurner", "StoveKnob"})
"""Categories that generated houses have as parts of dressers and stoves, never as things of their own."""


@dataclass(slots=True)
class Sweep:
    """What a sweep found."""

    houses: Counter[int] = field(default_factory=Counter)
    """Generated houses by number of rooms."""
    seconds: dict[int, list[float]] = field(default_factory=dict)
    """Processor time of each generation, by number of rooms."""
    problems: list[str] = field(default_factory=list)
    """Houses that did not come out, have a fault, do not load or are like another."""
    found: Counter[str] = field(default_factory=Counter)
    """Things of each category, in all houses."""
    objects: dict[int, list[int]] = field(default_factory=dict)
    """Objects of each house, by number of rooms."""

    def rare(self, least: int) -> list[str]:
        """Returns the categories with fewer things than `least`, parts of furniture aside."""
        return [name for name in CATALOG if name not in PARTS and self.found[name] < least]

    def lines(self) -> list[str]:
        """Returns the report, a line for each number of rooms."""
        report: list[str] = []
        for rooms in sorted(self.houses):
            seconds, objects = np.array(self.seconds[rooms]), np.array(self.objects[rooms])
            report.append(
                f"{rooms} rooms: {self.houses[rooms]} houses, {np.median(objects):.0f} objects "
                f"({objects.min()} to {objects.max()}); {np.median(seconds):.2f} s each, "
                f"95 % within {np.quantile(seconds, 0.95):.2f} s, at most {seconds.max():.2f} s"
            )
        return report


def sweep(
    seeds: Sequence[int], rooms: Iterable[int], load: Callable[[House], object], told: Callable[[str], None]
) -> Sweep:
    """Returns what the houses of all `seeds` and numbers of `rooms` are like.

    `load` raises HouseError for a house that does not load; `told` gets each problem as it is found.
    """
    result = Sweep()
    seen: dict[str, str] = {}

    def note(problem: str) -> None:
        result.problems.append(problem)
        told(problem)

    for count in rooms:
        for seed in seeds:
            started = time.process_time()
            try:
                house = generate(seed, spec_for(str(count)))
                seconds = time.process_time() - started
                load(house)
            except (SettingError, HouseError) as error:
                note(f"{count} rooms, seed {seed}: {error}")
                continue
            for fault in check_house(house, AssetDatabase.default()):
                note(f"{house.name}: {fault}")
            twin = seen.setdefault(_likeness(house), house.name)
            if twin != house.name:
                note(f"{house.name}: is the same house as {twin}")
            _count(result, count, house, seconds)
    return result


def _likeness(house: House) -> str:
    """Returns a hash of all that one sees of a house; its seed and name are no part of it."""
    return hashlib.sha256(canonical_json({**house.data, "metadata": None})).hexdigest()


def _count(result: Sweep, rooms: int, house: House, seconds: float) -> None:
    result.houses[rooms] += 1
    result.seconds.setdefault(rooms, []).append(seconds)
    objects = house.objects()
    result.objects.setdefault(rooms, []).append(len(objects))
    result.found.update(node.id.split("|")[0] for node, _ in objects)
    openings = [*house.document.doors, *house.document.windows]
    result.found.update(opening.asset_id.split("_")[1] for opening in openings)
