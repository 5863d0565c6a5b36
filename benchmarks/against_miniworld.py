"""Processor time of a step and its frame of 640 x 480 pixels, for MiniWorld and for both qualities of VIGIL.

    pip install miniworld
    python -m benchmarks.against_miniworld [--rounds 5] [--steps 80]

In each round, every row is measured once, in a process of its own: MiniWorld's and VIGIL's houses of one and four
rooms. The agent turns in each step. The table gives the medians of the rounds.
"""

import argparse
import importlib
import multiprocessing
import os
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from statistics import median
from typing import Any

import psutil

from benchmarks.render import open_house, own_houses, step
from vigil.assets.database import AssetDatabase
from vigil.protocol.house import House
from vigil.protocol.observation import FRAME_HEIGHT, FRAME_WIDTH, Quality

WARM_UP_STEPS = 40
MINIWORLD = ("MiniWorld-OneRoom-v0", "MiniWorld-FourRooms-v0")
QUALITIES: tuple[Quality, ...] = ("fast", "default")
Times = tuple[float, float, float]
"""Times of a step in ms: processor time of the process and of its main thread, and time by the clock."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--steps", type=int, default=80)
    options = parser.parse_args()
    print(f"load average at the start: {psutil.getloadavg()[0]:.1f}")
    with tempfile.TemporaryDirectory() as folder:
        jobs: dict[str, tuple[Callable[..., Times], tuple[object, ...]]] = {
            name: (miniworld_times, (name,)) for name in MINIWORLD
        }
        for quality in QUALITIES:
            for house in own_houses(Path(folder)):
                jobs[f"VIGIL, {quality}, {house.stem}"] = vigil_times, (house, quality)
        rounds = [
            {name: in_new_process(*job, options.steps) for name, job in jobs.items()} for _ in range(options.rounds)
        ]
    print("                           processor ms  main thread ms  clock ms")
    for name in jobs:
        whole, main_thread, clock = (median(each[name][column] for each in rounds) for column in range(3))
        print(f"{name:26} {whole:13.1f} {main_thread:15.1f} {clock:9.1f}")


def in_new_process(function: Callable[..., Times], arguments: tuple[object, ...], steps: int) -> Times:
    """Return the times that a function measures in a new process."""
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        return pool.submit(function, *arguments, steps).result()


def miniworld_times(name: str, steps: int) -> Times:
    """Return the times of an environment of MiniWorld."""
    os.environ["PYGLET_HEADLESS"] = "true"
    import gymnasium  # noqa: PLC0415 - it reads the variable above

    importlib.import_module("miniworld.envs")  # registers the environments
    environment: Any = gymnasium.make(name, obs_width=FRAME_WIDTH, obs_height=FRAME_HEIGHT).unwrapped
    environment.reset(seed=1)
    return times_of(lambda: environment.step(environment.actions.turn_right), steps)


def vigil_times(house: Path, quality: Quality, steps: int) -> Times:
    """Return the times of VIGIL in a house."""
    simulator = open_house(House.load(house), AssetDatabase.default(), quality)[1]
    return times_of(lambda: step(simulator), steps)


def times_of(take_step: Callable[[], object], steps: int) -> Times:
    """Return the times of a step, after some steps that are not measured."""
    for _ in range(WARM_UP_STEPS):
        take_step()
    clocks = (time.process_time, time.thread_time, time.perf_counter)
    before = [clock() for clock in clocks]
    for _ in range(steps):
        take_step()
    whole, main_thread, wall = (1000 * (clock() - then) / steps for clock, then in zip(clocks, before, strict=True))
    return whole, main_thread, wall


if __name__ == "__main__":
    main()
