"""Saved runs: reads a run's folder, with the rows that count, their verdicts, and why other rows do not count.

`vigil score`, `report`, `verify`, `view` and `export` all read runs through this module, which writes nothing. A run
that is still being played can be read again to get its new rows.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from heapq import nlargest
from pathlib import Path
from typing import BinaryIO

from vigil.base.files import open_file, resolve_inside
from vigil.base.json_lines import Line, LineReader, parse_line
from vigil.errors import PackMismatch, RecordError
from vigil.packs.pack import Pack, find_pack, frozen_episodes, manifest_sha256
from vigil.protocol.episode import Episode
from vigil.records.costs import RunTokens
from vigil.records.record import EPISODES_FILE, HEADER_FILE, EpisodeRecord, Key, RunHeader, read_header
from vigil.records.record_file import RowFilter, missing_file_error, parse_row
from vigil.records.row_check import LeftOutRow, RowCheck, summarize_left_out
from vigil.scoring.outcomes import Outcome
from vigil.scoring.summary import RunScores, Unscored, run_scores, score_or_error


@dataclass(frozen=True, slots=True)
class EffectiveRow:
    """A record that counts for its episode and epoch: its place in the file, and its verdict."""

    line: int
    start: int
    size: int
    verdict: Outcome | Unscored

    @property
    def outcome(self) -> Outcome | None:
        """The verdict on the record; None if the episode ended as an error."""
        return self.verdict if isinstance(self.verdict, Outcome) else None


class RecordTable:
    """The rows of a run's `episodes.jsonl` that count, with their verdicts. The records stay in the file."""

    def __init__(self, folder: Path, header: RunHeader, episodes: Iterable[Episode]) -> None:
        """`episodes` are all episodes of the pack; those that the run does not plan are ignored. Reads no rows yet."""
        self.path = folder / EPISODES_FILE
        self.check = RowCheck(header, episodes)
        self.is_missing = False
        """Whether the file does not exist yet."""
        self.stamp = (0, 0)
        """Size of the file and its modification time (ns), which change when rows are added."""
        self._epochs = header.spec.epochs
        self._reset()

    def _reset(self, identity: tuple[int, int] = (0, 0)) -> None:
        self.rows: dict[Key, EffectiveRow] = {}
        """The rows that count, by key (episode and epoch), in the order of the file."""
        self.partial_line_number: int | None = None
        """Number of the last line if it is partial (being written, or cut off by a crash); None if it is whole."""
        self._filter = RowFilter(self.check)
        self._seen = self._lines = 0
        self._lacks_newline = False
        self._identity = identity

    @property
    def episodes(self) -> dict[str, Episode]:
        """Planned episodes of the run by id."""
        return self.check.episodes

    @property
    def planned(self) -> int:
        """Number of rows that the run is to have; if the run is a shard, only the shard's rows count."""
        return len(self.check.played_ids) * self._epochs

    @property
    def tokens(self) -> RunTokens:
        """Tokens of the run's replies. Rows that were superseded by later rows count too."""
        return self._filter.tokens

    @property
    def left_out(self) -> tuple[LeftOutRow, ...]:
        """Rows that are not scored: unreadable, of another run, in conflict with the protocol, or repeated."""
        return tuple(self._filter.left_out)

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes about the rows, to be read before any results."""
        incomplete = (
            f"Line {self.partial_line_number} of its records is incomplete and is skipped. Either it is being written, "
            "or it was cut off; then the same command plays that episode again.",
        )
        return (
            *self.check.notes,
            *summarize_left_out(self.left_out),
            *(incomplete if self.partial_line_number is not None else ()),
        )

    def refresh(self) -> None:
        """Read the rows that were added to the file. Read the whole file again if it was replaced or cut, or if a last
        line that had no newline was continued.

        Raises RecordError if the file exists but cannot be read.
        """
        try:
            stat = self.path.stat()
        except OSError as error:
            if not isinstance(error, FileNotFoundError | NotADirectoryError):
                raise RecordError(f"{str(self.path)!r} cannot be read: {error.strerror}.") from None
            self._reset()
            self.is_missing, self.stamp = True, (0, 0)
            return
        self.is_missing, self.stamp = False, (stat.st_size, stat.st_mtime_ns)
        identity = (stat.st_dev, stat.st_ino)
        has_grown = stat.st_size > self._seen
        if identity != self._identity or stat.st_size < self._seen or (has_grown and self._lacks_newline):
            self._reset(identity)
        self.partial_line_number = None
        if stat.st_size > self._seen:
            with self._opened() as file:
                file.seek(self._seen)
                self._read_rows(LineReader(file, repr(str(self.path)), number=self._lines, start=self._seen))

    def _opened(self) -> BinaryIO:
        return open_file(
            resolve_inside(self.path.parent, self.path.name, RecordError), repr(str(self.path)), RecordError
        )

    def _read_rows(self, lines: LineReader) -> None:
        """Read the remaining lines of the file and add their rows."""
        for line in lines:
            record = self._filter.accept(line.number, parse_row(line))
            if record is not None:
                verdict = score_or_error(self.episodes[record.episode_id], record)
                self.rows[record.key] = EffectiveRow(line.number, line.start, len(line.data), verdict)
            self._lines, self._seen = line.number, line.end
        self._lacks_newline = lines.lacks_newline
        self.partial_line_number = self._lines + 1 if lines.partial_line else None

    def newest(self, count: int) -> list[EffectiveRow]:
        """Return the last `count` rows of the file, the last row first."""
        return nlargest(count, list(self.rows.values()), key=lambda row: row.line)

    def record(self, key: Key) -> EpisodeRecord:
        """Return the record that counts for `key`, read from the file. Raises RecordError."""
        row = self.rows.get(key)
        if row is None:
            raise RecordError(f"No readable record of episode {key[0]!r} (epoch {key[1]}) is in this run.")
        with self._opened() as file:
            file.seek(row.start)
            line = Line(row.line, row.start, file.read(row.size))
        changed = "The file was changed since it was read: read it again."
        record = parse_line(line, EpisodeRecord, repr(str(self.path)), changed)
        if record.key != key:
            raise RecordError(f"{str(self.path)!r} line {row.line}: {changed}")
        return record

    def scores(self) -> RunScores:
        """Return all verdicts, sorted by episode and epoch."""
        verdicts = {key: row.verdict for key, row in list(self.rows.items())}  # it may grow meanwhile
        return run_scores(verdicts, self.episodes.values(), self._epochs)


@dataclass(frozen=True, slots=True)
class SavedRun:
    """A run that was saved in a folder: its header, its rows, and the folder of its pack."""

    folder: Path
    header: RunHeader
    pack_folder: Path
    """Current folder of the pack that the run was played on."""
    table: RecordTable

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes about the run, to be read before any results."""
        return (*self.header.notes, *self.table.notes)


