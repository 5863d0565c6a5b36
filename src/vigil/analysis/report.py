"""Report: the runs of a study as HTML, Markdown, LaTeX, JSON and CSV.

All formats have the same order: problems of the data, how to read the report, the figures, the tables.
"""

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, TypeVar, get_args

import pandas as pd
from matplotlib.figure import Figure

from vigil.analysis.measures.chores import ChoresRun
from vigil.analysis.measures.closure import ClosureRun, SuiteRun
from vigil.analysis.measures.diagnosis import causes_of_closure, causes_of_rows
from vigil.analysis.measures.paper import NOTE
from vigil.analysis.measures.rows import combined_rows
from vigil.analysis.measures.study import Study, sorted_by_b
from vigil.analysis.plots.belief_figures import BELIEF_FIGURES
from vigil.analysis.plots.chores_figures import CHORES_FIGURES
from vigil.analysis.plots.figures import CAPTIONS, FIGURES, figure_captions
from vigil.analysis.plots.style import figure_bytes, on_paper
from vigil.analysis.tables.belief_tables import HEADING as BELIEFS
from vigil.analysis.tables.belief_tables import belief_tables
from vigil.analysis.tables.chores_tables import HEADING as CHORES
from vigil.analysis.tables.chores_tables import chores_tables
from vigil.analysis.tables.closure_tables import HEADING as CLOSURE
from vigil.analysis.tables.closure_tables import closure_tables
from vigil.analysis.tables.page import template
from vigil.analysis.tables.paper_index import ABSENT, PARTS, paper_index
from vigil.analysis.tables.paper_index import HEADING as PAPER_HEADING
from vigil.analysis.tables.paper_index import NAME as PAPER_INDEX
from vigil.analysis.tables.paper_style import INTERVALS, paper_tables
from vigil.analysis.tables.paper_style import TABLES as PAPER_TABLES
from vigil.analysis.tables.registry import SECTIONS, TABLES, TableBuilder, tables
from vigil.analysis.tables.table import DASH, TEXTS, Table
from vigil.analysis.tables.text import LEGEND, csv_text, latex, latex_escaped
from vigil.base.glossary import RESULTS
from vigil.errors import SettingError

_Shown = TypeVar("_Shown")
CaptionedFigure = tuple[Figure, str]
"""A figure with its caption."""
NO_FIGURES: Mapping[str, CaptionedFigure] = {}
NO_TABLES: Mapping[str, TableBuilder] = {}
CUSTOM_TABLES = "Own tables"
"""Heading of the tables that the caller adds to the report."""
Format = Literal["md", "html", "latex", "json", "csv"]
LatexStyle = Literal["report", "paper"]
FORMATS: tuple[Format, ...] = get_args(Format)
_FIGURES_IN: Mapping[str, str] = {"md": "svg", "html": "svg", "latex": "pdf"}
"""Format of a report -> kind of file of its pictures. Two formats share one kind, because drawing is slow."""
FLOATS = 8
"""Number of tables and figures after which LaTeX must place all that are waiting."""
CAUSES = "Why episodes were not verified successes, and what to do"
LIMITS: tuple[str, ...] = tuple(TEXTS["limits"])
"""What the numbers of a report do and do not say."""


@dataclass(frozen=True)
class AnalysisReport:
    """The content of a report, computed once for all formats."""

    study: Study
    suites: tuple[SuiteRun, ...]
    """Runs of suites (closure stress, lists of chores), which are not in the study's tables."""
    tables: Mapping[str, Table]
    figures: Mapping[str, Mapping[str, bytes]]
    """Name of a figure -> kind of file (png, svg, pdf) -> bytes."""
    captions: Mapping[str, str]
    sections: Mapping[str, tuple[str, ...]]
    """Heading -> names of the tables under it, in the report's order."""
    reveals: bool = False
    """Whether the report includes rows of episodes from private packs."""

    @property
    def warnings(self) -> tuple[str, ...]:
        """The warnings at the top of a report."""
        stress = (
            f"{run.name} ({_suite_name(run)}): {note.removesuffix('.')}." for run in self.suites for note in run.notes
        )
        return (*self.study.warnings, *stress)

    @property
    def summary(self) -> str:
        """A sentence that counts the runs and their episodes, and names their packs."""
        runs = [*self.study.runs, *self.suites]
        packs: dict[str, set[str]] = {}
        for run in runs:
            packs.setdefault(run.header.spec.pack, set()).add(run.header.spec.pack_sha256[:12])
        of = "pack" if sum(map(len, packs.values())) == 1 else "packs"
        named = ", ".join(f"{name} ({' and '.join(sorted(hashes))})" for name, hashes in sorted(packs.items()))
        episodes = sum(run.n for run in self.study.runs) + sum(len(run.outcomes) for run in self.suites)
        shown = "run" if len(runs) == 1 else "runs"
        return f"{len(runs)} {shown}, {episodes:,} scored episodes, {of} {named}."

    @property
    def causes(self) -> dict[str, tuple[str, ...]]:
        """Run -> sentences on why verified successes are missing, with advice; runs without causes are left out."""
        found = {entry.name: causes_of_rows(entry.run.rows) for entry in sorted_by_b(self.study.entries)}
        stress = [run for run in self.suites if isinstance(run, ClosureRun)]
        found |= {f"{run.name} (closure stress)": causes_of_closure(run.outcomes) for run in stress}
        return {name: sentences for name, causes in found.items() if (sentences := causes.sentences)}


