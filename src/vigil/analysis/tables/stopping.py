"""Tables that compare runs without reports with the baseline runs of the same models, by the measures that both define.

Each function takes a Study and returns one Table. Source: `protocol.md` section 11.
"""

from collections.abc import Callable

import numpy as np
import pandas as pd

from vigil.analysis.measures.intervals import PairedTest, houses_of, paired_test
from vigil.analysis.measures.metrics import mean_with_interval
from vigil.analysis.measures.pairs import Pair
from vigil.analysis.measures.rows import values
from vigil.analysis.measures.study import Study
from vigil.analysis.tables.paired import N, sided_means
from vigil.analysis.tables.rows import MODEL, run_row
from vigil.analysis.tables.table import (
    RateCell,
    Table,
    TableRow,
    cells_of,
    counts,
    intervals,
    means,
    p_values,
    pp_cell,
    rate_cell,
    texts,
    titled,
)
from vigil.scoring.outcomes import NEGATIVE
from vigil.scoring.rates import rate_of

_SIDES = {"0": "baseline", "1": "stop only"}
"""End of a column's key -> side of a pair."""
_MEANS = {"steps": "Steps", "input_tokens": "Input tokens", "output_tokens": "Output tokens"}
_Mask = Callable[[pd.DataFrame], np.ndarray]


def _ended(rows: pd.DataFrame) -> np.ndarray:
    return np.isin(rows["end"].to_numpy(dtype=str), ("report", "stop"))


def _held(rows: pd.DataFrame) -> np.ndarray:
    return values(rows, "W", bool)


_EVENTS: dict[str, tuple[str, _Mask]] = {
    "W": ("W: the goal held at the end", _held),
    "ended": ("the agent ended the episode", _ended),
    "both": ("the agent ended it, and the goal held", lambda rows: _ended(rows) & _held(rows)),
    "unfinished": ("the agent ended it, and the goal did not hold", lambda rows: _ended(rows) & ~_held(rows)),
    "late": ("the agent did not end it, and the goal held", lambda rows: ~_ended(rows) & _held(rows)),
}
"""Key of an event that can happen with and without reports -> its name, and a function that marks the rows in which it
happened."""


def stop_shifts(study: Study) -> Table:
    """Return the shares of the common events with and without reports, tested on the same episodes."""
    columns = (
        *texts(model="Event"),
        *counts(n="n"),
        *intervals(base="Baseline %", other="Stop only %", shift="Change (pp)"),
        *p_values(p="p"),
    )
    rows: list[TableRow] = []
    for pair in _pairs(study):
        tables = pair.tables()
        for name, event in _EVENTS.values():
            base, other = (event(table) for table in tables)
            episodes = tables[0]["episode_id"].to_numpy(dtype=str)
            test: PairedTest = paired_test(base, other, episodes=episodes, houses=houses_of(tables[0]))
            everything = np.ones(len(base), dtype=bool)
            cells = {
                key: rate_cell(rate_of(hits, everything, episodes)) for key, hits in (("base", base), ("other", other))
            }
            cells |= {"model": name, "n": len(base), "shift": pp_cell(test.difference, test.interval), "p": test.test.p}
            rows.append(TableRow(cells, group=f"{pair.base.name} → {pair.other.name}"))
    return titled("stop_shifts", columns, rows)


def stop_costs(study: Study) -> Table:
    """Return the closure lag, number of steps and tokens of each pair of runs, with and without reports."""
    columns = (
        MODEL,
        N,
        *means(
            **{
                f"lag_{at}": (f"Lag, steps, {side}", lambda pair, at=at: _lag(pair.tables()[at]))
                for at, side in enumerate(_SIDES.values())
            }
        ),
        *sided_means(_MEANS, _SIDES),
    )
    rows = [run_row(study.entry(pair.other), cells_of(columns, pair)) for pair in _pairs(study)]
    return titled("stop_costs", columns, rows)


def true_reports(study: Study) -> Table:
    """Return which status would have been true when the agent ended an episode, and how often the report stated it."""
    columns = (*texts(model="A true report would say"), *counts(base="Reports", said="Said so", other="Stops"))
    rows: list[TableRow] = []
    for pair in _pairs(study):
        tables = pair.tables()
        wanted = [_true_report(table)[_ended(table)] for table in tables]
        reported = tables[0]["reported"].to_numpy(dtype=object)[_ended(tables[0])]
        has_said = np.array([_is_said(*one) for one in zip(wanted[0], reported, strict=True)], dtype=bool)
        for status in sorted({*wanted[0], *wanted[1]}):
            base, other = (side == status for side in wanted)
            cells = {"model": status, "base": int(base.sum()), "other": int(other.sum())}
            cells["said"] = int((base & has_said).sum())
            rows.append(TableRow(cells, group=f"{pair.base.name} → {pair.other.name}"))
    return titled("true_reports", columns, rows)


def _pairs(study: Study) -> list[Pair]:
    found = [pair for pair in study.pairing.profile if not pair.other.header.spec.profile.row.has_report]
    return [pair for pair in found if len(pair.tables()[0])]


def _true_report(rows: pd.DataFrame) -> np.ndarray:
    expected = rows["expected"].to_numpy(dtype=object)
    return np.where(expected != None, expected, np.where(_held(rows), "success", "fail"))  # noqa: E711 - by element


def _is_said(wanted: str, reported: str | None) -> bool:
    return reported == wanted or (wanted == "fail" and reported in NEGATIVE)


def _lag(rows: pd.DataFrame) -> RateCell:
    since = values(rows, "steps") - values(rows, "first_goal_step")
    return mean_with_interval(rows.assign(lag=np.where(_ended(rows) & _held(rows), since, np.nan)), "lag")
