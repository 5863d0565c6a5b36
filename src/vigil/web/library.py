"""The library: the runs and packs that the pages may show, found under the given folders.

Page addresses have short names that the library assigns, never paths. Nothing outside the given folders is read, not
even through links, with two exceptions: packs that come with VIGIL, and the pack of a run if it has the recorded hash.
"""

import hashlib
import re
import threading
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from datetime import UTC, datetime
from itertools import chain, count
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from vigil.assets.database import AssetDatabase
from vigil.base.files import is_inside, resolve_inside
from vigil.base.json_lines import is_being_written
from vigil.errors import HouseError, PackMismatch, RecordError, VigilError
from vigil.packs.files import HOUSES, MANIFEST
from vigil.packs.pack import PACKAGED, Pack, find_pack, frozen_episodes, manifest_of, manifest_sha256, packaged_names
from vigil.protocol.episode import Episode
from vigil.protocol.house import House
from vigil.records.costs import Prices
from vigil.records.record import EPISODES_FILE, FRAMES_FOLDER, HEADER_FILE, RunHeader, read_header
from vigil.runner.workers.frames import FrameStore
from vigil.scoring.saved_run import RecordTable, SavedRun, pack_folder
from vigil.scoring.summary import RunScores, summarise

if TYPE_CHECKING:
    from vigil.analysis.measures.closure import ClosureScores

RunState = Literal["ended", "in progress", "interrupted", "not ended"]
"""State of a run. `interrupted`: it has not ended, and no process writes to it. `not ended`: it has not ended, and it
is unknown whether a process writes to it."""
_STATES: dict[bool | None, RunState] = {True: "in progress", False: "interrupted", None: "not ended"}
DEPTH = 3
"""Number of levels below a given folder at which runs are found."""


@dataclass(slots=True)
class LibraryPack:
    """A pack, identified by its manifest's hash. A house is read when it is needed."""

    slug: str
    folder: Path
    sha256: str
    episodes: dict[str, Episode]
    assets: AssetDatabase
    """Asset database that is used to draw plans of the pack's houses."""
    _houses: dict[str, House] = field(default_factory=dict)

    def houses(self) -> dict[str, list[Episode]]:
        """Return {name of a house: its episodes} of the pack, sorted."""
        found: dict[str, list[Episode]] = {}
        for episode in sorted(self.episodes.values(), key=lambda each: (each.house.name, each.id)):
            found.setdefault(episode.house.name, []).append(episode)
        return found

    def house_path(self, name: str) -> Path:
        """Return the file of a house. Raises HouseError if the file is a link to a place outside the pack."""
        return resolve_inside(self.folder, f"{HOUSES}/{name}.json", HouseError)

    def house(self, name: str) -> House:
        """Return the house that the pack's episodes refer to by `name`. Raises HouseError or PackMismatch."""
        if name not in self._houses:
            expected = {episode.house.sha256 for episode in self.episodes.values() if episode.house.name == name}
            if not expected:
                raise HouseError(f"Pack {self.slug!r} has no house {name!r}.")
            self._houses[name] = House.load(self.house_path(name), *expected)
        return self._houses[name]


