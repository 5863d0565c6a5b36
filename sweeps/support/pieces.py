"""Pieces: numbered parts of a sweep, done by processes, written to a log, and never done twice.

The log is a JSON-lines file: a first line with the sweep's settings, then one line for each finished piece. An
incomplete last line, left by a kill, is set aside, and that piece is done again. A sweep is a function from a piece's
number to a `PieceResult`; it must not depend on other pieces.
"""

import argparse
import json
import os
import shlex
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import as_completed
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from vigil.base.json_lines import AppendFile
from vigil.base.processes.group import WorkerGroup, given_state
from vigil.base.processes.worker import WorkerLost, WorkerSettings
from vigil.cli.progress import progress
from vigil.errors import RecordError
from vigil.runner.run_folder import source_state

SHOWN_FAILURES = 20
LOGS = Path("runs") / "sweeps"


@dataclass(frozen=True, slots=True)
class Failure:
    """One case in which a required property did not hold."""

    kind: str
    """Kind of the failure, in a few words that are the same for all cases of it."""
    detail: str
    case: str
    """Options that repeat the case alone, e.g. `--piece 3 --case 7`."""


@dataclass(slots=True)
class PieceResult:
    """The result of a piece."""

    counts: Counter[str] = field(default_factory=Counter)
    failures: list[Failure] = field(default_factory=list)


Work = Callable[[int], PieceResult]
"""Function that does the piece of a number. With several workers it must be picklable: a module's function, or a
`partial` of it."""


@dataclass(frozen=True, slots=True)
class Sweep:
    """A sweep by name, with the settings on which its cases depend."""

    name: str
    """Name of the module, as in `python -m sweeps.NAME`."""
    settings: dict[str, Any]
    """Settings, as JSON; a log that was made with others is refused."""
    work: Work


def parser(doc: str, pieces: int) -> argparse.ArgumentParser:
    """Return a parser with the options that all sweeps share; `pieces` is the default number of pieces."""
    made = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    made.add_argument("--seed", type=int, default=0, help="another seed, other cases (default 0)")
    made.add_argument("--pieces", type=int, default=pieces, help=f"how many pieces to do (default {pieces})")
    made.add_argument("--workers", type=int, default=1, help="processes; the result is the same with any number")
    made.add_argument("--log", type=Path, help="finished pieces; default runs/sweeps/NAME-SEED.jsonl")
    made.add_argument("--piece", type=int, help="do this piece alone, without a log")
    made.add_argument("--case", type=int, help="with --piece: this case of it alone")
    return made


def run(sweep: Sweep, options: argparse.Namespace) -> int:
    """Do the pieces that are missing from the log; print a summary. Return the exit code: 1 when any case failed."""
    if options.piece is not None:
        result = sweep.work(options.piece)
        return _summarize(sweep, {"options": vars(options)}, [_line(options.piece, 0.0, result)])
    path = options.log or LOGS / f"{sweep.name}-{options.seed}.jsonl"
    with PieceLog(path, sweep) as log:
        missing = [piece for piece in range(options.pieces) if piece not in log.done]
        if log.done:
            print(f"{path}: {len(log.done)} pieces are done, {len(missing)} are left", flush=True)
        with progress(sweep.name, may_fork=True) as show:
            for number, (piece, seconds, result) in enumerate(_results(sweep.work, missing, options.workers), start=1):
                log.append(_line(piece, seconds, result))
                for failure in result.failures[:3]:
                    print(f"FELL {failure.kind}: {failure.detail[:300]}", flush=True)
                show(number, len(missing))
        wanted = [log.done[piece] for piece in sorted(log.done) if piece < options.pieces]
    return _summarize(sweep, {"log": str(path)}, wanted)


class PieceLog:
    """The log of a sweep; one process at a time writes it."""

    def __init__(self, path: Path, sweep: Sweep) -> None:
        """Open or begins the log. Exits when it is another sweep's, or being written."""
        path.parent.mkdir(parents=True, exist_ok=True)
        self.done: dict[int, dict[str, Any]] = {}
        try:
            self._file = AppendFile(path)
        except RecordError as error:
            sys.exit(f"{error} Or give another --log.")
        asked = {"sweep": sweep.name, "settings": sweep.settings}
        lines = [json.loads(line.data) for line in self._file.lines.complete]
        if not lines:
            self.append(asked)
        elif lines[0] != asked:
            self._file.close()
            sys.exit(f"{path} is the log of {lines[0]}, this is {asked}. Give another --log.")
        self.done = {line["piece"]: line for line in lines[1:]}

    def append(self, line: dict[str, Any]) -> None:
        """Write a line through to the disk."""
        self._file.append(json.dumps(line, sort_keys=True).encode() + b"\n")
        if "piece" in line:
            self.done[line["piece"]] = line

    def __enter__(self) -> "PieceLog":
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()


def _results(work: Work, missing: Sequence[int], workers: int) -> Iterator[tuple[int, float, PieceResult]]:
    if workers == 1:
        yield from (_timed(work, piece) for piece in missing)
        return
    group = WorkerGroup(partial(given_state, work), workers, "Sweep worker", WorkerSettings(log=None, attempts=2))
    try:
        pieces = {group.submit(_timed, piece): piece for piece in missing}
        for future in as_completed(pieces):
            try:
                yield future.result()
            except WorkerLost:
                died = Failure("the process died", "crashed or was killed", f"--piece {pieces[future]}")
                yield pieces[future], 0.0, PieceResult(Counter(), [died])
    finally:
        group.close()


def _timed(work: Work, piece: int) -> tuple[int, float, PieceResult]:
    began = _processor_seconds()
    result = work(piece)
    return piece, _processor_seconds() - began, result


def _processor_seconds() -> float:
    """Return the processor time of this process and of those that it started and that have ended."""
    used = os.times()
    return used.user + used.system + used.children_user + used.children_system


def _line(piece: int, seconds: float, result: PieceResult) -> dict[str, Any]:
    return {
        "piece": piece,
        "seconds": round(seconds, 3),
        "counts": dict(sorted(result.counts.items())),
        "failures": [
            {"kind": failure.kind, "detail": failure.detail, "case": failure.case} for failure in result.failures
        ],
        "commit": source_state()[0],
    }


def _summarize(sweep: Sweep, place: dict[str, Any], lines: Sequence[dict[str, Any]]) -> int:
    """Print the failures, kind by kind, and the counts. Return the exit code."""
    counts: Counter[str] = Counter()
    for line in lines:
        counts.update(line["counts"])
    failures = [failure for line in lines for failure in line["failures"]]
    kinds = Counter(failure["kind"] for failure in failures)
    options = " ".join(
        f"--{name.replace('_', '-')} {shlex.quote(str(value))}" for name, value in sweep.settings.items()
    )
    for kind, number in kinds.most_common(SHOWN_FAILURES):
        first = min(
            (failure for failure in failures if failure["kind"] == kind), key=lambda failure: len(failure["detail"])
        )
        print(f"\nFELL {number} x {kind}\n  {first['detail'][:2000]}")
        print(f"  again: python -m sweeps.{sweep.name} {options} {first['case']}")
    seconds, commits = sum(line["seconds"] for line in lines), {line["commit"] for line in lines}
    print(
        f"\n{sweep.name} ({', '.join(f'{name} {value}' for name, value in place.items() if name == 'log')}): "
        f"{len(lines)} pieces, {seconds:.0f} s of processor time, {len(commits)} version(s) of the code"
    )
    print(", ".join(f"{name} {number}" for name, number in sorted(counts.items())))
    print(f"fell: {len(failures)}")
    return 1 if failures else 0
