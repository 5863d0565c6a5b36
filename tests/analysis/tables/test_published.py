"""The key proof: runs that realise the published counts print the published rows, to the printed digit."""

from typing import Any

import pytest

from tests.support.published_runs import FR, PUBLISHED, make_episodes, write_anchor, write_pack
from vigil.analysis.measures.metrics import broken_run_identities
from vigil.analysis.measures.paper import paper
from vigil.analysis.measures.rows import read_runs
from vigil.analysis.measures.study import Study, study
from vigil.analysis.tables.registry import tables
from vigil.analysis.tables.table import Table, TableRow
from vigil.scoring.rates import wilson

ANCHORS = tuple(row["model"] for row in paper().tables["global_cross_section"])
TIE = 0.05 + 1e-9


@pytest.fixture(scope="module")
def panel(tmp_path_factory: pytest.TempPathFactory) -> Study:
    folder = tmp_path_factory.mktemp("published")
    write_pack(folder / "pack", make_episodes())
    runs = [write_anchor(folder / f"run{index}", folder / "pack", model) for index, model in enumerate(ANCHORS)]
    return study(read_runs(runs))


@pytest.fixture(scope="module")
def made(panel: Study) -> dict[str, Table]:
    return tables(panel)


def own(table: Table, model: str) -> TableRow:
    return next(row for row in table.rows if row.cells["model"] == model and not row.is_published)


def agrees(cell: Any, published: float) -> bool:
    """Whether a cell's number prints as published, or lies within the rounding of a tie, inside of its interval."""
    found, low, high = cell if isinstance(cell, tuple) else (cell, None, None)
    assert low is None or low <= found <= high
    return f"{found:.1f}" == f"{published:.1f}" or abs(found - published) <= TIE


def published(name: str, model: str) -> dict[str, Any]:
    return next(row for row in paper().tables[name] if row["model"] == model)


def test_every_anchor_is_in_the_panel_and_obeys_the_identities(panel: Study):
    assert sorted(entry.name for entry in panel.main_panel()) == sorted(ANCHORS)
    assert [fault for run in panel.runs for fault in broken_run_identities(run)] == []


@pytest.mark.parametrize("model", ANCHORS)
def test_cross_section(made: dict[str, Table], model: str):
    cells, row = own(made["global_cross_section"], model).cells, published("global_cross_section", model)
    assert agrees(cells["All"][0], row["W"])
    assert agrees(cells["All"][1], row["B"])
    assert agrees(cells["Delta"], row["delta"])
    for family in PUBLISHED:
        for found, expected in zip(cells[family][:2], row["families"][family], strict=True):
            assert f"{found:.1f}" == f"{expected:.1f}", family


@pytest.mark.parametrize("model", ANCHORS)
def test_conditional_report(made: dict[str, Table], model: str):
    cells, row = own(made["conditional_report"], model).cells, published("conditional_report", model)
    assert (cells["n_W0"], cells["n_W1"]) == (row["n_W0"], row["n_W1"])
    for name in ("W", "B", "Stop", "P_rep_W0", "P_norep_W1"):
        assert agrees(cells[name], row[name]), name


@pytest.mark.parametrize("model", ANCHORS)
def test_counterfactual(made: dict[str, Table], model: str):
    row_found, row = own(made["counterfactual"], model), published("counterfactual", model)
    for name in ("B", "Always", "Rand"):
        assert agrees(row_found.cells[name], row[name]), name
    assert ("Always" in row_found.bold) == (row["Always"] > row["B"])


@pytest.mark.parametrize("model", ANCHORS)
def test_belief_lag(made: dict[str, Table], model: str):
    cells, row = own(made["belief_lag"], model).cells, published("belief_lag", model)
    assert (cells["W_plus"], cells["NoRep_W1"], cells["FS"]) == (row["W_plus"], row["NR_W1"], row["FS"])
    assert f"{cells['lag'][0]:.1f}" == f"{row['lag']:.1f}"
    assert round(cells["FS_zero"][0]) == row["zero_progress_pct"]
    assert cells["FS_zero"][1] < cells["FS_zero"][0] < cells["FS_zero"][2]


