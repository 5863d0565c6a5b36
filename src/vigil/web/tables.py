"""Tables and charts of runs as plain values for templates: rates, shares of outcomes, and comparisons of two runs."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, get_args

import numpy as np

from vigil.analysis.measures.intervals import paired_test
from vigil.protocol.families import FAMILIES
from vigil.records.costs import describe_costs
from vigil.scoring.outcomes import Label, Outcome
from vigil.scoring.rates import count, outcome_columns
from vigil.scoring.saved_run import RecordTable
from vigil.scoring.summary import RunScores
from vigil.web.library import LibraryRun
from vigil.web.phrases import LABELS as LABEL_WORDS

RATE_COLUMNS = ("W", "B", "Delta", "FR", "NR", "IL")
LABELS: tuple[Label, ...] = get_args(Label)
CHART_WIDTH = 1000.0


@dataclass(frozen=True, slots=True)
class RunRow:
    """A run in the table of runs."""

    run: LibraryRun
    rates: dict[str, Any] | None
    left_out: int = 0


@dataclass(frozen=True, slots=True)
class RunGroup:
    """The runs of one pack in the table of runs; runs of different packs are not ranked together."""

    pack: str
    sha256: str
    """The pack's hash; empty for runs whose header cannot be read."""
    rows: list[RunRow]


@dataclass(frozen=True, slots=True)
class Segment:
    """A segment of a stacked bar: the episodes with one label. Lengths are in the chart's units."""

    label: Label
    count: int
    x: float
    width: float
    share: float


@dataclass(frozen=True, slots=True)
class Bar:
    """One stacked bar, for all episodes or for the episodes of a family."""

    name: str
    count: int
    segments: tuple[Segment, ...]


def progress_of(run: LibraryRun, table: RecordTable, scores: RunScores) -> dict[str, Any]:
    """Return a run's progress in numbers of episodes, and a text about its cost so far, empty if that is unknown.

    `played` counts episodes that were scored or ended as an error; `counts` has the number for W and for each label.
    """
    outcomes, tokens = scores.outcomes, table.tokens
    labels = Counter(outcome.label for outcome in outcomes)
    played = len(outcomes) + len(scores.errors)
    is_known = run.prices is not None or tokens.total.reported
    return {
        "played": played,
        "planned": max(table.planned, played),
        "counts": {"W": sum(outcome.W for outcome in outcomes), **{label: labels[label] for label in LABELS}},
        "errors": len(scores.errors),
        "cost": describe_costs(run.prices, tokens) if is_known else "",
    }


def sorted_run_rows(runs: Iterable[LibraryRun], family: str, sort: str, descending: bool) -> list[RunRow]:
    """Return the rows of the table of runs, sorted by a rate or by name; runs that do not have the rate come last."""
    rows = [_run_row(run, family) for run in runs]
    if sort not in RATE_COLUMNS:
        return sorted(rows, key=lambda row: (row.run.name, row.run.slug), reverse=descending and sort == "name")
    with_rate = [row for row in rows if row.rates is not None and row.rates[sort] is not None]
    without = [row for row in rows if row not in with_rate]
    return sorted(with_rate, key=lambda row: row.rates[sort] if row.rates else 0.0, reverse=descending) + without


def group_by_pack(rows: Iterable[RunRow]) -> list[RunGroup]:
    """Return the rows grouped by pack, in order of the packs' names; unreadable runs come last."""
    found: dict[tuple[bool, str, str], list[RunRow]] = {}
    for row in rows:
        spec = None if row.run.header is None else row.run.header.spec
        key = (True, "", "") if spec is None else (False, spec.pack, spec.pack_sha256)
        found.setdefault(key, []).append(row)
    return [RunGroup(name, sha256, found[is_last, name, sha256]) for is_last, name, sha256 in sorted(found)]


