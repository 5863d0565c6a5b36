"""Tables of runs without reports, each next to the baseline."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support.published_runs import EpisodeScript, Write, small_records
from tools.known_beliefs import AGENTS, study_of
from vigil.analysis.measures.metrics import broken_run_identities
from vigil.analysis.measures.rows import read_runs
from vigil.analysis.measures.study import Study, study
from vigil.analysis.plots.belief_figures import belief_partition
from vigil.analysis.plots.figures import FIGURES
from vigil.analysis.report import make_report, markdown_report
from vigil.analysis.tables.table import RateCell
from vigil.protocol.actions import Report, Stop
from vigil.protocol.families import Family
from vigil.protocol.profile import Profile
from vigil.protocol.profiles.rows import PROFILE_NAMES
from vigil.records.record import EpisodeRecord
from vigil.scoring.rates import RATES
from vigil.scoring.saved_run import read_run
from vigil.scoring.summary import summarise

ENDS: dict[Family, tuple[bool, str]] = {
    "PG": (True, "NR"),
    "DA": (False, "fail"),
    "AI": (True, "fail"),
    "SI": (False, "success"),
}


def script_of(family: Family) -> EpisodeScript:
    """Return a script: of some families another than a true report of success."""
    w, end = ENDS.get(family, (True, "on" if family == "SV" else "success"))
    return EpisodeScript(family, w, end)


def stopping(record: EpisodeRecord) -> EpisodeRecord:
    """Return a record in which the agent stops where it reported."""
    *steps, last = record.steps
    if not isinstance(last.action, Report):
        return record.model_copy(update={"has_report": False})
    end = (*steps, last.model_copy(update={"action": Stop()}))
    return record.model_copy(update={"has_report": False, "steps": end, "end": "stop"})


@pytest.fixture
def both(write: Write) -> Study:
    stop = Profile(name=PROFILE_NAMES["stop_only"])
    stops = {name: stopping(record) for name, record in small_records(script_of).items()}
    runs = [write("base", small_records(script_of)), write("stop", stops, profile=stop)]
    return study(read_runs(runs), with_paper=False)


def test_only_w_is_a_number_without_reports(both: Study) -> None:
    stop = next(entry for entry in both.entries if entry.role == "condition")
    assert broken_run_identities(stop.run) == []
    assert stop.overall.share("W") == both.main_runs()[0].overall.share("W")
    assert [stop.overall.share(name) for name in ("B", "Delta", "FR", "NR", "Stop", "P_FR_W0")] == [None] * 6
    tables = make_report(both, ()).tables
    (row,) = tables["profile_shifts"].rows
    assert row.cells["dW"][0] == 0.0
    assert [row.cells.get(name) for name in ("dB", "dFR", "dNR", "p_B", "p_FR")] == [None] * 5
    assert not tables["transitions"].rows


def test_repeats_and_beliefs_without_reports_say_nothing_of_reports(write: Write) -> None:
    stop = Profile(name=PROFILE_NAMES["stop_only"])
    stops = {name: stopping(record) for name, record in small_records(script_of).items()}
    runs = read_runs([write(name, stops, profile=stop, epochs=2) for name in ("first", "second")])
    beliefs = (study_of(AGENTS[0], 20, np.random.default_rng(1)),)
    found = study([replace(run, beliefs=beliefs) for run in runs], with_paper=False)
    tables = make_report(found, ()).tables
    plays = tables["several_plays"].rows
    assert plays
    assert all(row.cells["every_W"] is not None and row.cells.get("every_B") is None for row in plays)
    assert tables["open_repeat_robustness"].rows
    for name in ("gain_sources", "transitions", "transition_tests", "belief_partition"):
        assert not tables[name].rows, name
    assert tables["belief_calibration"].rows
    assert belief_partition(found) is None


def test_rates_that_are_not_defined_have_no_interval_and_no_figure(both: Study) -> None:
    stop = next(entry.run for entry in both.entries if entry.role == "condition")
    overall = summarise(read_run(stop.folder).table.scores())["overall"]
    undefined = {name for name in RATES if overall[name] is None}
    assert (
        undefined
        == {name for name, ends in overall["intervals"].items() if ends is None}
        == {*RATES} - {"W", "W_strict"}
    )
    alone = study([stop], with_paper=False)
    assert {name for name, draw in FIGURES.items() if draw(alone) is not None} == set()
    (row,) = make_report(alone, ()).tables["family_rates"].rows[:1]
    assert row.cells["W"] is not None
    assert row.cells["B"] is None


def test_the_same_ends_are_the_same_events_with_and_without_reports(both: Study) -> None:
    tables = make_report(both, ()).tables
    events = {row.cells["model"]: row.cells for row in tables["stop_shifts"].rows}
    assert len(events) == 5
    for cells in events.values():
        assert cells["base"] == cells["other"]
        assert (first(cells["shift"]), cells["p"]) == (0.0, 1.0)
    assert first(events["the agent ended the episode"]["base"]) < 100.0
    rows = {row.cells["model"]: row.cells for row in tables["true_reports"].rows}
    assert {"success", "fail"} <= rows.keys()
    assert all(cells["base"] == cells["other"] >= cells["said"] for cells in rows.values())
    base = both.main_runs()[0].run.rows
    said = sum(cells["said"] for cells in rows.values())
    assert said == sum(base["label"] == "B") + sum((base["label"] == "Other") & base["expected"].isna())
    assert "Stop only" in markdown_report(make_report(both, ()))


def first(cell: RateCell) -> float:
    assert cell is not None
    return cell[0]
