"""LaTeX of the paper's tables as a paper prints them: the paper's columns, headers and text size (7 points).

Intervals are in a companion table. Widths are estimated from the number of characters; a test compiles every table.
"""

import re
import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from typing import Any

from vigil.analysis.measures.metrics import EVENTS
from vigil.analysis.measures.study import Study
from vigil.analysis.tables.paper_captions import GOALS, caption, shown_heading, without_condition
from vigil.analysis.tables.paper_index import PARTS
from vigil.analysis.tables.table import DASH, WITH_INTERVAL, Column, Table, TableRow, first_number, formatted
from vigil.analysis.tables.text import CHARACTER_PT, GAP_PT, latex_escaped, latex_text, marked_cell
from vigil.protocol.families import FAMILIES

COLUMN_PT, PAGE_PT = 234.0, 486.0
"""Widths of one column and of the page in a paper of two columns, in points."""
WORD_GAP_PT = 4.0
"""Space (points) on each side of a column of words; also of a column of numbers, if there is room."""
FILLED = 0.7
"""A table of numbers is stretched to the whole line if it is estimated to fill more than this share of the line."""
INTERVALS = "_intervals"
"""End of the name of a companion table with intervals."""
WIDEST = 0.9
"""A table whose estimated width exceeds this share of the available width needs more room: a table of numbers gets both
columns of the page, a table of words is wrapped."""
WRAPPED_SHARE = 0.4
"""Columns of words are wrapped, the longest first, until each has room for this share of the longest text."""
SHORT_CHARS = 12
"""A column of words is not wrapped if none of its texts is longer than this."""
HASH = re.compile(r" [0-9a-f]{8}$")
"""Pattern of the start of a pack's hash, which follows the pack's name in a cell. Hashes distinguish packs that have
the same name."""
NAMED_TABLE = re.compile(r"\(Table (\w+)\)")
_BEGIN = r"\centering\fontsize{7}{8.4}\selectfont\setlength{\tabcolsep}{2pt}"
_UPPER = {"diagnostic": "Diagnostic", "compositional": "Compositional"}


@dataclass(frozen=True, slots=True)
class PaperColumn:
    """One column of a table in a paper: its key, and its headings."""

    key: str
    heading: str
    over: str = ""
    """Heading over several columns; empty if there is none."""


def _columns(**headings: str) -> tuple[PaperColumn, ...]:
    return tuple(PaperColumn(key, heading) for key, heading in headings.items())


_MODEL = _columns(model="Model")
_FAMILIES = tuple(PaperColumn(family, family, _UPPER[spec.tier]) for family, spec in FAMILIES.items())
_CHANGE = "Change (pp)"
COLUMNS: dict[str, tuple[PaperColumn, ...]] = {
    "global_cross_section": (*_MODEL, *_columns(All="All", Delta="Δ"), *_FAMILIES),
    "full_panel": (*_MODEL, *_columns(All="All"), *_FAMILIES),
    "prompt_sensitivity": (*_MODEL, *_columns(All="All"), *_FAMILIES),
    "extended_panel": (
        *_MODEL,
        *_columns(B="B", W="W", Delta="Δ", FR="FR", NoRep="NoRep", IL="IL", mean_steps="Steps"),
    ),
    "proprio_minimal": (
        *_MODEL,
        *(
            PaperColumn(f"{event} {side}", heading, event)
            for event in EVENTS
            for side, heading in (("base", "base"), ("fb", "+FB"))
        ),
        *(PaperColumn(f"d{name}", name, _CHANGE) for name in ("W", "B", "FR", "NR")),
    ),
    "counterfactual": (*_MODEL, *_columns(B="B", Always="Always", Rand="Rand.")),
    "belief_lag": (*_MODEL, *_columns(W_plus="W+", lag="Lag", NoRep_W1="NoRep | W=1", FS="FS", FS_zero="FS @0")),
    "conditional_report": (
        *_MODEL,
        *_columns(
            W="W", B="B", Stop="Stop", P_rep_W0="P(rep | W=0)", P_norep_W1="P(no rep | W=1)", n_W0="n W=0", n_W1="n W=1"
        ),
    ),
    "open_repeat_robustness": (*_MODEL, *_columns(W="W", B="B", Delta="Δ", FR="FR", NR="NR")),
}
"""Name of a table -> its columns in the paper. A table that is not listed has the same columns in the paper as in a
report."""
WHOLE = ("FS_zero",)
"""Shares that the paper prints without decimals."""
IN_STEPS = ("mean_steps", "lag")
"""Columns in steps. Their intervals have one decimal; intervals in percent have no decimals."""
NAME_PT = 92.0
"""Largest width (points) of a model's name; longer names are wrapped."""
TABLES = tuple(dict.fromkeys(part.place for part in PARTS if not part.is_figure))


