"""Checks of bundles, several at a time: a house of a pack is then loaded once for all runs that were played in it.

The results are stored in a cache, so that a build checks only the bundles that are new to it.
"""

import hashlib
import json
import shutil
import tempfile
from collections.abc import Generator, Mapping, Sequence
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from vigil import __version__
from vigil.base.files import file_sha256
from vigil.base.json_files import read_json
from vigil.base.versions import Versions
from vigil.errors import InputError, RecordError, SimulatorError
from vigil.runner.run_folder import host_facts
from vigil.runner.verify_run import SAME_HOST, OnProgress, Verification
from vigil.web.drawing import RenderService
from vigil.web.leaderboard.bundle import Entry, unpack_bundle
from vigil.web.leaderboard.checking import CandidateRun, CheckedEntry, check_claims, verify_candidates
from vigil.web.leaderboard.pages import write_play_pages
from vigil.web.leaderboard.settings import BuildSettings

CACHE_VERSION = 3
"""Version of the check and its result. Results of another version are not used."""
MAX_TOGETHER = 10
"""Maximum number of bundles that are unpacked and checked together. If a build is interrupted, only their results are
lost."""
MAX_FAULT_CHARS = 80
_ENTRY, _PLAYS, _REFUSAL, _PAGES = "entry.json", "plays.parquet", "refusal.txt", "pages"
_UNREADABLE = (ArithmeticError, LookupError, TypeError, ValueError, RuntimeError)
"""Errors that odd values in records could cause in any measure. The bundle is then refused, and the build goes on."""


@dataclass(frozen=True)
class Cached:
    """The result of one bundle's check: an entry with the pages of some plays, or the reason for a refusal."""

    entry: CheckedEntry | None
    refusal: str = ""
    pages: Path | None = None
    """Folder of the pages of plays; None if the bundle was refused."""


class _Cache:
    """A folder with one folder for each checked bundle."""

    def __init__(self, folder: Path, settings: BuildSettings) -> None:
        here, facts = host_facts(), (settings.frames, settings.shown_plays, settings.asset_database)
        versions = {**Versions.current().model_dump(), **{name: here[name] for name in SAME_HOST}}
        self._facts = repr((CACHE_VERSION, __version__, sorted(versions.items()), facts))
        """Everything besides the bundle on which the result of a check depends."""
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)

    def find(self, bundle_sha256: str) -> Cached | None:
        """Return the result of a bundle's check; None if this version of the check has not checked the bundle."""
        place = self._place(bundle_sha256)
        if not place.is_dir():
            return None
        if (place / _REFUSAL).exists():
            return Cached(None, (place / _REFUSAL).read_text(encoding="utf-8"))
        fields = read_json((place / _ENTRY).read_bytes())
        plays = pd.read_parquet(place / _PLAYS)
        entry = CheckedEntry.model_validate({**fields, "plays": plays, "bundle_sha256": bundle_sha256})
        return Cached(entry, "", place / _PAGES)

    def store(self, bundle_sha256: str, result: CheckedEntry | str, pages: Path | None = None) -> None:
        """Store an entry, or why the bundle is refused; `pages` are moved into the cache."""
        with tempfile.TemporaryDirectory(dir=self.folder, prefix="new-") as name:
            new = Path(name) / "result"
            new.mkdir()
            if isinstance(result, str):
                (new / _REFUSAL).write_text(result, encoding="utf-8")
            else:
                (new / _ENTRY).write_text(json.dumps(result.model_dump(mode="json")), encoding="utf-8")
                result.plays.to_parquet(new / _PLAYS, index=False)
            if pages is not None:
                shutil.move(pages, new / _PAGES)
            place = self._place(bundle_sha256)
            shutil.rmtree(place, ignore_errors=True)
            new.rename(place)

    def _place(self, bundle_sha256: str) -> Path:
        return self.folder / hashlib.sha256(f"{bundle_sha256}\n{self._facts}".encode()).hexdigest()


@dataclass(frozen=True, slots=True)
class _Opened:
    """An unpacked bundle whose run passed the checks that do not need a simulator."""

    sha256: str
    work: Path
    claimed: Entry
    candidate: CandidateRun


