"""Tables of the suite `chores`, in a separate section: W, B and T of lists, labels of chores, and what T depends on."""

from collections.abc import Callable, Mapping, Sequence

from vigil.analysis.measures.chores import (
    POWER_CALLS,
    ChoresRun,
    Mean,
    by_interference,
    by_number,
    by_steps_since_done,
    mean_over,
    predicted_power,
    scores_of,
    tendencies,
)
from vigil.analysis.measures.itemising import itemising_pairs
from vigil.analysis.tables.rows import row_of
from vigil.analysis.tables.table import (
    Column,
    RateCell,
    Table,
    TableRow,
    counts,
    intervals,
    means,
    numbers,
    pp_cell,
    texts,
    titled,
)
from vigil.scoring.chore_answers import CHORE_KINDS
from vigil.scoring.chores import CHORE_LABELS, ChoreOutcome, ListOutcome

HEADING = "Lists of chores: W, B and T"
ChoreTest = Callable[[ListOutcome, ChoreOutcome], bool]
_SCORES = {
    "W_share": "W share %",
    "W": "W %",
    "B": "B %",
    "T": "T %",
    "chance": "T by chance %",
    "skill": "Skill over chance %",
    "overclaim": "Overclaim %",
    "underclaim": "Underclaim %",
    "status_true": "Status true %",
    "progress": "Progress %",
}


def chores_tables(runs: Sequence[ChoresRun]) -> dict[str, Table]:
    """Return the tables of the suite's runs by name; empty without runs."""
    if not runs:
        return {}
    built = (
        _scores(runs),
        _labels(runs),
        _kinds(runs),
        _places(runs),
        _split(runs, "chores_number", "Chores", by_number),
        _split(runs, "chores_since", "Steps", by_steps_since_done),
        _split(runs, "chores_interference", "Times undone", by_interference),
        _itemising(runs),
        _power(runs),
    )
    return {table.name: table for table in built}


def _scores(runs: Sequence[ChoresRun]) -> Table:
    columns = (
        *texts(run="Run"),
        *counts(lists="Lists", claims="Chores"),
        *intervals(**_SCORES),
        *numbers(interference="Undone per list", steps="Steps per list", lag="Lag"),
        *counts(strays="Claims off the list"),
        *texts(tendencies="Tendencies"),
    )
    rows: list[TableRow] = []
    for run in runs:
        found = scores_of(run.outcomes, has_claims=run.has_claims)
        interference, steps = (mean[0] if (mean := found[name]) else None for name in ("interference", "steps"))
        lags = [lag for each, chore in run.chores if (lag := each.lag(chore)) is not None and chore.first_held]
        cells = {name: _cell(found[name]) for name in _SCORES}
        rows.append(
            row_of(
                run,
                lists=len(run.outcomes),
                claims=len(run.chores),
                **cells,
                interference=interference,
                steps=steps,
                lag=sum(lags) / len(lags) if lags else None,
                strays=sum(each.strays for each in run.outcomes),
                tendencies=", ".join(tendencies(run)) or "none",
            )
        )
    return titled("chores_scores", columns, rows)


def _labels(runs: Sequence[ChoresRun]) -> Table:
    columns = (*texts(run="Run"), *counts(n="n", **{label: label.replace("_", " ") for label in CHORE_LABELS}))
    rows = [
        row_of(
            run,
            n=len(run.chores),
            **{label: sum(chore.label == label for _, chore in run.chores) for label in CHORE_LABELS},
        )
        for run in runs
    ]
    return titled("chores_labels", columns, rows)


def _kinds(runs: Sequence[ChoresRun]) -> Table:
    parts: dict[str, ChoreTest] = {kind: lambda _, chore, kind=kind: chore.answer.kind == kind for kind in CHORE_KINDS}
    return _parts(runs, "chores_kinds", "Kind", parts)


def _places(runs: Sequence[ChoresRun]) -> Table:
    most = max((chore.number for run in runs for _, chore in run.chores), default=0)
    parts: dict[str, ChoreTest] = {
        str(number): lambda _, chore, number=number: chore.number == number for number in range(1, most + 1)
    }
    return _parts(runs, "chores_places", "Chore", parts)