def paper_tables(table: Table, study: Study) -> dict[str, str]:
    """Return {file name: LaTeX} of a table and, if it has intervals, of its companion table with the intervals."""
    said = latex_text(caption(table, study))
    if table.name not in COLUMNS:
        return {table.name: _text_table(table, said)}
    if table.name == "prompt_sensitivity":
        table = _without_condition(table)
    columns = [(each, _column(table, each.key)) for each in COLUMNS[table.name]]
    numbers = [[_number(table, row, column) for _, column in columns] for row in table.rows]
    found = {table.name: _number_table(table, said, columns, list(zip(table.rows, numbers, strict=True)))}
    with_ends = [pair for pair in columns if pair[1] is columns[0][1] or pair[1].kind in (*WITH_INTERVAL, "pair")]
    ends = [
        (row, [marked_cell(table, row, columns[0][1]), *(_ends(row, column) for _, column in with_ends[1:])])
        for row in table.rows
        if not row.is_published
    ]
    ends = [(row, cells) for row, cells in ends if any(cell != DASH for cell in cells[1:])]
    if ends:
        found[table.name + INTERVALS] = _number_table(table, None, with_ends, ends)
    return found


def _without_condition(table: Table) -> Table:
    names = without_condition([row for row in table.rows if not row.is_published])
    rows = (
        row if row.is_published else replace(row, cells={**row.cells, "model": names[row.cells["model"]]})
        for row in table.rows
    )
    return replace(table, rows=tuple(rows))


def _column(table: Table, key: str) -> Column:
    return next(column for column in table.columns if column.key == key)


def _number(table: Table, row: TableRow, column: Column) -> str:
    """Return a cell without its interval; a share of 100 % is written without decimals."""
    if column.kind in WITH_INTERVAL:
        number = first_number(row.cells.get(column.key))
        if number is not None and column.key in WHOLE:
            return f"{number:.0f}"
        text = formatted(number, column.kind)
    else:
        text = marked_cell(table, row, column)
    return re.sub(r"\b100\.0\b", "100", text)


def _ends(row: TableRow, column: Column) -> str:
    """Return the interval of a cell, as low and high; for a pair, the intervals of W and B."""
    value = row.cells.get(column.key)
    pairs = value[2:] if column.kind == "pair" and value else (value[1:],) if isinstance(value, tuple) else ()
    digits = 1 if column.key in IN_STEPS else 0
    return " / ".join(_range(pair[0], pair[1], digits) for pair in pairs if pair and None not in pair) or DASH


def _range(low: float, high: float, digits: int) -> str:
    ends = (formatted(round(end, digits), "number1") for end in (low, high))
    return (" to " if low < 0 else "–").join(end if digits else end.removesuffix(".0") for end in ends)


def _number_table(
    table: Table,
    said: str | None,
    columns: Sequence[tuple[PaperColumn, Column]],
    rows: Sequence[tuple[TableRow, list[str]]],
) -> str:
    """Return a table of numbers with the caption `said`; if it is None, the companion table with intervals."""
    parts = [each for each, _ in columns]
    if said is None and any(column.kind == "pair" for _, column in columns):
        return _stacked_intervals(table, columns, rows)
    longest = [max([len(part.heading), *(len(cells[i]) for _, cells in rows)]) for i, part in enumerate(parts)]
    width = min(NAME_PT, CHARACTER_PT * longest[0]) + GAP_PT
    width += sum(CHARACTER_PT * size + GAP_PT for size in longest[1:])
    width = max([width, *(CHARACTER_PT * len(shown_heading(row.group)) for row, _ in rows)])
    is_wide = width > WIDEST * COLUMN_PT
    lines = [
        *_headers(parts),
        *_rows(
            [(row, _escaped(cells) if said is None else _styled(row, columns, cells)) for row, cells in rows],
            len(parts),
        ),
    ]
    kinds = _name_kind(longest[0]) + "r" * (len(parts) - 1)
    body = _spread(width / (PAGE_PT if is_wide else COLUMN_PT), kinds, lines)
    if said is None:
        return _float(table.name + INTERVALS, _of_intervals(table), body, wide=is_wide)
    return _float(table.name, said, body, wide=is_wide)


def _spread(filled: float, kinds: str, lines: Sequence[str]) -> list[str]:
    """Return a table of numbers; `filled` is its estimated share of the line. Above `FILLED`, it fills the line."""
    if filled > FILLED:
        return [
            rf"\begin{{tabular*}}{{\linewidth}}{{@{{\hspace{{2pt}}\extracolsep{{\fill}}}}{kinds}}}",
            *lines,
            r"\end{tabular*}",
        ]
    return [rf"\setlength{{\tabcolsep}}{{{WORD_GAP_PT}pt}}\begin{{tabular}}{{{kinds}}}", *lines, r"\end{tabular}"]


