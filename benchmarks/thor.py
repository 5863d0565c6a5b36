"""Measures AI2-THOR's client over this project's engine, and what the back end adds, beside the MuJoCo back end.

    python -m benchmarks.thor [--steps N] [--rooms SPEC] [--sizes | --houses N]

It needs the client: pip install "vigil-bench[thor]". Rounds of the ways of stepping alternate, so that the load of the
machine meets them alike; times are medians. Nothing of it says how fast Unity is.
"""

import argparse
import multiprocessing
import time
from collections.abc import Callable
from statistics import median
from typing import Any

import psutil

from vigil.assets.database import AssetDatabase
from vigil.base.geometry import Pose
from vigil.housegen.base.spec import SPECS
from vigil.housegen.generate import generate
from vigil.protocol.actions import Navigate
from vigil.protocol.house import House
from vigil.protocol.world import Setup
from vigil.sim import make_simulator
from vigil.sim.core.sight import HEIGHT, WIDTH
from vigil.sim.protocol import Simulator
from vigil.sim.scene_editor import SceneEditor
from vigil.sim.thor.guarded_client import GuardedClient
from vigil.sim.thor.segmented_frame import Event
from vigil.sim.thor.simulator import ThorSimulator
from vigil.sim.thor.start import INITIALIZE, engine_options, own_command
from vigil.thor.base.settings import Settings
from vigil.thor.base.world import World
from vigil.thor.engine import ThorEngine
from vigil.thor.serve import return_large_blocks
from vigil.thor.wire.fifo import message, packer

TURN = Navigate(mode="turn_right", magnitude=15.0)
MASKS = ("renderInstanceSegmentation", "renderDepthImage")
MEASURED_AFTER = (10, 50, 100, 150, 200, 300, 400, 500)
"""Numbers of houses after which the memory is printed."""
OBJECTS = 3
"""Number of objects whose hidden state each step asks for."""


class TimedConnection:
    """A connection that counts the seconds spent in the client and its engine."""

    def __init__(self, connection: GuardedClient) -> None:
        self._connection = connection
        self.seconds = 0.0

    @property
    def is_over(self) -> bool:
        return self._connection.is_over

    def open(self, house: dict[str, Any]) -> None:
        self._count(lambda: self._connection.open(house))

    def step(self, action: str, **arguments: Any) -> Event:
        return self._count(lambda: self._connection.step(action, **arguments))

    def close(self) -> None:
        self._connection.close()

    def _count(self, do: Callable[[], Any]) -> Any:
        began = time.perf_counter()
        try:
            return do()
        finally:
            self.seconds += time.perf_counter() - began


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=40)
    parser.add_argument("--rooms", choices=sorted(SPECS), default="4-room")
    parser.add_argument("--sizes", action="store_true", help="only the engine's steps, by image size and layers")
    parser.add_argument("--houses", type=int, help="only the engine's memory after some of N different houses")
    options = parser.parse_args()
    if options.houses:
        measure_memory(options.houses)
        return
    house = generate(7, SPECS[options.rooms])
    print(
        f"{options.rooms}, {options.steps} rounds; load average at the start: {psutil.getloadavg()[0]:.1f}", flush=True
    )
    (measure_sizes if options.sizes else measure)(house, options.steps)


def measure_sizes(house: House, steps: int) -> None:
    """Print an engine's time and processor time for a step, by size and layers of images, in turns.

    Processor time is that of all threads, so that other programs on the machine change it little.
    """
    turns: dict[str, Callable[[], object]] = {}
    for width, height in ((300, 300), (640, 480)):
        for layers in (False, True):
            name = f"{width} x {height}{', depth and masks' if layers else ''}"
            turns[name] = engine_in(house, width, height, **dict.fromkeys(MASKS, layers))
    wall: dict[str, list[float]] = {name: [] for name in turns}
    busy: dict[str, list[float]] = {name: [] for name in turns}
    for _ in range(steps):
        for name, turn in turns.items():
            before = time.process_time()
            wall[name].append(timed(turn)[1])
            busy[name].append(time.process_time() - before)
    for name, found in wall.items():
        print(
            f"{name:28} {1000 * median(busy[name]):8.1f} ms of processor time, {1000 * median(found):8.1f} ms in all",
            flush=True,
        )
    print(f"load average at the end: {psutil.getloadavg()[0]:.1f}")


