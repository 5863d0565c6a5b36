"""Table: named columns, rows with marks, and notes; also the text format of each kind of cell."""

import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import groupby
from pathlib import Path
from typing import Any, Literal

from vigil.scoring.rates import Counts, Interval, Rate

CellKind = Literal["text", "count", "number1", "number2", "signed1", "pair", "rate", "mean", "spread", "p", "link"]
DASH = "–"
PARTS: dict[CellKind, tuple[str, ...]] = {
    "pair": ("W", "B"),
    "rate": ("", "low", "high"),
    "mean": ("", "low", "high"),
    "spread": ("mean", "half_range"),
}
"""Kind of cell with several numbers -> names of these numbers in CSV."""
WITH_INTERVAL: tuple[CellKind, ...] = ("rate", "mean")
"""Kinds of cells with one number and, if known, the ends of its interval."""
RateCell = tuple[float, float | None, float | None] | None
"""Cell of a kind in WITH_INTERVAL: the number, and the two ends of its interval or None."""


@dataclass(frozen=True, slots=True)
class Column:
    """One column; its heading gives the unit: percent, percentage points, steps or counts."""

    key: str
    heading: str
    kind: CellKind = "number1"
    value: Callable[[Any], Any] | None = None
    """Function that returns the cell for the subject of a row, e.g. a run; None if the table fills in the cell."""


@dataclass(frozen=True)
class TableRow:
    """One row of a table, with its marks (e.g. published, privileged)."""

    cells: Mapping[str, Any]
    group: str = ""
    is_published: bool = False
    is_privileged: bool = False
    bold: frozenset[str] = frozenset()
    tints: Mapping[str, str] = field(default_factory=dict)
    """Key of a column -> `FR` or `NR`: the closure failure that the cell's colour indicates."""


@dataclass(frozen=True)
class Table:
    """A table of a report: its name, title, columns, rows and notes."""

    name: str
    title: str
    columns: tuple[Column, ...]
    rows: tuple[TableRow, ...]
    notes: tuple[str, ...] = ()

    def groups(self) -> list[tuple[str, list[TableRow]]]:
        """Return the groups of rows that stand together, each with its heading; an empty heading is not shown."""
        return [(group, list(rows)) for group, rows in groupby(self.rows, key=lambda row: row.group)]

    def cell(self, row: TableRow, column: Column) -> str:
        """Return the text that the table shows in this row and column."""
        return formatted(row.cells.get(column.key), column.kind)

    def flat_columns(self) -> list[tuple[str, Column, int | None]]:
        """Return (name, column, part) for every single number, as in CSV and JSON. `part` is the number's position in
        its cell; None for a cell with one number."""
        found: list[tuple[str, Column, int | None]] = []
        for column in self.columns:
            parts = PARTS.get(column.kind)
            if parts is None:
                found.append((column.key, column, None))
            else:
                found.extend((f"{column.key}.{part}".rstrip("."), column, i) for i, part in enumerate(parts))
        return found

    def flat_rows(self) -> list[dict[str, Any]]:
        """Return the rows with a separate field for every number; a missing number is None."""
        return [
            {
                "group": row.group,
                "published": row.is_published,
                "privileged": row.is_privileged,
                **{name: _part(row.cells.get(column.key), part) for name, column, part in self.flat_columns()},
            }
            for row in self.rows
        ]


def titled(
    name: str, columns: tuple[Column, ...], rows: Iterable[TableRow], *further: str, **values: float | str
) -> Table:
    """Return a table with the title and the notes that `texts.toml` has for `name`, and then the notes `further`.

    `values` are what the names in braces in its notes stand for.
    """
    text = TEXTS[name]
    notes = (note.format(**TEXTS["shared"], **values) for note in text.get("notes", ()))
    return Table(name, text["title"], columns, tuple(rows), (*notes, *further))


TEXTS = tomllib.loads((Path(__file__).parent / "texts.toml").read_text(encoding="utf-8"))
"""Name of a table -> its title, its notes, and its caption in a paper; `shared` has the texts that these refer to."""
Heading = str | tuple[str, Callable[[Any], Any]]
"""Heading of a column, optionally with the function that returns its cells."""


def texts(**headings: Heading) -> tuple[Column, ...]:
    """Return columns of text; `headings` are {key: heading}."""
    return _columns("text", headings)


def counts(**headings: Heading) -> tuple[Column, ...]:
    """Return columns of counts; `headings` are {key: heading}."""
    return _columns("count", headings)


def numbers(**headings: Heading) -> tuple[Column, ...]:
    """Return columns of numbers with one decimal; `headings` are {key: heading}."""
    return _columns("number1", headings)


def intervals(**headings: Heading) -> tuple[Column, ...]:
    """Return columns of numbers with one decimal and a 95 % interval; `headings` are {key: heading with unit}."""
    return _columns("rate", headings)


def means(**headings: Heading) -> tuple[Column, ...]:
    """Return columns of numbers with two decimals and a 95 % interval; `headings` are {key: heading}."""
    return _columns("mean", headings)


