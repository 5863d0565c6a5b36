"""How the cost of commands grows with episodes, objects, rooms, workers, shards, runs of a report, and houses.

    python -m benchmarks.growth --out build/growth [--axis shards ...]

Each point is one command in a process of its own; its inputs are made first and not measured. Processor time includes
all processes of the command; the memory is that of its largest process. The results are appended to `growth.csv` in the
folder, and the figure `growth.svg` is drawn from it, so that one axis can be measured again without the others.
"""

import argparse
import csv
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib.pyplot as plt

from benchmarks.analysis import write as write_runs
from benchmarks.render import MODES, open_house, step
from tests.support.tiny_pack import tiny_house, tiny_pack
from vigil.assets.database import AssetDatabase
from vigil.housegen.base.spec import SPECS
from vigil.housegen.generate import generate
from vigil.protocol.house import House, canonical_json

VIGIL = str(Path(sys.executable).with_name("vigil"))
Command = Sequence[str]
STEPS = 20
"""Number of steps with frames for a point of objects or rooms."""
COLUMNS: tuple[str, ...] = ("axis", "size", "processor_s", "wall_s", "peak_mb")
MEASURE = """
import json, resource, subprocess, sys, time
began = time.monotonic()
subprocess.run(sys.argv[1:], check=True, stdout=2)
used = resource.getrusage(resource.RUSAGE_CHILDREN)
print(json.dumps([used.ru_utime + used.ru_stime, time.monotonic() - began, used.ru_maxrss / 1024]))
"""
"""Program that runs a command as its only child, so that the largest process is one of the command's."""


