"""`vigil study`: plays what is missing, says how far it is, joins parts, and reports with a place for every part."""

from pathlib import Path

import pytest

from tests.support.commands import Vigil
from tests.support.tiny_pack import tiny_pack
from vigil.analysis.tables.paper_index import PARTS

STUDY = """name: tiny
folder: {folder}
settings: {{pack: {pack}, backend: fake, workers: 1}}
conditions:
  baseline:
  feedback: {{profile: action_feedback}}
models:
  - {{name: First, agent: coin, repeats: 2}}
  - {{name: Second, agent: always_success, conditions: [baseline], group: Mine}}
  - {{name: Third, model: openai/m, conditions: [baseline]}}
"""


@pytest.fixture(scope="module")
def pack(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("packs") / "tiny"
    tiny_pack(folder, 4)
    return folder


@pytest.fixture
def study(pack: Path, tmp_path: Path) -> Path:
    path = tmp_path / "study.yaml"
    path.write_text(STUDY.format(folder=tmp_path / "all", pack=pack), encoding="utf-8")
    return path


def test_a_study_is_played_continued_and_reported(vigil: Vigil, study: Path, tmp_path: Path) -> None:
    chosen = ("--model", "First", "--model", "Second")
    assert vigil("study", "report", study).code == 2
    assert "First [repeat 2]: 4 scored, 0 errors, 0 played before" in vigil("study", "run", study, *chosen).out
    again = vigil("study", "run", study, *chosen)
    assert again.out.count("4 played before") == 4
    status = vigil("study", "status", study).out
    assert "16 of 20 plays are scored" in status
    assert "not begun" in status
    done = vigil("study", "report", study, "--no-pdf", "--out", tmp_path / "report")
    assert "1 of the study's 5 runs are not played: Third." in done.out
    text = (tmp_path / "report" / "report.md").read_text(encoding="utf-8")
    main = text[text.index("`extended_panel`") : text.index("`proprio_minimal`")]
    assert "| First |" in main or "| First |" in text[text.index("`full_panel`") :]
    assert "| First [repeat 2] |" not in text[text.index("`global_cross_section`") : text.index("`proprio_minimal`")]
    assert "*Repeats of a run above*" in text
    page = (tmp_path / "report" / "report.html").read_text(encoding="utf-8")
    for part in PARTS:
        place = f"figure-{part.place}" if part.is_figure else part.place
        if part.place not in ("pipeline", "trajectory_sv", "trajectory_ai"):  # this pack has no such episodes
            assert f'href="#{place}"' in page
            assert f'id="{place}"' in page


def test_a_dry_run_says_what_is_left(vigil: Vigil, study: Path) -> None:
    said = vigil("study", "run", study, "--dry-run")
    assert said.code == 0
    assert "no model" in said.out
    assert "Nothing was sent" in said.out


def test_parts_are_joined(vigil: Vigil, study: Path) -> None:
    one = ("--model", "Second")
    assert vigil("study", "run", study, *one, "--shard", "1/2").code == 0
    assert "parts, not joined" in vigil("study", "status", study, *one).out
    early = vigil("study", "run", study, *one)
    assert early.code == 1
    assert "missing: 2/2" in early.err
    assert vigil("study", "run", study, *one, "--shard", "2/2").code == 0
    joined = vigil("study", "run", study, *one)
    assert joined.code == 0
    assert "Second: parts joined." in joined.out
    assert "4 played before" in joined.out


def test_a_name_that_is_unknown_is_an_error(vigil: Vigil, study: Path) -> None:
    said = vigil("study", "run", study, "--condition", "feedbak")
    assert (said.code, "Did you mean 'feedback'" in said.err) == (2, True)
