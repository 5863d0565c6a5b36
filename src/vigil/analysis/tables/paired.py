"""Paired tables: changes between two runs of the same episodes that differ in one thing.

Each function takes a Study and returns one Table. Source: the paper's sections on feedback, prompt sensitivity and
serving modes.
"""

from collections.abc import Iterator, Sequence
from typing import Any

import pandas as pd

from vigil.analysis.measures.intervals import holm
from vigil.analysis.measures.metrics import LABELS, mean_with_interval, measure
from vigil.analysis.measures.models import checkpoint_of
from vigil.analysis.measures.pairs import Pair, family_differences, mean_difference
from vigil.analysis.measures.paper import Paper
from vigil.analysis.measures.study import Study, sorted_by_group
from vigil.analysis.measures.transitions import homogeneity, label_matrix, transitions
from vigil.analysis.tables.results import MODEL, published_group, published_row, run_row
from vigil.analysis.tables.table import (
    Column,
    RateCell,
    Table,
    TableRow,
    counts,
    formatted,
    intervals,
    points,
    rate_cells,
    texts,
)

TESTED = ("W", "B", "FR", "NR")
SHIFTED = {"W": "ΔW (pp)", "B": "ΔB (pp)", "Delta": "Change of Δ (pp)", "FR": "ΔFR (pp)", "NR": "ΔNR (pp)"}
INTERVAL_NOTE = "Intervals of differences: paired bootstrap over houses."
RATE_NOTE = "Those of rates: Wilson."
P_NOTE = "p: McNemar, exact, not corrected for the number of tests."
DISAGREEMENT_NOTE = (
    "An interval and a p may seem to disagree: the test treats episodes as independent and looks only at those that "
    "changed; the interval resamples houses, because episodes of one house are similar, and is not given below five "
    "houses."
)
_SHIFTS = intervals(**{f"d{name}": heading for name, heading in SHIFTED.items()})
_TESTS = tuple(Column(f"p_{name}", f"p ({name})", "p") for name in TESTED)
_KINDS = {"feedback": "+FB", "prompt": "neutral prompt", "serving": "thinking"}


def prompt_shifts(study: Study) -> Table:
    """Return the shift of each rate under the neutral prompt, with tests; for published rows only printed values."""
    columns = (
        MODEL,
        *counts(n="n"),
        *_SHIFTS,
        *_TESTS,
        *texts(largest="Largest shift of W or B in a family (pp)"),
    )
    rows = [
        run_row(
            study.entry(pair.other),
            {"n": len(pair.tables()[0]), **shifts(pair), **p_values(pair), "largest": _largest_shift(pair)},
            group=study.entry(pair.other).group,
        )
        for pair in _grouped(study, study.pairing.prompt)
    ]
    if study.published:
        rows += list(_published_prompt_shifts(study.published))
    notes = (
        f"Neutral minus default, over the episodes that both runs have scored. {INTERVAL_NOTE} {P_NOTE} The largest "
        "shift is the widest of sixteen, which its interval does not account for: it is a hint, not a finding.",
        "Published shifts are differences of printed rows. The paper does not print FR under the neutral prompt, so a "
        "shift of FR cannot be derived, and prints NR only in its text, for one model.",
        DISAGREEMENT_NOTE,
        *study.pairing.choices["prompt"],
    )
    return Table("prompt_shifts", "Prompt sensitivity: shifts from the default prompt", columns, tuple(rows), notes)


def serving_modes(study: Study) -> Table:
    """Return each checkpoint's thinking serving mode against its instruct counterpart."""
    sides = {"base": "instruct", "other": "thinking"}
    columns = (
        MODEL,
        *counts(n="n"),
        *intervals(**{f"{name}_{side}": f"{name} {shown} %" for side, shown in sides.items() for name in "WB"}),
        *_SHIFTS,
        *_TESTS,
        *intervals(steps_base="Steps instruct", steps_other="Steps thinking"),
    )
    rows = []
    for pair in _grouped(study, study.pairing.serving):
        cells: dict[str, Any] = {"n": len(pair.tables()[0]), **shifts(pair), **p_values(pair)}
        for side, table in zip(sides, pair.tables(), strict=True):
            rates = rate_cells(measure(table), "WB")
            cells |= {f"{name}_{side}": rate for name, rate in rates.items()}
            cells[f"steps_{side}"] = mean_with_interval(table, "steps")
        entry = study.entry(pair.other)
        rows.append(run_row(entry, cells, group=entry.group))
    if study.published:
        rows += list(_published_serving_modes(study.published))
    notes = (
        "Runs of one checkpoint that differ only in the serving mode; thinking minus instruct, over the "
        f"episodes that both have scored. Thinking is a run with reasoning in its answers, or one whose name or "
        f"settings say so; a mode that is not stated counts as instruct. {INTERVAL_NOTE} {P_NOTE}",
        f"{RATE_NOTE} Published differences are those of printed rows.",
        DISAGREEMENT_NOTE,
        *study.pairing.choices["serving"],
    )
    return Table("serving_modes", "Serving modes: thinking and instruct", columns, tuple(rows), notes)


