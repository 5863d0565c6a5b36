"""Sweep: nothing goes through a wall. Every leaf opened and shut, things put down and dropped at walls, rays at seams.

    python -m sweeps.walls --packs all --seeds 0:1000

Each house is a piece. Finished pieces are kept in a log (JSON lines); started again, the sweep goes on after them.
"""

import argparse
import json
import sys
import time
import zlib
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from sweeps.simulators import embedded
from sweeps.support.wall_geometry import WallShell, containing_floor, floors_of, vertices_of
from vigil.base.geometry import Pose, Vec3
from vigil.base.json_lines import append_line, read_lines
from vigil.cli.progress import progress
from vigil.errors import VigilError
from vigil.housegen.base.spec import spec_for
from vigil.housegen.generate import generate
from vigil.packs.pack import PACKAGED
from vigil.protocol.house import House
from vigil.scene.supports import contents, level_surfaces
from vigil.scene.things import Thing
from vigil.sim.core.embedded import EmbeddedSimulator
from vigil.sim.core.opening import opening_blocker, set_openness
from vigil.sim.core.placing import put_down, spot_below, spot_on
from vigil.sim.core.state import SceneState

SPECS = ("kitchen", "bedroom", "2-room", "bathroom", "3-room", "living-room", "4-room", "kitchen-living", "6-room")
LEAF_M, PUT_DOWN_M, LEAK_M = 0.001, 1e-6, 0.02
"""Largest distances (m): of a leaf, and of what is put down, beyond a wall; and of a ray's end beyond a wall's
depth."""
OPENNESSES = np.linspace(0.0, 1.0, 17)
PLACEMENTS, DROPS, EYES = 20, 20, 4
JITTER_M = (0.0, 1e-4, -1e-4, 1e-3, -1e-3)


@dataclass
class HouseResult:
    """Result of one house."""

    counts: Counter[str] = field(default_factory=Counter)
    failures: list[str] = field(default_factory=list)


