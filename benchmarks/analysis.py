"""How long a report over 28 runs of 1,000 episodes takes: cold (from records) and from cached rows.

    python benchmarks/analysis.py [--runs 28] [--wait 10]

The runs are synthetic and realise the published counts of the ten anchors in turn; every episode idles `wait` steps
more, so that records have the length of real ones. Targets: cold under 60 s, cached under 5 s, within 2 GB, on two
cores. Times are those of child processes, Python's start and imports included.
"""

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests" / "support"))

from published import counts_of, plots_of, records_of, thousand, write_pack, write_run  # noqa: E402

from vigil.analysis.paper import paper  # noqa: E402

REPORT = """
import sys, time
from pathlib import Path
from vigil.analysis.rows import read_runs
from vigil.analysis.study import study
from vigil.analysis.tables import tables
from vigil.analysis.report import write_report
if __name__ == "__main__":
    began = time.monotonic()
    runs = read_runs([Path(folder) for folder in sys.argv[2:]])
    read = time.monotonic()
    tables(study(runs))
    tabled = time.monotonic()
    write_report(study(runs), Path(sys.argv[1]))
    print(f"rows {read - began:.1f} s, tables {tabled - read:.1f} s, whole report {time.monotonic() - tabled:.1f} s")
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=28)
    parser.add_argument("--wait", type=int, default=10)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folders = write(Path(name), options.runs, options.wait)
        size = sum((folder / "episodes.jsonl").stat().st_size for folder in folders)
        print(f"{len(folders)} runs, {size / 1e6:.0f} MB of records")
        for what in ("cold", "cached"):
            measure(what, Path(name), folders)


def write(folder: Path, count: int, wait: int) -> list[Path]:
    anchors = [row["model"] for row in paper().tables["global_cross_section"]]
    write_pack(folder / "pack", thousand())
    folders = []
    for index in range(count):
        plots = plots_of(counts_of(anchors[index % len(anchors)]))
        longer = {family: [replace(plot, wait=plot.wait + wait) for plot in row] for family, row in plots.items()}
        name = f"vllm/model-{index:02}"
        folders.append(write_run(folder / f"run{index:02}", folder / "pack", name, records_of(longer)))
    return folders


def measure(what: str, folder: Path, folders: list[Path]) -> None:
    script = folder / "report.py"
    script.write_text(REPORT, encoding="utf-8")
    began = time.monotonic()
    command = [sys.executable, str(script), str(folder / "report"), *map(str, folders)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, env=dict(os.environ))
    wall = time.monotonic() - began
    largest = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
    print(f"{what}: {done.stdout.strip()}; all {wall:.1f} s, largest process {largest:.0f} MB")


if __name__ == "__main__":
    main()
