"""`vigil export` to tables, datasets and results: what goes together, and what is said."""

import re
from pathlib import Path

import pandas as pd
import pytest

from tests.support.commands import Vigil
from tests.support.published_runs import make_episodes, small_records, write_pack, write_run
from vigil.analysis.measures.rows import combined_rows, read_runs


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with two runs of models, `a` whole and `b` incomplete."""
    folder = tmp_path_factory.mktemp("runs")
    write_pack(folder / "pack", make_episodes(2))
    records = small_records()
    write_run(folder / "a", folder / "pack", "vllm/Qwen/Qwen3-VL", records)
    some = dict(list(records.items())[:5])
    write_run(folder / "b", folder / "pack", "vllm/Qwen/Other", some, planned=sorted(records))
    return folder


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (
            ["a", "--format", "parqet", "--out", "e.parquet"],
            "'parqet' does not exist. Did you mean 'parquet'? Known: site",
        ),
        (["a", "--format", "parquet", "--out", "e.csv"], "Give a name that ends in .parquet"),
        (["a", "--format", "parquet", "--out", "no/e.parquet"], "folder 'no' does not exist"),
        (["a", "--format", "hf", "--out", "file"], "'file' is a file, but --format hf writes a folder"),
        (["a", "--format", "every-eval-ever", "--out", "file"], "is a file"),
        (["a", "--format", "hf", "--out", "new", "--episode", "AI-000"], "--episode exports a page or a film"),
        (["a", "b", "--out", "new"], "A site shows one run, but 2 were given"),
        (["a", "--format", "hf", "--out", "new", "--pack", "p", "--pack", "q"], "--pack may be given several times"),
        (["a", "--out", "new", "--answer-key"], "--answer-key is for --format hf and every-eval-ever"),
        (["a", "--out", "new", "--force"], "--force is for --format every-eval-ever only"),
        (["a", "--format", "hf", "--out", "new", "--developer", "me"], "--developer is for --format every-eval-ever"),
        (["a", "--format", "every-eval-ever", "--out", "new", "--relationship", "friend"], "--relationship"),
        (["a", "b", "--format", "every-eval-ever", "--out", "new"], "Run 'b' is incomplete: 5 of 16"),
        (["none", "--format", "parquet", "--out", "e.parquet"], "none' has no run.json"),
    ],
    ids=lambda value: value.replace(" ", "_") if isinstance(value, str) else "",
)
def test_what_does_not_go_together_is_named_and_nothing_is_written(
    vigil: Vigil, runs: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], words: str
) -> None:
    monkeypatch.chdir(runs)
    (runs / "file").touch()
    before = set(runs.iterdir())
    said = vigil("export", *arguments)
    assert said.code == 2
    assert words in re.sub(r"\s+", " ", said.err)
    assert set(runs.iterdir()) == before


def test_parquet_is_the_rows_of_a_report(vigil: Vigil, runs: Path, tmp_path: Path) -> None:
    both = (runs / "a", runs / "b")
    said = vigil("export", *both, "--format", "parquet", "--out", tmp_path / "e.parquet")
    assert said.out == f"{tmp_path / 'e.parquet'}\n"
    assert "INCOMPLETE: 5 of 16 episodes are scored" in said.err
    assert len(pd.read_parquet(tmp_path / "e.parquet")) == 16 + 5
    combined_rows(read_runs(both)).to_parquet(tmp_path / "rows.parquet", index=False)
    assert (tmp_path / "e.parquet").read_bytes() == (tmp_path / "rows.parquet").read_bytes()


def test_the_other_formats_print_what_to_open(vigil: Vigil, runs: Path, tmp_path: Path) -> None:
    said = vigil("export", runs / "a", runs / "b", "--format", "hf", "--out", tmp_path / "hf")
    assert said.out == f"{tmp_path / 'hf' / 'README.md'}\n"
    assert "INCOMPLETE" in said.err
    assert "INCOMPLETE" in (tmp_path / "hf" / "README.md").read_text(encoding="utf-8")
    both = (runs / "a", runs / "b", "--format", "every-eval-ever", "--force")
    said = vigil("export", *both, "--out", tmp_path / "results", "--organization", "Lab")
    assert all(Path(line).is_file() for line in said.out.splitlines())
    assert len(said.out.splitlines()) == 2
    assert "note: b: INCOMPLETE: 5 of 16 episodes are scored." in said.err