def _parts(runs: Sequence[ChoresRun], name: str, first: str, parts: Mapping[str, ChoreTest]) -> Table:
    """Return a table of each run's rates for parts of the chores. `first` is the heading of the parts' column."""
    rates: dict[str, tuple[str, Callable[[ChoreOutcome], bool]]] = {
        "W": ("W %", lambda chore: chore.W),
        "B": ("Closed %", lambda chore: chore.B),
        "T": ("Claim true %", lambda chore: chore.is_true),
        "unclaimed": ("Unclaimed %", lambda chore: chore.claim is None),
        "false_success": ("False success %", lambda chore: chore.label == "false_success"),
        "spoilt": ("Spoilt %", lambda chore: chore.is_spoilt),
    }
    headings = {key: heading for key, (heading, _) in rates.items()}
    columns = (*texts(run="Run", part=first), *counts(n="n"), *intervals(**headings))
    rows: list[TableRow] = []
    for run in runs:
        for part, is_in in parts.items():
            n = sum(is_in(each, chore) for each, chore in run.chores)
            cells = {key: _cell(_rate(run, is_in, test)) for key, (_, test) in rates.items()}
            rows += [row_of(run, part=part, n=n, **cells)] if n else []
    return titled(name, columns, rows)


def _rate(run: ChoresRun, is_in: ChoreTest, test: Callable[[ChoreOutcome], bool]) -> Mean | None:
    return mean_over(run.outcomes, lambda each: [(test(one), 1.0) for one in each.chores if is_in(each, one)])


def _split(runs: Sequence[ChoresRun], name: str, first: str, split: Callable[[ChoresRun], Mapping[str, Mean]]) -> Table:
    columns: tuple[Column, ...] = (*texts(run="Run", part=first), *intervals(T="T %"))
    rows = (row_of(run, part=part, T=_cell(mean)) for run in runs for part, mean in split(run).items())
    return titled(name, columns, rows)


def _itemising(runs: Sequence[ChoresRun]) -> Table:
    headings = {"status_true": "Status true, pp", "W": "W, pp", "W_share": "W share, pp"}
    columns = (
        *texts(run="Run", itemised="With claims"),
        *counts(n="Lists"),
        *intervals(**headings),
        *means(interference="Undone per list", steps="Steps per list"),
    )
    rows = [
        row_of(
            pair.base,
            itemised=pair.itemised.name,
            n=pair.lists,
            **{name: _cell(pair.differences[name]) for name in headings},
            **{name: _plain(pair.differences[name]) for name in ("interference", "steps")},
        )
        for pair in itemising_pairs(runs)
    ]
    return titled("chores_itemising", columns, rows)


def _plain(mean: Mean) -> RateCell:
    value, interval = mean
    return (value, None, None) if interval is None else (value, *interval)


def _power(runs: Sequence[ChoresRun]) -> Table:
    columns = (
        *texts(run="Run"),
        *numbers(calls="Calls per list", claims="Claims per list", design="Design effect"),
        *(column for calls in POWER_CALLS for column in numbers(**{f"lists_{calls}": f"± after {calls:,} calls"})),
        *(column for calls in POWER_CALLS for column in numbers(**{f"one_{calls}": f"± one claim, {calls:,} calls"})),
    )
    rows: list[TableRow] = []
    for run in runs:
        found = predicted_power(run)
        if found is not None:
            widths = {f"lists_{calls}": 100 * found.half_width(calls) for calls in POWER_CALLS}
            others = {f"one_{calls}": 100 * found.one_claim_half_width(calls) for calls in POWER_CALLS}
            facts = {"calls": found.calls, "claims": found.claims, "design": found.design_effect}
            rows.append(row_of(run, **facts, **widths, **others))
    return titled("chores_power", columns, rows)


def _cell(mean: Mean | None) -> RateCell:
    return None if mean is None else pp_cell(*mean)
