"""Checks of bundles, several at a time: a house of a pack is then loaded once for all runs that were played in it."""

from collections.abc import Generator, Mapping, Sequence
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass
from pathlib import Path

from vigil.base.files import file_sha256
from vigil.errors import InputError, RecordError, SimulatorError
from vigil.runner.verify_run import OnProgress, Verification
from vigil.web.drawing import RenderService
from vigil.web.leaderboard.bundle import Entry, unpack_bundle
from vigil.web.leaderboard.cache import Cache, Cached
from vigil.web.leaderboard.checking import CandidateRun, check_claims, verify_candidates
from vigil.web.leaderboard.pages import write_play_pages
from vigil.web.leaderboard.settings import BuildSettings

MAX_TOGETHER = 10
"""Maximum number of bundles that are unpacked and checked together. If a build is interrupted, only their results are
lost."""
MAX_FAULT_CHARS = 80
_UNREADABLE = (ArithmeticError, LookupError, TypeError, ValueError, RuntimeError)
"""Errors that odd values in records could cause in any measure. The bundle is then refused, and the build goes on."""


@dataclass(frozen=True, slots=True)
class _Opened:
    """An unpacked bundle whose run passed the checks that do not need a simulator."""

    sha256: str
    work: Path
    claimed: Entry
    candidate: CandidateRun


class BundleChecks:
    """Checks bundles that are not in the cache, and stores the results there."""

    def __init__(self, cache: Cache, packs: Mapping[str, Path], settings: BuildSettings) -> None:
        self._cache, self._packs, self._settings = cache, packs, settings
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
        new = {sha256: path for sha256, path in zip(hashes, bundles, strict=True) if self._is_new(sha256)}
        self.count += len(new)
        with closing(RenderService()) as drawing:
            waiting = list(new.items())
            while waiting:
                together, waiting = waiting[:MAX_TOGETHER], waiting[MAX_TOGETHER:]
                with ExitStack() as stack:
                    opened: list[_Opened] = []
                    for sha256, path in together:
                        work = Path(stack.enter_context(self._cache.work_folder()))
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

    def _is_new(self, sha256: str) -> bool:
        return sha256 not in self._faults and self._cache.find(sha256) is None

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
            for each, found in zip(group, self._verified(group, on_progress), strict=True):
                with self._storing_refusal(each.sha256, each.work):
                    self._conclude(each, found, drawing)

    def _verified(self, group: Sequence[_Opened], on_progress: OnProgress) -> Sequence[Verification | Exception]:
        try:
            return verify_candidates([each.candidate for each in group], self._settings, on_progress)
        except (InputError, SimulatorError) as fault:
            return [fault] * len(group)

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
            said = str(fault).replace(f"{work / 'run'}/", "").replace(str(work / "run"), "the run")
            self._cache.store(sha256, RecordError(said))
        except (InputError, SimulatorError) as fault:
            self._faults[sha256] = fault  # the next build may know the pack
        except _UNREADABLE as fault:
            said = f"{type(fault).__name__}: {ascii(str(fault))[:MAX_FAULT_CHARS]}"
            self._cache.store(sha256, RecordError(f"the check of the bundle failed with an error: {said}"))