@dataclass(frozen=True)
class Axis:
    """What grows, the sizes that are tried, and a function that makes a size's inputs and returns the command."""

    title: str
    sizes: tuple[int, ...]
    prepare: Callable[[int, Path], Command]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("build/growth"))
    parser.add_argument("--axis", choices=AXES, action="append", help="axis to measure; repeatable (default: all)")
    parser.add_argument("--largest", type=int, default=10**9, help="leave out larger sizes")
    parser.add_argument("--step", nargs=1, metavar="HOUSE", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.step:
        play(Path(options.step[0]))
        return
    options.out.mkdir(parents=True, exist_ok=True)
    for name in options.axis or AXES:
        rows = [measure(name, size) for size in AXES[name].sizes if size <= options.largest]
        keep(options.out / "growth.csv", name, rows)
    draw(options.out / "growth.csv", options.out / "growth.svg")


def measure(axis: str, size: int) -> dict[str, str]:
    """Return one row: processor time (s), wall time (s) and peak memory (MB) of the command of this size."""
    with tempfile.TemporaryDirectory() as folder:
        command = AXES[axis].prepare(size, Path(folder))
        done = subprocess.run([sys.executable, "-c", MEASURE, *command], capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(f"{' '.join(command)} failed:\n{done.stderr[-2000:]}")
    row = dict(zip(COLUMNS, (axis, str(size), *(f"{x:.2f}" for x in json.loads(done.stdout))), strict=True))
    print("  ".join(f"{name} {value}" for name, value in row.items()), f" load {os.getloadavg()[0]:.0f}", flush=True)
    return row


def episodes_scored(size: int, folder: Path) -> Command:
    """A run of `size` episodes that end at once is scored."""
    command = episodes_played(size, folder)
    subprocess.run(command, check=True, capture_output=True)
    return [VIGIL, "score", str(folder / "run")]


def episodes_played(size: int, folder: Path) -> Command:
    """`size` episodes in one small room are played by an agent that reports at once."""
    tiny_pack(folder / "pack", size)
    return [VIGIL, "run", "--pack", str(folder / "pack"), "--agent", "noop", "--log-dir", str(folder / "run")]


def shards_joined(size: int, folder: Path) -> Command:
    """A run of 1,000 episodes, played in `size` parts, is joined."""
    tiny_pack(folder / "pack", 1000)
    run = [VIGIL, "run", "--pack", str(folder / "pack"), "--agent", "noop"]
    parts = [str(folder / f"part{part}") for part in range(1, size + 1)]
    for part, path in enumerate(parts, 1):
        subprocess.run([*run, "--shard", f"{part}/{size}", "--log-dir", path], check=True, capture_output=True)
    return [VIGIL, "merge", str(folder / "joined"), *parts]


def runs_reported(size: int, folder: Path) -> Command:
    """A report with page and figures is made of `size` runs of 1,000 episodes."""
    runs = write_runs(folder, size, wait=10)
    return [VIGIL, "report", *map(str, runs), "--out", str(folder / "report")]


def houses_checked(size: int, folder: Path) -> Command:
    """`size` generated houses of one room in one folder are loaded and checked, without compiling their scenes."""
    for seed in range(size):
        generate(seed, SPECS["1-room"]).save(folder / f"house{seed:04}.json")
    return [VIGIL, "houses", "check", "-q", "--no-load", *map(str, sorted(folder.glob("house*.json")))]


def rooms_drawn(size: int, folder: Path) -> Command:
    """A generated house of `size` rooms is compiled, and 20 steps are drawn."""
    generate(7, SPECS[f"{size}-room"]).save(folder / "house.json")
    return _step_command(folder / "house.json")


def objects_drawn(size: int, folder: Path) -> Command:
    """A house of one room with `size` mugs on its floor is compiled, and 20 steps are drawn."""
    data = json.loads(canonical_json(tiny_house().data))
    mug = data["objects"][0].pop("children")[0]
    side = int(size**0.5) + 1
    for index in range(size):
        at = {"x": 0.3 + 4.4 * (index % side) / side, "y": 0.06, "z": 2.0 + 2.7 * (index // side) / side}
        data["objects"].append({**mug, "id": f"Mug|9|{index}", "position": at})
    House("mugs", data).save(folder / "house.json")
    return _step_command(folder / "house.json")


def workers_used(size: int, folder: Path) -> Command:
    """The solver plays the mini pack's 80 episodes in `size` processes."""
    run = [VIGIL, "run", "--pack", "vigil_mini", "--agent", "solver", "--workers", str(size)]
    return [*run, "--log-dir", str(folder / "run")]


def _step_command(house: Path) -> Command:
    return [sys.executable, "-m", "benchmarks.growth", "--step", str(house)]


def play(house: Path) -> None:
    """Compile a house, and draw some steps of an agent that turns."""
    _, simulator = open_house(House.load(house), AssetDatabase.default(), MODES[0][0])
    for _ in range(STEPS):
        step(simulator)


AXES = {
    "episodes": Axis("Episodes played (reporting at once)", (100, 1000, 10_000), episodes_played),
    "scored": Axis("Episodes scored", (100, 1000, 10_000), episodes_scored),
    "objects": Axis("Objects in a room (first frame and 20 steps)", (25, 100, 400, 1600), objects_drawn),
    "rooms": Axis("Rooms of a house (first frame and 20 steps)", (1, 2, 4, 7, 10), rooms_drawn),
    "workers": Axis("Workers (80 episodes of the solver)", (1, 2, 4, 8), workers_used),
    "shards": Axis("Parts joined (1,000 episodes)", (2, 10, 100), shards_joined),
    "runs": Axis("Runs of 1,000 episodes in a report", (1, 10, 30, 100), runs_reported),
    "houses": Axis("Houses checked", (10, 100, 1000), houses_checked),
}


def keep(path: Path, axis: str, rows: list[dict[str, str]]) -> None:
    """Write the rows of an axis to the table, in place of those that it had."""
    others = [row for row in read(path) if row["axis"] != axis] if path.exists() else []
    written = path.with_suffix(".new")
    with written.open("w", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS)
        writer.writeheader()
        writer.writerows([*others, *rows])
    shutil.move(written, path)


def read(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def draw(table: Path, figure: Path) -> None:
    """Draw processor time against size, both logarithmic, one panel an axis, with a line of slope 1."""
    rows = read(table)
    measured = [name for name in AXES if any(row["axis"] == name for row in rows)]
    plt.rcParams.update({"font.size": 9, "axes.titlesize": 9, "svg.hashsalt": "growth"})
    columns = 4
    fig, panels = plt.subplots(-(-len(measured) // columns), columns, figsize=(11, 5.5), squeeze=False)
    for panel in panels.flat[len(measured) :]:
        panel.remove()
    for name, panel in zip(measured, panels.flat, strict=False):
        points = [(int(row["size"]), float(row["processor_s"])) for row in rows if row["axis"] == name]
        sizes, seconds = zip(*sorted(points), strict=True)
        panel.loglog(sizes, seconds, "o-", label="measured")
        panel.loglog(
            sizes, [seconds[-1] * size / sizes[-1] for size in sizes], ":", color="grey", label="in proportion"
        )
        panel.set(title=AXES[name].title.replace(" (", "\n("), ylim=(0.3, 500), ylabel="processor time (s)")
        panel.set_xticks(sizes, [f"{size:,}" for size in sizes])
        panel.set_xticks([], minor=True)
        panel.yaxis.set_major_formatter("{x:g}")
    panels.flat[0].legend()
    fig.tight_layout()
    fig.savefig(figure)


if __name__ == "__main__":
    main()
