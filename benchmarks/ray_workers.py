"""How fast two Ray workers are beside the local pool of two, and that beside one worker, on the solver's run of a pack.

    python -m benchmarks.ray_workers [--rounds 3] [--pack vigil_mini_v6] [--limit 80]

The three take turns, so that they meet the same machine; each plays the same episodes, without frames, on one local Ray
of this machine that is started once. Only playing is counted, starting workers is not. It prints two ratios: of
episodes a second, which holds on a machine of two cores with nothing else to do, and of episodes a second of processor
time, which holds anywhere but counts no waiting. Beside them stands what two processes that share nothing do at that
moment.
"""

import argparse
import logging
import os
import statistics
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import psutil
import ray

from vigil.authoring.solving.solvers import privileged_agent
from vigil.runner.progress import RunProgress
from vigil.runner.run import run_pack
from vigil.runner.settings import RunSettings

SETUPS: dict[str, dict[str, Any]] = {
    "one worker": {"workers": 1},
    "local pool of two": {"workers": 2},
    "two Ray workers": {"workers": 2, "executor": "ray"},
}
TURNS = 3_000_000


def main() -> None:
    options = read_options()
    os.environ.update({"RAY_worker_niceness": "0"})  # of actors, as that of the local pool's workers
    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False, logging_level=logging.ERROR)
    rounds: list[dict[str, tuple[float, float]]] = []
    for number in range(options.rounds):
        gain = parallel_speedup()
        print(
            f"round {number + 1}, load average {os.getloadavg()[0]:.1f}, two processes do {gain:.2f} times one's work"
        )
        rounds.append({setup: measure(setup, options) for setup in SETUPS})
    ray.shutdown()
    for one, other in (("two Ray workers", "local pool of two"), ("local pool of two", "one worker")):
        print(f"{one} over {other}")
        for index, of in enumerate(("a second", "a second of processor time")):
            ratios = [each[one][index] / each[other][index] for each in rounds]
            listed = ", ".join(f"{ratio:.2f}" for ratio in ratios)
            print(f"  episodes {of}: {listed}; median {statistics.median(ratios):.2f}")


def measure(setup: str, options: argparse.Namespace) -> tuple[float, float]:
    """Return the episodes a second of one run, from the first that began to the last that ended, and of its CPU."""
    times: list[float] = []
    used: list[tuple[float, float]] = []

    def on_progress(progress: RunProgress) -> None:
        times.append(time.perf_counter())
        if progress.done in (0, progress.total):
            used.append((time.process_time(), workers_cpu_seconds()))

    with tempfile.TemporaryDirectory() as folder:
        settings = RunSettings(
            pack=options.pack,
            agent="solver",
            agent_factory=privileged_agent,
            limit=options.limit,
            log_dir=Path(folder) / "run",
            **SETUPS[setup],
        )
        assert run_pack(settings, on_progress=on_progress).is_complete
    seconds, episodes = times[-1] - times[0], len(times) - 1
    own, workers = (last - first for first, last in zip(used[0], used[-1], strict=True))
    print(
        f"  {setup}: {episodes} episodes in {seconds:.1f} s, {episodes / seconds:.1f} a second; processor time an "
        f"episode: workers {1000 * workers / episodes:.0f} ms, main process {1000 * own / episodes:.1f} ms",
        flush=True,
    )
    return episodes / seconds, episodes / (workers + own)


def workers_cpu_seconds() -> float:
    """Return the processor time that simulators have used so far."""
    total = 0.0
    for process in psutil.Process().children(recursive=True):
        try:
            if process.name().startswith("ray::WorkerAct") or "vigil.base.processes" in process.cmdline():
                total += sum(process.cpu_times()[:2])
        except psutil.NoSuchProcess:
            continue
    return total


def parallel_speedup() -> float:
    """Return how many times as much two processes that share nothing do in the same time as one."""
    with ProcessPoolExecutor(2) as pool:
        list(pool.map(spin, [1, 1]))
        alone = next(pool.map(spin, [TURNS]))
        both = list(pool.map(spin, [TURNS, TURNS]))
    return 2 * alone / max(both)


def spin(turns: int) -> float:
    start, total = time.perf_counter(), 0
    for number in range(turns):
        total += number * number % 7
    return time.perf_counter() - start


def read_options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--pack", default="vigil_mini_v6")
    parser.add_argument("--limit", type=int, default=80)
    return parser.parse_args()


if __name__ == "__main__":
    main()