class WallSweep:
    """One loaded house."""

    def __init__(self, simulator: EmbeddedSimulator, house: House) -> None:
        simulator.load(house)
        self.simulator = simulator
        self.state: SceneState = simulator._require_loaded().state
        self.floors = floors_of(self.state.scene)
        self.shell = WallShell(self.state.scene)
        self.random = np.random.default_rng(zlib.crc32(house.name.encode()))
        self.result = HouseResult()

    def sweep(self) -> HouseResult:
        """Try everything and return the result."""
        self.leaves()
        for _ in range(PLACEMENTS):
            self.place()
        spots = self._spots_by_walls()
        for _ in range(DROPS if len(spots) else 0):
            self.drop(spots[self.random.integers(len(spots))])
        self.rays()
        return self.result

    def leaves(self) -> None:
        """Open and close everything that opens, starting from the house's states."""
        for thing in list(self.state.scene.things.values()):
            if not thing.is_openable or not thing.asset.can_open:
                continue
            self._check_leaf(thing, [thing.openness], "stands")
            self._count("leaves")
            with self.simulator.rollback():
                set_openness(self.state, thing, 0.0)
                for target in (1.0, 0.0):
                    if opening_blocker(self.state, thing, target) is not None:
                        self._count("swings refused")
                        break
                    self._count("swings")
                    set_openness(self.state, thing, target)
                    self._check_leaf(thing, [float(each) for each in OPENNESSES], "swings")

    def _check_leaf(self, thing: Thing, openness: list[float], what: str) -> None:
        own_floor = containing_floor(thing, self.floors)
        allowed = self._beyond(thing, own_floor, vertices_of(thing, 0.0, moving=True)) + LEAF_M
        for each in openness:
            deep = self._beyond(thing, own_floor, vertices_of(thing, each, moving=True))
            if deep > allowed:
                self._record_failure(f"{thing.id} {what} {deep:.4f} m beyond a wall at openness {each:.3f}")
                return

    def _beyond(self, thing: Thing, own_floor: BaseGeometry, vertices: np.ndarray) -> float:
        """Return how far (m) vertices reach out of a room through a wall; not through a doorway."""
        out = np.asarray(shapely.distance(own_floor, shapely.points(vertices[:, 0], vertices[:, 2])))
        if not len(out) or out.max() <= 0.0:
            return 0.0
        inner = (
            own_floor.representative_point()
            if thing.is_structure
            else shapely.Point(thing.position.x, thing.position.z)
        )
        if not thing.is_structure and own_floor.covers(inner):
            from_middle = np.tile([thing.position.x, 0.0, thing.position.z], (len(vertices), 1))
            from_middle[:, 1] = vertices[:, 1]
            is_through = np.isfinite(self.shell.crossings(from_middle, vertices, windows_are_holes=False))
            out = np.where(is_through, out, 0.0)
        return float(out.max())

    def place(self) -> None:
        """Put a thing of the house at a place of a surface that is near a wall."""
        things = list(self.state.scene.things.values())
        small = [thing for thing in things if thing.is_pickupable]
        wide = [thing for thing in things if thing.is_receptacle and not thing.is_pickupable]
        if not small or not wide:
            return
        thing, receptacle = (pool[self.random.integers(len(pool))] for pool in (small, wide))
        surfaces = list(level_surfaces(receptacle))
        if not surfaces or receptacle in contents(self.state.scene, thing.id):
            return
        surface, frame = surfaces[self.random.integers(len(surfaces))]
        shares = self.random.uniform(-0.5, 0.5, (8, 2)) * [surface.size_x, surface.size_z]
        points = frame(np.insert(shares, 1, 0.0, axis=1))
        own_floor = containing_floor(receptacle, self.floors)
        inside = points[shapely.contains_xy(own_floor, points[:, 0], points[:, 2])]
        if not len(inside):
            return
        edges = shapely.distance(own_floor.boundary, shapely.points(inside[:, 0], inside[:, 2]))
        clicked = Vec3(*map(float, inside[int(np.argmin(edges))]))
        with self.simulator.rollback():
            self.state.take(thing)
            self._count("placements tried")
            spot = spot_on(self.state, thing, receptacle, clicked)
            if spot is not None:
                put_down(self.state, spot)
                self._check_put_down(thing, clicked, f"put on {receptacle.id}")
                self._count("placements")

    def drop(self, place: np.ndarray) -> None:
        """Drop a thing of the house from a place next to a wall."""
        small = [thing for thing in self.state.scene.things.values() if thing.is_pickupable]
        if not small:
            return
        thing = small[self.random.integers(len(small))]
        with self.simulator.rollback():
            stand = Vec3(float(place[0]), 0.0, float(place[1]))
            self.state.agent = Pose(position=stand, rotation=float(self.random.uniform(-180, 180)))
            self.state.take(thing)
            self._count("drops tried")
            spot = spot_below(self.state, thing)
            if spot is not None:
                put_down(self.state, spot)
                self._check_put_down(thing, stand, "dropped")
                self._count("drops")

    def _check_put_down(self, thing: Thing, hand: Vec3, what: str) -> None:
        """Check that the way from the hand to the thing's middle, and from there to all of it, passes no wall.

        Of two ways, since a thing that went through an open doorway may lie beside it, out of the hand's sight.
        """
        vertices = vertices_of(thing)
        middle = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
        ends = np.vstack([middle, vertices])
        starts = np.vstack([[hand.x, middle[1], hand.z], np.tile(middle, (len(vertices), 1))])
        shares = self.shell.crossings(starts, ends, windows_are_holes=False)
        through = np.isfinite(shares)
        if through.any():
            lengths = np.linalg.norm(ends - starts, axis=1)
            deep = float(((1.0 - shares[through]) * lengths[through]).max())
            if deep > PUT_DOWN_M:
                self._record_failure(f"{thing.id} {what} is {deep:.5f} m beyond a wall")

    def _spots_by_walls(self) -> np.ndarray:
        lines = shapely.unary_union([floor.boundary for floor in self.floors.values()])
        found: list[np.ndarray] = []
        for floor in self.floors.values():
            left, low, right, high = floor.bounds
            tried = self.random.uniform((left, low), (right, high), (150, 2))
            near = tried[shapely.distance(lines, shapely.points(tried[:, 0], tried[:, 1])) < 0.6]
            free = [spot for spot in near if self.simulator.can_stand(Vec3(float(spot[0]), 0.0, float(spot[1])))]
            found += free[:20]
        return np.array(found).reshape(-1, 2)

    def rays(self) -> None:
        """Cast rays from points in every room at the joints of walls, and at points close to them."""
        joints = np.array(list(self.shell.joints()))
        for floor in self.floors.values():
            left, low, right, high = floor.bounds
            places = self.random.uniform((left, low), (right, high), (40 * EYES, 2))
            places = places[shapely.contains_xy(floor.buffer(-0.05), places[:, 0], places[:, 1])][:EYES]
            for number, (x, z) in enumerate(places):
                eye = Vec3(float(x), 1.576 if number % 2 else float(self.random.uniform(0.1, 2.2)), float(z))
                jitter = self.random.choice(JITTER_M, joints.shape)
                for targets in (joints, joints + jitter):
                    for through_glass in (False, True):
                        self._cast(eye, targets, through_glass=through_glass)

    def _cast(self, eye: Vec3, targets: np.ndarray, *, through_glass: bool) -> None:
        offsets = targets - np.array(eye)
        lengths = np.linalg.norm(offsets, axis=1)
        offsets, lengths = offsets[lengths > 1e-3], lengths[lengths > 1e-3]
        directions = offsets / lengths[:, None]
        hits = self.simulator._engine.cast(eye, directions, through_glass=through_glass)
        far = 50.0
        starts = np.tile(np.array(eye), (len(directions), 1))
        shares = self.shell.crossings(starts, starts + far * directions, windows_are_holes=through_glass)
        self._count("rays", len(directions))
        for index in np.flatnonzero(hits.distances > shares * far + LEAK_M):
            thing = list(self.state.scene.things.values())[hits.things[index]] if hits.things[index] >= 0 else None
            if thing is None:
                self._count("rays past a wall that meet no thing")
            elif not thing.is_structure:
                self._record_failure(
                    f"a ray from ({eye.x:.4f}, {eye.y:.4f}, {eye.z:.4f}) along {directions[index].tolist()} meets "
                    f"{thing.id} at {hits.distances[index]:.3f} m, a wall is at {shares[index] * far:.3f} m"
                )

    def _count(self, what: str, number: int = 1) -> None:
        self.result.counts[what] += number

    def _record_failure(self, text: str) -> None:
        self._count(f"FAILURES: {text.split()[0] if text.startswith('a ray') else text.split()[1]}")
        self.result.failures.append(text)


