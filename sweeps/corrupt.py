"""Corrupted record files: every reader works or raises a VigilError that says what is wrong, and keeps good rows.

    python -m sweeps.corrupt --count 2000
    python -m sweeps.corrupt --case 1234          one case again, with the traceback

Each case corrupts a finished run in one way; then `vigil score`, `report`, `verify`, the pages of `vigil view`, `vigil
export` and the resumption of the run read it, in this process. A failure is a traceback, an answer of 500 and above,
more than `SECONDS`, a file that a reader has changed, or a row that resuming has lost. The exit code is 1 when any case
failed.
"""

import argparse
import asyncio
import contextlib
import io
import os
import random
import shutil
import signal
import sys
import tempfile
import traceback
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from fastapi.testclient import TestClient

from sweeps.support.corruptions import corrupt
from tests.support.tiny_pack import tiny_pack
from vigil.analysis.measures.rows import combined_rows, read_runs
from vigil.assets.database import AssetDatabase
from vigil.cli.progress import progress
from vigil.cli.scores import score
from vigil.env import Env
from vigil.errors import VigilError
from vigil.protocol.profile import Profile
from vigil.records.record import EPISODES_FILE, read_header
from vigil.runner.run import run_pack
from vigil.runner.run_folder import RunFolder
from vigil.runner.settings import RunSettings
from vigil.runner.workers.messages import RenderSettings
from vigil.runner.workers.resimulation import ComparisonSettings, resimulate
from vigil.scoring.saved_run import load_run_pack, read_run
from vigil.sim import make_simulator
from vigil.web.drawing import RenderService
from vigil.web.export import episode_page
from vigil.web.library import Library
from vigil.web.view import make_view

SECONDS = 120
Reader = Callable[[Path], None]


class ReaderTimeout(BaseException):
    """A reader took too long."""


class Readers:
    """The readers of a run's folder, by name."""

    def __init__(self, run: Path, pack: Path) -> None:
        self._pack = pack
        self._spec = read_header(run).spec
        self._drawer = RenderService()
        played = load_run_pack(read_header(run), pack)
        self._episodes = played.episodes
        self._env = Env(make_simulator("fake", assets=AssetDatabase.default()), played.house_of, Profile())

    def all(self) -> dict[str, Reader]:
        """Return the readers by name; the last one may change the folder."""
        return {
            "score": lambda run: score([run], as_json=False, pack=str(self._pack)),
            "report": lambda run: _discard(combined_rows(read_runs([run], str(self._pack)))),
            "verify": self._verify,
            "view": self._view,
            "export": self._export,
            "resume": self._resume,
        }

    def close(self) -> None:
        """End the drawing process."""
        self._drawer.close()

    def _verify(self, run: Path) -> None:
        table = read_run(run, self._pack).table
        for key, row in sorted(table.rows.items())[:3]:
            if row.outcome is not None:
                resimulate(
                    table.episodes[key[0]], table.record(key), self._env, ComparisonSettings(frames=False, exact=True)
                )

    def _view(self, run: Path) -> None:
        library = Library([run], [self._pack])
        site = TestClient(
            make_view(library, self._drawer, render_settings=RenderSettings("fake")), base_url="http://127.0.0.1"
        )
        (shown,) = library.runs() or [None]
        pages = ["/", "/houses"]
        if shown is not None:
            pages += [f"/runs/{shown.slug}", f"/compare?a={shown.slug}&b={shown.slug}"]
            for episode_id, epoch in list(shown.table.rows)[:3] if shown.table else []:
                here = f"/runs/{shown.slug}/episodes/{episode_id}/{epoch}"
                pages += [here, f"{here}/frames/1.png", f"{here}/frames/1.json"]
        for page in pages:
            status = site.get(page).status_code
            if status >= 500:
                raise RuntimeError(f"{page} answers with {status}")

    def _export(self, run: Path) -> None:
        for shown in Library([run], [self._pack]).runs():
            for key in sorted(shown.table.rows)[:1] if shown.table else []:
                episode_page(shown, key, self._drawer)

    def _resume(self, run: Path) -> None:
        rows = run / EPISODES_FILE
        before = rows.read_bytes() if rows.is_file() else b""
        try:
            RunFolder.create_or_resume(run, self._spec, self._episodes).close()
        finally:
            after = rows.read_bytes() if rows.is_file() else b""
            torn = b"".join(side.read_bytes() for side in sorted(run.glob(f"{EPISODES_FILE}.partial-*")))
            if after + torn not in (before, before + b"\n"):
                raise RuntimeError(
                    f"resuming has lost rows: {len(before)} bytes before, {len(after)} + {len(torn)} after"
                )


