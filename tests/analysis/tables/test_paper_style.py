"""The paper's tables as LaTeX for a paper: they fit their columns when a real LaTeX compiles them."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.support.published_runs import SMALL, make_episodes, small_records, write_pack, write_run
from tests.support.waiting import HANGS_AFTER_S
from vigil.analysis.measures.paper import paper
from vigil.analysis.measures.rows import read_runs
from vigil.analysis.measures.study import study
from vigil.analysis.report import write_report
from vigil.analysis.tables.paper_captions import GOALS, without_condition
from vigil.analysis.tables.paper_index import PARTS
from vigil.analysis.tables.paper_style import COLUMNS, TABLES
from vigil.analysis.tables.registry import PAPER_TABLES
from vigil.analysis.tables.registry import TABLES as ALL_TABLES
from vigil.analysis.tables.table import TableRow
from vigil.protocol.families import FAMILIES


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A report in the paper's style, of one run next to the published rows."""
    place = tmp_path_factory.mktemp("paper")
    write_pack(place / "pack", make_episodes(SMALL))
    records = small_records()
    write_run(place / "run", place / "pack", "vllm/Qwen3-VL-30B-A3B-Thinking", records, planned=sorted(records))
    found = study(read_runs([place / "run"]))
    write_report(found, place / "report", ("latex",), style="paper")
    return place / "report"


def test_every_table_of_the_paper_is_there() -> None:
    assert set(TABLES) == set(PAPER_TABLES)
    assert len(TABLES) == 16
    assert {part.place for part in PARTS if not part.is_figure} <= set(ALL_TABLES)
    assert len(PARTS) == 16 + 7


def test_columns_are_those_of_the_paper(folder: Path) -> None:
    text = (folder / "tables" / "global_cross_section.tex").read_text(encoding="utf-8")
    assert r"\multicolumn{4}{c}{Diagnostic} & \multicolumn{4}{c}{Compositional}" in text
    assert "resizebox" not in text
    printed = paper().tables["global_cross_section"][0]
    assert f"{printed['W']}/{printed['B']}" in text
    feedback = (folder / "tables" / "proprio_minimal.tex").read_text(encoding="utf-8")
    assert len(re.findall(r"base & \+FB", feedback)) == 3
    assert set(COLUMNS) < set(TABLES)


def test_intervals_are_in_a_companion_table(folder: Path) -> None:
    for name in ("global_cross_section", "conditional_report", "extended_panel"):
        own = (folder / "tables" / f"{name}_intervals.tex").exists()
        assert own or "Published" in (folder / "tables" / f"{name}.tex").read_text(encoding="utf-8")
    assert list((folder / "tables").glob("*_intervals.tex"))


def test_a_table_of_words_has_one_column_that_is_wrapped(folder: Path) -> None:
    text = (folder / "tables" / "family_specs.tex").read_text(encoding="utf-8")
    assert text.count("X") - text.count("EX") >= 1
    assert "several of these" in text
    assert "constraint resolved, and object in the asked state or object held" in text


def test_every_kind_of_goal_has_words() -> None:
    assert {kind for family in FAMILIES.values() for kind in family.allowed_goal_kinds} <= set(GOALS)


def test_captions_give_the_episodes_and_the_marks(folder: Path) -> None:
    texts = {name: (folder / "tables" / f"{name}.tex").read_text(encoding="utf-8") for name in COLUMNS}
    n = len(small_records())
    assert rf"This study: {n} episodes" in texts["full_panel"]
    assert all("1,000 other episodes" in text for text in texts.values())
    assert all("(T): served in thinking mode" in text for text in texts.values())
    assert "two runs of 1,000" in texts["open_repeat_robustness"]
    assert "Bold: highest W, highest B, lowest $\\Delta$ of the published rows." in texts["global_cross_section"]
    assert r"\textbf{95.2}/74.4" in texts["global_cross_section"]
    assert "supplementary" not in texts["extended_panel"]
    words = (folder / "tables" / "episode_distribution.tex").read_text(encoding="utf-8")
    assert "Episodes of " not in words.split("toprule")[1]


def test_a_condition_in_brackets_is_left_out_unless_two_rows_would_be_alike() -> None:
    def shown(*names: str) -> list[str]:
        return list(without_condition([TableRow({"model": name}) for name in names]).values())

    assert shown("A [neutral]", "B [neutral]") == ["A", "B"]
    assert shown("A [neutral]", "A [quiet]") == ["A [neutral]", "A [quiet]"]


def test_the_index_comes_first_and_intervals_come_last(folder: Path) -> None:
    text = (folder / "report.tex").read_text(encoding="utf-8")
    index, rest = text.split(r"\input", 1)
    assert all(rf"\pageref{{tab:{name}}}" in index for name in TABLES)
    assert r"Figure~\ref{fig:belief_closure} (b)" in index
    assert "Trajectories, interaction (not in this report)" in index
    last_of_paper = rest.index("figures/belief_closure.pdf")
    assert last_of_paper < rest.index("_intervals.tex")
    assert rest.rindex("tables/open_repeat_robustness.tex") < last_of_paper


def test_a_real_latex_finds_no_table_too_wide(folder: Path) -> None:
    if shutil.which("pdflatex") is None:
        pytest.skip("LaTeX is not installed")
    command = ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "report.tex"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=HANGS_AFTER_S, check=False)
    assert done.returncode == 0, done.stdout[-2000:]
    assert re.findall(r"Overfull \\hbox.*", done.stdout) == []
    assert (folder / "report.pdf").exists()