def p_values(**headings: Heading) -> tuple[Column, ...]:
    """Return columns of p-values; `headings` are {key: heading}."""
    return _columns("p", headings)


def _columns(kind: CellKind, headings: Mapping[str, Heading]) -> tuple[Column, ...]:
    given = {key: (heading, None) if isinstance(heading, str) else heading for key, heading in headings.items()}
    ends = " [95\u00a0%]" if kind in WITH_INTERVAL else ""
    return tuple(Column(key, heading + ends, kind, value) for key, (heading, value) in given.items())


def cells_of(columns: Iterable[Column], subject: Any) -> dict[str, Any]:
    """Return {key: cell} for the subject of a row (e.g. a run), from the columns that have a `value` function."""
    return {column.key: column.value(subject) for column in columns if column.value is not None}


def formatted(value: Any, kind: CellKind) -> str:
    """Return the text of a cell with this value; a dash for None."""
    return DASH if first_number(value) is None else _format(value, kind)


def first_number(value: Any) -> Any:
    """Return the number of a cell without its interval; for a pair of numbers, the first."""
    return value[0] if isinstance(value, tuple | list) else value


def _format(value: Any, kind: CellKind) -> str:
    match kind:
        case "count":
            return f"{value:,}"
        case "number1":
            return _fixed(value, 1)
        case "number2":
            return _fixed(value, 2)
        case "signed1":
            return f"{value:+.1f}".replace("-0.0", "0.0").replace("+0.0", "0.0").replace("-", "−")
        case "pair":
            return f"{_fixed(value[0], 1)}/{_fixed(value[1], 1)}"
        case "rate" | "mean":
            digits = 1 if kind == "rate" else 2
            number, low, high = value if isinstance(value, tuple | list) else (value, None, None)
            ends = "" if low is None or high is None else f" [{_fixed(low, digits)}, {_fixed(high, digits)}]"
            shown = str(number) if isinstance(number, int) else _fixed(number, digits)  # a published whole number
            return f"{shown}{ends}"
        case "spread":
            return f"{_fixed(value[0], 1)} ± {_fixed(value[1], 1)}"
        case "p":
            return "< 0.001" if value < 0.001 else f"{value:.3f}"
        case _:
            return str(value)


def in_percent(value: float | None) -> float | None:
    """Return a fraction as a percentage."""
    return None if value is None else 100 * value


def rate_cell(rate: Rate) -> tuple[float, float, float] | None:
    """Return a rate with its Wilson interval, in percent."""
    if rate.value is None or rate.interval is None:
        return None
    low, high = rate.interval
    return 100 * rate.value, 100 * low, 100 * high


def rate_cells(counts: Counts, names: Iterable[str]) -> dict[str, RateCell]:
    """Return {name: cell} with each rate in percent and its Wilson interval."""
    return {name: rate_cell(counts.rate(name)) for name in names}


def pp_cell(value: float | None, interval: Interval | None) -> RateCell:
    """Return a cell with a fraction and its interval, both converted to percentage points."""
    if value is None:
        return None
    return (100 * value, None, None) if interval is None else (100 * value, 100 * interval[0], 100 * interval[1])


def with_best_bold(
    rows: Sequence[TableRow], columns: Sequence[Column], *, lowest: frozenset[str] = frozenset()
) -> list[TableRow]:
    """Return the rows, with the best number of each column marked; in the columns `lowest`, the lowest is best.

    The best of the published rows and the best of the others are marked separately; privileged rows are never marked.
    Of a pair of W and B, the column's key marks the best B, and the key with `.W` marks the best W.
    """
    marked = list(rows)
    for published in (False, True):
        indices = [i for i, row in enumerate(rows) if row.is_published is published and not row.is_privileged]
        for column in columns:
            ranked = {column.key: 1, f"{column.key}.W": 0} if column.kind == "pair" else {column.key: 0}
            for key, part in ranked.items():
                found = {i: _comparable(rows[i].cells.get(column.key), part) for i in indices}
                values = {i: value for i, value in found.items() if value is not None}
                if len(values) < 2:
                    continue
                best = (min if column.key in lowest else max)(values.values())
                for i, value in values.items():
                    if value == best:
                        marked[i] = replace(marked[i], bold=marked[i].bold | {key})
    return marked


def _comparable(value: Any, part: int) -> float | None:
    """Return the number by which a cell is ranked: for a pair, the one at index `part`; else the only number."""
    found = value[part] if part and value is not None else first_number(value)
    return None if found is None or isinstance(found, str) else float(found)


def _part(value: Any, part: int | None) -> Any:
    if part is None or value is None:
        return value
    if not isinstance(value, tuple | list):
        return value if part == 0 else None
    return value[part]


def _fixed(value: float, digits: int) -> str:
    text = f"{value:.{digits}f}"
    return text.lstrip("-") if float(text) == 0 else text.replace("-", "−")
