"""Submitting: makes a bundle from a run and its metadata, after the same check that maintainers make."""

from pathlib import Path

from vigil.base.files import read_file
from vigil.errors import RecordError, SettingError
from vigil.packs.private import check_revealed
from vigil.records.probe_file import PROBES_FILE
from vigil.records.record import EPISODES_FILE, HEADER_FILE, RunHeader, read_header
from vigil.scoring.saved_run import pack_folder
from vigil.web.leaderboard.bundle import MEMBERS, Entry, sha256_of, without_paths, write_bundle
from vigil.web.leaderboard.checking import CandidateRun, CheckedEntry, OnProgress, known_packs, verify_candidates
from vigil.web.leaderboard.metadata import EntryMetadata
from vigil.web.leaderboard.settings import CheckSettings


def check_places(run: Path, out: Path) -> RunHeader:
    """Return the header of a run. Raises SettingError or RecordError unless `run` is one and `out` can be written."""
    if out.suffix != ".zip" or not out.absolute().parent.is_dir():
        raise SettingError(f"--out {str(out)!r}: give a file that ends in .zip, in a folder that exists.")
    return read_header(run)


def submit_run(
    run: Path,
    metadata: EntryMetadata,
    out: Path,
    settings: CheckSettings,
    *,
    pack: str | Path | None = None,
    reveals: bool = False,
    on_progress: OnProgress = lambda _done, _total: None,
) -> CheckedEntry:
    """Check a run, write it as a bundle to `out`, and return its entry.

    Raises RecordError that says why the run is not a valid entry, or SettingError.
    """
    header = check_places(run, out)
    packs = known_packs((pack_folder(header, pack),))
    try:
        candidate = CandidateRun.read(run, metadata, packs)
        (found,) = verify_candidates([candidate], settings, on_progress)
        entry, measures = candidate.conclude(found)
    except RecordError as fault:
        raise RecordError(f"{str(run)!r} cannot be submitted: {str(fault).removesuffix('.')}.") from None
    check_revealed(header.spec.pack, entry.is_private, "A bundle has every record of the run, which", reveals=reveals)
    members = {HEADER_FILE: without_paths(header).model_dump_json(indent=1).encode() + b"\n"}
    for name in (EPISODES_FILE, PROBES_FILE):
        if (run / name).exists():
            members[name] = read_file(run / name, repr(str(run / name)), RecordError, MEMBERS[name])
    claimed = Entry(
        metadata=metadata,
        pack=header.spec.pack,
        pack_sha256=header.spec.pack_sha256,
        frames=measures.frames,
        figures=measures.figures,
        files={name: sha256_of(data) for name, data in members.items()},
    )
    write_bundle(out, claimed, members)
    return entry
