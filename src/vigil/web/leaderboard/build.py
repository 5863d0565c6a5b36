"""Building: checks every bundle, compares the entries, and writes a static site that any web server can host."""

import os
import shutil
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from vigil.base.files import read_file
from vigil.base.json_files import is_array, is_object, read_json
from vigil.errors import SettingError, shorten
from vigil.runner.verify_run import OnProgress
from vigil.web.leaderboard.bundle import MAX_ZIP_BYTES
from vigil.web.leaderboard.bundle_checks import BundleChecks
from vigil.web.leaderboard.cache import Cache, Cached
from vigil.web.leaderboard.checking import CheckedEntry, known_packs
from vigil.web.leaderboard.comparisons import copied_plays, signs_between
from vigil.web.leaderboard.decisions import EntryDecision, read_decisions
from vigil.web.leaderboard.pages import DATA, LogLine, SiteContent, write_site
from vigil.web.leaderboard.settings import BuildSettings

MAX_NAME_CHARS = 80


@dataclass
class SiteBuild:
    """One build of a site: the maintainers' decisions, and the entries and the log so far."""

    decisions: Mapping[str, EntryDecision]
    entries: list[CheckedEntry] = field(default_factory=list[CheckedEntry])
    pages: dict[str, Path] = field(default_factory=dict[str, Path])
    """Id of an entry -> folder of its plays' pages."""
    log: list[LogLine] = field(default_factory=list[LogLine])
    checked: int = 0
    """Number of bundles that this build checked itself, because they were not in the cache."""

    def add(self, name: str, found: Cached) -> None:
        """Add the entry of a checked bundle, or a line to the log that says why there is no entry."""
        if found.entry is None:
            self.log.append(LogLine(name, "", "refused by the check", found.refusal))
            return
        entry = found.entry
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
            self.log.append(
                LogLine(name, entry.id, "not decided yet", "It passed the check; the maintainers have not decided.")
            )
        tier = entry.tier if decision is None or decision.tier is None else decision.tier
        self.entries.append(entry.model_copy(update={"tier": tier}))
        if found.pages is not None:
            self.pages[entry.id] = found.pages

    def _is_other_bundle(self, entry: CheckedEntry, decision: EntryDecision | None) -> str | None:
        """Return why a bundle is refused (the maintainers chose another bundle, or it copies an earlier one), else
        None."""
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


def build_site(
    bundles: Sequence[Path],
    out: Path,
    settings: BuildSettings,
    on_progress: OnProgress = lambda _done, _total: None,
) -> SiteBuild:
    """Check bundles, in the order in which they arrived, write their site to `out`, and return the state of the build.

    `on_progress` is that of `BundleChecks.check`. Raises SettingError or PackMismatch.
    """
    for bundle in bundles:
        if not bundle.exists():
            raise SettingError(f"Bundle {str(bundle)!r} does not exist. Give the path of a bundle of `vigil submit`.")
    out = Path(os.path.realpath(out))  # a link stays, and its folder gets the site
    if os.path.lexists(out) and (not out.is_dir() or (any(out.iterdir()) and not (out / DATA).exists())):
        raise SettingError(f"{str(out)!r} exists, but is not the site of a leaderboard. Give another --out.")
    cache = Cache(
        settings.cache or out.with_name(f"{out.name}-cache"),
        settings.frames,
        settings.shown_plays,
        settings.asset_database,
    )
    checks = BundleChecks(cache, known_packs(settings.packs), settings)
    builder = SiteBuild(read_decisions(settings.decisions))
    earlier = _earlier_rows(settings.earlier)
    for path, found in zip(bundles, checks.check(bundles, on_progress), strict=True):
        builder.add(shorten(ascii(path.name)[1:-1], MAX_NAME_CHARS), found)
    builder.checked = checks.count
    unused = builder.decisions.keys() - {line.entry for line in builder.log}
    builder.log += [
        LogLine("", name, builder.decisions[name].status, f"{builder.decisions[name].why} (its bundle was not given)")
        for name in sorted(unused)
    ]
    content = SiteContent(builder.entries, builder.log, signs_between(builder.entries), builder.pages, earlier)
    out.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=out.parent, prefix=f"{out.name}-new-") as work:
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
