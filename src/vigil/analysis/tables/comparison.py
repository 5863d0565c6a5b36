"""Comparison tables: differences between runs, their tests, and the smallest differences that can be detected.

Each function takes a Study and returns one Table. Source: `protocol.md` section 6.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import combinations

from vigil.analysis.measures.intervals import (
    holm,
    independent_difference,
    smallest_difference,
    smallest_paired_difference,
)
from vigil.analysis.measures.metrics import COMPARABLE_W_PP, RunMetrics
from vigil.analysis.measures.pairs import RunComparison
from vigil.analysis.measures.study import RunEntry, Study, sorted_by_role
from vigil.analysis.tables.rows import MODEL, RUN, run_row, shown_name, with_values
from vigil.analysis.tables.run_tables import rows_by_b
from vigil.analysis.tables.table import (
    Column,
    Table,
    TableRow,
    cells_of,
    counts,
    in_percent,
    intervals,
    numbers,
    p_values,
    pp_cell,
    texts,
    titled,
)
from vigil.scoring.rates import CONDITIONAL, RATES, wilson

PUBLISHED_EPISODES = 1000
"""Number of episodes from which each published rate was computed."""
CONDITIONAL_HEADINGS = {
    "P_B_W1": "P(B | W=1)",
    "P_FR_W0": "P(FR | W=0)",
    "P_rep_W0": "P(rep | W=0)",
    "P_norep_W1": "P(no rep | W=1)",
    "P_zero_FS": "FS @0",
    "P_high_FS": "FS > 0.75",
}
"""Conditional rate -> its heading, without the unit."""
_HOUSES = ("Houses", lambda entry: entry.run.rows["house"].nunique())
_SIZE = ("n", lambda entry: entry.overall.n)


def clustered(study: Study) -> Table:
    """Return a table of W, B and Delta with intervals that account for the fact that episodes share houses."""
    columns = (RUN, *counts(n=_SIZE, houses=_HOUSES), *_rates_by_houses(RATES))
    return titled("clustered", columns, rows_by_b(study, columns))


def clustered_conditional(study: Study) -> Table:
    """Return a table of conditional rates, with intervals that account for the fact that episodes share houses."""
    columns = (RUN, *_rates_by_houses(CONDITIONAL))
    return titled("clustered_conditional", columns, rows_by_b(study, columns))


def family_clustered(study: Study) -> Table:
    """Return a table of each family's rates, with intervals that account for the fact that episodes share houses."""
    columns = (RUN, *texts(family="Family"), *counts(n=_SIZE, houses=_HOUSES), *_rates_by_houses(RATES))
    rows = [
        run_row(part, {"family": family, **cells_of(columns, part)})
        for entry in sorted_by_role(study.entries)
        for family, part in entry.family_parts()
    ]
    return titled("family_clustered", columns, rows)


def published_differences(study: Study) -> Table:
    """Return a table of your own and the published rates of the same models, and their differences."""
    columns = (
        MODEL,
        *texts(rate="Rate"),
        *intervals(own="Own", printed="Published"),
        *intervals(difference="Own minus published (pp)"),
    )
    printed = {model.name: (w, b) for model, w, b in study.published.points()} if study.published else {}
    rows = []
    for entry in study.main_runs():
        w, b = printed.get(entry.published or "", (None, None))
        if w is None or b is None or not entry.overall.n:
            continue
        for name, value in (("W", w), ("B", b), ("Delta", w - b)):
            rows.append(run_row(entry, _difference_cells(entry, name, value / 100)))
    return titled("published_differences", columns, rows, published_episodes=PUBLISHED_EPISODES)


def _difference_cells(entry: RunEntry, name: str, value: float) -> dict[str, object]:
    """Return the cells that compare one rate of a run with `value`, the published rate as a fraction."""
    own, printed = entry.overall.share(name) or 0.0, wilson(PUBLISHED_EPISODES * value, PUBLISHED_EPISODES)
    ends = entry.by_houses[name]
    found = None if ends is None else independent_difference((own, *ends), (value, *printed))[1]
    return {
        "rate": shown_name(name),
        "own": pp_cell(own, ends),
        "printed": pp_cell(value, printed),
        "difference": pp_cell(own - value, found),
    }


def _rates_by_houses(names: Iterable[str]) -> tuple[Column, ...]:
    headings = {name: shown_name(CONDITIONAL_HEADINGS.get(name, name)) for name in names}
    return intervals(
        **with_values(headings, lambda entry, name: pp_cell(entry.overall.share(name), entry.by_houses[name]))
    )