def feedback_events(study: Study) -> Table:
    """Return how action feedback changes events and lengths of episodes."""
    names = {"too_far": "too_far", "path_blocked": "path_blocked", "retry": "retry", "steps": "Steps"}
    columns = (
        MODEL,
        *counts(n="n"),
        *(
            column
            for name, shown in names.items()
            for column in (
                Column(f"{name} base", f"{shown} base [95\u00a0%]", "mean"),
                Column(f"{name} fb", f"{shown} +FB [95\u00a0%]", "mean"),
                Column(f"{name} change", f"{shown} change %"),
            )
        ),
    )
    rows = []
    for pair in study.pairing.feedback:
        base, other = pair.tables()
        cells: dict[str, Any] = {"n": len(base)}
        for name in names:
            before, after = mean_with_interval(base, name), mean_with_interval(other, name)
            cells |= {f"{name} base": before, f"{name} fb": after, f"{name} change": _change(before, after)}
        rows.append(run_row(study.entry(pair.base), cells))
    notes = (
        "Means per episode; intervals: bootstrap over houses, not given if all agree. Change: relative to the base "
        "run.",
    )
    return Table("feedback_events", "Action feedback: events and steps", columns, tuple(rows), notes)


def transition_matrix(study: Study) -> Table:
    """Return the transitions of episodes between labels, for every pair of runs and every repeat."""
    columns = (
        *texts(model="Label before"),
        *counts(n="n"),
        *(Column(label, f"{label} after", "count") for label in LABELS),
    )
    rows = [
        TableRow({"model": label, "n": sum(after.values()), **after}, group=name)
        for name, base, other in _named_tables(study)
        for label, after in label_matrix(base, other).items()
    ]
    notes = (
        "Each row: the episodes with that label in the base run, by their label in the other. On the diagonal nothing "
        "changed. Runs of one condition are not added up: each run with an intervention is compared with one base, and "
        "each repeat with the first, which shows how many labels change when nothing else does.",
        *(note for notes in study.pairing.choices.values() for note in notes),
    )
    return Table("transitions", "Labels before and after", columns, tuple(rows), notes)


def transition_tests(study: Study) -> Table:
    """Return tests of changes in the labels' frequencies, and, for every two labels, of the two directions."""
    columns = (
        *texts(model="Labels", test="Test"),
        *counts(there="→", back="←"),
        *intervals(net="Net (pp)"),
        Column("p", "p", "p"),
        Column("p_holm", "p, Holm", "p"),
    )
    rows: list[TableRow] = []
    for name, base, other in _named_tables(study):
        if whole := homogeneity(base, other):
            shown = f"Stuart-Maxwell: χ² = {whole.statistic:.1f}, df = {whole.df}"
            rows.append(TableRow({"model": "all labels", "test": shown, "p": whole.p}, group=name))
        found = transitions(base, other)
        for one, adjusted in zip(found, holm([one.p for one in found]), strict=True):
            cells = {"there": one.forward, "back": one.backward, "net": points(one.net, one.interval), "p": one.p}
            cells |= {"test": "McNemar, exact", "p_holm": adjusted}
            rows.append(TableRow({"model": f"{one.source} → {one.target}", **cells}, group=name))
    notes = (
        "All labels: whether each is as frequent after as before; approximate, so with fewer than about ten changes "
        "only the exact tests count. →: episodes that went from the first label to the second; ←: those that went "
        "back; their p is corrected by Holm for the transitions of the same two runs. Net: → minus ←, as a share of "
        f"the shared episodes. {INTERVAL_NOTE}",
        DISAGREEMENT_NOTE,
    )
    return Table("transition_tests", "Transitions between labels, tested", columns, tuple(rows), notes)


