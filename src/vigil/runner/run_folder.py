"""A run's folder: `run.json` says what the run is, and the append-only `episodes.jsonl` says what has been played.

The same command continues a run, and a command with more episodes extends it. A command with other settings is refused
with a message that names the difference.
"""

import hashlib
import os
import platform
import secrets
import shutil
import subprocess
from collections.abc import Iterable, Iterator, Mapping
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any, cast

from vigil import __version__
from vigil.base.files import refuse_outward_links
from vigil.base.json_files import is_object
from vigil.base.json_lines import write_error
from vigil.errors import MAX_PART_CHARS, RecordError, shorten
from vigil.protocol.episode import Episode
from vigil.records.costs import Prices
from vigil.records.reasoning_file import store_reasoning
from vigil.records.record import (
    EPISODES_FILE,
    FRAMES_FOLDER,
    HEADER_FILE,
    EpisodeRecord,
    ProviderFacts,
    Resumption,
    RunHeader,
    RunSpec,
    read_header,
)
from vigil.records.record_file import RecordLog
from vigil.records.row_check import RowCheck, summarize_left_out
from vigil.runner.attempts import ATTEMPTS_FILE, AttemptLog
from vigil.runner.workers.messages import SimulatorFacts

LOGS_FOLDER = "logs"
"""Name of the folder with the standard error of workers."""
INSPECT_FOLDER = "inspect"
"""Name of the folder with Inspect's logs."""
CPU_FACTS, FEATURE_DIGITS = Path("/proc/cpuinfo"), 8
GIT_TIMEOUT_S = 60.0
"""Time limit of a Git command, in seconds."""
_IGNORED_DIFFERENCES = frozenset({"base_url"})
"""Fields that do not identify a run, because a model that is served from another address is the same model."""


