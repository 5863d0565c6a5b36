"""Processor time (user and system) of the help of each verb of `vigil`, and of each verb up to its first line.

    python -m benchmarks.start
    python -m benchmarks.start --rounds 5 score view

The programs are started in turns, so that a machine whose speed changes slows them alike; the figures are medians.
"""

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

from vigil.cli.verbs import VERBS, Group

MAIN = ["-c", "from vigil.cli import main; main()"]
BARE = """
import typer
app = typer.Typer()
@app.callback()
def before() -> None: ...
@app.command()
def run(name: str, count: int = 1) -> None: ...
app()
"""
TICK_S = 1 / os.sysconf("SC_CLK_TCK")


def helps() -> dict[str, list[str]]:
    names = [
        name if not isinstance(verb, Group) else f"{name} {inner}"
        for name, verb in VERBS.items()
        for inner in (verb.verbs if isinstance(verb, Group) else [""])
    ]
    return {f"{name} --help": [*MAIN, *name.split(), "--help"] for name in names}


def works(folder: Path) -> dict[str, list[str]]:
    """Return commands whose first line is a fact about what they do, by name."""
    run, out = str(folder / "run"), str(folder / "out")
    port = ["--no-open", "--port", "8399"]
    commands = {
        "run": ["--agent", "noop", "--backend", "fake", "--limit", "2", "--log-dir", str(folder / "new")],
        "run --dry-run": ["--model", "openai/gpt-4o", "--dry-run"],
        "score": [run],
        "verify": [run, "--records-only"],
        "report": [run],
        "figure": ["plane", run, "--out", str(folder / "plane.png")],
        "export": [run, "--out", out, "--format", "parquet"],
        "view": [run, *port],
        "play": ["--player", "ada", "--backend", "fake", "--log-dir", str(folder / "played"), *port],
        "review": ["--reviewer", "ada", "--file", str(folder / "reviews.jsonl"), *port],
        "prompt": [],
        "models": [],
        "pack list": [],
        "pack info": ["starter"],
        "pack propose": ["--seeds", "0:1", "--family", "PG", "--out", str(folder / "drafts.jsonl"), "--workers", "1"],
    }
    return {name: [*MAIN, *name.split(), *words] for name, words in commands.items()}


def whole(words: list[str]) -> float:
    """Return the processor time (s) of a program."""
    before = os.times()
    subprocess.run([sys.executable, *words], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=True)
    after = os.times()
    return after.children_user + after.children_system - before.children_user - before.children_system


def to_first_line(words: list[str]) -> float:
    """Return the processor time (s) of a program when its first line comes; the program is then ended."""
    with subprocess.Popen([sys.executable, *words], stdout=subprocess.PIPE, stderr=subprocess.STDOUT) as program:
        assert program.stdout is not None
        program.stdout.readline()
        fields = Path(f"/proc/{program.pid}/stat").read_text().rpartition(")")[2].split()
        program.kill()
    return (int(fields[11]) + int(fields[12])) * TICK_S


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("verbs", nargs="*", help="verbs to measure; all if none is given")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        run = ["run", "--agent", "solver", "--backend", "fake", "--log-dir", f"{place}/run"]
        subprocess.run([sys.executable, *MAIN, *run], stdout=subprocess.DEVNULL, check=True)
        timed = {"a bare program of Typer's, --help": (whole, ["-c", BARE, "--help"])}
        timed |= {name: (whole, words) for name, words in helps().items()}
        timed |= {f"{name}, first line": (to_first_line, words) for name, words in works(Path(place)).items()}
        wanted = {name: one for name, one in timed.items() if not asked.verbs or name.startswith(tuple(asked.verbs))}
        found = {name: [] for name in wanted}
        for _ in range(asked.rounds + 1):  # the first round compiles, and reads from disk
            for name, (measure, words) in wanted.items():
                found[name].append(measure(words))
    for name, times in found.items():
        print(f"{name:36} {statistics.median(times[1:]):5.2f} s")


if __name__ == "__main__":
    main()