@dataclass(slots=True)
class LibraryRun:
    """A run's folder, header and rows; `fault` says why it cannot be shown completely."""

    slug: str
    folder: Path
    header: RunHeader | None = None
    pack: LibraryPack | None = None
    table: RecordTable | None = None
    fault: str = ""
    assets: Path | None = None
    """Asset database of the run; None if the run did not use one, or if the user gave a different database."""
    prices: Prices | None = None
    """Prices from which the run's costs are computed."""
    state: RunState = "ended"
    stamp: tuple[int, ...] = ()
    """Numbers that change when one of the run's files is written to."""
    lock: threading.RLock = field(default_factory=threading.RLock, repr=False, compare=False)
    """Lock that is held while the run is read."""
    _closure_scores: "ClosureScores" = field(default_factory=dict, repr=False, compare=False)
    """Cached verdicts on rows of the closure-stress suite."""
    _cache: dict[str, tuple[RecordTable, tuple[int, int], Any]] = field(default_factory=dict, repr=False, compare=False)
    """Name of a result -> the table and its stamp from which the result was computed, and the result."""

    @property
    def name(self) -> str:
        """The agent's name, or the folder's name if the header cannot be read."""
        return self.header.spec.agent if self.header else self.folder.name

    def scores_and_summary(self, table: RecordTable) -> tuple[RunScores, dict]:
        """Return all verdicts on the rows in `table`, and their summary; cached until the file changes."""

        def compute() -> tuple[RunScores, dict]:
            scores = table.scores()
            return scores, summarise(scores)

        return self._cached("scores", table, compute)

    def _cached(self, name: str, table: RecordTable, compute: Callable[[], Any]) -> Any:
        with self.lock:
            known = self._cache.get(name)
            if known is None or known[0] is not table or known[1] != table.stamp:
                known = self._cache[name] = (table, table.stamp, compute())
            return known[2]

    def closure(self, table: RecordTable) -> dict[str, dict[str, Any]] | None:
        """Return C (correct closures) and related rates by kind; None for packs that are not of the closure-stress
        suite."""
        if self.pack is None or manifest_of(self.pack.folder).suite is None:
            return None
        from vigil.analysis.measures.closure import closure_rates  # noqa: PLC0415 - loads pandas

        with self.lock:
            return closure_rates(self.pack.folder, table, self._closure_scores)

    def chores(self, table: RecordTable) -> dict[str, dict[str, Any]] | None:
        """Return scores of lists by number of chores, cached until the file changes; None if the pack has no lists."""
        from vigil.analysis.measures.chores import scores_by_number  # noqa: PLC0415 - loads pandas

        if self.pack is None or self.header is None:
            return None
        run = SavedRun(self.folder, self.header, self.pack.folder, table)
        return self._cached("chores", table, lambda: scores_by_number(run))

    @property
    def version(self) -> str:
        """A text that changes whenever the pages have something new to show about the run."""
        return hashlib.sha256(repr((self.stamp, self.state, self.fault)).encode()).hexdigest()[:16]

    @property
    def last_written(self) -> datetime | None:
        """The time of the last row or, without rows, of the run's start; None if unknown."""
        if self.table is not None and self.table.stamp[0]:
            return datetime.fromtimestamp(self.table.stamp[1] // 10**9, UTC)
        return None if self.header is None else self.header.started

    @property
    def notes(self) -> tuple[str, ...]:
        """Caveats that a reader must see before this run's numbers."""
        notes = self.header.notes if self.header else ()
        return notes if self.table is None else (*notes, *self.table.notes)

    def parts(self) -> tuple[RunHeader, LibraryPack, RecordTable]:
        """Return the header, the pack and the rows. Raises RecordError if the run cannot be read."""
        if self.header is None or self.pack is None or self.table is None:
            raise RecordError(f"Run {self.slug!r} cannot be read: {self.fault}")
        return self.header, self.pack, self.table

    @property
    def frames(self) -> FrameStore:
        """The store of the run's saved frames."""
        return FrameStore(self.folder / FRAMES_FOLDER)


class Library:
    """Everything that the pages may show; safe to use from several threads."""

    def __init__(
        self,
        roots: Iterable[Path] = (),
        packs: Iterable[str | Path] = (),
        assets: Path | None = None,
        prices: Prices | None = None,
    ) -> None:
        """Open a library of the runs in `roots`; a root is a run's folder or a folder of runs.

        `assets` is AI2-THOR's asset database, for houses that use it; `prices` apply to runs played without prices.
        Raises InputError if a root, pack or database does not exist.
        """
        self._assets = assets
        self._prices = prices
        self._database = AssetDatabase.from_file(assets)
        self._roots = [root.resolve() for root in roots]
        for root in self._roots:
            if not root.is_dir():
                fault = "is not a folder" if root.exists() else "does not exist"
                raise RecordError(f"{str(root)!r} {fault}. Give the folder of a run, or a folder that contains runs.")
        self.packs: dict[str, LibraryPack] = {}
        for pack in packs:
            self._open_pack(find_pack(pack))
        self._runs: dict[Path, LibraryRun] = {}
        self._lock = threading.RLock()

    def runs(self) -> list[LibraryRun]:
        """Read all runs again, including new ones, and return them in order of their names."""
        runs = self.known_runs()
        for run in runs:
            self._refresh(run)
        return runs

    def run(self, slug: str) -> LibraryRun:
        """Return the run with this short name, after reading this run (but no other run) again. Raises KeyError."""
        known = {run.slug: run for run in list(self._runs.values())}
        run = known[slug] if slug in known else {run.slug: run for run in self.known_runs()}[slug]
        self._refresh(run)
        return run

    def known_runs(self) -> list[LibraryRun]:
        """Return all runs under the folders, in order of their names, without reading them again."""
        with self._lock:
            for root in self._roots:
                for folder in _run_folders(root, root, DEPTH):
                    if folder not in self._runs:
                        slug = _free_name(folder.name, {run.slug for run in self._runs.values()})
                        self._runs[folder] = LibraryRun(slug, folder)
            return sorted(self._runs.values(), key=lambda run: run.slug)

    def pack_folders(self) -> dict[str, Path]:
        """Return {short name: folder} of the packs that were opened, and of the other packs that come with VIGIL."""
        with self._lock:
            found = {slug: pack.folder for slug, pack in self.packs.items()}
            opened = set(found.values())
            for folder in ((PACKAGED / name).resolve() for name in packaged_names()):
                if folder not in opened:
                    found[_free_name(folder.name, found)] = folder
            return found

    def pack(self, slug: str) -> LibraryPack:
        """Return a pack by its short name. Raises KeyError or PackMismatch."""
        with self._lock:
            if slug in self.packs:
                return self.packs[slug]
            folder = self.pack_folders()[slug]
            return self._open_pack(folder, manifest_sha256(folder))

    def _refresh(self, run: LibraryRun) -> None:
        with run.lock:
            try:
                self._read(run)
                run.fault = ""
            except (VigilError, OSError) as error:
                run.fault = str(error)

    def _read(self, run: LibraryRun) -> None:
        header, known = read_header(run.folder), run.header
        is_another = known is None or (header.sha256, header.spec) != (known.sha256, known.spec)
        run.header, spec = header, header.spec
        has_assets = spec.asset_database_sha256 is not None and spec.asset_database_sha256 == self._database.sha256
        run.assets = self._assets if has_assets else None
        run.prices = header.prices or self._prices
        if is_another:
            run.pack = run.table = None
        if run.table is None:
            with self._lock:
                run.pack = self._pack_of(run.header)
            run.table = RecordTable(run.folder, header, run.pack.episodes.values())
        run.table.refresh()
        _note_state(run, header, run.table)

    def _pack_of(self, header: RunHeader) -> LibraryPack:
        spec = header.spec
        for pack in self.packs.values():
            if pack.sha256 == spec.pack_sha256:
                return pack
        try:
            # The manifest must be inside the pack's folder; its hash says whether it is the run's pack.
            folder = pack_folder(header, may_read=lambda pack: is_inside(pack / MANIFEST, pack))
            return self._open_pack(folder, spec.pack_sha256)
        except PackMismatch:
            where = f", which lay in {header.pack_folder!r}" if header.pack_folder else ""
            raise PackMismatch(
                f"The run was played on pack {spec.pack!r} with SHA-256 {spec.pack_sha256[:12]}...{where}. "
                "Give this pack: vigil view RUNS --pack FOLDER."
            ) from None

    def _open_pack(self, folder: Path, sha256: str | None = None) -> LibraryPack:
        folder = folder.resolve()
        for pack in self.packs.values():
            if pack.folder == folder and sha256 in (None, pack.sha256):
                return pack
        if sha256 is None:
            loaded = Pack.load(folder)
            sha256, episodes = loaded.sha256, list(loaded.episodes)
        else:
            episodes = frozen_episodes(folder, sha256)
        slug, by_id = _free_name(folder.name, self.packs), {episode.id: episode for episode in episodes}
        self.packs[slug] = LibraryPack(slug, folder, sha256, by_id, self._database)
        return self.packs[slug]


def _note_state(run: LibraryRun, header: RunHeader, table: RecordTable) -> None:
    """Update a run's state. If no process writes to a run, its state is checked again only after a file has changed."""
    stamp = ((run.folder / HEADER_FILE).stat().st_mtime_ns, *table.stamp)
    if header.ended is not None:
        run.state = "ended"
    elif stamp != run.stamp or run.state == "in progress":
        run.state = _STATES[is_being_written(table.path)]
    run.stamp = stamp


def _free_name(wanted: str, taken: Iterable[str]) -> str:
    plain = re.sub(r"[^A-Za-z0-9_.-]+", "-", wanted).strip(".-") or "unnamed"
    names = set(taken)
    candidates = chain([plain], (f"{plain}-{number}" for number in count(2)))
    return next(name for name in candidates if name not in names)


def _run_folders(folder: Path, root: Path, depth: int) -> list[Path]:
    """Return the folders of runs at or under `folder`, without following links out of `root`."""
    if not is_inside(folder, root):
        return []
    if (folder / HEADER_FILE).exists() or (folder / EPISODES_FILE).exists():
        return [folder]
    if depth == 0:
        return []
    try:
        entries = sorted(entry for entry in folder.iterdir() if entry.is_dir())
    except OSError:
        return []
    return [found for entry in entries for found in _run_folders(entry, root, depth - 1)]
