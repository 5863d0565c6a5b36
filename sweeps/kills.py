"""Kill -9 loops: a command is killed at a random moment and started again, until it finishes; then all is compared.

    python -m sweeps.kills run --count 500 --log kills.jsonl      vigil run: scripted, exec: and model agents
    python -m sweeps.kills play --count 300 --log kills.jsonl     vigil play, driven through HTTP
    python -m sweeps.kills pack --count 200 --log kills.jsonl     vigil pack propose, build and make

One *life* is a folder that is worked on until it is complete. After each kill every line that was ever complete must
still be there, byte for byte; at the end nothing may be lost or doubled, the result must equal an undisturbed one, and
no process may be left over. `--count` is the total of kills in the log, so that the same command continues. Most
starts are forks of this process, which has imported everything; `--command-share` is the share of starts by command
line.
"""

import argparse
import json
import os
import random
import signal
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from sweeps.support.kill_targets import KINDS, KillTarget
from sweeps.support.process_groups import ProcessGroup, leftovers, start
from vigil.base.json_lines import append_line, read_lines

SHORTEST_S = 0.05
LONGEST_SHARE = 0.9
"""Longest time until the first kill, as a share of the time that undisturbed work takes."""
GROWTH = 1.05
"""Factor on the longest time until a kill after each kill of a life, so that every life ends."""


def kill_until_done(target: KillTarget, rng: random.Random, command_share: float) -> dict[str, Any]:
    """Kill and start a target until its work is complete; return the entry for the log."""
    began, kills, faults = time.monotonic(), 0, []
    longest_s = LONGEST_SHARE * target.typical_s
    token = f"trial-{os.getpid()}-{target.folder.name}-{time.monotonic_ns()}"
    while True:
        delay_s = rng.uniform(SHORTEST_S, longest_s)
        process = start(target.command() if rng.random() < command_share else target.run_in_fork, token, target.folder)
        code = _run_then_kill(process, target, delay_s)
        if code is None:
            kills, longest_s = kills + 1, longest_s * GROWTH
            faults += [f"after kill {kills}: {fault}" for fault in target.check_final_lines()]
        elif code == target.final_code:
            if target.is_finished():
                break
        elif code:
            faults.append(f"after kill {kills}: the command ended with {code}: {process.output_tail()}")
            break
        if faults:
            break
    faults += [f"process left over: {name}" for name in leftovers(token)]
    faults += [] if faults else target.check_finished()
    return {"kills": kills, "seconds": round(time.monotonic() - began, 1), "faults": faults}


def _run_then_kill(process: ProcessGroup, target: KillTarget, delay_s: float) -> int | None:
    """Let a start work for a while, then kill it; return its exit code if it ended before, None if it was killed."""
    target.drive(time.monotonic() + delay_s)
    code = process.wait(delay_s)
    if code is not None:
        return code
    process.signal(signal.SIGTERM if target.is_over else signal.SIGKILL)
    code = process.wait(30.0)
    if target.is_over:
        return code
    return None


def read_log(path: Path) -> list[dict[str, Any]]:
    """Return the lives in the log; an incomplete last line is left out."""
    return [json.loads(line.data) for line in read_lines(path)]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the sweep and return its exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m sweeps.kills", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("what", choices=sorted(KINDS))
    parser.add_argument("--count", type=int, default=100, help="kills in all, those in the log included (100)")
    parser.add_argument(
        "--log", type=Path, default=Path("kills.jsonl"), help="one line a life; continued (kills.jsonl)"
    )
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--command-share", type=float, default=0.1, help="share of starts by command line (0.1)")
    given = parser.parse_args(arguments)
    trials = [trial for trial in read_log(given.log) if (trial["what"], trial["seed"]) == (given.what, given.seed)]
    with tempfile.TemporaryDirectory() as place, KINDS[given.what](Path(place)) as kind:
        while sum(trial["kills"] for trial in trials) < given.count:
            case = len(trials)
            rng = random.Random(f"{given.seed} {given.what} {case}")
            target = kind.target(case)
            trial = {"what": given.what, "seed": given.seed, "case": case, "variant": target.variant}
            trial |= kill_until_done(target, rng, given.command_share)
            trials.append(trial)
            append_line(given.log, json.dumps(trial).encode() + b"\n")
            print(json.dumps(trial), flush=True)
            target.clear()
    kills, seconds = (sum(trial[name] for trial in trials) for name in ("kills", "seconds"))
    fallen = [fault for trial in trials for fault in trial["faults"]]
    print(f"{given.what}: {kills} kills in {len(trials)} lives, {seconds:.0f} s: {len(fallen)} faults")
    for fault in fallen:
        print(f"  {fault}")
    return 1 if fallen else 0


if __name__ == "__main__":
    sys.exit(main())