def shifts(pair: Pair) -> dict[str, RateCell]:
    """Return the differences of a pair, other minus base, in points with intervals."""
    found = {name: mean_difference(pair, name) for name in SHIFTED}
    return {f"d{name}": None if shift is None else points(*shift) for name, shift in found.items()}


def p_values(pair: Pair) -> dict[str, float | None]:
    """Return McNemar's p for W, B, FR and NR."""
    return {f"p_{name}": pair.p(name) for name in TESTED}


def _grouped(study: Study, pairs: Sequence[Pair]) -> list[Pair]:
    """Return pairs in the order of the panels' groups, best B first in each."""
    order = [entry.name for entry in sorted_by_group(study.entries)]
    return sorted(pairs, key=lambda pair: order.index(pair.other.name))


def _named_tables(study: Study) -> Iterator[tuple[str, pd.DataFrame, pd.DataFrame]]:
    """Yield the heading and the rows of every two runs whose labels are compared."""
    pairing = study.pairing
    for pair in (*pairing.feedback, *pairing.prompt, *pairing.serving):
        base, other = pair.tables()
        if len(base):
            yield f"{pair.base.name} → {pair.other.name} ({_KINDS[pair.kind]})", base, other
    for repeats in pairing.repeats:
        for name, base, other in repeats.compared_with_first():
            if len(base):
                yield f"{repeats.names[0]} → {name} (repeat)", base, other


def _change(before: RateCell, after: RateCell) -> float | None:
    return 100 * (after[0] / before[0] - 1) if before and after and before[0] else None


def _largest_shift(pair: Pair) -> str | None:
    return _largest({place: points(*moved) for place, moved in family_differences(pair, "WB").items()})


def _largest(moved: dict[str, RateCell]) -> str | None:
    """Return the place and the size of the largest shift, with its interval if it has one."""
    known = {place: cell for place, cell in moved.items() if cell is not None}
    if not known:
        return None
    place = max(known, key=lambda place: abs(known[place][0]))
    size, low, high = known[place]
    ends = "" if low is None or high is None else f" [{formatted(low, 'signed1')}, {formatted(high, 'signed1')}]"
    return f"{place} {formatted(size, 'signed1')}{ends}" if size else "none"


def _published_prompt_shifts(paper: Paper) -> Iterator[TableRow]:
    before = {model.name: (w, b) for model, w, b in paper.points()}
    families = {row["model"]: row["families"] for row in paper.tables["full_panel"]}
    for model, row in paper.rows("prompt_sensitivity"):
        cells: dict[str, Any] = _printed_shifts(before[model.name], (row["W"], row["B"]))
        for name in ("FR", "NR"):
            said = paper.text.get(model.name, {})
            if name in said and f"{name}_neutral" in said:
                cells[f"d{name}"] = round(said[f"{name}_neutral"] - said[name], 1)
        moved: dict[str, RateCell] = {
            f"{family} {name}": (round(after[i] - families[model.name][family][i], 1), None, None)
            for family, after in row["families"].items()
            for i, name in enumerate("WB")
            if model.name in families
        }
        yield published_row(model, {**cells, "largest": _largest(moved)}, group=published_group(model))


def _published_serving_modes(paper: Paper) -> Iterator[TableRow]:
    rows = {model.name: (model, (w, b)) for model, w, b in paper.points()}
    instruct = {checkpoint_of(name): values for name, (model, values) in rows.items() if model.thinking is not True}
    for name, (model, values) in rows.items():
        if model.thinking and checkpoint_of(name) in instruct:
            base = instruct[checkpoint_of(name)]
            cells: dict[str, Any] = {f"{rate}_base": value for rate, value in zip("WB", base, strict=True)}
            cells |= {f"{rate}_other": value for rate, value in zip("WB", values, strict=True)}
            cells |= _printed_shifts(base, values)
            yield published_row(model, cells, group=published_group(model))


def _printed_shifts(before: tuple[float, float], after: tuple[float, float]) -> dict[str, float]:
    """Return the differences of W, B and the gap between two printed rows."""
    w, b = (round(two - one, 1) for one, two in zip(before, after, strict=True))
    return {"dW": w, "dB": b, "dDelta": round(w - b, 1)}
