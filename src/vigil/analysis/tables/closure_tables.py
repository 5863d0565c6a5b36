"""Tables of the closure-stress suite, in a separate section: correct closure (C) by kind of episode, and results of
twins."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any

from vigil.analysis.measures.closure import ClosureRun, correct_pairs, discrimination, house_interval, rate
from vigil.analysis.tables.rows import row_of
from vigil.analysis.tables.table import (
    Column,
    RateCell,
    Table,
    TableRow,
    counts,
    intervals,
    pp_cell,
    rate_cell,
    texts,
    titled,
)
from vigil.scoring.closure import CLOSURE_KINDS, CLOSURE_LABELS, PAIRED, ClosureOutcome
from vigil.scoring.rates import Interval

HEADING = "Closure stress: C, correct closure"
OutcomePredicate = Callable[[ClosureOutcome], bool]
NamedParts = Iterator[tuple[dict[str, str], Sequence[ClosureOutcome]]]
"""Parts of a run's outcomes. Each part has the cells that name it (column -> text) and its outcomes."""

_BY_KIND: dict[str, tuple[str, OutcomePredicate]] = {
    "W": ("W %", lambda each: each.outcome.W),
    "false_success": ("False success, of all %", lambda each: each.is_false_success),
    "no_report": ("No report %", lambda each: not each.outcome.is_reported),
    "needless": ("Acted needlessly %", lambda each: each.is_needless),
    "knowing": ("Closed knowingly %", lambda each: each.is_knowing),
    "refused": ("Met a silent refusal %", lambda each: each.is_refused),
    "wrong_object": ("The look-alike instead %", lambda each: each.is_wrong_object),
}
_ON_SECOND: dict[str, tuple[str, OutcomePredicate]] = {
    "concession": ("Honest concession %", lambda each: each.C),
    "exact": ("... by the exact status %", lambda each: each.C and each.is_exact),
    "informed": ("... having seen all evidence %", lambda each: each.C and each.evidence_seen == 1.0),
    "false_success": ("False success %", lambda each: each.is_false_success),
}
_ON_FIRST: dict[str, tuple[str, OutcomePredicate]] = {
    "twin": ("Its possible twin: C %", lambda each: each.C),
    "gave_up": ("Possible twin given up %", lambda each: each.gave_up),
    "gave_up_early": ("... before all evidence was seen %", lambda each: each.gave_up_early),
}
_BY_FORM = {
    "false_success": _ON_SECOND["false_success"],
    **{name: _BY_KIND[name] for name in ("needless", "knowing", "wrong_object")},
}


def closure_tables(runs: Sequence[ClosureRun]) -> dict[str, Table]:
    """Return {name: table} for runs of the closure-stress suite; empty without runs."""
    if not runs:
        return {}
    built = (_kinds(runs), _forms(runs), _labels(runs), _pairs(runs), _impossible(runs))
    return {table.name: table for table in built}


def _kinds(runs: Sequence[ClosureRun]) -> Table:
    def parts(run: ClosureRun) -> NamedParts:
        yield from (({"kind": kind}, run.outcomes_of(kind)) for kind in run.kinds)
        yield {"kind": "all"}, list(run.outcomes)

    columns, rows = _rates_of_parts(runs, {"kind": "Kind"}, parts, _BY_KIND)
    return titled("closure_kinds", columns, rows)


def _forms(runs: Sequence[ClosureRun]) -> Table:
    def parts(run: ClosureRun) -> NamedParts:
        for kind in run.kinds:
            of_form: dict[str, list[ClosureOutcome]] = {}
            for each in run.outcomes_of(kind):
                of_form.setdefault(_form(each), []).append(each)
            yield from (({"kind": kind, "form": form}, part) for form, part in sorted(of_form.items()))

    columns, rows = _rates_of_parts(runs, {"kind": "Kind", "form": "Form"}, parts, _BY_FORM)
    return titled("closure_forms", columns, rows)


def _rates_of_parts(
    runs: Sequence[ClosureRun],
    headings: dict[str, str],
    parts: Callable[[ClosureRun], NamedParts],
    wanted: dict[str, tuple[str, OutcomePredicate]],
) -> tuple[tuple[Column, ...], tuple[TableRow, ...]]:
    """Return the columns and rows of a table with C and other rates for parts of each run.

    `parts` returns the parts of a run; `headings` are the headings of the columns that name a part.
    """
    rates = {"C": "C %", **{key: heading for key, (heading, _) in wanted.items()}}
    columns = (*texts(run="Run", **headings), *counts(n="n"), *intervals(**rates))
    rows = (
        row_of(run, **names, n=len(part), C=_c_cell(part), **_rates(part, wanted))
        for run in runs
        for names, part in parts(run)
    )
    return columns, tuple(rows)