def test_rows_of_every_table_stand_in_the_published_order(made: dict[str, Table]):
    names = [row.cells["model"] for row in made["global_cross_section"].rows if not row.is_published]
    assert names == list(ANCHORS)


def test_the_two_readings_of_nr_come_under_their_two_names(made: dict[str, Table]):
    overview = {row.cells["model"]: row.cells for row in made["overview"].rows}
    for model, (exclusive, inclusive) in {"InternVL3.5-38B": (66.1, 71.7), "Qwen3-VL-32B": (44.6, 51.8)}.items():
        assert overview[model]["NR"][0] == pytest.approx(exclusive)
        assert overview[model]["NoRep"][0] == pytest.approx(inclusive)
    for model, count in FR.items():
        assert overview[model]["FR"][0] == pytest.approx(count / 10)


def test_the_widest_gap_at_alike_w_is_the_papers(made: dict[str, Table]):
    first = made["comparable_pairs"].rows[0]
    assert (first.cells["first"], first.cells["second"]) == ("Doubao-Seed-1.8", "InternVL3.5-38B")
    assert first.cells["dB"][0] == pytest.approx(19.7)
    assert first.cells["dB"][1] < 19.7 < first.cells["dB"][2]


PLAIN = {"open_repeat_robustness", "full_panel", "prompt_sensitivity", "global_cross_section", "proprio_minimal"}
"""Their rates stand as printed in the paper: with their intervals in another table."""
WITHOUT_RATES = {
    "power",
    "stability",
    "repeat_rates",
    "feedback_events",
    "levels",
    "event_reductions",
    "false_success_progress",
}
"""Numbers that are no rates of one run: detectable differences, half-ranges, relative changes, an index."""


def test_every_rate_has_its_interval(made: dict[str, Table]):
    for name, table in made.items():
        plain = [column.key for column in table.columns if column.kind in ("number1", "number2", "pair", "spread")]
        assert not plain or name in PLAIN | WITHOUT_RATES, (name, plain)
        for column in table.columns:
            if column.kind == "rate":
                cells = [row.cells.get(column.key) for row in table.rows if not row.is_published]
                known = [cell for cell in cells if cell is not None]
                assert not known or any(cell[1] is not None for cell in known) or {c[0] for c in known} == {0.0}, name


def test_rates_that_are_printed_bare_have_their_intervals_per_family(made: dict[str, Table]):
    found = {(row.cells["model"], row.cells["family"]): row.cells for row in made["family_rates"].rows}
    for row in made["global_cross_section"].rows:
        if not row.is_published:
            for column in ("All", *PUBLISHED):
                cells = found[row.cells["model"], "all" if column == "All" else column]
                assert (cells["W"][0], cells["B"][0]) == pytest.approx(row.cells[column][:2])
                assert cells["W"][1] <= cells["W"][0] <= cells["W"][2]


def test_the_serving_modes_of_one_checkpoint_are_the_papers(made: dict[str, Table]):
    rows = made["serving_modes"].rows
    (row,) = [row for row in rows if not row.is_published]
    assert row.cells["model"] == "Qwen3-VL-32B (T)"
    shown = {"W_base": 39.2, "B_base": 18.9, "W_other": 30.7, "B_other": 26.4}
    for key, rate in shown.items():
        low, high = wilson(round(10 * rate), 1000)
        assert row.cells[key] == pytest.approx((rate, 100 * low, 100 * high))
    (printed,) = [row for row in rows if row.is_published and row.cells["model"] == "Qwen3-VL-32B (T)"]
    assert {key: printed.cells[key] for key in shown} == shown
    assert row.cells["dDelta"][0] == pytest.approx(4.3 - 20.3)
    published_pairs = {row.cells["model"]: row.cells["dB"] for row in rows if row.is_published}
    assert published_pairs == {
        "Kimi-VL-A3B (T)": 8.8,
        "Qwen3-VL-32B (T)": 7.5,
        "Qwen3-VL-4B (T)": -7.7,
        "Qwen3-VL-8B (T)": -7.6,
        "Qwen3-VL-2B (T)": 3.6,
    }


