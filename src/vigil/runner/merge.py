"""Joining the shards of a run into one run, as if one machine had played it: rows, attempts, frames and logs.

The joined folder is written under a temporary name and renamed when it is complete. It has the rows of the first shard,
then those of the second, and so on. Its header lists every session of every shard. The shards are not changed.
"""

import shutil
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import cache
from itertools import chain
from pathlib import Path
from typing import Any

from vigil.base.files import refuse_outward_links
from vigil.base.json_lines import AppendFile, Line, dump_line
from vigil.errors import RecordError
from vigil.packs.pack import frozen_episodes
from vigil.protocol.episode import Episode
from vigil.records.probe_file import PROBES_FILE, read_probes
from vigil.records.reasoning_file import REASONING_FILE, read_reasoning
from vigil.records.record import (
    EPISODES_FILE,
    FRAMES_FOLDER,
    HEADER_FILE,
    EpisodeRecord,
    Resumption,
    RunHeader,
    Shard,
    read_header,
)
from vigil.records.shards import shard_episodes
from vigil.runner.attempts import ATTEMPTS_FILE, read_attempts
from vigil.runner.run_folder import INSPECT_FOLDER, LOGS_FOLDER, abbreviated, new_nonce
from vigil.runner.settings import MergeSettings
from vigil.scoring.saved_run import SavedRun, open_run

MAX_LISTED = 5
"""Maximum number of differences, shards and episodes that a message names."""
_SHARD_SPECIFIC = {"shard.index", "base_url"}
"""Settings in which the shards of one run may differ."""
_UNKNOWN_UNTIL_PLAYED = {"simulator_version", "answering models"}
"""Facts that a shard does not have before it is played."""
_PLAYER_FACTS = ("agent_files", "answering models")
"""Facts about the model or program that answered; with `force`, these may differ between shards."""


@dataclass(frozen=True, slots=True)
class _ShardRun:
    """One shard to be joined: its run, its rows as lines of its file, and its number of missing plays."""

    run: SavedRun
    shard: Shard
    lines: tuple[Line, ...]
    """Rows in the order of the file, including those of earlier attempts that failed."""
    missing: int
    """Number of planned plays that do not have a row, or whose row is an error."""


def merge_runs(out: Path, shards: Sequence[Path], settings: MergeSettings | None = None) -> RunHeader:
    """Join the shards of one run into the new folder `out` and return its header.

    Raises RecordError, and does not create `out`, when the shards are not of one run, overlap, are incomplete, or have
    a file that cannot be read.
    """
    settings = settings or MergeSettings()
    if out.exists():
        raise RecordError(f"{str(out)!r} exists already. Shards are joined into a new folder: choose another.")
    headers = {folder: read_header(folder) for folder in shards}
    _check_headers(headers, len(shards), settings)
    with ExitStack() as stack:
        episodes_of = cache(frozen_episodes)  # all shards have the same pack
        parts = [_read(folder, settings, stack, episodes_of) for folder in shards]
        parts.sort(key=lambda part: part.shard.index)
        if not settings.partial:
            _check_finished(parts)
        header = _joined_header(out.resolve().name, parts)
        _write(out, header, parts)
    return header


def _check_headers(headers: dict[Path, RunHeader], given: int, settings: MergeSettings) -> None:
    """Raise RecordError unless the headers are those of all shards of one run or, with `partial`, of some shards."""
    seen: dict[int, Path] = {}
    for folder, header in headers.items():
        shard = header.spec.shard
        if shard is None:
            raise RecordError(f"{str(folder)!r} is a whole run, not a shard. Give folders that `--shard` made.")
        if shard.index in seen:
            raise RecordError(
                f"{str(folder)!r} and {str(seen[shard.index])!r} overlap: both are shard {shard}. Give one of them."
            )
        seen[shard.index] = folder
    _check_same(headers, settings)
    if len(headers) < given:
        raise RecordError("A shard is given twice. Give each folder once.")
    count = max(header.spec.shard.of for header in headers.values() if header.spec.shard)
    absent = [f"{index}/{count}" for index in range(1, count + 1) if index not in seen]
    if absent and not settings.partial:
        raise RecordError(
            f"Of {count} shards, {len(absent)} are missing: {_listed(absent)}. Give all, or join what there is with "
            "--partial."
        )


