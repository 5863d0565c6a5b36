"""Runs on lists of chores: every verb that gives results gives W, B and T, and says what is not judged."""

import json
from pathlib import Path
from typing import Any

import pytest

from tests.support.chore_lists import write_lists, write_lists_run
from tests.support.commands import Vigil
from vigil.analysis.measures.chores import read_chores_runs, scores_by_number
from vigil.analysis.plots.chores_figures import CHORES_FIGURES
from vigil.protocol.profile import BASELINE
from vigil.scoring.saved_run import read_run
from vigil.web.site import TEMPLATES


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("lists")
    pack = write_lists(folder / "pack")
    found = {name: write_lists_run(folder / name, pack, name) for name in ("sometimes_wrong", "undoes")}
    return {**found, "baseline": write_lists_run(folder / "baseline", pack, "truthful", profile=BASELINE), "pack": pack}


def test_scores_give_w_b_and_t_with_chance_and_say_what_they_mean(vigil: Vigil, folders: dict[str, Path]) -> None:
    said = vigil("score", folders["sometimes_wrong"], folders["undoes"])
    assert said.code == 0
    assert "Lists of chores, %" in said.out
    assert "T: share of claims that are true." in said.out
    (row,) = [line for line in said.out.splitlines() if "sometimes_wrong" in line]
    scores = read_chores_runs([folders["sometimes_wrong"]])[0].scores()
    for name in ("W", "B", "T", "chance"):
        assert f"{100 * scores[name]:.1f}" in row
    assert "by family" not in said.out
    told = json.loads(vigil("score", folders["sometimes_wrong"], "--json").out)["runs"][0]["chores"]
    assert told == json.loads(json.dumps(scores))


def test_a_run_without_claims_is_said_to_be_judged_as_a_list(vigil: Vigil, folders: dict[str, Path]) -> None:
    said = vigil("score", folders["baseline"])
    assert "its profile asks for no claims, so each list is judged only as a whole" in said.out + said.err
    assert "--profile itemised_report" in said.out
    (row,) = [line for line in said.out.splitlines() if line.startswith("│ truthful")]
    assert "100.0" in row
    assert " - " in row


def test_a_report_has_a_section_with_tables_and_figures(vigil: Vigil, folders: dict[str, Path], tmp_path: Path) -> None:
    out = tmp_path / "report"
    runs = [folders[name] for name in ("sometimes_wrong", "undoes", "baseline")]
    assert vigil("report", *runs, "--format", "html", "--format", "md", "--out", out).code == 0
    page = (out / "report.html").read_text()
    assert "Lists of chores: W, B and T" in page
    assert "Truthfulness by the steps since a chore was done" in page
    assert "truthful (lists of chores): its profile asks for no claims" in page
    assert "Outcome partition" not in page
    assert {path.stem for path in (out / "figures").iterdir()} == set(CHORES_FIGURES)


def test_a_pack_whose_answers_are_gone_is_said_to_lack_them(vigil: Vigil, folders: dict[str, Path], tmp_path: Path):
    pack = write_lists(tmp_path / "pack")
    run = write_lists_run(tmp_path / "run", pack, "undoes")
    rows = (pack / "chores.jsonl").read_bytes()
    (pack / "chores.jsonl").write_bytes(rows.replace(b'"locked"', b'"broken"'))
    said = vigil("score", run)
    assert said.code != 0
    assert "chores.jsonl has SHA-256" in said.err


def test_the_page_of_a_run_has_the_scores_by_number_of_chores(folders: dict[str, Path]) -> None:
    macros: Any = TEMPLATES.get_template("macros.html").module
    table = str(macros.chores_table(scores_by_number(read_run(folders["sometimes_wrong"]))))
    rows = table.split('<th scope="row">')[1:]
    assert [row.split("<")[0] for row in rows] == ["5", "6", "all"]
    scores = read_chores_runs([folders["sometimes_wrong"]])[0].scores()
    for name in ("W", "B", "T", "overclaim", "underclaim"):
        assert f"<b>{100 * scores[name]:.1f}</b>" in rows[-1]