def test_labels_before_and_after_are_whole(made: dict[str, Table]):
    matrix = {row.cells["model"]: row.cells for row in made["transitions"].rows}
    assert sum(cells["n"] for cells in matrix.values()) == 1000
    assert matrix["FR"]["n"] == FR["Qwen3-VL-32B"]
    assert sum(cells["FR"] for cells in matrix.values()) == FR["Qwen3-VL-32B (T)"]
    tested = {row.cells["model"]: row.cells for row in made["transition_tests"].rows}
    assert tested["FR → NR"]["there"] == matrix["FR"]["NR"]
    assert tested["FR → NR"]["back"] == matrix["NR"]["FR"]


def test_published_shifts_and_half_ranges_are_what_the_paper_says_of_them(made: dict[str, Table]):
    rows = {
        (row.cells["change"].split(":")[0], row.cells["rate"]): row.cells
        for row in made["stability"].rows
        if row.is_published
    }
    prompt, repeats = "Default and neutral prompt", "Repeats"
    assert (rows[prompt, "W %"]["n"], rows[prompt, "W %"]["largest"]) == (20, 3.5)
    assert (rows[prompt, "B %"]["largest"], rows[prompt, "B %"]["whose"]) == (4.8, "Qwen3-VL-32B")
    assert rows[prompt, "NR %"]["largest"] == pytest.approx(2.1)
    b = rows[repeats, "B %"]
    assert (b["n"], b["steady"], b["largest"], b["whose"]) == (20, 19, 2.7, "Qwen3-VL-32B (T)")


def test_the_extended_panel_stands_in_its_two_printed_groups(made: dict[str, Table]):
    groups: dict[str, list[str]] = {}
    for row in made["extended_panel"].rows:
        groups.setdefault(row.group, []).append(row.cells["model"])
    excluded, supplementary = groups.values()
    assert excluded == ["Qwen3-VL-2B", "Qwen3.5-2B", "Kimi-VL-A3B-Instruct"]
    assert len(supplementary) == 5


def test_published_prompt_rows_are_grouped_and_ordered_as_printed(made: dict[str, Table]):
    for name in ("prompt_sensitivity", "prompt_shifts"):
        rows = [row for row in made[name].rows if row.is_published]
        assert [row.cells["model"] for row in rows] == [row["model"] for row in paper().tables["prompt_sensitivity"]]
        assert list(dict.fromkeys(row.group for row in rows)) == [
            "Embodied / robotics-tuned, published",
            "Open general and reasoning VLMs, published",
        ]


def test_api_identifiers_are_shown(made: dict[str, Table]):
    found = {row.cells["model"]: row.cells["api"] for row in made["models"].rows if row.is_published}
    assert found["Claude-Sonnet-4"] == "claude-sonnet-4-20250514"
    assert own(made["models"], "GPT-5.4").cells["api"] == "openai/GPT-5.4"


def test_regimes_are_those_that_the_paper_names(made: dict[str, Table]):
    found = {row.cells["model"]: row.cells["regime"] for row in made["regimes"].rows}
    for model in ("GPT-5.4", "Claude-Sonnet-4"):
        assert found[model].startswith("FR-heavy"), model
    for model in ("InternVL3.5-38B", "Qwen3-VL-32B"):
        assert found[model].startswith("NR-heavy"), model
    for model in ("Gemini-3.1-Pro", "Doubao-Seed-1.8", "Qwen3.6-27B", "Qwen3.5-27B"):
        assert found[model].startswith("state-coupled"), model


def test_groups_are_those_of_the_papers_panel(panel: Study):
    for entry in panel.entries:
        assert entry.group == paper().model(entry.name).group, entry.name


def test_conditional_cells_are_tinted_where_the_paper_tints_them(made: dict[str, Table]):
    tinted = {row.cells["model"]: dict(row.tints) for row in made["conditional_report"].rows if not row.is_published}
    expected = {
        "GPT-5.4": {"P_rep_W0": "FR"},
        "Claude-Sonnet-4": {"P_rep_W0": "FR"},
        "Qwen3-VL-32B": {"P_norep_W1": "NR"},
        "InternVL3.5-38B": {"P_norep_W1": "NR"},
    }
    assert {model: tints for model, tints in tinted.items() if tints} == expected
