"""How close the runner comes to the ideal with a slow model: steps x latency / concurrency.

    python -m benchmarks.runner [--episodes 192] [--concurrency 64] [--latency 1.0] [--turns 5] [--backend still]

A loopback server in a process of its own answers every request after `latency` seconds. Worker processes, PNG encoding,
HTTP, Inspect and the records on disk are all real; the simulator `still` shows one picture and never moves, so that it
is not the limit. With `--backend mujoco` it may be.
"""

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks import still
from tests.support.tiny_pack import tiny_pack
from vigil.runner.progress import RunProgress
from vigil.runner.run import run_pack
from vigil.runner.settings import RunSettings


def main() -> None:
    options = read_options()
    server = subprocess.Popen(
        [sys.executable, "-m", "tests.support.chat_server", str(options.latency), str(options.turns)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert server.stdout is not None
    url = server.stdout.readline().strip()
    with tempfile.TemporaryDirectory() as folder:
        tiny_pack(Path(folder) / "pack", options.episodes, families=("DA", "VS"))
        measure(options, url, Path(folder))
    server.communicate("")


def measure(options: argparse.Namespace, url: str, folder: Path) -> None:
    times: list[tuple[float, RunProgress]] = []
    began = time.monotonic()
    cpu = time.process_time()
    result = run_pack(
        RunSettings(
            pack=folder / "pack",
            model="openai/loopback",
            base_url=url,
            log_dir=folder / "run",
            backend=options.backend,
            simulator_factory=still.make if options.backend == "still" else None,
            workers=options.workers,
            max_connections=options.concurrency,
        ),
        on_progress=lambda progress: times.append((time.monotonic(), progress)),
    )
    cpu = time.process_time() - cpu
    steps = sum(len(record.steps) for record in result.records)
    ideal = steps * options.latency / options.concurrency
    wall = times[-1][0] - times[0][0]
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    workers = resource.getrusage(resource.RUSAGE_CHILDREN)
    print(f"episodes {len(result.records)}, errors {result.errors}, steps {steps}, concurrency {options.concurrency}")
    print(f"ideal {ideal:.1f} s, playing took {wall:.1f} s: {ideal / wall:.0%} of it, {steps / wall:.0f} steps/s")
    print(f"start-up {times[0][0] - began:.1f} s, peak memory of the main process {peak:.0f} MB")
    cpu_of_workers = workers.ru_utime + workers.ru_stime
    print(f"CPU a step: main process {1000 * cpu / steps:.1f} ms, workers {1000 * cpu_of_workers / steps:.1f} ms")


def read_options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--episodes", type=int, default=192)
    parser.add_argument("--concurrency", type=int, default=64)
    parser.add_argument("--latency", type=float, default=1.0)
    parser.add_argument("--turns", type=int, default=5)
    parser.add_argument("--backend", default="still")
    parser.add_argument("--workers", type=int, default=2)
    return parser.parse_args()


if __name__ == "__main__":
    main()