def _check_same(headers: dict[Path, RunHeader], settings: MergeSettings) -> None:
    facts = {folder: _identity(header, settings) for folder, header in headers.items()}
    differ: list[str] = []
    for name in sorted(set[str]().union(*facts.values())):
        values = {folder: found.get(name) for folder, found in facts.items()}
        if name in _UNKNOWN_UNTIL_PLAYED:
            values = {folder: value for folder, value in values.items() if value}
        (first, expected), *others = values.items() or [(None, None)]
        other = next(((folder, value) for folder, value in others if value != expected), None)
        if other is not None:
            differ.append(
                f"{name}: {abbreviated(expected)} in {str(first)!r}, {abbreviated(other[1])} in {str(other[0])!r}"
            )
    if differ:
        only_answers = all(each.startswith(_PLAYER_FACTS) for each in differ)
        hint = "Join them anyway with --force." if only_answers else "Only shards of one run can be joined."
        raise RecordError(f"These are shards of different runs: {_listed(differ)}. {hint}")


def _identity(header: RunHeader, settings: MergeSettings) -> dict[str, Any]:
    """Return {name: value} of the facts that must be equal for all shards of one run."""
    found = {name: value for name, value in header.spec.settings.items() if name not in _SHARD_SPECIFIC}
    found["package_version"] = header.package_version
    found["simulator_version"] = header.simulator_version
    found["answering models"] = header.answering_models
    return {name: value for name, value in found.items() if not (settings.force and name.startswith(_PLAYER_FACTS))}


def _read(
    folder: Path, settings: MergeSettings, stack: ExitStack, episodes_of: Callable[[Path, str], Iterable[Episode]]
) -> _ShardRun:
    """Read a shard, and lock its rows until `stack` is closed. Raises RecordError when a row is invalid."""
    refuse_outward_links(folder, RecordError)
    run = open_run(folder, settings.pack, episodes_of)
    path = run.table.path
    if not path.is_file():
        raise RecordError(f"{str(folder)!r} has no {EPISODES_FILE}. Play the shard first.")
    lines = stack.enter_context(AppendFile(path)).lines
    run.table.refresh()
    if run.table.partial_line_number is not None:
        raise RecordError(
            f"{str(path)!r}: line {run.table.partial_line_number} is incomplete because its run was interrupted. "
            "Repeat the shard's command, which repairs it."
        )
    if run.table.left_out:
        fault = run.table.left_out[0]
        raise RecordError(f"{str(path)!r} line {fault.line} {fault}. Remove the line, and repeat the shard's command.")
    spec = run.header.spec
    assert spec.shard is not None
    done = sum(row.outcome is not None for row in run.table.rows.values())
    planned = len(shard_episodes(run.table.episodes.values(), spec.shard)) * spec.epochs
    return _ShardRun(run, spec.shard, lines.complete, planned - done)


def _check_finished(parts: Sequence[_ShardRun]) -> None:
    unfinished = [f"{part.shard} ({part.missing}, in {str(part.run.folder)!r})" for part in parts if part.missing]
    if unfinished:
        raise RecordError(
            f"Shards with episodes that were not played or ended as errors: {_listed(unfinished)}. Repeat each shard's "
            "command, or join what there is with --partial."
        )


