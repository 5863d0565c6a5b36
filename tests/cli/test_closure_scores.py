"""Runs of the closure-stress suite: every verb that gives results gives C."""

import json
import re
from pathlib import Path

import pytest

from tests.support.commands import Vigil
from tests.support.quick_runs import quick
from tests.support.tiny_pack import tiny_pack
from tests.support.web_server import served
from vigil.analysis.measures.closure import read_closure_runs
from vigil.runner.run import run_pack
from vigil.scoring.closure import KINDS
from vigil.web.drawing import RenderService
from vigil.web.library import Library
from vigil.web.view import make_view

PACK = "vigil_closure_400"
SUITE = ("run", "--pack", PACK, "--agent", "always_fail", "--limit", "10", "--backend", "fake", "--workers", "1")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Ten episodes of the suite: of each kind one, or a pair."""
    folder = tmp_path_factory.mktemp("runs") / "fails"
    run_pack(quick(Path(PACK), folder, agent="always_fail", limit=10))
    return folder


def test_a_run_and_its_scores_give_c_by_kind(vigil: Vigil, folder: Path) -> None:
    rates = read_closure_runs([folder])[0].rates()
    assert set(rates) == {*KINDS, "all"}
    again = vigil(*SUITE, "--log-dir", folder)
    scored = vigil("score", folder)
    shown = f"{100 * rates['all']['C']:.1f}"
    for said in (again, scored):
        assert said.code == 0
        assert "closure stress, %" in said.out
        (row,) = [line for line in said.out.splitlines() if "impossible" in line]
        assert "50.0" in row
        (row,) = [line for line in said.out.splitlines() if line.startswith("│ all ")]
        assert f" {shown} [" in row
        assert " B " not in said.out
    told = json.loads(vigil("score", folder, "--json").out)["runs"][0]["closure"]
    assert told == json.loads(json.dumps(rates))
    assert told["impossible"]["C"] == 0.5
    assert told["impossible"]["correct_pairs"] == 0.0


def test_runs_of_the_suite_stand_beside_one_another_and_apart_from_others(
    vigil: Vigil, folder: Path, tmp_path: Path
) -> None:
    other = tmp_path / "other"
    run_pack(quick(Path(PACK), other, agent="always_success", limit=10))
    families = tmp_path / "families"
    run_pack(quick(tiny_pack(tmp_path / "tiny").folder, families, agent="noop"))
    said = vigil("score", folder, other, families).out
    assert "Closure stress: C by kind, %" in said
    assert "noop: %" in said
    table = said[said.index("Closure stress") :]
    assert "always_fail" in table
    assert "always_success" in table
    assert "noop" not in table


def test_the_page_of_a_run_gives_c(folder: Path) -> None:
    service = RenderService()
    with served(make_view(Library([folder]), service)) as site:
        text = site.get(f"/runs/{folder.name}").text
        (row,) = re.findall(r'<th scope="row" class="name">.*?</th>', site.get("/").text, re.DOTALL)
    service.close()
    assert re.search(r"C <b>10\.0</b> 0–\d+", row)
    section = text[text.index('<h2 id="closure">') :]
    for kind in (*KINDS, "all"):
        assert f'<th scope="row">{kind}</th>' in section
    assert "<b>50.0</b>" in section


def test_a_report_without_figures_has_no_heading_for_them(vigil: Vigil, folder: Path, tmp_path: Path) -> None:
    assert vigil("report", folder, "--format", "html", "--out", tmp_path / "report").code == 0
    page = (tmp_path / "report" / "report.html").read_text()
    assert "Correct closure by kind" in page
    assert "Figures" not in page
    assert 'href="#figures"' not in page
