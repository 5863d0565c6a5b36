"""How long `vigil --help` takes, beside the help of a program of Typer's with one command and beside Python alone.

    python -m benchmarks.start

All three are started in turns, so that a machine whose speed changes slows them alike; the figures are medians.
"""

import argparse
import statistics
import subprocess
import sys
import time

BARE = """
import typer
app = typer.Typer()
@app.callback()
def before() -> None: ...
@app.command()
def run(name: str, count: int = 1) -> None: ...
app()
"""
PROGRAMS = {
    "Python alone": ["-c", "pass"],
    "a bare program of Typer's, --help": ["-c", BARE, "--help"],
    "vigil --help": ["-c", "from vigil.cli import main; main()", "--help"],
    "vigil run --help": ["-c", "from vigil.cli import main; main()", "run", "--help"],
}


def seconds(words: list[str]) -> float:
    began = time.perf_counter()
    subprocess.run([sys.executable, *words], stdout=subprocess.DEVNULL, check=True)
    return time.perf_counter() - began


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=15)
    rounds = parser.parse_args().rounds
    for words in PROGRAMS.values():
        seconds(words)  # the first start compiles, and reads from disk
    taken = [[seconds(words) for words in PROGRAMS.values()] for _ in range(rounds)]
    for name, times in zip(PROGRAMS, zip(*taken, strict=True), strict=True):
        ratio = statistics.median(time / each[1] for time, each in zip(times, taken, strict=True))
        print(f"{name:36} {statistics.median(times):5.2f} s   {ratio:4.2f} of the bare program")


if __name__ == "__main__":
    main()