def _joined_header(run_id: str, parts: Sequence[_ShardRun]) -> RunHeader:
    """Return the header of the joined run: that of its first shard, with the sessions of all shards."""
    first = parts[0].run.header
    sessions: list[Resumption] = []
    rows = 0
    for part in parts:
        sessions += _sessions(part, rows)
        rows += len(part.lines)
    count = parts[0].shard.of
    is_whole = len(parts) == count and not any(part.missing for part in parts)
    ends = [part.run.header.ended for part in parts if part.run.header.ended is not None]
    return first.model_copy(
        update={
            "run_id": run_id,
            "nonce": new_nonce(),
            "spec": first.spec.model_copy(update={"shard": None}),
            "started": min(part.run.header.started for part in parts),
            "ended": max(ends) if is_whole and ends else None,
            "host": {**first.host, "pack_folder": str(parts[0].run.pack_folder.resolve())},
            "resumed": tuple(sessions[1:]),
        }
    )


def _sessions(part: _ShardRun, before: int) -> Iterator[Resumption]:
    """Yield the sessions of a shard. `before` is the number of rows of the earlier shards, which precede its rows."""
    header = part.run.header
    yield Resumption(
        started=header.started,
        rows_before=before,
        episodes=len(header.spec.episode_ids),
        commit=header.commit,
        is_dirty=header.is_dirty,
        renderer=header.renderer,
        host=header.host,
        answered=header.answered,
        agent_files=header.spec.agent_files,
    )
    for session in header.resumed:
        yield session.model_copy(update={"rows_before": before + session.rows_before})


def _write(out: Path, header: RunHeader, parts: Sequence[_ShardRun]) -> None:
    """Write the joined run to the folder `out` atomically. Raises RecordError."""
    try:
        out.absolute().parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=f".{out.name}.", dir=out.absolute().parent) as work:
            folder = Path(work) / "run"
            folder.mkdir()
            (folder / HEADER_FILE).write_bytes(header.model_dump_json(indent=1).encode() + b"\n")
            with (folder / EPISODES_FILE).open("wb") as file:
                for line in chain.from_iterable(part.lines for part in parts):
                    file.write(dump_line(header.stamp(EpisodeRecord.model_validate_json(line.data))))
            (folder / ATTEMPTS_FILE).write_bytes(b"".join(_attempt_lines(parts, header.spec.sha256)))
            tables = [read_probes(part.run.folder, part.run.header.sha256) for part in parts]
            if probes := [row for table in tables for row in table.rows.values()]:
                lines = (dump_line(row.model_copy(update={"run_sha256": header.sha256})) for row in probes)
                (folder / PROBES_FILE).write_bytes(b"".join(lines))
            for part in parts:
                _copy_files(part, folder)
            folder.rename(out)
    except OSError as error:
        raise RecordError(
            f"The shards cannot be joined into {str(out)!r}: {error.strerror or error}. The folder was not created; "
            "fix the cause and repeat the command."
        ) from error


def _attempt_lines(parts: Sequence[_ShardRun], spec_hash: str) -> list[bytes]:
    """Return the lines of all shards' attempts, sorted by time and written as attempts of the joined run."""
    found = [
        attempt.model_copy(update={"spec_sha256": spec_hash})
        for part in parts
        for attempt in read_attempts(part.run.folder / ATTEMPTS_FILE, part.run.header.spec)
    ]
    return [dump_line(attempt) for attempt in sorted(found, key=lambda attempt: attempt.started)]


def _copy_files(part: _ShardRun, folder: Path) -> None:
    """Copy saved frames (named by content), saved reasoning, and logs (into a separate folder per shard)."""
    found = read_reasoning(part.run.folder)
    if found:
        with (folder / REASONING_FILE).open("ab") as file:
            file.writelines(map(dump_line, found))
    own = f"shard-{part.shard.index}-of-{part.shard.of}"
    places = {FRAMES_FOLDER: FRAMES_FOLDER, **{name: f"{name}/{own}" for name in (LOGS_FOLDER, INSPECT_FOLDER)}}
    for name, place in places.items():
        if (part.run.folder / name).is_dir():
            shutil.copytree(part.run.folder / name, folder / place, dirs_exist_ok=True)


def _listed(texts: Sequence[str]) -> str:
    more = f" and {len(texts) - MAX_LISTED} more" if len(texts) > MAX_LISTED else ""
    return f"{', '.join(texts[:MAX_LISTED])}{more}"
