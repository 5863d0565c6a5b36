"""Surveys of many seeds: generates and checks their houses, and counts objects and processor time."""

import hashlib
import time
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from vigil.assets.catalog import CATALOG
from vigil.assets.database import AssetDatabase
from vigil.assets.drawers import split_drawer_id
from vigil.base.processes.group import given_state, map_in_workers
from vigil.errors import HouseError, SettingError
from vigil.housegen.base.spec import spec_for
from vigil.housegen.checking.check import check_house
from vigil.housegen.generate import generate
from vigil.protocol.house import House, canonical_json

PART_CATEGORIES = frozenset({"Drawer", "StoveBurner", "StoveKnob"})
"""Categories that occur in generated houses only as parts of dressers and stoves."""

LoadHouse = Callable[[House], object]
"""Function that loads a house, e.g. in a simulator. Raises HouseError."""


@dataclass(frozen=True, slots=True)
class HouseReport:
    """Facts about one generated house; `name` is None if it could not be generated or loaded."""

    rooms: int
    problems: tuple[str, ...]
    name: str | None = None
    seconds: float = 0.0
    """Processor time (s) that the generation took."""
    fingerprint: str = ""
    """Hash of everything that is visible in the house."""
    objects: int = 0
    category_counts: Counter[str] = field(default_factory=Counter)
    """Number of objects of each category, including doors and windows."""


@dataclass(slots=True)
class Survey:
    """What a survey found in the houses of many seeds: counts, times and problems."""

    houses: Counter[int] = field(default_factory=Counter)
    """Number of generated houses, by number of rooms."""
    seconds: dict[int, list[float]] = field(default_factory=dict)
    """Processor times (s) that houses took to generate, by number of rooms."""
    problems: list[str] = field(default_factory=list)
    """Messages about houses that could not be generated or loaded, have a fault, or are equal to another house."""
    category_counts: Counter[str] = field(default_factory=Counter)
    """Number of objects of each category, in all houses."""
    objects: dict[int, list[int]] = field(default_factory=dict)
    """Numbers of objects in the houses, by number of rooms."""
    fingerprints: dict[str, str] = field(default_factory=dict)
    """Fingerprint -> name of the first house that has it."""

    def rare_categories(self, least: int) -> list[str]:
        """Return the categories with fewer than `least` objects, except categories of parts of furniture."""
        return [name for name in CATALOG if name not in PART_CATEGORIES and self.category_counts[name] < least]

    def lines(self) -> list[str]:
        """Return the survey's report: one line for each number of rooms."""
        report: list[str] = []
        for rooms in sorted(self.houses):
            seconds, objects = np.array(self.seconds[rooms]), np.array(self.objects[rooms])
            report.append(
                f"{rooms} rooms: {self.houses[rooms]} houses, {np.median(objects):.0f} objects "
                f"({objects.min()} to {objects.max()}); {np.median(seconds):.2f} s each, "
                f"95 % within {np.quantile(seconds, 0.95):.2f} s, at most {seconds.max():.2f} s"
            )
        return report

    def add(self, report: HouseReport) -> list[str]:
        """Add a house; return its problems, one of which may be that it is equal to an earlier house."""
        problems = list(report.problems)
        if report.name is not None:
            twin = self.fingerprints.setdefault(report.fingerprint, report.name)
            if twin != report.name:
                problems.append(f"{report.name} is the same house as {twin}")
            self.houses[report.rooms] += 1
            self.seconds.setdefault(report.rooms, []).append(report.seconds)
            self.objects.setdefault(report.rooms, []).append(report.objects)
            self.category_counts.update(report.category_counts)
        self.problems += problems
        return problems


def survey(
    seeds: Sequence[int],
    rooms: Iterable[int],
    load: LoadHouse,
    on_house: Callable[[list[str]], None],
    workers: int = 1,
) -> Survey:
    """Survey the houses of all `seeds` for all numbers of `rooms`. The result does not depend on `workers`.

    With several `workers` (processes), `load` must be picklable. `on_house` is called for each house in order, with its
    problems.
    """
    result = Survey()
    wanted = [(count, seed) for count in rooms for seed in seeds]
    for report in map_in_workers(partial(given_state, load), survey_seed, wanted, workers):
        on_house(result.add(report))
    return result


def survey_seed(load: LoadHouse, wanted: tuple[int, int]) -> HouseReport:
    """Generate, load and check one house, given as `wanted` (number of rooms, seed); return its report."""
    rooms, seed = wanted
    started = time.process_time()
    try:
        house = generate(seed, spec_for(str(rooms)))
        seconds = time.process_time() - started
        load(house)
    except (SettingError, HouseError) as error:
        return HouseReport(rooms, (f"{rooms} rooms, seed {seed}: {error}",))
    objects = house.objects()
    openings = [*house.document.doors, *house.document.windows]
    return HouseReport(
        rooms=rooms,
        problems=tuple(f"{house.name}: {fault}" for fault in check_house(house, AssetDatabase.default())),
        name=house.name,
        seconds=seconds,
        fingerprint=hashlib.sha256(canonical_json({**house.data, "metadata": None})).hexdigest(),
        objects=sum(split_drawer_id(node.asset_id) is None for node, _ in objects),
        category_counts=Counter(node.id.split("|")[0] for node, _ in objects)
        + Counter(opening.asset_id.split("_")[1] for opening in openings),
    )