def houses(packs: str, seeds: str) -> Iterator[tuple[str, Path | tuple[int, str]]]:
    """Yield (name of the piece, file or (seed, spec)) of all houses that were asked for."""
    for file in sorted(PACKAGED.glob("*/houses/*.json")) if packs else ():
        if packs == "all" or file.parts[-3] in packs.split(","):
            yield "/".join(file.parts[-3:]), file
    first, _, last = seeds.partition(":")
    for seed in range(int(first), int(last)) if last else ():
        spec = SPECS[seed % len(SPECS)]
        yield f"{spec}_{seed}", (seed, spec)


def main() -> int:
    """Sweeps; return 1 when anything fell."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--packs", default="", help="'all', or names of packs, separated by commas")
    parser.add_argument("--seeds", default="", help="generated houses: FIRST:LAST, the last one not included")
    parser.add_argument(
        "--share", default="0/1", help="I/N: only every N-th house, from the I-th: for several processes"
    )
    parser.add_argument("--log", type=Path, default=Path("runs/sweeps/walls.jsonl"), help="finished pieces")
    options = parser.parse_args()
    options.log.parent.mkdir(parents=True, exist_ok=True)
    done = {row["piece"]: row for row in (json.loads(line.data) for line in read_lines(options.log))}
    part, _, of = options.share.partition("/")
    wanted = [each for index, each in enumerate(houses(options.packs, options.seeds)) if index % int(of) == int(part)]
    simulator = embedded("mujoco")
    missing = [(name, source) for name, source in wanted if name not in done]
    with progress("houses", may_fork=True) as show:
        for number, (name, source) in enumerate(missing, start=1):
            done[name] = row = _sweep_house(simulator, name, source)
            append_line(options.log, json.dumps(row).encode() + b"\n")
            for failure in row["failures"][:5]:
                print(f"{name}: {failure}", flush=True)
            show(number, len(missing))
    return _summarize([done[name] for name, _ in wanted])


def _sweep_house(simulator: EmbeddedSimulator, name: str, source: Path | tuple[int, str]) -> dict[str, Any]:
    began = time.process_time()
    try:
        house = House.load(source) if isinstance(source, Path) else generate(source[0], spec_for(source[1]))
        result = WallSweep(simulator, house).sweep()
    except VigilError as error:
        result = HouseResult(Counter({"houses that do not load": 1}), [str(error)])
    seconds = round(time.process_time() - began, 2)
    return {"piece": name, "seconds": seconds, "counts": result.counts, "failures": result.failures}


def _summarize(rows: list[dict]) -> int:
    total: Counter[str] = Counter()
    for row in rows:
        total.update(row["counts"])
    failures = sum(len(row["failures"]) for row in rows)
    seconds = sum(row["seconds"] for row in rows)
    print(f"{len(rows)} houses, {seconds / max(len(rows), 1):.2f} s of processor time each")
    for name, count in sorted(total.items()):
        print(f"  {name}: {count}")
    print(f"  falls: {failures}")
    return int(failures > 0)


if __name__ == "__main__":
    sys.exit(main())
