"""Text: tables as Markdown and LaTeX."""

import re
from typing import TYPE_CHECKING

from jinja2 import Environment, PackageLoader, StrictUndefined

from vigil.analysis.tables.paper_index import ABSENT
from vigil.analysis.tables.table import Column, Table, TableRow
from vigil.base.markup import replace_invalid

if TYPE_CHECKING:
    import pandas as pd

MARKS = {"published": "†", "privileged": "‡"}
LEGEND = "† published in the paper, on another pack and simulator. ‡ privileged: the agent sees hidden state."
_LATEX = {
    **{character: "\\" + character for character in "&%$#_{}"},
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "−": "$-$",
    "–": "--",
    "Δ": r"$\Delta$",
    "χ": r"$\chi$",
    "²": r"$^2$",
    "±": r"$\pm$",
    "|": r"$\mid$",
    "†": r"$^\dagger$",
    "‡": r"$^\ddagger$",
    "<": "$<$",
    ">": "$>$",
    "·": r"$\cdot$",
    "→": r"$\rightarrow$",
    "←": r"$\leftarrow$",
    "\u00a0": "~",
}
CHARACTER_PT, GAP_PT = 3.9, 4.0
"""In LaTeX, mean width of a character of 7-point text, and space between two columns, both in points."""
LINE_PT = 725.0
"""Width of a line of the report's LaTeX document, in points."""
WRAPPED_PT = 300.0
"""Width in points to which longer texts are wrapped in LaTeX."""
MAX_REPEATED = 2
"""Maximum number of first columns that are repeated in each part of a table that is too wide for one line."""
CODE = re.compile(r"`([^`]+)`")
NO_ROWS = "No rows: this table does not apply to any of these runs."


def markdown(table: Table) -> str:
    """Return a table as GitHub's Markdown, with its title as a heading."""
    return TEXT.get_template("table.md").render(table=table, cell=_md_cell, no_rows=NO_ROWS)


def latex(table: Table) -> str:
    """Return a table as LaTeX at 7 points (packages booktabs and longtable), labelled `tab:NAME`.

    It may span pages. Columns that do not fit the line are in further parts below, which repeat the first columns.
    """
    return TEXT.get_template("table.tex").render(table=table, blocks=_blocks(table), kind=_tex_kind, cell=_tex_cell)


def _blocks(table: Table) -> list[list[Column]]:
    """Return the columns in groups that fit a line. Each group begins with the table's first columns of text."""
    texts = [column for column in table.columns[:MAX_REPEATED] if column.kind == "text"]
    repeated = texts if sum(_width_pt(table, column) for column in texts) < LINE_PT / 2 else []
    blocks = [list(repeated)]
    for column in table.columns[len(repeated) :]:
        width = sum(_width_pt(table, each) for each in (*blocks[-1], column))
        if width > LINE_PT and len(blocks[-1]) > len(repeated):
            blocks.append(list(repeated))
        blocks[-1].append(column)
    return blocks


def _width_pt(table: Table, column: Column) -> float:
    cells = (len(marked_cell(table, row, column)) for row in table.rows)
    width = CHARACTER_PT * max([len(column.heading), *cells])
    return GAP_PT + (width if column.kind != "text" else min(width, WRAPPED_PT))


FORMULA_STARTS = ("=", "+", "-", "@", "\t", "\r", "\n")
"""Characters with which a formula begins in spreadsheets."""


def csv_text(table: "pd.DataFrame") -> str:
    """Return a table as CSV, with an apostrophe before each text that spreadsheets would take for a formula.

    Carriage returns become newlines, because spreadsheets begin a new row at an unquoted carriage return.
    """
    from pandas.api.types import is_numeric_dtype  # noqa: PLC0415 - half a second, which pages of tables do not need

    texts = {name: table[name].map(_without_formula) for name in table.columns if not is_numeric_dtype(table[name])}
    return table.assign(**texts).to_csv(index=False)


def _without_formula(value: object) -> object:
    if not isinstance(value, str):
        return value
    text = f"'{value}" if value.startswith(FORMULA_STARTS) else value
    return text.replace("\r\n", "\n").replace("\r", "\n")


def mark(row: TableRow) -> str:
    """Return the mark that stands after a row's name, e.g. † for a published row."""
    marks = [MARKS["published"]] if row.is_published else []
    return "".join([*marks, *([MARKS["privileged"]] if row.is_privileged else [])])


def marked_cell(table: Table, row: TableRow, column: Column) -> str:
    """Return a cell's text; the first cell of a row includes the row's mark."""
    text = table.cell(row, column)
    return text + mark(row) if column is table.columns[0] else text


def _md(text: str) -> str:
    text = replace_invalid(text).replace("|", "\\|").replace("\n", " ")
    return text.replace("<", "&lt;").replace("*", "\\*").replace("_", "\\_")


def _md_cell(table: Table, row: TableRow, column: Column) -> str:
    text = _md(marked_cell(table, row, column))
    if column.key in row.bold:
        text = f"**{text}**"
    return f"{text} ({row.tints[column.key]})" if column.key in row.tints else text


def latex_escaped(text: str) -> str:
    """Return a text with the special characters of LaTeX escaped."""
    return "".join(_LATEX.get(character, character) for character in replace_invalid(text))


def latex_text(text: str) -> str:
    """Return a sentence as LaTeX; text between back-ticks is set as code."""
    return CODE.sub(r"\\texttt{\1}", latex_escaped(text))


def _tex_kind(table: Table, column: Column) -> str:
    if column.kind not in ("text", "link"):
        return "r"
    is_wrapped = _width_pt(table, column) >= GAP_PT + WRAPPED_PT
    return rf"p{{{WRAPPED_PT:.0f}pt}}" if is_wrapped and column.kind == "text" else "l"


def _tex_cell(table: Table, row: TableRow, column: Column) -> str:
    text = latex_escaped(marked_cell(table, row, column))
    if column.kind == "link" and text != ABSENT:
        name = row.cells[column.key]
        label = name.replace("figure-", "fig:") if name.startswith("figure-") else f"tab:{name}"
        return rf"{text}, p.~\pageref{{{label}}}"
    if column.key in row.bold:
        text = rf"\textbf{{{text}}}"
    if column.key in row.tints:
        text = rf"\cellcolor{{{row.tints[column.key]}tint}}{text}"
    return rf"\textcolor{{gray}}{{{text}}}" if row.is_published else text


TEXT = Environment(
    *("<%", "%>", "<<", ">>", "<#", "#>"),
    loader=PackageLoader("vigil.analysis.tables"),
    undefined=StrictUndefined,
    trim_blocks=True,
    keep_trailing_newline=True,
)
"""Templates of Markdown and LaTeX."""
TEXT.filters |= {"escaped": latex_escaped, "markdown": markdown, "md": _md, "tex": latex_text}
