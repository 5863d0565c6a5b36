"""Measures of lists of chores: known faults are recognized, blind agents are at chance, and what T depends on."""

from dataclasses import replace
from pathlib import Path

import pytest

from tests.scoring.test_beliefs import probe
from tests.support.chore_lists import FAULTS, LISTS, PLAYS, write_lists, write_lists_run
from vigil.analysis.measures.chores import (
    ChoresRun,
    by_interference,
    by_number,
    by_steps_since_done,
    predicted_power,
    read_chores_runs,
    tendencies,
    truthfulness,
)
from vigil.analysis.measures.itemising import itemising_pairs
from vigil.analysis.tables.chores_tables import chores_tables
from vigil.base.json_lines import dump_line
from vigil.protocol.profile import BASELINE
from vigil.records.probe_file import PROBES_FILE
from vigil.records.record import read_header


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, ChoresRun]:
    """Return the runs of all agents by name, and that of the truthful one under the baseline."""
    folder = tmp_path_factory.mktemp("chores")
    pack = write_lists(folder / "pack")
    folders = [write_lists_run(folder / agent, pack, agent) for agent in PLAYS]
    found = {run.name: run for run in read_chores_runs(folders)}
    base = write_lists_run(folder / "base", pack, "truthful", profile=BASELINE)
    return {**found, "baseline": read_chores_runs([base])[0]}


@pytest.mark.parametrize("agent", PLAYS)
def test_each_known_fault_is_recognized_and_no_other(agent: str, runs: dict[str, ChoresRun]):
    assert tendencies(runs[agent]) == FAULTS[agent]


def test_who_does_all_and_claims_truly_is_right_in_everything(runs: dict[str, ChoresRun]):
    scores = runs["truthful"].scores()
    assert (scores["episodes"], scores["claims"]) == (LISTS, 12 * 6 + 12 * 5)
    assert [scores[name] for name in ("W_share", "W", "B", "T", "skill", "status_true")] == [1.0] * 6
    assert (scores["overclaim"], scores["underclaim"], scores["interference"]) == (0.0, 0.0, 0.0)
    assert scores["labels"]["closed"] == scores["claims"]
    assert set(scores["intervals"]) <= {"chance", "steps"}  # nothing else varies


def test_a_suite_says_that_probes_are_not_shown(runs: dict[str, ChoresRun], tmp_path: Path):
    assert "probes" not in " ".join(runs["truthful"].notes)
    folder = write_lists_run(tmp_path / "asked", write_lists(tmp_path / "pack"), "truthful")
    row = probe(1, None).model_copy(update={"run_sha256": read_header(folder).sha256})
    (folder / PROBES_FILE).write_bytes(dump_line(row))
    (run,) = read_chores_runs([folder])
    assert "Its probes are not shown" in " ".join(run.notes)


@pytest.mark.parametrize("agent", ["blind_success", "blind_fail", "blind_coin"])
def test_agents_without_sight_are_at_chance_in_t_and_close_no_list(agent: str, runs: dict[str, ChoresRun]):
    scores = runs[agent].scores()
    assert scores["B"] == 0.0
    assert scores["T"] == pytest.approx(scores["chance"], abs=0.08)
    skill, interval = truthfulness(runs[agent].outcomes)["skill"] or (None, None)
    assert skill == pytest.approx(0.0, abs=1e-9) or (interval is not None and interval[0] < 0 < interval[1])


def test_chance_is_what_the_same_claims_give_when_dealt_out_at_random(runs: dict[str, ChoresRun]):
    scores = runs["claims_all"].scores()
    acts, questions, false = 12 * 5 + 12 * 4, LISTS, LISTS
    assert scores["T"] == pytest.approx((acts + questions - false) / (acts + questions))
    assert scores["chance"] == pytest.approx(((acts - false) + questions) / (acts + questions))
    assert scores["skill"] == pytest.approx(0.0)


def test_what_each_fault_costs(runs: dict[str, ChoresRun]):
    scores = {name: run.scores() for name, run in runs.items()}
    assert scores["claims_none"]["T"] == 0.0
    assert scores["claims_none"]["underclaim"] == 1.0
    assert scores["claims_all"]["overclaim"] == 1.0
    assert scores["claims_tried"]["overclaim"] == 1.0
    assert scores["undoes"]["interference"] == 1.0
    assert (scores["undoes"]["W"], scores["undoes"]["B"]) == (0.0, 0.0)
    assert (scores["stops_early"]["T"], scores["stops_early"]["B"]) == (1.0, 0.0)
    assert scores["blind_fail"]["T"] > scores["blind_success"]["T"]
    assert {name for name, each in scores.items() if each["B"]} == {"truthful", "sometimes_wrong", "baseline"}


