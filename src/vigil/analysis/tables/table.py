"""Table: named columns, rows with marks, and notes; and the format of each kind of cell."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
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
"""Kinds of cells with several numbers -> the numbers' names in CSV."""
WITH_INTERVAL: tuple[CellKind, ...] = ("rate", "mean")
"""Kinds of cells with one number and, optionally, the ends of its interval."""
RateCell = tuple[float, float | None, float | None] | None
"""Cell of a kind in WITH_INTERVAL: the number and the ends of its interval, if it has one."""


@dataclass(frozen=True, slots=True)
class Column:
    """One column; its heading gives the unit: percent, percentage points, steps or counts."""

    key: str
    heading: str
    kind: CellKind = "number1"
    value: Callable[[Any], Any] | None = None
    """Function that returns the cell from the subject of a row, e.g. a run; None if the table fills in the cell."""


@dataclass(frozen=True)
class TableRow:
    """One row with its marks."""

    cells: Mapping[str, Any]
    group: str = ""
    is_published: bool = False
    is_privileged: bool = False
    bold: frozenset[str] = frozenset()
    tints: Mapping[str, str] = field(default_factory=dict)
    """Column -> `FR` or `NR`, the closure failure that the cell's tint indicates."""


@dataclass(frozen=True)
class Table:
    """One table of a report."""

    name: str
    title: str
    columns: tuple[Column, ...]
    rows: tuple[TableRow, ...]
    notes: tuple[str, ...] = ()

    def cell(self, row: TableRow, column: Column) -> str:
        """Return a cell as printed."""
        return formatted(row.cells.get(column.key), column.kind)

    def flat_columns(self) -> list[tuple[str, Column, int | None]]:
        """Return (name, column, part) for every single number, as in CSV and JSON."""
        found: list[tuple[str, Column, int | None]] = []
        for column in self.columns:
            parts = PARTS.get(column.kind)
            if parts is None:
                found.append((column.key, column, None))
            else:
                found.extend((f"{column.key}.{part}".rstrip("."), column, i) for i, part in enumerate(parts))
        return found

    def flat_rows(self) -> list[dict[str, Any]]:
        """Return the rows with every number in a separate field; None for a missing number."""
        return [
            {
                "group": row.group,
                "published": row.is_published,
                "privileged": row.is_privileged,
                **{name: _part(row.cells.get(column.key), part) for name, column, part in self.flat_columns()},
            }
            for row in self.rows
        ]


Heading = str | tuple[str, Callable[[Any], Any]]
"""Heading of a column, optionally with the function that returns its cells."""


def texts(**headings: Heading) -> tuple[Column, ...]:
    """Return columns of text: key -> heading."""
    return _columns("text", headings)


def counts(**headings: Heading) -> tuple[Column, ...]:
    """Return columns of counts: key -> heading."""
    return _columns("count", headings)


def numbers(**headings: Heading) -> tuple[Column, ...]:
    """Return columns of numbers with one decimal: key -> heading."""
    return _columns("number1", headings)


def intervals(**headings: Heading) -> tuple[Column, ...]:
    """Return columns of numbers with one decimal and their 95 % interval: key -> heading, with quantity and unit."""
    return _columns("rate", headings)


def means(**headings: Heading) -> tuple[Column, ...]:
    """Return columns of numbers with two decimals and their 95 % interval: key -> heading."""
    return _columns("mean", headings)


def p_values(**headings: Heading) -> tuple[Column, ...]:
    """Return columns of p-values: key -> heading."""
    return _columns("p", headings)


def _columns(kind: CellKind, headings: Mapping[str, Heading]) -> tuple[Column, ...]:
    given = {key: (heading, None) if isinstance(heading, str) else heading for key, heading in headings.items()}
    ends = " [95\u00a0%]" if kind in WITH_INTERVAL else ""
    return tuple(Column(key, heading + ends, kind, value) for key, (heading, value) in given.items())


def cells_of(columns: Iterable[Column], subject: Any) -> dict[str, Any]:
    """Return the cells of the columns that have a value function, for the subject of a row."""
    return {column.key: column.value(subject) for column in columns if column.value is not None}


def formatted(value: Any, kind: CellKind) -> str:
    """Return a value as printed; a dash for None."""
    return DASH if first_number(value) is None else _format(value, kind)


def first_number(value: Any) -> Any:
    """Return a cell's number without its interval; for a pair, the first number."""
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
            return f"{_fixed(number, digits)}{ends}"
        case "spread":
            return f"{_fixed(value[0], 1)} ± {_fixed(value[1], 1)}"
        case "p":
            return "< 0.001" if value < 0.001 else f"{value:.3f}"
        case _:
            return str(value)


def percent(value: float | None) -> float | None:
    """Return a fraction in percent."""
    return None if value is None else 100 * value


def rate_cell(rate: Rate) -> tuple[float, float, float] | None:
    """Return a rate with its Wilson interval, in percent."""
    if rate.value is None:
        return None
    low, high = rate.interval
    return 100 * rate.value, 100 * low, 100 * high


def rate_cells(counts: Counts, names: Iterable[str]) -> dict[str, RateCell]:
    """Return rates by name, each with its Wilson interval, in percent."""
    return {name: rate_cell(counts.rate(name)) for name in names}


def points(value: float | None, interval: Interval | None) -> RateCell:
    """Return a fraction and its interval in percent (points)."""
    if value is None:
        return None
    return (100 * value, None, None) if interval is None else (100 * value, 100 * interval[0], 100 * interval[1])


def with_best_bold(
    rows: Sequence[TableRow], columns: Sequence[Column], *, lowest: frozenset[str] = frozenset()
) -> list[TableRow]:
    """Return the rows with the best number of each column marked.

    Published and own rows are marked separately; privileged rows are never marked.
    """
    marked = list(rows)
    for published in (False, True):
        indices = [i for i, row in enumerate(rows) if row.is_published is published and not row.is_privileged]
        for column in columns:
            found = {i: _comparable(rows[i].cells.get(column.key), column.kind) for i in indices}
            values = {i: value for i, value in found.items() if value is not None}
            if len(values) < 2:
                continue
            best = (min if column.key in lowest else max)(values.values())
            for i, value in values.items():
                if value == best:
                    marked[i] = replace(marked[i], bold=marked[i].bold | {column.key})
    return marked


def _comparable(value: Any, kind: CellKind) -> float | None:
    """Return the number by which a cell is ranked: B of W/B, and a number without its interval."""
    found = value[1] if kind == "pair" and value is not None else first_number(value)
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
