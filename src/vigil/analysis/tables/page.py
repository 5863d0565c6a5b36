"""Templates of reports and tables: HTML, whose templates escape all text, Markdown and LaTeX."""

import base64
import re

from jinja2 import Environment, PackageLoader, StrictUndefined, Template
from markupsafe import Markup, escape

from vigil.analysis.tables.paper_index import ABSENT
from vigil.analysis.tables.table import WITH_INTERVAL, Column, Table, TableRow
from vigil.analysis.tables.text import CODE, NO_ROWS, TEXT, marked_cell
from vigil.base.glossary import term_of
from vigil.base.markup import finalize

_INTERVAL = re.compile(r"(.*) (\[.*\])")


def template(name: str) -> Template:
    """Return a template of a report by its file name. In Markdown and LaTeX, `<< >>` and `<% %>` mark what is filled
    in."""
    return (_HTML if name.endswith(".html") else TEXT).get_template(name)


def html_table(table: Table) -> str:
    """Return a table as HTML: a section with a heading, the table in a box that scrolls, and its notes."""
    return template("table.html").render(table=table, cell=_content, no_rows=NO_ROWS)


def prose(sentence: str) -> Markup:
    """Return a sentence as HTML; text between back-ticks is set as code."""
    return Markup(CODE.sub(r"<code>\1</code>", str(escape(sentence))))


def _content(table: Table, row: TableRow, column: Column) -> Markup:
    text = marked_cell(table, row, column)
    if column.kind == "link" and text != ABSENT:
        return Markup('<a href="#{0}">{0}</a>').format(text)
    if column.kind == "text" and column is not table.columns[0]:
        return Markup("_<wbr>").join(text.split("_"))
    if column.kind in WITH_INTERVAL and (found := _INTERVAL.fullmatch(text)):
        return Markup('{} <span class="ci">{}</span>').format(*found.groups())
    return escape(text)


def _anchor(heading: str) -> str:
    """Return the anchor for links to a section with this heading."""
    return re.sub(r"[',]", "", heading.lower()).replace(" ", "-")


def _data_uri(svg: bytes) -> str:
    return f"data:image/svg+xml;base64,{base64.b64encode(svg).decode()}"


_HTML = Environment(
    loader=PackageLoader("vigil.analysis.tables"),
    autoescape=True,
    undefined=StrictUndefined,
    finalize=finalize,
    keep_trailing_newline=True,
)
_HTML.filters |= {"anchor": _anchor, "data_uri": _data_uri, "html_table": html_table, "prose": prose, "term": term_of}
