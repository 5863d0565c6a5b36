"""Tables of beliefs, in a separate section: why reports were false or missing, beliefs over time, and calibration."""

import math
from collections.abc import Iterator

from vigil.analysis.measures.beliefs.study import DELAY_STEPS, NEAR_STEPS, BeliefStudy, Estimate
from vigil.analysis.measures.study import RunEntry, Study
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
    rate_cell,
    texts,
    titled,
)
from vigil.scoring.beliefs import PARTS

HEADING = "What it believed, and when"
PART_HEADINGS = {
    "knew_and_did_not_say": "Knew and did not say %",
    "said_without_believing": "Said without believing %",
    "believed_wrongly": "Believed wrongly %",
    "doubted_correctly": "Doubted correctly %",
    "no_answer": "No answer %",
}
"""Reason why a report was false or missing (`BeliefPart`) -> heading of its column."""
_NAMES = texts(run="Run", framing="Question")


def belief_tables(study: Study) -> dict[str, Table]:
    """Return the tables of beliefs by name; empty if no run has probes."""
    if not any(entry.run.beliefs for entry in study.entries):
        return {}
    built = (_partition(study), _over_time(study), _calibration(study), _recalibration(study))
    return {table.name: table for table in built}


def belief_rows(study: Study) -> Iterator[tuple[RunEntry, BeliefStudy]]:
    """Yield each run with its studies of beliefs, one pair for each study."""
    for entry in study.entries:
        yield from ((entry, beliefs) for beliefs in entry.run.beliefs)


def partition_rows(study: Study) -> Iterator[tuple[RunEntry, BeliefStudy]]:
    """Yield the rows of `belief_rows` whose runs have reports; without reports, FR and NR are not defined."""
    return (row for row in belief_rows(study) if row[0].overall.has_reports)


def _partition(study: Study) -> Table:
    columns: tuple[Column, ...] = (
        *_NAMES,
        *texts(label="Label"),
        *counts(plays="Plays"),
        *intervals(share="All %", **PART_HEADINGS),
        *counts(unasked="Not asked"),
    )
    rows: list[TableRow] = []
    for entry, beliefs in partition_rows(study):
        for label in ("FR", "NR"):
            shares = {part: beliefs.parts[part][label] for part in PARTS}
            cells = {
                part: pp_cell(share.rate.value, share.interval) if share.rate.n else None
                for part, share in shares.items()
            }
            mine = [play for play in beliefs.plays if play.outcome.label == label]
            unasked = sum(not any(belief.is_closing for belief in play.of(beliefs.framing)) for play in mine)
            facts = {"label": label, "plays": len(mine), "share": rate_cell(entry.overall.rate(label))}
            rows.append(row_of(entry.run, framing=beliefs.framing, **facts, **cells, unasked=unasked))
    return titled("belief_partition", columns, rows)


def _over_time(study: Study) -> Table:
    columns = (
        *_NAMES,
        *counts(asked="Asked", answered="Answered", failed="Failed"),
        *intervals(
            false_before="Done, before the goal %",
            missed_after="Not done, while it holds %",
            false_after_loss="Done, after it was lost %",
            lost="Belief lost, of plays %",
        ),
        *counts(attained="Plays attained", detected="Detected"),
        *intervals(at_once="Detected at once %"),
        *numbers(median="Median delay, steps"),
        *means(mean=f"Mean delay up to {DELAY_STEPS}, steps"),
    )
    rows: list[TableRow] = []
    for entry, beliefs in belief_rows(study):
        delay = beliefs.delay()
        cells: dict[str, RateCell | int | float | None] = {
            "asked": beliefs.asked,
            "answered": beliefs.answered,
            "failed": beliefs.failed,
            "false_before": _points(beliefs.false_before()),
            "missed_after": _points(beliefs.missed_after()),
            "false_after_loss": _points(beliefs.false_after_loss()),
            "lost": rate_cell(beliefs.lost()),
        }
        if delay is not None:
            mean, (low, high) = delay.restricted_mean.value, delay.restricted_mean.interval or (None, None)
            cells |= {"attained": delay.plays, "detected": delay.detected, "at_once": _points(delay.at_once)}
            cells |= {"median": delay.median, "mean": (mean, low, high)}
        rows.append(row_of(entry.run, framing=beliefs.framing, **cells))
    return titled("belief_over_time", columns, rows)


def _calibration(study: Study) -> Table:
    headings = {
        "base_rate": "True %",
        "overconfidence": "Overconfidence, points",
        "brier": "Brier score × 100",
        "skill": "Skill %",
        "reliability": "Reliability × 100",
        "resolution": "Resolution × 100",
        "uncertainty": "Uncertainty × 100",
        "debiased_error": "Calibration error², debiased × 100",
        "auroc_near": f"AUROC within {NEAR_STEPS} steps %",
        "auroc_closing": "AUROC at the end %",
        "risk_coverage": "Risk and coverage %",
    }
    columns = (*_NAMES, *counts(answered="Answers"), *intervals(**headings))
    rows: list[TableRow] = []
    for entry, beliefs in belief_rows(study):
        cells = {name: _points(found) for name, found in beliefs.calibration().items()}
        rows.append(row_of(entry.run, framing=beliefs.framing, answered=beliefs.answered, **cells))
    return titled("belief_calibration", columns, rows, near_steps=NEAR_STEPS)


def _recalibration(study: Study) -> Table:
    headings = {
        "brier_before": "Brier score × 100",
        "brier_after": "Recalibrated × 100",
        "gain": "Gain × 100",
        "skill_after": "Skill, recalibrated %",
    }
    errors = {"error_before": "Calibration error × 100", "error_after": "Recalibrated error × 100"}
    columns = (*_NAMES, *counts(answered="Answers"), *intervals(**headings), *numbers(**errors))
    rows: list[TableRow] = []
    for entry, beliefs in belief_rows(study):
        found = beliefs.recalibration()
        cells = {name: _points(found[name]) for name in headings if found}
        cells |= {name: 100 * found[name].value for name in errors if found}
        rows.append(row_of(entry.run, framing=beliefs.framing, answered=beliefs.answered, **cells))
    return titled("belief_recalibration", columns, rows)


def _points(found: Estimate) -> RateCell:
    return pp_cell(found.value, found.interval) if math.isfinite(found.value) else None
