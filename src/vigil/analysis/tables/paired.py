"""Paired tables: changes between two runs of the same episodes that differ in one thing.

Each function takes a Study and returns one Table. Source: the paper's sections on feedback, prompt sensitivity and
serving modes.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any

import pandas as pd

from vigil.analysis.measures.intervals import holm
from vigil.analysis.measures.metrics import LABELS, mean_with_interval
from vigil.analysis.measures.models import checkpoint_of
from vigil.analysis.measures.pairs import Pair, family_differences, mean_difference
from vigil.analysis.measures.paper import Paper
from vigil.analysis.measures.study import Study, sorted_by_group
from vigil.analysis.measures.transitions import homogeneity, label_matrix, transitions
from vigil.analysis.tables.rows import MODEL, published_group, published_row, run_row
from vigil.analysis.tables.table import (
    Column,
    RateCell,
    Table,
    TableRow,
    cells_of,
    counts,
    formatted,
    intervals,
    means,
    numbers,
    p_values,
    pp_cell,
    rate_cell,
    texts,
    titled,
)

TESTED = ("W", "B", "FR", "NR")
SHIFTED = {"W": "ΔW (pp)", "B": "ΔB (pp)", "Delta": "Change of Δ (pp)", "FR": "ΔFR (pp)", "NR": "ΔNR (pp)"}


def shift(pair: Pair, name: str) -> RateCell:
    """Return the change (pp) of a rate from the base run to the other, with interval; None without shared episodes."""
    found = mean_difference(pair, name)
    return None if found is None else pp_cell(*found)


def shifts(names: Iterable[str]) -> tuple[Column, ...]:
    """Return columns with the differences of a pair's rates: other run minus base run, with intervals."""
    return intervals(**{f"d{name}": (SHIFTED[name], lambda pair, name=name: shift(pair, name)) for name in names})


N = Column("n", "n", "count", lambda pair: len(pair.tables()[0]))
"""Column of the number of plays that both runs of a pair have scored."""
TESTS = p_values(**{f"p_{name}": (f"p ({name})", lambda pair, name=name: pair.p(name)) for name in TESTED})
"""Columns of McNemar's p for W, B, FR and NR."""
_KINDS = {
    "feedback": "+FB",
    "profile": "profile",
    "prompt": "neutral prompt",
    "serving": "thinking",
    "perturbation": "perturbed",
}


def prompt_shifts(study: Study) -> Table:
    """Return the shift of each rate under the neutral prompt, with tests. Published rows have no tests."""
    columns = (
        MODEL,
        N,
        *shifts(SHIFTED),
        *TESTS,
        *texts(largest=("Largest shift of W or B in a family (pp)", _largest_shift)),
    )
    rows = _grouped_rows(study, study.pairing.prompt, columns)
    if study.published:
        rows += _published_prompt_shifts(study.published)
    return titled("prompt_shifts", columns, rows, *study.pairing.choices["prompt"])


def profile_shifts(study: Study) -> Table:
    """Return the shift of each rate under each profile, with tests, closure lag, number of steps and tokens."""
    measures = {"lag": "Lag, steps", "steps": "Steps", "input_tokens": "Input tokens", "output_tokens": "Output tokens"}
    columns = (
        MODEL,
        *texts(profile=("Profile", lambda pair: pair.other.header.spec.profile.row.short)),
        N,
        *shifts(SHIFTED),
        *TESTS,
        *sided_means(measures, {"baseline": "baseline", "here": "here"}),
    )
    rows = [run_row(study.entry(pair.other), cells_of(columns, pair)) for pair in study.pairing.profile]
    return titled("profile_shifts", columns, rows, *study.pairing.choices["profile"])