def default_comparison(groups: Sequence[RunGroup]) -> tuple[str, ...]:
    """Return the short names of the two runs to offer for comparison, preferably two runs of one pack."""
    readable = [[row.run.slug for row in group.rows if row.run.table is not None] for group in groups]
    together = next((slugs for slugs in readable if len(slugs) > 1), [slug for slugs in readable for slug in slugs])
    return tuple(together[:2])


def _run_row(run: LibraryRun, family: str) -> RunRow:
    if run.table is None:
        return RunRow(run, None)
    _, summary = run.scores_and_summary(run.table)
    rates = summary["families"].get(family) if family else summary["overall"]
    is_cut = run.table.partial_line_number is not None and run.header is not None and run.header.ended is not None
    return RunRow(run, rates, len(run.table.left_out) + is_cut)


def run_values(run: LibraryRun, table: RecordTable) -> dict[str, Any]:
    """Return the values with which a template shows a run's verdicts, without links to its episodes."""
    scores, summary = run.scores_and_summary(table)
    return {
        "run": run,
        "scores": scores,
        "summary": summary,
        "closure": run.closure(table),
        "chores": run.chores(table),
        "bars": make_bars(scores),
        "labels": LABELS,
        "label_words": LABEL_WORDS,
        "columns": RATE_COLUMNS,
        "families": FAMILIES,
    }


def make_bars(scores: RunScores) -> list[Bar]:
    """Return the bars that divide episodes by their outcomes: one bar for all episodes, then one for each family."""
    outcomes = scores.outcomes
    by_family = {family: [each for each in outcomes if each.family == family] for family in FAMILIES}
    return [_bar("all", outcomes), *(_bar(family, some) for family, some in by_family.items() if some)]


def _bar(name: str, outcomes: Sequence[Outcome]) -> Bar:
    segments: list[Segment] = []
    x = 0.0
    for label in LABELS:
        count = sum(outcome.label == label for outcome in outcomes)
        if count:
            share = count / len(outcomes)
            segments.append(Segment(label, count, x, share * CHART_WIDTH, share))
            x += share * CHART_WIDTH
    return Bar(name, len(outcomes), tuple(segments))


def compare_runs(a: RunScores, b: RunScores, family: str) -> dict[str, Any]:
    """Return the comparison of two runs on the episodes that both have scored.

    `rates` has W and B of both with the test of the difference; `gained` and `lost` have, for each of these verdicts,
    the outcomes in both runs of the episodes for which it is true only in the second run, or only in the first.
    """
    first = {(o.episode_id, o.epoch): o for o in a.outcomes if not family or o.family == family}
    second = {(o.episode_id, o.epoch): o for o in b.outcomes if not family or o.family == family}
    pairs = [(first[key], second[key]) for key in sorted(first.keys() & second.keys())]
    names = ("W", "B") if all(o.has_report for o in (*first.values(), *second.values())) else ("W",)
    return {
        "shared": len(pairs),
        "only_a": len(first.keys() - second.keys()),
        "only_b": len(second.keys() - first.keys()),
        "rates": _paired_rates(*zip(*pairs, strict=True)) if pairs else [],
        "gained": {
            name: [pair for pair in pairs if getattr(pair[1], name) and not getattr(pair[0], name)] for name in names
        },
        "lost": {
            name: [pair for pair in pairs if getattr(pair[0], name) and not getattr(pair[1], name)] for name in names
        },
    }


def _paired_rates(first: Sequence[Outcome], second: Sequence[Outcome]) -> list[dict[str, Any]]:
    """Return W and B of two runs on the same plays, with the test of the difference."""
    of_first, of_second = count(outcome_columns(first)), count(outcome_columns(second))
    episodes, houses = (np.array([getattr(each, name) for each in first]) for name in ("episode_id", "house"))
    found = []
    for name in ("W", "B") if of_first.has_reports and of_second.has_reports else ("W",):
        ours, theirs = (np.array([getattr(each, name) for each in side]) for side in (first, second))
        paired = paired_test(ours, theirs, episodes=episodes, houses=houses)
        found.append({"name": name, "sides": (of_first.rate(name), of_second.rate(name)), "paired": paired})
    return found
