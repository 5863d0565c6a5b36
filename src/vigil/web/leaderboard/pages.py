"""Pages of the site: the boards, a page for each entry, pages of plays, and the data as CSV, JSON and Parquet."""

import json
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pandas as pd
from jinja2 import FileSystemLoader
from markupsafe import Markup

from vigil.analysis.tables.text import csv_text
from vigil.base.glossary import RESULTS
from vigil.errors import RecordError
from vigil.web import site
from vigil.web.drawing import RenderService
from vigil.web.export import Links, embedded, episode_page, page_name
from vigil.web.leaderboard.boards import Board, Ranked, boards_of, history_of, history_row
from vigil.web.leaderboard.checking import CheckedEntry
from vigil.web.leaderboard.measures import COLUMNS
from vigil.web.library import Library

DATA = "entries.json"
SCHEMA = 1
ENTRIES = "entries"
_HERE = Path(__file__).parent / "templates"
_TEMPLATES = site.template_environment()
_TEMPLATES.filters["tier"] = lambda tier: tier.replace("re_", "re-").replace("self_", "self-").replace("_", " ")
_TEMPLATES.loader = FileSystemLoader([_HERE, site.HERE / "templates"])
PLOT_WIDTH, PLOT_HEIGHT, PLOT_MARGIN, LABEL_HEIGHT = 640.0, 420.0, 44.0, 18.0
MOST_LABELS = 16
"""Maximum number of entries for which a plot shows names."""


@dataclass(frozen=True, slots=True)
class LogLine:
    """A line of the site's log: how the check of one bundle ended."""

    bundle: str
    """Name of the bundle's file."""
    entry: str
    """Id of the bundle's entry; empty if the bundle was refused."""
    status: str
    why: str


@dataclass(frozen=True)
class SiteContent:
    """Everything that a site shows."""

    entries: Sequence[CheckedEntry]
    log: Sequence[LogLine]
    signs: Mapping[str, Sequence[str]]
    """Id of an entry -> its signs that follow from a comparison with other entries."""
    pages: Mapping[str, Path]
    """Id of an entry -> folder of its plays' pages."""
    earlier: Sequence[dict[str, str]] = ()

    def signs_of(self, entry: CheckedEntry) -> list[str]:
        """Return all signs of an entry: its own, and those from comparisons."""
        return [*entry.signs, *self.signs.get(entry.id, ())]


@dataclass(frozen=True, slots=True)
class PlotPoint:
    """An entry in the plot of W against B, in the plot's units."""

    entry: CheckedEntry
    x: float
    y: float
    x_ends: tuple[float, float]
    y_ends: tuple[float, float]
    label_y: float
    """Height at which the entry's name is written, so that names do not overlap."""


def write_play_pages(run: Path, pack: Path, entry: CheckedEntry, out: Path, drawing: RenderService, count: int) -> None:
    """Write pages of `count` plays: in each family, first one that was not closed truthfully, then one that was."""
    found = Library([run], [pack]).runs()[0]
    if found.table is None:
        raise RecordError(f"the plays of the bundle cannot be shown: {found.fault}")
    plays = entry.plays.assign(turn=entry.plays.groupby(["family", "closed"]).cumcount())
    chosen = plays.sort_values(["turn", "closed", "family", "episode_id", "epoch"]).head(count)
    for name, epoch in sorted(zip(chosen["episode_id"], chosen["epoch"], strict=True)):
        key = (str(name), int(epoch))
        text = episode_page(found, key, drawing, Links(f"../{entry.id}.html"))
        (out / page_name(*key)).write_text(text, encoding="utf-8")


def write_site(content: SiteContent, out: Path) -> None:
    """Write the site into a new folder."""
    (out / ENTRIES).mkdir(parents=True)
    boards = boards_of(content.entries)
    ranks = {each.entry.id: (board, each) for board in boards for each in board.entries}
    packs: dict[tuple[str, str], list[Board]] = {}
    for board in boards:
        packs.setdefault((board.pack, board.pack_sha256), []).append(board)
    shown = [(name, of_pack, _points(of_pack)) for (name, _), of_pack in packs.items()]
    history = history_of(content.entries, content.earlier)
    page = {**embedded((_HERE / "leaderboard.js").read_text(encoding="utf-8")), "columns_of": COLUMNS}
    page["style"] += Markup((_HERE / "leaderboard.css").read_text(encoding="utf-8"))
    page |= {"most_labels": MOST_LABELS, "content": content, "parts": _parts, "cell": _cell}
    index = _TEMPLATES.get_template("leaderboard.html")
    text = index.render(title="Leaderboard", packs=shown, history=history, filters=_filters(content.entries), **page)
    (out / "index.html").write_text(text, encoding="utf-8")
    for name, (board, ranked) in ranks.items():
        pages = content.pages.get(name)
        names = sorted(path.name for path in pages.iterdir()) if pages is not None else []
        if pages is not None and names:
            shutil.copytree(pages, out / ENTRIES / name)
        text = _TEMPLATES.get_template("entry.html").render(
            title=ranked.entry.metadata.model_name, board=board, ranked=ranked, entry=ranked.entry, plays=names, **page
        )
        (out / ENTRIES / f"{name}.html").write_text(text, encoding="utf-8")
    glossary = _TEMPLATES.get_template("glossary_alone.html").render(
        title="Glossary", run=SimpleNamespace(name="Leaderboard"), glossary=RESULTS, **page
    )
    (out / "glossary.html").write_text(glossary, encoding="utf-8")
    _write_data(content, ranks, out)