def make_report(
    study: Study,
    kinds: tuple[str, ...] = ("svg",),
    further: Mapping[str, CaptionedFigure] = NO_FIGURES,
    own: Mapping[str, TableBuilder] = NO_TABLES,
    suites: Sequence[SuiteRun] = (),
) -> AnalysisReport:
    """Return a report. Its figures are drawn as files of each kind in `kinds`.

    `further` are figures that the caller has drawn from frames, with their captions. `own` are additional tables by
    name; they come last. `suites` are runs of suites, which get separate sections; if there are no other runs, the
    study's own tables are left out. Raises SettingError if an additional table has the name of a
    standard one.
    """
    chores = [run for run in suites if isinstance(run, ChoresRun)]
    beliefs = belief_tables(study)
    apart = {
        BELIEFS: beliefs,
        CLOSURE: closure_tables([run for run in suites if isinstance(run, ClosureRun)]),
        CHORES: chores_tables(chores),
    }
    taken = [name for name in own if name in TABLES or any(name in group for group in apart.values())]
    if taken:
        raise SettingError(f"Every report has a table {taken[0]!r} already. Choose another name for your table.")
    is_wanted = bool(study.runs or not suites)
    drawn: dict[str, CaptionedFigure] = {}
    if kinds and is_wanted:
        drawn |= _drawn(FIGURES | (BELIEF_FIGURES if beliefs else {}), CAPTIONS | figure_captions(study), study)
    if kinds:
        drawn |= _drawn(CHORES_FIGURES, CAPTIONS, chores)
    drawn |= further
    figures = {name: {kind: figure_bytes(figure, kind) for kind in kinds} for name, (figure, _) in drawn.items()}
    captions = {name: caption for name, (_, caption) in drawn.items()}
    built = tables(study) if is_wanted else {}
    sections = {heading: tuple(names) for heading, names in SECTIONS.items()} if is_wanted else {}
    if is_wanted:
        built = {PAPER_INDEX: paper_index(built, figures), **built}
        first, *others = sections
        sections = {first: sections[first], PAPER_HEADING: (PAPER_INDEX,), **{name: sections[name] for name in others}}
    apart[CUSTOM_TABLES] = {name: build(study) for name, build in own.items()}
    for heading, group in apart.items():
        built |= group
        sections |= {heading: tuple(group)} if group else {}
    return AnalysisReport(study, tuple(suites), built, figures, captions, sections)


def _drawn(
    figures: Mapping[str, Callable[[_Shown], Figure | None]], captions: Mapping[str, str], shown: _Shown
) -> dict[str, CaptionedFigure]:
    """Return the figures that have something to show, with their captions."""
    return {name: (figure, captions[name]) for name, draw in figures.items() if (figure := draw(shown))}


def write_report(
    study: Study,
    folder: Path,
    formats: tuple[Format, ...] = ("md", "html"),
    further: Mapping[str, CaptionedFigure] = NO_FIGURES,
    own: Mapping[str, TableBuilder] = NO_TABLES,
    suites: Sequence[SuiteRun] = (),
    *,
    reveals: bool = False,
    style: LatexStyle = "report",
) -> list[Path]:
    """Write a report into `folder` in each format, and return the paths of the written files. Raises SettingError.

    For a private pack only rates are written, unless `reveals`. `style` is the style of the LaTeX: `paper` has only the
    paper's tables, as they would be printed.
    """
    unknown = [name for name in formats if name not in FORMATS]
    if unknown:
        raise SettingError(f"There is no format {unknown[0]!r}. Choose from {', '.join(FORMATS)}.")
    kinds = dict.fromkeys(_FIGURES_IN[name] for name in formats if name in _FIGURES_IN)
    with on_paper("page" if style == "paper" else None):
        report = replace(make_report(study, tuple(kinds), further, own, suites), reveals=reveals)
    written: list[Path] = []

    try:
        for form in dict.fromkeys(formats):
            for name, content in _files_of(report, form, style):
                path = folder / name
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(content.encode() if isinstance(content, str) else content)
                written.append(path)
    except OSError as error:
        raise SettingError(f"Cannot write the report into {str(folder)!r}: {error}. Give another --out.") from None
    return written


