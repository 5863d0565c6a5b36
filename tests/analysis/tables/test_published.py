"""The key proof: runs that realise the published counts print the published rows, to the printed digit."""

from typing import Any

import pytest
from published import FR, thousand, write_anchor, write_pack

from vigil.analysis.measures.metrics import run_faults
from vigil.analysis.measures.paper import paper
from vigil.analysis.measures.rows import read_runs
from vigil.analysis.measures.study import Study, study
from vigil.analysis.tables.registry import tables
from vigil.analysis.tables.table import Row, Table
from vigil.episode import FAMILIES

ANCHORS = tuple(row["model"] for row in paper().tables["global_cross_section"])
TIE = 0.05 + 1e-9


@pytest.fixture(scope="module")
def panel(tmp_path_factory: pytest.TempPathFactory) -> Study:
    folder = tmp_path_factory.mktemp("published")
    write_pack(folder / "pack", thousand())
    runs = [write_anchor(folder / f"run{index}", folder / "pack", model) for index, model in enumerate(ANCHORS)]
    return study(read_runs(runs, use_cache=False))


@pytest.fixture(scope="module")
def made(panel: Study) -> dict[str, Table]:
    return tables(panel)


def own(table: Table, model: str) -> Row:
    return next(row for row in table.rows if row.cells["model"] == model and not row.is_published)


def agrees(found: Any, published: float) -> bool:
    """Whether a number prints as published, or lies within the rounding of a tie."""
    return f"{found:.1f}" == f"{published:.1f}" or abs(found - published) <= TIE


def published(name: str, model: str) -> dict[str, Any]:
    return next(row for row in paper().tables[name] if row["model"] == model)


def test_every_anchor_is_in_the_panel_and_obeys_the_identities(panel: Study):
    assert sorted(entry.name for entry in panel.main_panel()) == sorted(ANCHORS)
    assert [fault for run in panel.runs for fault in run_faults(run)] == []


@pytest.mark.parametrize("model", ANCHORS)
def test_cross_section(made: dict[str, Table], model: str):
    cells, row = own(made["global_cross_section"], model).cells, published("global_cross_section", model)
    assert agrees(cells["All"][0], row["W"])
    assert agrees(cells["All"][1], row["B"])
    assert agrees(cells["Delta"], row["delta"])
    for family in FAMILIES:
        for found, expected in zip(cells[family], row["families"][family], strict=True):
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
    assert f"{cells['lag']:.1f}" == f"{row['lag']:.1f}"
    assert round(cells["FS_zero"]) == row["zero_progress_pct"]


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
    assert first.cells["dB"] == pytest.approx(19.7)


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
