"""Tables of beliefs, in a separate section: why reports were false or missing, beliefs over time, and calibration."""

import math
from collections.abc import Iterator

from vigil.analysis.measures.beliefs.study import DELAY_STEPS, NEAR_STEPS, BeliefStudy, Estimate
from vigil.analysis.measures.study import RunEntry, Study
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


def _row(entry: RunEntry, beliefs: BeliefStudy, cells: dict[str, RateCell | int | float | None]) -> TableRow:
    names = {"run": entry.name, "framing": beliefs.framing}
    return TableRow({**names, **cells}, is_privileged=entry.run.header.is_privileged)


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
            rows.append(_row(entry, beliefs, {**facts, **cells, "unasked": unasked}))
    notes = (
        "FR and NR, as shares of all scored plays, split by the answer at the last step: knew and did not say (no "
        "report, and a right belief that the task was done); said without believing (a false report, and a right "
        "belief that says something else); believed wrongly; doubted correctly (no report, and a right belief that the "
        "task was not done); no answer. The parts add up to FR and to NR. Runs without reports are left out: they have "
        "neither. A belief is judged by the world at the frame that it answers. Not asked: plays of 'no answer' whose "
        "last step was not probed.",
        "Intervals: the wider ends of Wilson's interval and of that from resampled houses.",
    )
    return Table("belief_partition", "Why reports were false or missing", columns, tuple(rows), notes)


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
        rows.append(_row(entry, beliefs, cells))
    notes = (
        "Done, before the goal: among the answers before the goal first held, the share that says that the task is "
        "done. The next two columns are shares among the answers while the goal held, and after it was lost. Belief "
        "lost: among the plays that were asked again, the share in which a right belief was given up while the goal "
        "held. Failed: probes on which the server failed.",
        "Delay: steps from the first frame that shows the goal to the first answer that the task is done, by Kaplan "
        "and Meier's method, censored at the last answer before the play ended or the goal was lost. If not every step "
        "is probed, a delay is known only up to the next probe. The median is a dash if half of the plays never gave "
        "this answer.",
        "Intervals: resampled houses, if there are at least five and they differ; belief lost: Wilson.",
    )
    return Table("belief_over_time", "Belief against the world", columns, tuple(rows), notes)


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
        rows.append(_row(entry, beliefs, {"answered": beliefs.answered, **cells}))
    notes = (
        "The stated likelihood, 0 to 20, against what was true. Overconfidence: mean stated likelihood minus the share "
        "that was true. Brier score = reliability − resolution + uncertainty; skill: 1 − Brier score / uncertainty. "
        "The debiased squared calibration error may be below 0. AUROC: the chance that a true belief is stated as "
        "likelier than a false one; 50 % without knowledge. One column uses only answers within "
        f"{NEAR_STEPS} steps of attainment, because long before attainment it is easy to know that the task is not "
        "done; the other uses only answers at the last step. Risk and coverage: 100 % if every right belief is surer "
        "than every wrong one, 0 % if the order is random.",
        "Intervals: resampled houses, if there are at least five and they differ.",
    )
    return Table("belief_calibration", "Calibration of stated beliefs", columns, tuple(rows), notes)


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
        rows.append(_row(entry, beliefs, {"answered": beliefs.answered, **cells}))
    notes = (
        "What a map from stated to true likelihoods would repair. The map is monotone (isotonic regression), and is "
        "fitted on other houses, so no episode recalibrates itself. Gain: Brier score minus that after the map. "
        "Miscalibrated: the gain is above 0, and so is the skill afterwards. Uninformative: the skill stays at 0 or "
        "below, because no map helps beliefs that do not depend on what is true.",
        "Calibration error: mean difference between a belief's likelihood and the share of beliefs with the same "
        "stated value that were true; not debiased. Intervals: resampled houses; the maps are not fitted again.",
    )
    return Table("belief_recalibration", "What recalibration repairs", columns, tuple(rows), notes)


def _points(found: Estimate) -> RateCell:
    return pp_cell(found.value, found.interval) if math.isfinite(found.value) else None