class RunFolder:
    """A run on disk, open for writing. Use `create_or_resume`, and close it."""

    def __init__(
        self, path: Path, header: RunHeader, log: RecordLog, notes: tuple[str, ...], agent_files: dict[str, str]
    ) -> None:
        """`notes` say which rows could not be checked; `agent_files` are the hashes of this session's program files."""
        self.path = path
        self.frames = path / FRAMES_FOLDER
        self.logs = path / LOGS_FOLDER
        self.inspect_logs = path / INSPECT_FOLDER
        self.header = header
        self.log = log
        self._notes = notes
        self._is_resumed = False
        self._agent_files = agent_files
        self.attempts = AttemptLog(path / ATTEMPTS_FILE, header.spec)

    @classmethod
    def create_or_resume(
        cls,
        path: Path,
        spec: RunSpec,
        episodes: Iterable[Episode],
        input_paths: Mapping[str, str] | None = None,
        *,
        force: bool = False,
    ) -> "RunFolder":
        """Return the folder of the run `spec`: a new one, or one in which the run continues.

        `input_paths` go into the header. `force` continues a run even if the agent's program has changed. `episodes`
        are all episodes of the pack; rows that do not belong to this run do not count. A folder without recorded rows
        may be reused. Raises RecordError when the folder has another run.
        """
        rows = path / EPISODES_FILE
        refuse_outward_links(path, RecordError)
        if not (path / HEADER_FILE).exists() and rows.exists() and rows.stat().st_size:
            raise RecordError(
                f"Folder {str(path)!r} has {EPISODES_FILE} without {HEADER_FILE}, so the run that it belongs to is "
                "unknown. Restore the header, or choose another folder."
            )
        log = RecordLog(path / EPISODES_FILE)
        try:
            header = _resume(path, spec, force) if log.count else _create(path, spec, input_paths or {})
        except RecordError:
            log.close()
            raise
        check = RowCheck(header, episodes)
        log.check(check)
        return cls(path, header, log, check.notes, spec.agent_files)

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on rows that do not count, on replies from several models, and on checks that failed before the run."""
        names = self.header.answering_models
        several = f"The provider answered under several names: {', '.join(names)}." if len(names) > 1 else ""
        sessions = (self.header.answered, *(session.answered for session in self.header.resumed))
        failed = {answered.check.get("contract", "") for answered in sessions if answered} - {"", "passed"}
        checks = [f"The check before the run {one}." for one in sorted(failed)]
        return (*self._notes, *summarize_left_out(self.log.left_out), *([several] if several else []), *checks)

    def played(self) -> list[str]:
        """Return the id of the episode of each row that counts, once for each epoch."""
        return [episode_id for episode_id, _ in self.log.rows]

    def cost(self) -> float | None:
        """Return the cost of the replies; None without prices, or when no tokens are known."""
        return None if self.header.prices is None else self.header.prices.cost(self.log.tokens.total)

    def append(self, record: EpisodeRecord) -> None:
        """Write one row of this run and its saved reasoning; both are on disk when this returns.

        Raises RecordError when they cannot be written.
        """
        self.log.append(store_reasoning(self.path, self.header.stamp(record)))

    def note_facts(self, facts: SimulatorFacts) -> None:
        """Begin the session: add the backend's facts to the header.

        Raises RecordError when the run began with another version of the simulator.
        """
        recorded = self.header.simulator_version
        if recorded and recorded != facts.simulator:
            raise RecordError(
                f"Run {str(self.path)!r} was begun with simulator {recorded!r}, but the simulator is now "
                f"{facts.simulator!r}. Continue the run with the same version, or start a new run in another "
                "folder."
            )
        self._update(simulator_version=facts.simulator, ended=None, **self._session(facts.renderer))

    def _session(self, renderer: str) -> dict[str, Any]:
        """Return the header fields that describe this session's software and machine."""
        rows = self.log.count
        self._is_resumed = rows > 0
        if not rows:
            return {"renderer": renderer}
        commit, is_dirty = source_state()
        session = Resumption(
            started=datetime.now(UTC),
            rows_before=rows,
            episodes=len(self.header.spec.episode_ids),
            commit=commit,
            is_dirty=is_dirty,
            renderer=renderer,
            host=host_facts(),
            agent_files=self._agent_files,
        )
        return {"resumed": (*self.header.resumed, session)}

    def note_provider(self, answered: ProviderFacts) -> None:
        """Add facts from the provider's answers to this session's entry in the header."""
        if not self._is_resumed:
            self._update(answered=answered)
            return
        *earlier, session = self.header.resumed
        self._update(resumed=(*earlier, session.model_copy(update={"answered": answered})))

    def note_prices(self, prices: Prices) -> None:
        """Add prices to the header. The cost of the run is computed from these prices."""
        if self.header.prices != prices:
            self._update(prices=prices)

    def note_end(self) -> None:
        """Add the run's end time to the header, unless the header already has it."""
        if self.header.ended is None:
            self._update(ended=datetime.now(UTC))

    def close(self) -> None:
        """Release the folder to other processes. A new folder in which nothing was recorded or logged is removed."""
        try:
            files = (file for file in self.path.rglob("*") if file.is_file())
            others = (file for file in files if file.name not in (HEADER_FILE, EPISODES_FILE))
            is_empty = not self.log.count and not any(file.stat().st_size for file in others)
            if self.log.made_folder and is_empty:
                # Remove the folder while it is locked. Rename it first, so that no process opens it partly removed.
                gone = self.path.with_name(f"{self.path.name}.empty-{os.getpid()}")
                self.path.rename(gone)
                shutil.rmtree(gone)
        finally:
            self.log.close()

    def _update(self, **fields: Any) -> None:
        self.header = self.header.model_copy(update=fields)
        write_header(self.path, self.header)


def write_header(path: Path, header: RunHeader) -> None:
    """Write `run.json` atomically. Raises RecordError when it cannot be written."""
    partial = path / f"{HEADER_FILE}.{os.getpid()}"
    try:
        with partial.open("wb") as file:
            file.write(header.model_dump_json(indent=1).encode() + b"\n")
            file.flush()
            os.fsync(file.fileno())
        partial.replace(path / HEADER_FILE)
    except OSError as error:
        raise write_error(path / HEADER_FILE, error) from error


def new_nonce() -> str:
    """Return a random string that distinguishes a run from other runs with the same name and settings."""
    return secrets.token_hex(16)


def source_state() -> tuple[str | None, bool | None]:
    """Return the commit of VIGIL's checkout and whether it has changes; (None, None) outside of a checkout."""
    root = Path(__file__).parents[3]
    if not (root / ".git").exists():
        return None, None
    commit = _git(root, "rev-parse", "HEAD")
    status = _git(root, "status", "--porcelain", "--untracked-files=no")
    return commit, None if status is None else bool(status)