def comparisons(study: Study) -> Table:
    """Return paired tests between runs on the same episodes."""
    columns = (
        *texts(first=("First", lambda pair: pair.first.name), second=("Second", lambda pair: pair.second.name)),
        *counts(n=("Shared episodes", lambda pair: pair.n)),
        *intervals(dW=("ΔW (pp)", lambda pair: pp_cell(pair.w.difference, pair.w.interval))),
        *p_values(p_W=("p (W)", lambda pair: pair.w.test.p), p_W_holm="p (W), Holm"),
        *intervals(dB=("ΔB (pp)", lambda pair: pp_cell(pair.b.difference, pair.b.interval))),
        *p_values(p_B=("p (B)", lambda pair: pair.b.test.p), p_B_holm="p (B), Holm"),
        *intervals(dDelta=("Change of the gap (pp)", lambda pair: pp_cell(*pair.delta))),
        *texts(verdict="Different?"),
    )
    pairs = study.comparisons
    adjusted = holm([pair.w.test.p for pair in pairs] + [pair.b.test.p for pair in pairs])
    rows = []
    for pair, p_w, p_b in zip(pairs, adjusted[: len(pairs)], adjusted[len(pairs) :], strict=True):
        different = " and ".join(name for name, p in (("W", p_w), ("B", p_b)) if p < 0.05)
        tested = {"p_W_holm": p_w, "p_B_holm": p_b, "verdict": f"in {different}" if different else "not shown"}
        rows.append(TableRow({**cells_of(columns, pair), **tested}))
    return titled("comparisons", columns, rows)


def comparable_pairs(study: Study) -> Table:
    """Return pairs of rows that have similar W but different B; your own and published rows are not mixed in a pair."""
    columns = (*texts(first="Higher B", second="Lower B", W="W % of both"), *intervals(dW="ΔW (pp)", dB="ΔB (pp)"))
    own = [
        (e.name, in_percent(e.overall.share("W")) or 0.0, in_percent(e.overall.share("B")) or 0.0)
        for e in study.main_runs()
        if e.overall.n
    ]
    tested = {frozenset((c.first.name, c.second.name)): c for c in study.comparisons}
    rows = [_with_intervals(row, tested) for row in _pairs_close_in_w(own, is_published=False)]
    if study.published:
        anchors = [(model.name, w, b) for model, w, b in study.published.points() if model.anchor]
        rows += _pairs_close_in_w(anchors, is_published=True)
    return titled("comparable_pairs", columns, rows, comparable_w_pp=COMPARABLE_W_PP)


def power(study: Study) -> Table:
    """Return the smallest differences that can be detected with the runs' numbers of episodes."""
    columns = (
        RUN,
        *counts(n=_SIZE),
        *numbers(
            W=("in W, two systems (pp)", lambda entry: _detectable(entry.overall, "W")),
            B=("in B, two systems (pp)", lambda entry: _detectable(entry.overall, "B")),
            B_paired=(
                "in B, paired, 10 % discordant (pp)",
                lambda entry: in_percent(smallest_paired_difference(entry.overall.episodes, 0.1)),
            ),
            family=("in W of one family (pp)", _detectable_in_family),
        ),
    )
    return titled("power", columns, rows_by_b(study, columns))


def _pairs_close_in_w(points: Sequence[tuple[str, float, float]], *, is_published: bool) -> list[TableRow]:
    found = []
    for first, second in combinations(points, 2):
        high, low = sorted((first, second), key=lambda point: -point[2])
        if abs(high[1] - low[1]) <= COMPARABLE_W_PP + 1e-9 and high[2] > low[2]:
            found.append((high[2] - low[2], high, low))
    found.sort(key=lambda pair: (-pair[0], pair[1][0]))
    group = "Published anchors" if is_published else ""
    rows = []
    for gap, high, low in found[:5]:
        cells = {"first": high[0], "second": low[0], "W": f"{high[1]:.1f} and {low[1]:.1f}"}
        rows.append(TableRow({**cells, "dW": high[1] - low[1], "dB": gap}, group, is_published))
    return rows


def _with_intervals(row: TableRow, tested: Mapping[frozenset[str], RunComparison]) -> TableRow:
    """Return the row of a pair of runs, with the intervals of its differences if the pair was tested."""
    found = tested.get(frozenset((row.cells["first"], row.cells["second"])))
    if found is None:
        return row
    sign = 1.0 if found.second.name == row.cells["first"] else -1.0
    ends = {"dW": found.w.interval, "dB": found.b.interval}
    cells = {
        name: pp_cell(row.cells[name] / 100, None if pair is None else (min(turned), max(turned)))
        for name, pair in ends.items()
        for turned in [tuple(sign * end for end in pair or ())]
    }
    return replace(row, cells={**row.cells, **cells})


def _detectable(measures: RunMetrics, name: str) -> float | None:
    """Return the smallest detectable difference of W or B, in percentage points.

    The rate is clipped away from 0 and 1, where the normal approximation would detect any difference.
    """
    rate = measures.share(name)
    inside = min(0.95, max(0.05, rate if rate is not None else 0.5))
    return in_percent(smallest_difference(measures.rate(name).effective_n, inside))


def _detectable_in_family(entry: RunEntry) -> float | None:
    """Return the smallest detectable difference of W in the family with the fewest independent plays."""
    smallest = min((part.rate("W").effective_n for part in entry.families.values()), default=0)
    return in_percent(smallest_difference(smallest, 0.5))