def _of_intervals(table: Table) -> str:
    of = rf"Table~\ref{{tab:{table.name}}}"
    said = (
        f"Intervals of rates are Wilson's, those of Δ and of means are from resampled houses. {DASH}: there is none, "
        "because there are no such episodes, fewer than five houses, or no differences between houses."
    )
    head = rf"95~\% intervals of this study's rows in {of}, whose caption explains the columns and marks."
    return f"{head} {latex_text(said)}"


def _stacked_intervals(
    table: Table, columns: Sequence[tuple[PaperColumn, Column]], rows: Sequence[tuple[TableRow, list[str]]]
) -> str:
    """Return intervals of W and B in two lines for each model, so that eight families fit the page."""
    single = [i for i, (_, column) in enumerate(columns) if column.kind != "pair"]
    pairs = [i for i in range(len(columns)) if i not in single]
    parts = [*(columns[i][0] for i in single), PaperColumn("rate", ""), *(columns[i][0] for i in pairs)]
    lines = []
    for row, cells in rows:
        split = [f"{cells[i]} / {cells[i]}".split(" / ") for i in pairs]
        for i, rate in enumerate(("W", "B")):
            own = [cells[at] if i == 0 else "" for at in single]
            lines.append((row, _escaped([*own, rate, *(each[i] for each in split)])))
    kinds = _name_kind(max((len(cells[0]) for _, cells in rows), default=0))
    body = [
        rf"\setlength{{\tabcolsep}}{{{WORD_GAP_PT}pt}}",
        rf"\begin{{tabular}}{{{kinds}{'r' * (len(single) - 1)}l{'r' * len(pairs)}}}",
        *_headers(parts),
        *_rows(lines, len(parts)),
        r"\end{tabular}",
    ]
    return _float(table.name + INTERVALS, _of_intervals(table), body, wide=True)


def _name_kind(longest: int) -> str:
    """Return the LaTeX type of the column of names: wrapped if the longest name is too wide."""
    if CHARACTER_PT * longest <= NAME_PT:
        return "l"
    return rf">{{\raggedright\arraybackslash}}p{{{NAME_PT:.0f}pt}}"


def _escaped(cells: Sequence[str]) -> list[str]:
    return [latex_escaped(text) for text in cells]


def _text_table(table: Table, said: str) -> str:
    """Return a table of words. If it is too wide, its long columns of words are wrapped."""
    cells = [[_words(table, row, column) for column in table.columns] for row in table.rows]
    headings = [
        _stacked(heading, max((len(row[i]) for row in cells), default=0)) for i, heading in enumerate(_headings(table))
    ]
    longest = [
        max(len(text) for text in (*heading.splitlines(), *(row[i] for row in cells)))
        for i, heading in enumerate(headings)
    ]
    width = sum(CHARACTER_PT * size + 2 * WORD_GAP_PT for size in longest)
    is_wide = width > COLUMN_PT and (width - CHARACTER_PT * max(longest) > COLUMN_PT / 2 or len(longest) > 3)
    kinds = ["l" if column.kind == "text" else "r" for column in table.columns]
    begin, end = r"\begin{tabular}", r"\end{tabular}"
    if width > WIDEST * (PAGE_PT if is_wide else COLUMN_PT):
        for i in _wrapped(longest, kinds, (PAGE_PT if is_wide else COLUMN_PT) - width):
            kinds[i] = r">{\raggedright\arraybackslash}X"
        begin, end = r"\begin{tabularx}{\linewidth}", r"\end{tabularx}"
    parts = [PaperColumn(column.key, heading) for column, heading in zip(table.columns, headings, strict=True)]
    is_mixed = not all(row.is_published for row in table.rows)
    lines = [
        (replace(row, is_published=row.is_published and is_mixed), [_with_references(text) for text in texts])
        for row, texts in zip(table.rows, cells, strict=True)
    ]
    gap = rf"\setlength{{\tabcolsep}}{{{WORD_GAP_PT}pt}}"
    body = [f"{gap}{begin}{{{''.join(kinds)}}}", *_headers(parts), *_rows(lines, len(parts)), end]
    return _float(table.name, said, body, wide=is_wide)


def _stacked(heading: str, longest: int) -> str:
    """Return a heading in two lines if it is longer than the longest text of its column."""
    if len(heading) <= longest:
        return heading
    wrapped = (
        textwrap.wrap(heading, width, break_long_words=False) for width in range(max(longest, 1), len(heading) + 1)
    )
    return "\n".join(next(lines for lines in wrapped if len(lines) <= 2))


