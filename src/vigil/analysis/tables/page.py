"""Tables and the report as HTML, made with templates that escape all text."""

import base64
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

from vigil.analysis.tables.paper_index import ABSENT
from vigil.analysis.tables.table import WITH_INTERVAL, Column, Table, TableRow
from vigil.analysis.tables.text import CODE, NO_ROWS, marked_cell
from vigil.base.glossary import RESULTS, term_of
from vigil.base.markup import finalize

_INTERVAL = re.compile(r"(.*) (\[.*\])")


@dataclass(frozen=True, slots=True)
class Section:
    """A part of the report: a heading with its tables."""

    heading: str
    tables: tuple[Table, ...]

    @property
    def anchor(self) -> str:
        """Anchor for links to the section, made from its heading."""
        return re.sub(r"[',]", "", self.heading.lower()).replace(" ", "-")


@dataclass(frozen=True, slots=True)
class PageFigure:
    """Name, picture and caption of a figure of the report."""

    name: str
    svg: bytes
    caption: str

    @property
    def source(self) -> str:
        """The picture as a data URI."""
        return f"data:image/svg+xml;base64,{base64.b64encode(self.svg).decode()}"


@dataclass(frozen=True, slots=True)
class PageNotes:
    """The sentences that stand above a report's figures: warnings, causes of failures, and limits of the numbers."""

    warnings: Sequence[str]
    causes_heading: str
    causes: Mapping[str, Sequence[str]]
    """Run -> sentences on why verified successes are missing."""
    limits: Sequence[str]


@dataclass(frozen=True, slots=True)
class Page:
    """The content of a report's page: its summary, legend, notes, pictures and sections of tables."""

    summary: str
    legend: str
    notes: PageNotes
    sections: Sequence[Section]
    pictures: Sequence[PageFigure]


@dataclass(frozen=True, slots=True)
class _Cell:
    text: str
    classes: str
    is_bold: bool
    interval: str = ""
    is_breakable: bool = False


@dataclass(frozen=True, slots=True)
class _HtmlRow:
    classes: str
    cells: tuple[_Cell, ...]


def html_table(table: Table) -> str:
    """Return a table as HTML: a section with a heading, the table in a box that scrolls, and its notes."""
    groups = [
        (group, [_html_row(table, row) for row in rows])
        for group, rows in groupby(table.rows, key=lambda row: row.group)
    ]
    return _TEMPLATES.get_template("table.html").render(table=table, groups=groups, no_rows=NO_ROWS)


def html_page(page: Page) -> str:
    """Return the whole report as one self-contained page."""
    return _TEMPLATES.get_template("report.html").render(
        page=page, glossary=RESULTS, table_of=lambda table: Markup(html_table(table))
    )


def _html_row(table: Table, row: TableRow) -> _HtmlRow:
    classes = {"published": row.is_published, "privileged": row.is_privileged}
    cells = tuple(_cell(table, row, column) for column in table.columns)
    return _HtmlRow(" ".join(name for name, applies in classes.items() if applies), cells)


def _cell(table: Table, row: TableRow, column: Column) -> _Cell:
    text, interval = marked_cell(table, row, column), ""
    if column.kind in WITH_INTERVAL and (found := _INTERVAL.fullmatch(text)):
        text, interval = found.groups()
    classes = f"{column.kind} tint-{row.tints[column.key]}" if column.key in row.tints else column.kind
    is_breakable = column.kind == "text" and column is not table.columns[0]
    return _Cell(text, classes, column.key in row.bold, interval, is_breakable)


def _content(cell: _Cell) -> Markup:
    if cell.classes == "link" and cell.text != ABSENT:
        return Markup('<a href="#{0}">{0}</a>').format(cell.text)
    if cell.is_breakable:
        return Markup("_<wbr>").join(cell.text.split("_"))
    if cell.interval:
        return Markup('{} <span class="ci">{}</span>').format(cell.text, cell.interval)
    return escape(cell.text)


def prose(sentence: str) -> Markup:
    """Return a sentence as HTML; text between back-ticks is set as code."""
    return Markup(CODE.sub(r"<code>\1</code>", str(escape(sentence))))


_TEMPLATES = Environment(
    loader=PackageLoader("vigil.analysis.tables"),
    autoescape=True,
    undefined=StrictUndefined,
    finalize=finalize,
    keep_trailing_newline=True,
)
_TEMPLATES.filters |= {"content": _content, "prose": prose, "term": term_of}
