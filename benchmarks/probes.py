"""What probing costs apart from the calls: processor time of the same run with and without probes.

    python -m benchmarks.probes [--episodes 24] [--turns 5] [--rounds 3]

A loopback server in a process of its own answers the steps at once. Probes are answered in the process itself, so that
the difference is all that probing does but its calls: building messages, parsing answers, writing rows. The least of
several rounds counts.
"""

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from benchmarks import still
from tests.support.tiny_pack import tiny_pack
from vigil.protocol.actions import Reply, Usage
from vigil.records.probe_file import read_probes
from vigil.records.record import RunHeader
from vigil.runner import probes, run
from vigil.runner.probes import Prober
from vigil.runner.settings import RunSettings
from vigil.scoring.probe_schedule import parse_schedule

BELIEF = '{"done": false, "report": "fail", "sure": 3, "evidence": "I do not see it."}'


def main() -> None:
    options = read_options()
    command = [sys.executable, "-m", "tests.support.chat_server", "0", str(options.turns)]
    probes.Prober = answered_here  # pyright: ignore[reportPrivateImportUsage, reportAttributeAccessIssue]
    server = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert server.stdout is not None
    url = server.stdout.readline().strip()
    found: dict[bool, list[tuple[float, float, int]]] = {False: [], True: []}
    with tempfile.TemporaryDirectory() as folder:
        tiny_pack(Path(folder) / "pack", options.episodes, families=("DA", "VS"))
        for number in range(options.rounds):
            for is_probed in (False, True):
                found[is_probed].append(measure(Path(folder), url, f"{number}-{is_probed}", is_probed))
    server.communicate("")
    (main_s, worker_s, steps), (probed_main_s, probed_worker_s, calls) = (min(found[key]) for key in (False, True))
    added_s = probed_main_s + probed_worker_s - main_s - worker_s
    print(f"{steps} steps, {calls - steps} probes; the least of {options.rounds} rounds")
    print(f"without probes: main process {main_s:.2f} s, workers {worker_s:.2f} s")
    print(f"with probes: main process {probed_main_s:.2f} s, workers {probed_worker_s:.2f} s")
    print(f"apart from the calls, probing adds {added_s / (main_s + worker_s):+.1%}")


def measure(folder: Path, url: str, name: str, is_probed: bool) -> tuple[float, float, int]:
    """Return the processor time (s) of the main process and of the workers, and the number of calls."""
    own, of_workers = time.process_time(), children_s()
    result = run.run_pack(
        RunSettings(
            pack=folder / "pack",
            model="openai/loopback",
            base_url=url,
            log_dir=folder / name,
            backend="still",
            simulator_factory=still.make,
            workers=1,
            preflight=False,
            probe=parse_schedule("every") if is_probed else None,
        )
    )
    probes = read_probes(result.folder, result.header.sha256).rows
    calls = sum(len(record.steps) for record in result.records) + len(probes)
    return time.process_time() - own, children_s() - of_workers, calls


def answered_here(asked: Any, header: RunHeader, _: object, *others: Any) -> Prober:
    """Return a prober whose questions are answered here and not by the server."""

    async def answer(_: object) -> Reply:
        return Reply(text=BELIEF, usage=Usage(input_tokens=1, output_tokens=1))

    return Prober(asked, header, answer, *others)


def children_s() -> float:
    """Return the processor time (s) of all processes that were started here and have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def read_options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--episodes", type=int, default=24)
    parser.add_argument("--turns", type=int, default=5)
    parser.add_argument("--rounds", type=int, default=3)
    return parser.parse_args()


if __name__ == "__main__":
    main()