def _wrapped(longest: Sequence[int], kinds: Sequence[str], free: float) -> list[int]:
    """Return the columns of words to wrap: the longest, as many as needed. `free` is the rest of the line (points) if
    no column is wrapped; it is negative."""
    words = sorted((i for i, kind in enumerate(kinds) if kind == "l"), key=lambda i: -longest[i])
    for number in range(1, len(words)):
        room = free + CHARACTER_PT * sum(longest[i] for i in words[:number])
        if room / number >= WRAPPED_SHARE * CHARACTER_PT * longest[words[0]]:
            return words[:number]
    return [i for i in words if longest[i] > SHORT_CHARS] or words


def _words(table: Table, row: TableRow, column: Column) -> str:
    text = table.cell(row, column)
    if (table.name, column.key) != ("family_specs", "success"):
        return text
    family = row.cells["family"]
    *others, last = (GOALS.get(f"{family} {kind}") or GOALS.get(kind, kind) for kind in text.split(" or "))
    return GOALS.get(family, "") + (f"{', '.join(others)} or {last}" if others else last)


def _headings(table: Table) -> list[str]:
    """Return the headings of a table of words. A pack's column has its name, or `This study` if there is only one."""
    packs = [column.heading for column in table.columns if HASH.search(column.heading)]
    named = {heading: HASH.sub("", heading).removeprefix("Episodes of ") for heading in packs}
    own = dict.fromkeys(packs, "This study") if len(packs) == 1 else named
    return [(own | {"Published pack": "Published"}).get(column.heading, column.heading) for column in table.columns]


def _with_references(text: str) -> str:
    """Return a text as LaTeX. A name of a table in brackets, such as "(Table intents)", becomes a reference to the
    table."""
    parts = NAMED_TABLE.split(text)
    return "".join(rf"(Table~\ref{{tab:{part}}})" if i % 2 else latex_text(part) for i, part in enumerate(parts))


def _headers(parts: Sequence[PaperColumn]) -> Iterator[str]:
    """Yield the lines of the header: two lines of headings if a heading stands over several columns, else one."""
    yield r"\toprule"
    if any(part.over for part in parts):
        upper, rules, at = [], [], 1
        for over, group in groupby(parts, key=lambda part: part.over):
            size = len(list(group))
            upper.append(rf"\multicolumn{{{size}}}{{c}}{{{latex_escaped(over)}}}" if over else "&".join([""] * size))
            if over:
                rules.append(rf"\cmidrule(lr){{{at}-{at + size - 1}}}")
            at += size
        yield " & ".join(upper) + r" \\" + "".join(rules)
    yield " & ".join(_heading(part.heading) for part in parts) + r" \\"
    yield r"\midrule"


def _heading(text: str) -> str:
    lines = [latex_escaped(line) for line in text.splitlines()]
    return rf"\shortstack[l]{{{lines[0]}\\{lines[1]}}}" if len(lines) > 1 else "".join(lines)


def _rows(rows: Sequence[tuple[TableRow, list[str]]], columns: int) -> Iterator[str]:
    groups = ((group, list(members)) for group, members in groupby(rows, key=lambda pair: pair[0].group))
    for index, (group, members) in enumerate(groups):
        if index:
            yield r"\midrule"
        heading = latex_escaped(shown_heading(group))
        if heading and heading != members[0][1][0]:
            yield rf"\multicolumn{{{columns}}}{{l}}{{\makebox[0pt][l]{{\emph{{{heading}}}}}}} \\"
        for row, cells in members:
            shown = [rf"\textcolor{{black!75}}{{{cell}}}" for cell in cells] if row.is_published else cells
            yield " & ".join(shown) + r" \\"
    yield r"\bottomrule"


def _styled(row: TableRow, columns: Sequence[tuple[PaperColumn, Column]], cells: Sequence[str]) -> list[str]:
    """Return the cells of a row as LaTeX, in bold or tinted where the row marks them so."""
    found: list[str] = []
    for (part, column), text in zip(columns, cells, strict=True):
        marks = (f"{part.key}.W" in row.bold, part.key in row.bold)
        if column.kind == "pair" and marks[0] != marks[1]:
            shares = zip(text.split("/"), marks, strict=True)
            shown = "/".join(_bold(latex_escaped(share), is_best) for share, is_best in shares)
        else:
            shown = _bold(latex_escaped(text), part.key in row.bold)
        if part.key in row.tints:
            shown = rf"\cellcolor{{{row.tints[part.key]}tint}}{shown}"
        found.append(shown)
    return found


def _bold(shown: str, is_bold: bool) -> str:
    return rf"\textbf{{{shown}}}" if is_bold else shown


def _float(name: str, caption: str, body: Sequence[Any], *, wide: bool) -> str:
    kind = "table*" if wide else "table"
    lines = [rf"\begin{{{kind}}}[t]", _BEGIN, rf"\caption{{{caption}}}\label{{tab:{name}}}", *body]
    return "\n".join([*lines, rf"\end{{{kind}}}"]) + "\n"
