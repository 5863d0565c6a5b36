"""Measures the MuJoCo engine: time to the first frame, steps with their frames a second, memory per live scene.

    python -m benchmarks.render [house.json ...] [--assets DB]

Every row is measured in processes of its own, so that each first frame is a cold one. Without houses it takes one of
one room and one of four from the generator.
"""

import argparse
import multiprocessing
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
import psutil

from vigil.assets.database import AssetDatabase
from vigil.base.geometry import Pose, Vec3
from vigil.housegen.base.spec import SPECS
from vigil.housegen.generate import generate
from vigil.protocol.actions import Navigate
from vigil.protocol.house import House
from vigil.protocol.observation import Quality
from vigil.protocol.world import Setup
from vigil.sim.core.embedded import EmbeddedSimulator
from vigil.sim.engines.mujoco.engine import MujocoEngine

AGAIN = 7
STEPS = 10
ROUNDS = 5
LIVE = 4
MODES: tuple[tuple[Quality, int], ...] = (("default", 1), ("fast", 1), ("default", 2))
"""Quality, and how many processes at once."""
HEADER = "quality  at once  house           first s  again s  step+RGB /s  MB live"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("houses", nargs="*", type=Path)
    parser.add_argument("--assets", type=Path, help="THOR's asset-database.json")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        houses = options.houses or own_houses(Path(folder))
        print(f"load average at the start: {psutil.getloadavg()[0]:.1f}\n{HEADER}", flush=True)
        for quality, at_once in MODES:
            for house in houses:
                print(row(house, options.assets, quality, at_once), flush=True)
        for house in houses:
            print(f"fast draws {faster(house, options.assets):.1f} times as many frames of {house.stem} as default")


def own_houses(folder: Path) -> list[Path]:
    """Return the files of two generated houses."""
    paths = [folder / f"{name}.json" for name in ("1-room", "4-room")]
    for path in paths:
        generate(7, SPECS[path.stem]).save(path)
    return paths


def row(house: Path, assets: Path | None, quality: Quality, at_once: int) -> str:
    """Return one line of the table, the mean over the processes."""
    with ProcessPoolExecutor(at_once, multiprocessing.get_context("spawn")) as pool:
        jobs = [pool.submit(measure, house, assets, quality) for _ in range(at_once)]
        first, again, stepping, each = np.mean([job.result() for job in jobs], axis=0)
    times = f"{first:7.2f} {again:8.3f} {stepping:12.1f} {each:8.1f}"
    return f"{quality:7} {at_once:8}  {house.stem:14} {times}"


def measure(path: Path, assets_path: Path | None, quality: Quality) -> tuple[float, float, float, float]:
    """Return the seconds to the first frame, to that of a house loaded before, steps a second, and MB a live scene."""
    house = House.load(path)
    assets = AssetDatabase.load(assets_path) if assets_path else AssetDatabase.default()
    first, simulator = open_house(house, assets, quality)
    again = min(open_and_close(house, assets, quality) for _ in range(AGAIN))
    stepping = rate(lambda: step(simulator))
    before = memory_mb()
    live = [open_house(house, assets, quality)[1] for _ in range(LIVE)]
    each = (memory_mb() - before) / LIVE
    for one in [*live, simulator]:
        one.close()
    return first, again, stepping, each


def faster(path: Path, assets_path: Path | None) -> float:
    """Return the rate of `fast` over that of the default, each at its best, drawn in turns in one process."""
    house = House.load(path)
    assets = AssetDatabase.load(assets_path) if assets_path else AssetDatabase.default()
    qualities: tuple[Quality, ...] = ("default", "fast")
    simulators = [open_house(house, assets, quality)[1] for quality in qualities]
    turns = [[seconds_of(one) for one in simulators] for _ in range(2 * ROUNDS)]
    for one in simulators:
        one.close()
    slow, fast = (min(each) for each in zip(*turns, strict=True))
    return slow / fast


def seconds_of(simulator: EmbeddedSimulator) -> float:
    """Return what some steps with their frames take."""
    start = time.perf_counter()
    for _ in range(STEPS):
        step(simulator)
    return time.perf_counter() - start


def open_and_close(house: House, assets: AssetDatabase, quality: Quality) -> float:
    """Return the seconds from a house document to its first frame."""
    seconds, simulator = open_house(house, assets, quality)
    simulator.close()
    return seconds


def open_house(house: House, assets: AssetDatabase, quality: Quality) -> tuple[float, EmbeddedSimulator]:
    """Return the seconds from a house document to its first frame, and the simulator."""
    start = time.perf_counter()
    simulator = EmbeddedSimulator(MujocoEngine(quality), assets)
    simulator.load(house)
    simulator.reset(start_of(house, simulator), Setup())
    simulator.frame()
    return time.perf_counter() - start, simulator


def start_of(house: House, simulator: EmbeddedSimulator) -> Pose:
    """Return the house's own start, or else the first free place on a grid."""
    if house.start is not None and simulator.can_stand(house.start.position):
        return house.start
    corners = np.array([(point.x, point.z) for point in house.document.rooms[0].floor_polygon])
    low, high = corners.min(axis=0), corners.max(axis=0)
    places = [
        Vec3(float(x), 0.0, float(z)) for x in np.arange(low[0], high[0], 0.2) for z in np.arange(low[1], high[1], 0.2)
    ]
    return Pose(position=next(place for place in places if simulator.can_stand(place)), rotation=0.0, horizon=30.0)


def step(simulator: EmbeddedSimulator) -> None:
    """Turn a little and draw."""
    simulator.step(Navigate(mode="turn_right", magnitude=9.0))
    simulator.frame()


def rate(act: Callable[[], None]) -> float:
    """Return how often an act runs in a second, once it is warm."""
    for _ in range(STEPS):
        act()
    start = time.perf_counter()
    for _ in range(STEPS * ROUNDS):
        act()
    return STEPS * ROUNDS / (time.perf_counter() - start)


def memory_mb() -> float:
    """Return this process's resident memory."""
    return psutil.Process().memory_info().rss / 2**20


if __name__ == "__main__":
    main()