def read_run(
    folder: Path,
    pack: str | Path | None = None,
    episodes_of: Callable[[Path, str], Iterable[Episode]] = frozen_episodes,
) -> SavedRun:
    """Return a run with all its rows so far. `pack` is the folder of its pack; by default, the folder in the run's
    header.

    Raises RecordError or PackMismatch.
    """
    run = open_run(folder, pack, episodes_of)
    run.table.refresh()
    if run.table.is_missing:
        raise missing_file_error(run.table.path)
    return run


def open_run(
    folder: Path,
    pack: str | Path | None = None,
    episodes_of: Callable[[Path, str], Iterable[Episode]] = frozen_episodes,
) -> SavedRun:
    """Return a run without reading its rows. Raises RecordError or PackMismatch."""
    header = read_header(folder)
    place = pack_folder(header, pack)
    table = RecordTable(folder, header, episodes_of(place, header.spec.pack_sha256))
    unknown = [episode_id for episode_id in header.spec.episode_ids if episode_id not in table.episodes]
    if unknown:
        raise RecordError(
            f"Run {header.run_id!r} names episode {unknown[0]!r}, absent from its pack. Was the run altered?"
        )
    return SavedRun(folder, header, place, table)


def load_run_pack(header: RunHeader, pack: str | Path | None = None) -> Pack:
    """Return the pack that a run was played on, after a check of all its files. Raises PackMismatch."""
    return Pack.load(pack_folder(header, pack), header.spec.pack_sha256)


SEARCH_DEPTH = 3
"""Number of levels of subfolders that are searched for runs."""


def find_runs(folders: Iterable[Path]) -> list[Path]:
    """Return the run folders among and under `folders`; a folder without runs is returned so that errors name it."""
    return [found for folder in folders for found in _runs_under(folder, SEARCH_DEPTH) or [folder]]


def _runs_under(folder: Path, depth: int) -> list[Path]:
    if (folder / HEADER_FILE).exists() or (folder / EPISODES_FILE).exists():
        return [folder]
    inner = sorted(each for each in folder.iterdir() if each.is_dir()) if depth and folder.is_dir() else []
    return [found for each in inner for found in _runs_under(each, depth - 1)]


def pack_folder(
    header: RunHeader, pack: str | Path | None = None, may_read: Callable[[Path], bool] = lambda _: True
) -> Path:
    """Return the folder of a run's pack: `pack` if given; otherwise the folder that the run's header names, or the pack
    of this name that comes with VIGIL. A folder for which `may_read` returns False is not used.

    Raises PackMismatch.
    """
    spec = header.spec
    places = [place for place in _candidate_folders(header) if may_read(place)] if pack is None else [find_pack(pack)]
    faults = [] if places else [PackMismatch(f"Pack {spec.pack!r} is in a folder that may not be read. Give the pack.")]
    for place in places:
        try:
            found = manifest_sha256(place)
        except PackMismatch as fault:
            faults.append(fault)
            continue
        if found == spec.pack_sha256:
            return place
        faults.append(
            PackMismatch(
                f"Run {header.run_id!r} was played on pack {spec.pack!r} with SHA-256 {spec.pack_sha256[:12]}..., "
                f"but {str(place)!r} has {found[:12]}.... Give the pack that the run was played on; results on another "
                "pack cannot be compared."
            )
        )
    raise faults[0]


def _candidate_folders(header: RunHeader) -> list[Path]:
    """Return the existing folders that may hold a run's pack: the folder that was used when the run was played, and the
    folder of the pack with the same name that comes with VIGIL.

    Raises PackMismatch if neither exists.
    """
    noted = Path(header.pack_folder) if header.pack_folder else None
    places = [noted] if noted is not None and noted.is_dir() else []
    try:
        return [*places, find_pack(header.spec.pack)]
    except PackMismatch:
        if places:
            return places
        raise