def perturbation_shifts(study: Study) -> Table:
    """Return W and B on perturbed packs and on their originals, with the differences of all rates, tests and steps."""
    sides = ("original", "perturbed")
    rates = {
        f"{name}_{side}": (f"{name} {side} %", lambda pair, at=at, name=name: rate_cell(pair.measures[at].rate(name)))
        for name in "WB"
        for at, side in enumerate(sides)
    }
    steps = {f"steps_{side}": (f"Steps {side}", _mean_of("steps", at)) for at, side in enumerate(sides)}
    columns = (
        MODEL,
        *texts(change=("Changed", lambda pair: pair.other.perturbation and pair.other.perturbation.change)),
        *counts(
            seed=("Seed", lambda pair: pair.other.perturbation and pair.other.perturbation.seed),
            n=("n", lambda pair: len(pair.tables()[0])),
        ),
        *intervals(**rates),
        *shifts(TESTED),
        *TESTS,
        *means(**steps),
    )
    rows = [run_row(study.entry(pair.other), cells_of(columns, pair)) for pair in study.pairing.perturbation]
    return titled("perturbation_shifts", columns, rows, *study.pairing.choices["perturbation"])


def sided_means(measures: Mapping[str, str], sides: Mapping[str, str]) -> tuple[Column, ...]:
    """Return a column for each measure on each side of a pair: its mean in that run. Arguments are {key: heading}."""
    return means(
        **{
            f"{name}_{side}": (f"{shown}, {words}", _mean_of(name, at))
            for name, shown in measures.items()
            for at, (side, words) in enumerate(sides.items())
        }
    )


def _mean_of(name: str, at: int) -> Callable[[Pair], RateCell]:
    """Return the function that gives the mean of a column in one run of a pair."""
    return lambda pair: mean_with_interval(pair.tables()[at], name)


def serving_modes(study: Study) -> Table:
    """Return a table that compares each checkpoint in thinking mode with the same checkpoint in instruct mode."""
    sides = (("base", "instruct", 0), ("other", "thinking", 1))
    rates = {
        f"{name}_{side}": (f"{name} {shown} %", lambda pair, at=at, name=name: rate_cell(pair.measures[at].rate(name)))
        for side, shown, at in sides
        for name in "WB"
    }
    steps = {f"steps_{side}": (f"Steps {shown}", _mean_of("steps", at)) for side, shown, at in sides}
    columns = (MODEL, N, *intervals(**rates), *shifts(SHIFTED), *TESTS, *intervals(**steps))
    rows = _grouped_rows(study, study.pairing.serving, columns)
    if study.published:
        rows += _published_serving_modes(study.published)
    return titled("serving_modes", columns, rows, *study.pairing.choices["serving"])


def feedback_events(study: Study) -> Table:
    """Return a table of how action feedback changes the number of events and the length of episodes."""
    names = {"too_far": "too_far", "path_blocked": "path_blocked", "retry": "retry", "steps": "Steps"}
    columns = [MODEL, N]
    for name, shown in names.items():
        columns += means(**{f"{name} base": f"{shown} base", f"{name} fb": f"{shown} +FB"})
        columns += numbers(**{f"{name} change": f"{shown} change %"})
    rows = []
    for pair in study.pairing.feedback:
        cells = cells_of(columns, pair)
        for name in names:
            before, after = (mean_with_interval(rows_of, name) for rows_of in pair.tables())
            change = 100 * (after[0] / before[0] - 1) if before and after and before[0] else None
            cells |= {f"{name} base": before, f"{name} fb": after, f"{name} change": change}
        rows.append(run_row(study.entry(pair.base), cells))
    return titled("feedback_events", tuple(columns), rows)


def transition_matrix(study: Study) -> Table:
    """Return how many episodes changed from each label to each other label, for every pair of runs and every repeat."""
    columns = (*texts(model="Label before"), *counts(n="n", **{label: f"{label} after" for label in LABELS}))
    rows = [
        TableRow({"model": label, "n": sum(after.values()), **after}, group=name)
        for name, base, other in named_tables(study)
        for label, after in label_matrix(base, other).items()
    ]
    return titled("transitions", columns, rows, *(note for notes in study.pairing.choices.values() for note in notes))