def markdown_report(report: AnalysisReport, figures: bool = True) -> str:
    """Return the whole report as Markdown. It refers to figures as files under `figures/`."""
    return _rendered(report, "report.md", pictures=report.figures if figures else ())


def html_report(report: AnalysisReport) -> str:
    """Return the whole report as one self-contained page."""
    return _rendered(report, "report.html", glossary=RESULTS)


def _rendered(report: AnalysisReport, name: str, **facts: Any) -> str:
    """Return the text of a report by the template `name`, which gets `facts` too."""
    return template(name).render(report=report, causes_heading=CAUSES, limits=LIMITS, legend=LEGEND, **facts)


def json_report(report: AnalysisReport) -> str:
    """Return the numbers of every table as JSON, without NaN."""
    document: dict[str, Any] = {
        "schema_version": 1,
        "warnings": report.warnings,
        "causes": report.causes,
        "limits": LIMITS,
        "published_note": NOTE if report.study.published else None,
        "tables": {
            name: {
                "title": table.title,
                "columns": [{"key": each.key, "heading": each.heading, "kind": each.kind} for each in table.columns],
                "rows": table.flat_rows(),
                "notes": table.notes,
            }
            for name, table in report.tables.items()
        },
    }
    return json.dumps(document, ensure_ascii=False, indent=1, allow_nan=False, default=_plain_value) + "\n"


def csv_table(table: Table) -> str:
    """Return the numbers of one table as CSV."""
    names = ["group", "published", "privileged", *(name for name, *_ in table.flat_columns())]
    return csv_text(pd.DataFrame(table.flat_rows(), columns=names))


def _files_of(report: AnalysisReport, form: Format, style: LatexStyle) -> Iterator[tuple[str, str | bytes]]:
    """Yield (name, content) for each file of a report in one format."""
    match form:
        case "md":
            yield "report.md", markdown_report(report)
            yield from ((f"figures/{name}.svg", drawn["svg"]) for name, drawn in report.figures.items())
        case "html":
            yield "report.html", html_report(report)
        case "latex" if style == "paper":
            made = (paper_tables(report.tables[key], report.study) for key in PAPER_TABLES)
            found = {name: text for each in made for name, text in each.items()}
            yield from ((f"tables/{name}.tex", text) for name, text in found.items())
            yield from ((f"figures/{name}.pdf", drawn["pdf"]) for name, drawn in report.figures.items())
            yield "report.tex", _paper_document(report, found)
        case "latex":
            yield from ((f"tables/{name}.tex", latex(table)) for name, table in report.tables.items())
            yield from ((f"figures/{name}.pdf", drawn["pdf"]) for name, drawn in report.figures.items())
            yield "report.tex", _rendered(report, "report.tex")
        case "json":
            yield "report.json", json_report(report)
        case "csv":
            yield from ((f"tables/{name}.csv", csv_table(table)) for name, table in report.tables.items())
            disclosed = [run for run in report.study.runs if report.reveals or not run.is_private]
            if disclosed:
                rows = combined_rows(disclosed)
                yield "rows.csv", csv_text(rows)
                yield "rows.parquet", rows.to_parquet(index=False)


def _paper_document(report: AnalysisReport, tables: Iterable[str]) -> str:
    """Return a document in two columns: an index, then the paper's tables and figures in its order, then all others."""
    of_paper = [part.place for part in PARTS]
    names = sorted(tables, key=lambda name: name.endswith(INTERVALS))
    pictures = sorted(report.figures, key=lambda name: of_paper.index(name) if name in of_paper else len(of_paper))
    groups = (
        [name for name in (*names, *pictures) if name in of_paper],
        [name for name in names if name not in of_paper],
        [name for name in pictures if name not in of_paper],
    )
    captions = {name: report.captions[name] for name in pictures}
    facts = {"parts": PARTS, "absent": ABSENT, "dash": latex_escaped(DASH), "intervals": INTERVALS, "floats": FLOATS}
    return template("paper.tex").render(tables=names, captions=captions, groups=groups, **facts)


def _suite_name(run: SuiteRun) -> str:
    return "closure stress" if isinstance(run, ClosureRun) else "lists of chores"


def _plain_value(value: Any) -> Any:
    return value.item() if hasattr(value, "item") else str(value)
