"""Building: checks every bundle, compares the entries, and writes a static site that any web server can host."""

import os
import shutil
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, StringConstraints, ValidationError

from vigil.base.files import read_file
from vigil.base.json_files import is_array, is_object, read_json
from vigil.errors import SettingError, shorten
from vigil.runner.verify_run import OnProgress
from vigil.studies.yaml_text import read_yaml
from vigil.web.leaderboard.boards import copied_plays, signs_between
from vigil.web.leaderboard.bundle import MAX_ZIP_BYTES
from vigil.web.leaderboard.bundle_checks import BundleChecks, Cached
from vigil.web.leaderboard.checking import CheckedEntry, known_packs
from vigil.web.leaderboard.metadata import Line, Tier, reason
from vigil.web.leaderboard.pages import DATA, LogLine, SiteContent, write_site
from vigil.web.leaderboard.settings import BuildSettings

MAX_NAME_CHARS = 80


class EntryDecision(BaseModel):
    """A decision about the entry of one run."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    run: Annotated[str, StringConstraints(pattern=r"^[0-9a-f]{12}$")] = Field(description="id of the entry")
    status: Literal["accepted", "refused", "withdrawn"]
    why: Annotated[str, StringConstraints(min_length=1, max_length=1000)]
    by: Line
    date: date
    tier: Tier | None = None
    """Tier that the maintainers vouch for; None to use the tier that the check proves."""
    bundle: Annotated[str, StringConstraints(pattern=r"^[0-9a-f]{64}$")] | None = None
    """SHA-256 of the bundle that the decision accepts, if several bundles contain the same run."""


class _Decisions(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)

    decisions: tuple[EntryDecision, ...]


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
        status, why, tier = "not decided yet", "It passed the check; the maintainers have not decided.", entry.tier
        if (refusal := self._is_other_bundle(entry, decision)) is not None:
            status, why = "refused by the check", refusal
        elif decision is not None:
            status, why = decision.status, f"{decision.why} ({decision.by}, {decision.date})"
            tier = decision.tier or tier
        self.log.append(LogLine(name, entry.id, status, why))
        if status not in ("accepted", "not decided yet"):
            return
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
    checks = BundleChecks(settings.cache or out.with_name(f"{out.name}-cache"), known_packs(settings.packs), settings)
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


def read_decisions(path: Path | None) -> dict[str, EntryDecision]:
    """Return {id of an entry: decision}. Raises SettingError that names the line of an invalid decision."""
    if path is None:
        return {}
    if not path.is_file():
        raise SettingError(
            f"--decisions {str(path)!r} does not exist. Give an existing file; docs/leaderboard.md shows an example."
        )
    text = read_yaml(path, is_text=True)
    try:
        found = _Decisions.model_validate(text.value).decisions
    except ValidationError as error:
        raise text.error(tuple(error.errors()[0]["loc"]), f"{reason(error)}.") from None
    for index, decision in enumerate(found):
        if decision.run in {other.run for other in found[:index]}:
            raise text.error(("decisions", index), f"there are two decisions about {decision.run}. Remove one of them.")
    return {decision.run: decision for decision in found}