def transition_tests(study: Study) -> Table:
    """Return tests of whether each label became more or less frequent, and of whether changes between two labels were
    more frequent in one direction."""
    columns = (
        *texts(model="Labels", test="Test"),
        *counts(there="→", back="←"),
        *intervals(net="Net (pp)"),
        *p_values(p="p", p_holm="p, Holm"),
    )
    rows: list[TableRow] = []
    for name, base, other in named_tables(study):
        if whole := homogeneity(base, other):
            shown = f"Stuart-Maxwell: χ² = {whole.statistic:.1f}, df = {whole.df}"
            rows.append(TableRow({"model": "all labels", "test": shown, "p": whole.p}, group=name))
        found = transitions(base, other)
        for one, adjusted in zip(found, holm([one.p for one in found]), strict=True):
            cells = {"there": one.forward, "back": one.backward, "net": pp_cell(one.net, one.interval), "p": one.p}
            cells |= {"test": "McNemar, exact", "p_holm": adjusted}
            rows.append(TableRow({"model": f"{one.source} → {one.target}", **cells}, group=name))
    return titled("transition_tests", columns, rows)


def _grouped_rows(study: Study, pairs: Sequence[Pair], columns: Sequence[Column]) -> list[TableRow]:
    """Return one row for each pair, named after its second run. Rows are sorted by the panels' groups, then by B."""
    by_name = {pair.other.name: pair for pair in pairs}
    return [
        run_row(entry, cells_of(columns, by_name[entry.name]), entry.group)
        for entry in sorted_by_group(study.entries)
        if entry.name in by_name
    ]


def named_tables(study: Study) -> Iterator[tuple[str, pd.DataFrame, pd.DataFrame]]:
    """Yield (heading, rows of the first run, rows of the second run) for every two runs whose labels are compared."""
    pairing = study.pairing
    for pair in (*pairing.feedback, *pairing.profile, *pairing.prompt, *pairing.serving, *pairing.perturbation):
        base, other = pair.tables()
        if len(base) and pair.defines("label"):
            yield f"{pair.base.name} → {pair.other.name} ({_KINDS[pair.kind]})", base, other
    for repeats in pairing.repeats:
        for name, base, other in repeats.compared_with_first():
            if len(base) and study.entry(repeats.run).overall.has_reports:
                yield f"{repeats.names[0]} → {name} (repeat)", base, other


def _largest_shift(pair: Pair) -> str | None:
    return _largest({place: pp_cell(*moved) for place, moved in family_differences(pair, "WB").items()})


def _largest(moved: dict[str, RateCell]) -> str | None:
    """Return a text with the name and the size of the largest shift, and its interval if it has one."""
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
        yield published_row(model, {**cells, "largest": _largest(moved)}, published_group(model))


def _published_serving_modes(paper: Paper) -> Iterator[TableRow]:
    rows = {model.name: (model, (w, b)) for model, w, b in paper.points()}
    instruct = {checkpoint_of(name): values for name, (model, values) in rows.items() if model.thinking is not True}
    for name, (model, values) in rows.items():
        if model.thinking and checkpoint_of(name) in instruct:
            base = instruct[checkpoint_of(name)]
            cells: dict[str, Any] = {f"{rate}_base": value for rate, value in zip("WB", base, strict=True)}
            cells |= {f"{rate}_other": value for rate, value in zip("WB", values, strict=True)}
            cells |= _printed_shifts(base, values)
            yield published_row(model, cells, published_group(model))


def _printed_shifts(before: tuple[float, float], after: tuple[float, float]) -> dict[str, float]:
    """Return the differences of W, B and the gap W - B between two published rows."""
    w, b = (round(two - one, 1) for one, two in zip(before, after, strict=True))
    return {"dW": w, "dB": b, "dDelta": round(w - b, 1)}
