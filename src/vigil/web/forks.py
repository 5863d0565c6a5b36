"""Links between a play and the plays that continue it from one of its steps."""

from dataclasses import dataclass
from urllib.parse import quote

from vigil.errors import VigilError
from vigil.records.record import EpisodeRecord, ForkPoint, read_header
from vigil.web.library import Library, LibraryRun


@dataclass(frozen=True, slots=True)
class ForkLink:
    """A link to a play of the same episode."""

    name: str
    href: str
    step: int
    """Number of steps that both plays share."""


def continued_play(library: Library, record: EpisodeRecord) -> ForkLink | None:
    """Return the play that a record continues; None if it continues no play, or that play is not in the library."""
    point = record.fork
    if point is None:
        return None
    source = next((run for run in library.known_runs() if _sha256(run) == point.run_sha256), None)
    return None if source is None else _link(source, record.episode_id, point.epoch, point)


def branches_of(library: Library, shown: LibraryRun, record: EpisodeRecord) -> list[ForkLink]:
    """Return the plays of the library that continue a record of a run, sorted by the names of their runs."""
    found: list[ForkLink] = []
    for run in library.known_runs():
        if run.slug == shown.slug or _source_sha256(run) != _sha256(shown):
            continue
        table = library.run(run.slug).table
        for key in sorted(table.rows if table is not None else ()):
            if table is None or key[0] != record.episode_id:
                continue
            point = table.record(key).fork
            if point is not None and (point.epoch, point.attempt) == (record.epoch, record.attempt):
                found.append(_link(run, *key, point))
    return found


def _link(run: LibraryRun, episode_id: str, epoch: int, point: ForkPoint) -> ForkLink:
    return ForkLink(run.slug, f"/runs/{quote(run.slug)}/episodes/{quote(episode_id)}/{epoch}", point.step)


def _sha256(run: LibraryRun) -> str | None:
    _read_header(run)
    return None if run.header is None else run.header.sha256


def _source_sha256(run: LibraryRun) -> str | None:
    _read_header(run)
    fork = None if run.header is None else run.header.spec.fork
    return None if fork is None else fork.run_sha256


def _read_header(run: LibraryRun) -> None:
    """Read only the header of a run that has not been shown yet, because reading many records takes long."""
    if run.header is None:
        try:
            run.header = read_header(run.folder)
        except (VigilError, OSError):
            return  # the list of runs says why