def _write_data(content: SiteContent, ranks: Mapping[str, tuple[Board, Ranked]], out: Path) -> None:
    rows = [_data_of(content, *each) for each in ranks.values()]
    log = [asdict(line) for line in content.log]
    history = [*(history_row(entry) for entry in content.entries), *content.earlier]
    document = {"schema_version": SCHEMA, "entries": rows, "log": log, "history": history}
    (out / DATA).write_text(
        json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False) + "\n", encoding="utf-8"
    )
    columns = ("id", "rank", "pack", "profile", "tier", "division", "agent", "agent_kind", "thinking", "plays", "cost")
    table = [
        {
            "model_name": row["metadata"]["model_name"],
            **{name: row[name] for name in columns},
            **{
                f"{name}{part}": value
                for name, figure in row["figures"].items()
                for part, value in zip(("", ".low", ".high"), figure, strict=True)
            },
        }
        for row in rows
    ]
    (out / "entries.csv").write_text(csv_text(pd.DataFrame(table)), encoding="utf-8")
    public = [entry for entry in content.entries if not entry.is_private]
    if public:
        hidden = ["replies_sha256", "play_sha256", "actions_sha256"]
        plays = pd.concat([entry.plays.drop(columns=hidden).assign(entry=entry.id) for entry in public])
        plays.to_parquet(out / "plays.parquet", index=False)


def _data_of(content: SiteContent, board: Board, ranked: Ranked) -> dict[str, Any]:
    """Return what the site's data say about an entry."""
    entry, header = ranked.entry, ranked.entry.header
    tokens = {"input": entry.tokens.input, "output": entry.tokens.output, "unknown": entry.tokens.unreported}
    return {
        "id": entry.id,
        "rank": ranked.rank,
        "to_next": None if ranked.to_next is None else ranked.to_next.sentence,
        **{name: getattr(board, name) for name in ("pack", "pack_sha256", "profile", "tier", "division")},
        "agent": header.spec.agent,
        "agent_kind": header.spec.agent_kind,
        "answered_as": header.answering_models,
        "prompt_sha256": header.spec.prompt_policy_sha256,
        "versions": header.spec.versions.model_dump(),
        "vigil": header.package_version,
        "plays": len(entry.plays),
        "attempts": int(sum(entry.plays["attempt"])),
        "thinking": entry.thinking,
        "tokens": tokens,
        "cost": entry.cost,
        "regimes": entry.regimes,
        "signs": content.signs_of(entry),
        "checked": entry.checked,
        "bundle_sha256": entry.bundle_sha256,
        "metadata": entry.metadata.model_dump(mode="json"),
        "figures": entry.figures,
    }


def _parts(board: Board, kind: str) -> list[str]:
    """Return the names of the parts (`kind` is `family`, `level`, `kind` or `pass`) for which a board has figures."""
    found = dict.fromkeys(name.rpartition(".")[0] for each in board.entries for name in each.entry.figures)
    return [name for name in found if name.startswith(kind)]


def _cell(entry: CheckedEntry, name: str) -> dict[str, Any] | None:
    """Return a figure in the form that the template's macro `rate` takes; None if the figure has no value."""
    value, low, high = entry.figures.get(name, (None, None, None))
    if value is None:
        return None
    return {name: value, "intervals": {name: (value if low is None else low, value if high is None else high)}}


def _points(boards: Sequence[Board]) -> list[PlotPoint]:
    """Return a pack's entries as points of the plot of W against B; empty for a suite without W or B."""
    entries = [each.entry for board in boards for each in board.entries]
    with_both = [
        entry for entry in entries if None not in (*entry.figures.get("W", [None]), *entry.figures.get("B", [None]))
    ]
    points: list[PlotPoint] = []
    label_y = PLOT_HEIGHT
    for entry in sorted(with_both, key=lambda each: (each.figures["B"][0], each.id)):
        (x, *x_ends), (y, *y_ends) = ([float(end or 0.0) for end in entry.figures[name]] for name in "WB")
        label_y = min(_y(y) - 7, label_y - LABEL_HEIGHT)
        ends = (_x(x_ends[0]), _x(x_ends[1])), (_y(y_ends[0]), _y(y_ends[1]))
        points.append(PlotPoint(entry, _x(x), _y(y), *ends, label_y))
    return points


def _x(share: float) -> float:
    return PLOT_MARGIN + share * (PLOT_WIDTH - 1.5 * PLOT_MARGIN)


def _y(share: float) -> float:
    return PLOT_HEIGHT - PLOT_MARGIN - share * (PLOT_HEIGHT - 1.5 * PLOT_MARGIN)


def _filters(entries: Sequence[CheckedEntry]) -> dict[str, list[str]]:
    """Return {name of a filter: its values}. A filter with only one value is left out."""
    names = ("thinking", "profile", "tier", "division")
    found = {"weights": sorted({entry.metadata.weights for entry in entries})}
    found |= {name: sorted({getattr(entry, name) for entry in entries}) for name in names}
    return {name: values for name, values in found.items() if len(values) > 1}