class BundleChecks:
    """Checks bundles whose results are not in the cache yet."""

    def __init__(self, cache: Path, packs: Mapping[str, Path], settings: BuildSettings) -> None:
        """Open the cache in the folder `cache`; `packs` are the known packs."""
        self._cache, self._packs, self._settings = _Cache(cache, settings), packs, settings
        self._faults: dict[str, InputError | SimulatorError] = {}
        """SHA-256 of a bundle -> why it could not be checked. The next build tries again."""
        self.count = 0
        """Number of bundles that were checked."""

    def check(self, bundles: Sequence[Path], on_progress: OnProgress) -> list[Cached]:
        """Return the results of bundles; those that are not in the cache are checked.

        `on_progress` is called with two numbers: how many plays have been played again, and how many there are in all.
        For each group of bundles that are checked together, both numbers count only the plays of this group.
        """
        hashes = [self._hash_of(path) for path in bundles]
        new = {
            sha256: path
            for sha256, path in zip(hashes, bundles, strict=True)
            if sha256 not in self._faults and self._cache.find(sha256) is None
        }
        self.count += len(new)
        waiting = list(new.items())
        with closing(RenderService()) as drawing:
            for start in range(0, len(waiting), MAX_TOGETHER):
                with ExitStack() as stack:
                    opened: list[_Opened] = []
                    for sha256, path in waiting[start : start + MAX_TOGETHER]:
                        folder = tempfile.TemporaryDirectory(dir=self._cache.folder, prefix="unpacked-")
                        work = Path(stack.enter_context(folder))
                        with self._storing_refusal(sha256, work):
                            opened.append(self._open(sha256, path, work))
                    self._check(opened, drawing, on_progress)
        return [self._cache.find(sha256) or Cached(None, str(self._faults[sha256])) for sha256 in hashes]

    def _hash_of(self, path: Path) -> str:
        """Return the SHA-256 of a bundle; its path if it cannot be read."""
        try:
            return file_sha256(path, f"Bundle {str(path)!r}", RecordError)
        except RecordError as fault:
            self._faults[str(path)] = fault
            return str(path)

    def _open(self, sha256: str, path: Path, work: Path) -> _Opened:
        run = work / "run"
        run.mkdir()
        claimed = unpack_bundle(path, run)
        return _Opened(sha256, work, claimed, CandidateRun.read(run, claimed.metadata, self._packs))

    def _check(self, opened: Sequence[_Opened], drawing: RenderService, on_progress: OnProgress) -> None:
        groups: dict[tuple[object, ...], list[_Opened]] = {}
        for each in opened:
            groups.setdefault(each.candidate.checked_with, []).append(each)
        for group in groups.values():
            found: Sequence[Verification | Exception]
            try:
                found = verify_candidates([each.candidate for each in group], self._settings, on_progress)
            except (InputError, SimulatorError) as fault:
                found = [fault] * len(group)
            for each, verification in zip(group, found, strict=True):
                with self._storing_refusal(each.sha256, each.work):
                    self._conclude(each, verification, drawing)

    def _conclude(self, opened: _Opened, found: Verification | Exception, drawing: RenderService) -> None:
        entry, measures = opened.candidate.conclude(found)
        check_claims(opened.claimed, measures)
        pages = opened.work / "pages"
        pages.mkdir()
        if self._settings.shown_plays and not entry.is_private:
            place, run = opened.candidate.pack.folder, opened.candidate.run.folder
            write_play_pages(run, place, entry, pages, drawing, self._settings.shown_plays)
        self._cache.store(opened.sha256, entry, pages)

    @contextmanager
    def _storing_refusal(self, sha256: str, work: Path) -> Generator[None, None, None]:
        """If the `with` block raises an error that refuses a bundle, store the reason."""
        try:
            yield
        except RecordError as fault:
            self._cache.store(sha256, str(fault).replace(f"{work / 'run'}/", "").replace(str(work / "run"), "the run"))
        except (InputError, SimulatorError) as fault:
            self._faults[sha256] = fault  # the next build may know the pack
        except _UNREADABLE as fault:
            said = f"{type(fault).__name__}: {ascii(str(fault))[:MAX_FAULT_CHARS]}"
            self._cache.store(sha256, f"the check of the bundle failed with an error: {said}")