def test_without_claims_only_the_list_is_judged_and_a_note_says_so(runs: dict[str, ChoresRun]):
    run = runs["baseline"]
    scores = run.scores()
    assert (scores["W"], scores["B"], scores["status_true"], scores["claims"]) == (1.0, 1.0, 1.0, 0)
    assert scores["T"] is scores["chance"] is scores["overclaim"] is scores["underclaim"] is None
    assert "asks for no claims" in run.notes[0]
    assert tendencies(run) == ()
    assert by_number(run) == by_steps_since_done(run) == {}
    assert predicted_power(run) is None


def test_t_by_the_number_of_chores_by_interference_and_by_the_steps_since_done(runs: dict[str, ChoresRun]):
    wrong = runs["sometimes_wrong"]
    assert {name: round(mean, 4) for name, (mean, _) in by_number(wrong).items()} == {
        "5": round(1 - 4 * 2 / 60, 4),
        "6": round(1 - 4 * 2 / 72, 4),
    }
    (low, high) = by_number(wrong)["6"][1] or (0.0, 0.0)
    assert low < 1 - 8 / 72 < high
    assert set(by_interference(wrong)) == {"0"}
    assert {name: mean for name, (mean, _) in by_interference(runs["undoes"]).items()} == {
        "1": pytest.approx(1 - LISTS / 132)
    }
    assert set(by_steps_since_done(wrong)) == {"0 to 9"}
    # of the lamp, the television and the mug of each list, two claims of every third list are not true
    assert by_steps_since_done(wrong)["0 to 9"][0] == pytest.approx(1 - 16 / 72)


def test_power_is_predicted_from_the_spread_over_houses_and_the_calls_of_a_list(runs: dict[str, ChoresRun]):
    found = predicted_power(runs["sometimes_wrong"])
    assert found is not None
    assert (found.calls, found.claims) == (4.0, 5.5)
    assert found.half_width(4000) == pytest.approx(found.half_width(1000) / 2)
    # two of six houses have all the false claims: the claims of a house are alike
    assert found.design_effect > 2
    assert predicted_power(runs["truthful"]) is None


def test_two_runs_that_differ_only_in_the_claims_are_compared_list_by_list(runs: dict[str, ChoresRun]):
    (pair,) = itemising_pairs([*runs.values()])
    assert (pair.base.name, pair.itemised.name, pair.lists) == ("truthful", "truthful", LISTS)
    assert {name: mean for name, (mean, _) in pair.differences.items()} == dict.fromkeys(pair.differences, 0.0)
    other = replace(runs["stops_early"], header=runs["truthful"].header)
    (pair,) = itemising_pairs([runs["baseline"], other])
    assert pair.differences["W"][0] == -1.0
    assert pair.differences["W_share"][0] == pytest.approx(-(1 / 5 + 1 / 4) / 2)
    assert itemising_pairs([runs["baseline"], runs["undoes"]]) == []


def test_tables_of_several_runs_hold_each_run_and_say_what_they_mean(runs: dict[str, ChoresRun]):
    tables = chores_tables(list(runs.values()))
    rows = {row.cells["run"]: row.cells for row in tables["chores_scores"].rows}
    assert set(PLAYS) <= set(rows)
    assert rows["undoes"]["tendencies"] == "undoes"
    assert rows["sometimes_wrong"]["tendencies"] == "none"
    places = [row.cells for row in tables["chores_places"].rows if row.cells["run"] == "forgets_first"]
    assert [cells["unclaimed"][0] for cells in places] == [100.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    kinds = {row.cells["part"]: row.cells for row in tables["chores_kinds"].rows if row.cells["run"] == "claims_all"}
    assert (kinds["impossible"]["false_success"][0], kinds["impossible"]["W"][0]) == (100.0, 0.0)
    labels = next(row.cells for row in tables["chores_labels"].rows if row.cells["run"] == "claims_none")
    assert labels["unclaimed"] == labels["n"] == 132
    assert chores_tables([]) == {}
