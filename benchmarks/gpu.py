"""Measures how many frames a GPU draws through EGL, for 1, 4 and 16 processes at once, and what limits them.

    bash benchmarks/gpu.sh

Each process moves an agent through a generated house and draws every frame (640 x 480). It takes under eight minutes,
downloads nothing, and says so when OpenGL does not run on a GPU. The columns:

- frames/s: of all processes together, and of each process;
- step ms, frame ms: wall-clock time of the simulator's step, and of its frame;
- CPU ms: processor time of the main thread for a step and its frame, including what a driver spends on busy waiting;
- cores: processor seconds that all processes use in a second, all their threads counted;
- GPU %, W, MB: mean utilisation and power of the GPU, and its memory in use, read once a second from nvidia-smi.
"""

import argparse
import cProfile
import multiprocessing
import os
import pstats
import shutil
import subprocess
import tempfile
import threading
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from threading import Barrier
from typing import Any

import numpy as np

from benchmarks.render import open_house, own_houses
from vigil.assets.database import AssetDatabase
from vigil.protocol.actions import Navigate
from vigil.protocol.house import House
from vigil.protocol.observation import Quality
from vigil.sim.engines.mujoco.camera import gl_strings

AT_ONCE = (1, 4, 16)
QUALITIES: tuple[Quality, ...] = ("default", "fast")
SECONDS = 6.0
WARM_UP = 40
"""Frames before measuring: one full turn, so that the light of everything in view has been worked out."""
TURN_DEG = 9.0
PROFILED_FRAMES = 200
SLOWEST = 12
SOFTWARE = ("llvmpipe", "softpipe", "swrast")
HEADER = (
    "| quality | house | processes | frames/s | each | step ms | frame ms | CPU ms | cores | GPU % | W | MB |\n"
    "|---|---|---|---|---|---|---|---|---|---|---|---|"
)


@dataclass(frozen=True)
class Played:
    """What one process measured: counts and seconds."""

    frames: int
    wall: float
    stepping: float
    drawing: float
    thread: float
    """Processor time of the main thread."""
    process: float
    """Processor time of all threads."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--at-once", type=int, nargs="+", default=AT_ONCE, help="Numbers of processes to try.")
    options = parser.parse_args()
    renderer = gl_strings()["renderer"]
    print(f"OpenGL: {renderer}; {os.cpu_count()} processor cores", flush=True)
    if any(name in renderer for name in SOFTWARE):
        print("There is no GPU here, or OpenGL does not use it: these figures are those of software rendering.")
    with tempfile.TemporaryDirectory() as folder:
        houses = own_houses(Path(folder))
        print(HEADER, flush=True)
        for quality in QUALITIES:
            for house in houses:
                for at_once in options.at_once:
                    print(row(house, quality, at_once), flush=True)
        for house in houses:
            print(f"\nWhere the time of a frame goes ({house.stem}, default, one process; ms a frame):")
            print(profile(house), flush=True)


def row(house: Path, quality: Quality, at_once: int) -> str:
    """Return one line of the table."""
    context = multiprocessing.get_context("spawn")
    with context.Manager() as manager, ProcessPoolExecutor(at_once, context) as pool:
        barrier = manager.Barrier(at_once + 1)
        jobs = [pool.submit(play, house, quality, barrier) for _ in range(at_once)]
        barrier.wait()
        gpu = watch_gpu(SECONDS)
        played = [job.result() for job in jobs]
    frames = sum(one.frames for one in played)
    rates = [one.frames / one.wall for one in played]
    step, draw, thread = (
        1000 * sum(seconds) / frames
        for seconds in zip(*[(one.stepping, one.drawing, one.thread) for one in played], strict=True)
    )
    cores = sum(one.process / one.wall for one in played)
    return (
        f"| {quality} | {house.stem} | {at_once} | {sum(rates):.0f} | {np.mean(rates):.1f} | {step:.2f} | {draw:.2f} "
        f"| {thread:.2f} | {cores:.1f} | {gpu} |"
    )


def play(path: Path, quality: Quality, barrier: Barrier) -> Played:
    """Warm up, wait for the other processes, then step and draw for some seconds."""
    simulator = open_house(House.load(path), AssetDatabase.default(), quality)[1]
    for _ in range(WARM_UP):
        move_and_draw(simulator)
    barrier.wait()
    frames, stepping, drawing = 0, 0.0, 0.0
    start, thread, process = time.perf_counter(), time.thread_time(), time.process_time()
    while (now := time.perf_counter()) < start + SECONDS:
        stepped, drawn = move_and_draw(simulator)
        frames, stepping, drawing = frames + 1, stepping + stepped, drawing + drawn
    result = Played(frames, now - start, stepping, drawing, time.thread_time() - thread, time.process_time() - process)
    simulator.close()
    return result


def move_and_draw(simulator: Any) -> tuple[float, float]:
    """Turn the agent and draw its frame; return the seconds of the step and of the frame."""
    start = time.perf_counter()
    simulator.step(Navigate(mode="turn_right", magnitude=TURN_DEG))
    stepped = time.perf_counter()
    simulator.frame()
    return stepped - start, time.perf_counter() - stepped


def watch_gpu(seconds: float) -> str:
    """Return the columns GPU %, W and MB, means of what nvidia-smi says each second; dashes where it is missing."""
    if shutil.which("nvidia-smi") is None:
        return "- | - | -"
    query = ["nvidia-smi", "--query-gpu=utilization.gpu,power.draw,memory.used", "--format=csv,noheader,nounits"]
    readings: list[list[float]] = []
    end = threading.Event()
    timer = threading.Timer(seconds, end.set)
    timer.start()
    while not end.wait(1.0):
        answer = subprocess.run(query, capture_output=True, text=True, check=True, timeout=10)
        readings.append([float(value) for value in answer.stdout.splitlines()[0].split(",")])
    timer.join()
    return " | ".join(f"{value:.0f}" for value in np.mean(readings, axis=0))


def profile(path: Path) -> str:
    """Return the functions that take most of a frame's time themselves, with their milliseconds a frame."""
    simulator = open_house(House.load(path), AssetDatabase.default(), "default")[1]
    for _ in range(WARM_UP):
        move_and_draw(simulator)
    profiler = cProfile.Profile()
    profiler.enable()
    for _ in range(PROFILED_FRAMES):
        move_and_draw(simulator)
    profiler.disable()
    simulator.close()
    stats: dict[tuple[str, int, str], tuple[int, int, float, float, object]] = pstats.Stats(profiler).stats  # type: ignore[attr-defined]
    slowest = sorted(stats.items(), key=lambda entry: -entry[1][2])[:SLOWEST]
    return "\n".join(
        f"{1000 * own / PROFILED_FRAMES:8.2f} {calls / PROFILED_FRAMES:7.1f} calls  {Path(file).name}:{line} {name}"
        for (file, line, name), (_, calls, own, _, _) in slowest
    )


if __name__ == "__main__":
    main()
