"""How long a report over 28 runs of 1,000 episodes takes: cold (from records) and from cached rows.

    python -m benchmarks.analysis [--runs 28] [--wait 10] [--repeats 3]

The runs are synthetic and realise the published counts of the ten anchors in turn; every episode idles `wait` steps
more, so that records have the length of real ones. Targets: cold under 60 s, cached under 5 s, within 2 GB, on two
cores. Times are those of the whole command `vigil report`, Python's start and imports included.
"""

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

from tests.support.published_runs import counts_of, make_episodes, records_of, scripts_of, write_pack, write_run
from vigil.analysis.measures.paper import paper

VIGIL = Path(sys.executable).with_name("vigil")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=28)
    parser.add_argument("--wait", type=int, default=10)
    parser.add_argument("--repeats", type=int, default=3)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folders = write(Path(name), options.runs, options.wait)
        size = sum((folder / "episodes.jsonl").stat().st_size for folder in folders)
        print(f"{len(folders)} runs, {size / 1e6:.0f} MB of records")
        out = ("--out", str(Path(name) / "report"))
        measure("cold, page and Markdown", folders, *out)
        measure("cached, page and Markdown", folders, *out, repeats=options.repeats)
        measure("cached, Markdown without figures", folders, repeats=options.repeats)


def write(folder: Path, count: int, wait: int) -> list[Path]:
    anchors = [row["model"] for row in paper().tables["global_cross_section"]]
    write_pack(folder / "pack", make_episodes())
    folders = []
    for index in range(count):
        plots = scripts_of(counts_of(anchors[index % len(anchors)]))
        longer = {family: [replace(plot, wait=plot.wait + wait) for plot in row] for family, row in plots.items()}
        name = f"vllm/model-{index:02}"
        folders.append(write_run(folder / f"run{index:02}", folder / "pack", name, records_of(longer)))
    return folders


def measure(what: str, folders: list[Path], *options: str, repeats: int = 1) -> None:
    """Print the best wall and processor time of `vigil report`; a busy machine affects only the wall time."""
    walls, processor = [], []
    for _ in range(repeats):
        before, began = _children(), time.monotonic()
        subprocess.run([VIGIL, "report", *folders, *options], capture_output=True, check=True)
        walls.append(time.monotonic() - began)
        processor.append(_children() - before)
    largest = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
    print(f"{what}: {min(walls):.1f} s, {min(processor):.1f} s of processor, largest process so far {largest:.0f} MB")


def _children() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


if __name__ == "__main__":
    main()