def host_facts() -> dict[str, str]:
    """Return facts about this machine that may matter when two runs are compared."""
    return {
        "platform": platform.platform(),
        "machine": platform.machine(),
        "python": platform.python_version(),
        "numpy": version("numpy"),
        "cpus": str(os.cpu_count()),
        "processor": _processor(),
    }


def _processor() -> str:
    """Return the processor's name and a hash of its features; results of numerical libraries depend on the features."""
    try:
        text = CPU_FACTS.read_text()
    except OSError:
        return platform.processor()
    facts: dict[str, str] = {}
    for line in text.partition("\n\n")[0].splitlines():
        name, _, value = line.partition(":")
        facts[name.strip()] = value.strip()
    features = " ".join(sorted((facts.get("flags") or facts.get("Features") or "").split()))
    digest = hashlib.sha256(features.encode()).hexdigest()[:FEATURE_DIGITS]
    return f"{facts.get('model name') or platform.processor()} {digest}".strip()


def _git(root: Path, *arguments: str) -> str | None:
    try:
        done = subprocess.run(
            ["git", "-C", str(root), *arguments], capture_output=True, text=True, timeout=GIT_TIMEOUT_S
        )
    except (OSError, subprocess.TimeoutExpired):
        return None
    return done.stdout.strip() if done.returncode == 0 else None


def _create(path: Path, spec: RunSpec, input_paths: Mapping[str, str]) -> RunHeader:
    commit, is_dirty = source_state()
    header = RunHeader(
        run_id=path.resolve().name,
        nonce=new_nonce(),
        spec=spec,
        package_version=__version__,
        commit=commit,
        is_dirty=is_dirty,
        started=datetime.now(UTC),
        host={**host_facts(), **input_paths},
    )
    write_header(path, header)
    return header


def _resume(path: Path, spec: RunSpec, force: bool) -> RunHeader:
    header = read_header(path)
    others = header.spec.versions.differences()
    if others:
        raise RecordError(
            f"Run {str(path)!r} was begun under other versions: {', '.join(others)}. Rows that were "
            "played under different versions cannot be compared. Continue it with the version of vigil that began "
            "it, or give another --log-dir for a new run."
        )
    header = _with_more_episodes(header, spec)
    differences = list(_differences("", header.spec.model_dump(mode="json"), spec.model_dump(mode="json")))
    if header.package_version != __version__:
        differences.append(f"package_version: {header.package_version!r} there, {__version__!r} here")
    changed = [each for each in differences if each.startswith("agent_files")]
    if differences and differences == changed:
        if force:
            return header
        raise RecordError(
            f"The program of run {str(path)!r} has changed since it was begun: {'; '.join(changed)}. Its episodes "
            "would be played by two agents: continue anyway with --force, or give another --log-dir for a new run."
        )
    if differences:
        raise RecordError(
            f"Folder {str(path)!r} holds another run: {'; '.join(differences)}. Give the same settings to continue it, "
            "or another --log-dir for a new run."
        )
    return header


def _with_more_episodes(header: RunHeader, spec: RunSpec) -> RunHeader:
    """Return the header. If `spec` has all episodes of the header and more, the returned header has the episodes of
    `spec`.

    A shard cannot be extended, because more episodes would be divided into different shards.
    """
    if header.spec.shard is None and set(header.spec.episode_ids) < set(spec.episode_ids):
        return header.model_copy(update={"spec": header.spec.model_copy(update={"episode_ids": spec.episode_ids})})
    return header


def _differences(place: str, there: Any, here: Any) -> Iterator[str]:
    """Yield a text for each value at or below `place` that differs, without the fields `_IGNORED_DIFFERENCES`."""
    if is_object(there) and is_object(here):
        for name in sorted(there.keys() | here.keys()):
            if name not in _IGNORED_DIFFERENCES:
                yield from _differences(f"{place}.{name}".lstrip("."), there.get(name), here.get(name))
    elif there != here:
        yield f"{place}: {abbreviated(there)} there, {abbreviated(here)} here"


def abbreviated(value: Any) -> str:
    """Return the text of a value for a message; for a long list or tuple, only the number of its items."""
    items: list[Any] = list(cast("list[Any]", value)) if isinstance(value, list | tuple) else []
    return f"{len(items)} of them" if len(items) > 3 else shorten(repr(cast("object", value)), MAX_PART_CHARS)
