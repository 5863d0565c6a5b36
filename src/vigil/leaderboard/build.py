"""Building: checks every bundle, compares the entries, and writes a static site that any web server can host."""

import shutil
import tempfile
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path

from vigil.base.files import file_sha256, read_file
from vigil.base.json_files import is_array, is_object, read_json
from vigil.errors import InputError, PackMismatch, RecordError, SettingError, SimulatorError, shorten
from vigil.leaderboard.bundle import MAX_ZIP_BYTES, unpack_bundle
from vigil.leaderboard.cache import Cache, Cached
from vigil.leaderboard.checking import CheckedEntry, check_claims, check_run, known_packs
from vigil.leaderboard.decisions import Decision, read_decisions
from vigil.leaderboard.pages import DATA, Content, LogLine, write_play_pages, write_site
from vigil.leaderboard.settings import BuildSettings
from vigil.leaderboard.signs import copied_plays, signs_between
from vigil.web.drawing import RenderService

OnBundle = Callable[[Path, int, int], None]
MAX_NAME_CHARS = 80
_UNREADABLE = (ArithmeticError, LookupError, TypeError, ValueError, RuntimeError)
"""Errors that odd values in records could cause in any measure. The bundle is then refused, and the build goes on."""


@dataclass
class Builder:
    """The state of one build."""

    settings: BuildSettings
    cache: Cache
    packs: Mapping[str, Path]
    decisions: Mapping[str, Decision]
    entries: list[CheckedEntry] = field(default_factory=list[CheckedEntry])
    pages: dict[str, Path] = field(default_factory=dict[str, Path])
    """Id of an entry -> folder of its plays' pages."""
    log: list[LogLine] = field(default_factory=list[LogLine])
    checked: int = 0
    """Number of bundles that this build checked itself, because they were not in the cache."""

    def add(self, path: Path, on_play: Callable[[int, int], None]) -> None:
        """Check a bundle. Add its entry, or a line to the log that says why there is no entry."""
        name = shorten(ascii(path.name)[1:-1], MAX_NAME_CHARS)
        try:
            sha256 = file_sha256(path, f"Bundle {str(path)!r}", RecordError)
            found = self.cache.find(sha256) or self._checked(path, sha256, on_play)
        except (InputError, SimulatorError) as fault:
            self.log.append(LogLine(name, "", "refused by the check", str(fault)))
            return
        if found.entry is None:
            self.log.append(LogLine(name, "", "refused by the check", found.refusal))
            return
        entry = found.entry.model_copy(update={"bundle_sha256": sha256})
        decision = self.decisions.get(entry.id)
        if (why := self._is_other_bundle(entry, decision)) is not None:
            self.log.append(LogLine(name, entry.id, "refused by the check", why))
            return
        if decision is not None:
            by = f"{decision.why} ({decision.by}, {decision.date})"
            self.log.append(LogLine(name, entry.id, decision.status, by))
            if decision.status != "accepted":
                return
        else:
            self.log.append(LogLine(name, entry.id, "not decided yet", "It holds; the maintainers have not decided."))
        tier = entry.tier if decision is None or decision.tier is None else decision.tier
        self.entries.append(entry.model_copy(update={"tier": tier}))
        if found.pages is not None:
            self.pages[entry.id] = found.pages

    def _is_other_bundle(self, entry: CheckedEntry, decision: Decision | None) -> str | None:
        """Return why a bundle is refused: the maintainers chose another bundle, or it copies an earlier one; None if
        neither."""
        if decision is not None and decision.bundle is not None and decision.bundle != entry.bundle_sha256:
            return f"the maintainers name another bundle of this run: {decision.bundle[:12]}..."
        for other in self.entries:
            copied = copied_plays(entry, other)
            if other.id == entry.id or 2 * copied >= len(entry.plays):
                return (
                    f"{copied} of its {len(entry.plays)} plays are those of entry {other.id} "
                    f"({other.metadata.model_name}), times included: it is a copy of that entry"
                )
        return None

    def _checked(self, path: Path, sha256: str, on_play: Callable[[int, int], None]) -> Cached:
        self.checked += 1
        with self.cache.work_folder() as work:
            run = Path(work) / "run"
            run.mkdir()
            try:
                claimed = unpack_bundle(path, run)
                entry, measures = check_run(run, claimed.metadata, self.packs, self.settings, on_play)
                check_claims(claimed, measures)
            except PackMismatch:
                raise  # it may be known to the next build
            except _UNREADABLE as fault:
                raise RecordError(
                    f"the check of the bundle failed with an error: {type(fault).__name__}: "
                    f"{ascii(str(fault))[:MAX_NAME_CHARS]}"
                ) from None
            except RecordError as fault:
                return self.cache.store(
                    sha256, RecordError(str(fault).replace(f"{run}/", "").replace(str(run), "the run"))
                )
            pages = Path(work) / "pages"
            pages.mkdir()
            if self.settings.shown_plays and not entry.is_private:
                with closing(RenderService()) as drawing:
                    place = self.packs[entry.header.spec.pack_sha256]
                    write_play_pages(run, place, entry, pages, drawing, self.settings.shown_plays)
            return self.cache.store(sha256, entry, pages)


def build_site(
    bundles: Sequence[Path],
    out: Path,
    settings: BuildSettings,
    on_bundle: OnBundle = lambda _path, _done, _total: None,
) -> Builder:
    """Check bundles, in the order in which they arrived, write their site to `out`, and return the state of the build.

    `on_bundle` is called with a bundle, how many of its plays were played again so far, and how many plays it has.
    Raises SettingError or PackMismatch.
    """
    if out.exists() and (not out.is_dir() or (any(out.iterdir()) and not (out / DATA).exists())):
        raise SettingError(f"{str(out)!r} exists, but is not the site of a leaderboard. Give another --out.")
    cache = Cache(
        settings.cache or out.with_name(f"{out.name}-cache"),
        settings.frames,
        settings.shown_plays,
        settings.asset_database,
    )
    builder = Builder(settings, cache, known_packs(settings.packs), read_decisions(settings.decisions))
    earlier = _earlier_rows(settings.earlier)
    for path in bundles:
        builder.add(path, lambda done, total, path=path: on_bundle(path, done, total))
    unused = builder.decisions.keys() - {line.entry for line in builder.log}
    builder.log += [
        LogLine("", name, builder.decisions[name].status, f"{builder.decisions[name].why} (its bundle was not given)")
        for name in sorted(unused)
    ]
    content = Content(builder.entries, builder.log, signs_between(builder.entries), builder.pages, earlier)
    out.absolute().parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=out.absolute().parent, prefix=f"{out.name}-new-") as work:
        new = Path(work) / "site"
        write_site(content, new)
        if out.exists():
            out.rename(Path(work) / "old")
        shutil.move(new, out)
    return builder


def _earlier_rows(path: Path | None) -> list[dict[str, str]]:
    if path is None:
        return []
    try:
        found = read_json(read_file(path, f"--earlier {str(path)!r}", SettingError, MAX_ZIP_BYTES))
        rows = found["history"] if is_object(found) else None
        if not is_array(rows) or not all(set(row) == {"model_name", "profile", "pack", "result"} for row in rows):
            raise ValueError("`history` is missing or is not a list of results")
    except (ValueError, KeyError, TypeError) as error:
        raise SettingError(f"--earlier {str(path)!r} is not the entries.json of a site: {error}.") from None
    return [{name: str(value) for name, value in row.items()} for row in rows]