def _form(outcome: ClosureOutcome) -> str:
    answer = outcome.answer
    form = "" if CLOSURE_KINDS[answer.kind].has_branches else answer.form
    return answer.reason or " ".join(filter(None, (answer.side, form))) or "-"


def _labels(runs: Sequence[ClosureRun]) -> Table:
    headings = {label: label.replace("_", " ") for label in CLOSURE_LABELS}
    columns = (*texts(run="Run", kind="Kind"), *counts(n="n", **headings))
    rows = []
    for run in runs:
        for kind in run.kinds:
            part = run.outcomes_of(kind)
            found = {label: sum(each.label == label for each in part) for label in CLOSURE_LABELS}
            rows.append(row_of(run, kind=kind, n=len(part), **found))
    return titled("closure_labels", columns, rows)


def _c_cell(part: Sequence[ClosureOutcome]) -> RateCell:
    """Return C with its interval from resampled houses, or Wilson's interval if there are too few houses."""
    cell, interval = rate_cell(rate(part, lambda each: each.C)), house_interval(part, lambda each: each.C)
    return cell if cell is None or interval is None else pp_cell(cell[0] / 100, interval)


def _pairs(runs: Sequence[ClosureRun]) -> Table:
    columns = (
        *texts(run="Run", kind="Kind"),
        *counts(pairs="Pairs"),
        *intervals(right="Both twins right %", auc="AUC %"),
        *texts(d_prime="d' [95\u00a0%]"),
    )
    rows = []
    for run in runs:
        for kind in (kind for kind in run.kinds if kind in PAIRED):
            part = run.outcomes_of(kind)
            found = discrimination(part)
            rows.append(
                row_of(
                    run,
                    kind=kind,
                    pairs=found.pairs,
                    right=rate_cell(correct_pairs(part)),
                    auc=pp_cell(found.auc, found.auc_interval),
                    d_prime=_with_interval(found.d_prime, found.d_prime_interval)
                    if "impossible" in PAIRED[kind]
                    else None,
                )
            )
    return titled("closure_pairs", columns, rows)


def _impossible(runs: Sequence[ClosureRun]) -> Table:
    headings = {key: heading for key, (heading, _) in {**_ON_SECOND, **_ON_FIRST}.items()}
    columns = (*texts(run="Run", reason="Reason"), *counts(n="n"), *intervals(**headings, seen="Evidence seen"))
    rows = []
    for run in runs:
        part = run.outcomes_of("impossible")
        reasons = sorted({each.answer.reason for each in part if each.answer.reason is not None})
        for name in [*reasons, "all"] if reasons else []:
            second = [each for each in part if each.answer.reason == name or (name == "all" and each.answer.reason)]
            pairs = {each.answer.pair for each in second}
            first = [each for each in part if each.answer.reason is None and each.answer.pair in pairs]
            cells = {**_rates(second, _ON_SECOND), **_rates(first, _ON_FIRST), "seen": _mean_seen(second)}
            rows.append(row_of(run, reason=name, n=len(second), **cells))
    return titled("closure_impossible", columns, rows)


def _rates(part: Sequence[ClosureOutcome], wanted: dict[str, tuple[str, OutcomePredicate]]) -> dict[str, Any]:
    return {key: rate_cell(rate(part, is_hit)) for key, (_, is_hit) in wanted.items()}


def _mean_seen(part: Sequence[ClosureOutcome]) -> RateCell:
    conceded = [each for each in part if each.C and each.evidence_seen is not None]
    shares = [each.evidence_seen or 0.0 for each in conceded]
    interval = house_interval(conceded, lambda each: each.evidence_seen or 0.0)
    return pp_cell(sum(shares) / len(shares), interval) if shares else None


def _with_interval(value: float | None, interval: Interval | None) -> str | None:
    ends = "" if interval is None else f" [{interval[0]:.2f}, {interval[1]:.2f}]"
    return None if value is None else f"{value:.2f}{ends}"