def measure_memory(count: int) -> None:
    """Print the memory and the processor time of an engine after some of `count` different houses, each drawn once.

    Another process generates the houses, so that the figures are those of the engine alone.
    """
    return_large_blocks()
    engine, me = bare_engine(300, 300), psutil.Process()
    pack, before = packer(), time.process_time()
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        for number in range(1, count + 1):
            data = pool.apply(small_house, (number,))
            assert engine.respond({"action": "CreateHouse", "house": data}).metadata["agents"][0]["lastActionSuccess"]
            message(engine.respond({"action": "RotateRight", "degrees": 15.0}), pack)
            if number in MEASURED_AFTER or number == count:
                seconds, megabytes = time.process_time() - before, me.memory_info().rss / 2**20
                print(f"{number:4} houses {megabytes:8.0f} MiB {seconds / number:6.2f} s a house", flush=True)


def small_house(seed: int) -> dict[str, Any]:
    """Return the document of a house with one or two rooms."""
    return generate(seed, SPECS[("1-room", "2-room")[seed % 2]]).data


def measure(house: House, steps: int) -> None:
    """Print all figures."""
    embedded = make_simulator("mujoco", assets=AssetDatabase.default())
    embedded.load(house)
    start, named = Pose.model_validate(start_of(house)), embedded.object_ids()[:OBJECTS]
    embedded.reset(start, Setup())
    unmasked, started = timed(
        lambda: connect(house, {name: value for name, value in INITIALIZE.items() if name not in MASKS})
    )
    timed_connection, started_again = timed(lambda: TimedConnection(connect(house, INITIALIZE)))
    simulator = ThorSimulator("benchmark", lambda _: timed_connection, AssetDatabase.default())
    simulator.load(house)
    simulator.reset(start, Setup())
    engine = engine_in(house)
    operations: dict[str, Callable[[], object]] = {
        "MuJoCo back end": lambda: step(embedded, named),
        "engine, picture alone": engine,
        "client, picture alone": lambda: unmasked.step("RotateRight", degrees=15.0).frame,
        "AI2-THOR back end": lambda: step(simulator, named),
    }
    times: dict[str, list[float]] = {name: [] for name in [*operations, "own"]}
    for _ in range(steps):
        for name, operation in operations.items():
            timed_connection.seconds = 0.0
            spent = timed(operation)[1]
            times[name].append(spent)
            if operation is operations["AI2-THOR back end"]:
                times["own"].append(spent - timed_connection.seconds)
    bare = median(times["MuJoCo back end"])
    for name, found in times.items():
        print(f"{name:24} {1000 * median(found):8.1f} ms a step {median(found) / bare:7.2f} of MuJoCo's", flush=True)
    print(f"{'start, first picture':24} {started:8.2f} s, {started_again:.2f} s")
    print(f"{'house built anew':24} {timed(lambda: simulator.load(house))[1]:8.2f} s")
    print(f"{'reset of an episode':24} {timed(lambda: simulator.reset(start, Setup()))[1]:8.2f} s")
    simulator.close()
    unmasked.close()
    embedded.close()


def start_of(house: House) -> dict[str, Any]:
    """Return the pose of the house's own start."""
    agent = house.data["metadata"]["agent"]
    return {"position": tuple(agent["position"][axis] for axis in "xyz"), "rotation": agent["rotation"]["y"]}


def engine_in(house: House, width: int = WIDTH, height: int = HEIGHT, **layers: bool) -> Callable[[], object]:
    """Return what has an engine in this process carry out a step and write its answer as the pipe has it."""
    engine = bare_engine(width, height, **layers)
    engine.respond({"action": "CreateHouse", "house": house.data})
    engine.respond({"action": "TeleportFull", **house.data["metadata"]["agent"]})
    pack = packer()
    return lambda: message(engine.respond({"action": "RotateRight", "degrees": 15.0}), pack)


def bare_engine(width: int, height: int, **layers: bool) -> ThorEngine:
    """Return an engine without a house in this process; `layers` says what it draws in addition to colours."""
    editor = make_simulator("mujoco", assets=AssetDatabase.default())
    assert isinstance(editor, SceneEditor)
    engine = ThorEngine(World(editor, Settings(screen_width=width, screen_height=height)))
    engine.respond({"action": "Initialize", **INITIALIZE, **dict.fromkeys(MASKS, False), **layers})
    return engine


def connect(house: House, settings: dict[str, Any]) -> GuardedClient:
    """Return a connection to this project's engine."""
    return GuardedClient(house.data, own_command(engine_options("mujoco", "default", None)), **settings)


def step(simulator: Simulator, named: list[str]) -> object:
    """Turn, ask for hidden state and draw, as an episode's step does."""
    simulator.step(TURN)
    simulator.world(named)
    return simulator.frame()


def timed(do: Callable[[], Any]) -> tuple[Any, float]:
    """Return the result and the seconds it took."""
    began = time.perf_counter()
    return do(), time.perf_counter() - began


if __name__ == "__main__":
    main()