def _discard(rows: object) -> None:
    """Take what a reader has read."""


@contextlib.contextmanager
def time_limit(seconds: int) -> Iterator[None]:
    """End the block by an exception after the given number of seconds."""

    def ring(*_: object) -> None:
        raise ReaderTimeout(f"not done within {seconds} s")

    before = signal.signal(signal.SIGALRM, ring)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def try_reader(name: str, reader: Reader, run: Path, shows_trace: bool) -> str:
    """Let a reader read a folder. Return `works`, `refuses`, or a description of the failure."""
    before = _state(run)
    try:
        with time_limit(SECONDS), contextlib.redirect_stdout(io.StringIO()):
            reader(run)
        outcome = "works"
    except VigilError:
        outcome = "refuses"
    except (Exception, ReaderTimeout, SystemExit) as error:  # noqa: BLE001 - this is what the sweep looks for
        if shows_trace:
            traceback.print_exc()
        place = traceback.extract_tb(error.__traceback__)[-1]
        return f"{type(error).__name__}: {str(error)[:160]} ({Path(place.filename).name}:{place.lineno})"
    if name != "resume" and _state(run) != before:
        return "the reader has changed the folder"
    return outcome


def _state(run: Path) -> dict[str, tuple[int, int]]:
    return {str(path): (path.lstat().st_size, path.lstat().st_mtime_ns) for path in run.rglob("*") if not path.is_dir()}


def run_case(
    seed: int, case: int, finished: Path, readers: Readers, shows_trace: bool = False
) -> tuple[str, dict[str, str]]:
    """Corrupt a copy of a run as one case says; return what was done and how each reader reacted."""
    rng = random.Random(f"{seed} {case}")
    run = finished.with_name("corrupted")
    shutil.copytree(finished, run)
    try:
        corruption = corrupt(rng, run)
        return corruption, {name: try_reader(name, reader, run, shows_trace) for name, reader in readers.all().items()}
    finally:
        shutil.rmtree(run)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the sweep and return its exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m sweeps.corrupt", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=300, help="cases (300)")
    parser.add_argument("--first", type=int, default=0, help="number of the first case, to go on (0)")
    parser.add_argument("--case", type=int, help="this case alone, with tracebacks")
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args(arguments)
    cases = range(given.first, given.first + given.count) if given.case is None else [given.case]
    outcomes: Counter[str] = Counter()
    failures: Counter[str] = Counter()
    asyncio.set_event_loop(asyncio.new_event_loop())
    with tempfile.TemporaryDirectory() as place:
        pack = tiny_pack(Path(place) / "tiny", 6)
        finished = Path(place) / "finished"
        run_pack(
            RunSettings(pack=pack.folder, agent="sweep", log_dir=finished, backend="fake", workers=1, save_frames=True)
        )
        readers = Readers(finished, pack.folder)
        with progress("cases", may_fork=True) as show:
            for number, case in enumerate(cases, start=1):
                corruption, found = run_case(given.seed, case, finished, readers, given.case is not None)
                for name, outcome in found.items():
                    outcomes[outcome if outcome in ("works", "refuses") else "falls"] += 1
                    if outcome not in ("works", "refuses"):
                        failures[f"{name}: {outcome[:90]}"] += 1
                        print(f"case {case}: {corruption}: {name}: {outcome}", flush=True)
                show(number, len(cases), f"{outcomes['falls']} falls")
        readers.close()
    for failure, count in failures.most_common():
        print(f"{count} x {failure}")
    counted = ", ".join(f"{name} {outcomes[name]}" for name in ("works", "refuses", "falls"))
    print(f"{len(cases)} cases, {outcomes.total()} readings: {counted}")
    return 1 if failures else 0


if __name__ == "__main__":
    os.umask(0o077)
    sys.exit(main())
