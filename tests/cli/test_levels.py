"""`vigil pack levels` and `difficulty`, `--level` and `--levels`, as one would type them."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from tests.support.published_runs import good, make_episodes, record_of, write_pack, write_run
from vigil.cli import app
from vigil.errors import EpisodeError, SettingError
from vigil.packs.freeze import freeze
from vigil.packs.pack import Pack, find_pack
from vigil.scoring.levels import EpisodeLevel, LevelMeasures, dump_levels, read_levels, read_pack_levels

FIGURES = LevelMeasures(
    path_m=0.0, turns=0, doors=0, rooms=1, look_alikes=0, target_px=9000, containers=0, occlusion=0.0, slack=1.0,
    reference_words=1,
)  # fmt: skip


def vigil(*arguments: str | Path) -> Result:
    return CliRunner().invoke(app, list(map(str, arguments)))


@pytest.fixture
def runs(tmp_path: Path) -> list[Path]:
    """One model that completes all, and one that was scored on half of it."""
    episodes = make_episodes(2)
    write_pack(tmp_path / "pack", episodes)
    levels = [
        EpisodeLevel(episode_id=one.id, level="easy" if n % 2 else "hard", index=float(n), measures=FIGURES)
        for n, one in enumerate(episodes)
    ]
    (tmp_path / "mine.jsonl").write_bytes(dump_levels(levels))
    records = {one.id: record_of(good(one.family)) for one in episodes}
    fewer = {name: record for n, (name, record) in enumerate(records.items()) if n % 2}
    return [
        write_run(tmp_path / f"run{n}", tmp_path / "pack", f"vllm/model{n}", some)
        for n, some in enumerate((records, fewer))
    ]


def test_a_pack_is_measured(tmp_path: Path) -> None:
    starter = Pack.load("starter")
    chosen = [episode for episode in starter.episodes if episode.family == "PG"][:2]
    solutions = [starter.solutions[episode.id] for episode in chosen]
    houses = list({episode.house.name: starter.house_of(episode) for episode in chosen}.values())
    freeze(tmp_path / "small", chosen, solutions, houses, name="small")
    told = vigil("pack", "levels", tmp_path / "small", "--out", tmp_path / "l.jsonl", "--workers", "1")
    assert told.exit_code == 0, told.output
    assert "PG" in told.stdout
    assert set(read_levels(tmp_path / "l.jsonl")) == {episode.id for episode in chosen}


def test_difficulties_are_fitted_to_runs(runs: list[Path], tmp_path: Path) -> None:
    told = vigil("pack", "difficulty", *runs, "--levels", tmp_path / "mine.jsonl")
    assert told.exit_code == 0, told.output
    assert all(word in told.stdout for word in ("model0", "ability", "easy", "hard", "within families"))
    facts = json.loads(vigil("pack", "difficulty", *runs, "--success", "W", "--json").stdout)
    assert [agent["agent"] for agent in facts["agents"]] == ["model0", "model1"]
    assert len(facts["episodes"]) == 16
    assert facts["episodes"][0]["index"] is None
    assert facts["index"]["overall"]["value"] is None


def test_a_report_takes_levels_from_a_file(runs: list[Path], tmp_path: Path) -> None:
    told = vigil("report", runs[0], "--no-paper", "--levels", tmp_path / "mine.jsonl")
    assert told.exit_code == 0, told.output
    assert "Results by level of difficulty" in told.stdout
    assert isinstance(vigil("report", runs[0], "--levels", tmp_path / "none.jsonl").exception, SettingError)


def test_a_pack_is_shared_out_over_levels(tmp_path: Path) -> None:
    houses = sorted((find_pack("starter") / "houses").glob("bathroom*.json"))[:1]
    drafts = tmp_path / "drafts.jsonl"
    asked = ["--family", "PG", "--per-house", "6"]
    assert vigil("pack", "propose", "--houses", houses[0], *asked, "--out", drafts, "--tries", "12").exit_code == 0
    build = ["pack", "build", "--drafts", drafts, "--family", "PG", "--max-per-house", "9", "--workers", "1"]
    wanted = ["--per-family", "1", "--level", "easy", "--robust"]
    built = vigil(*build, "--name", "mine", "--out", tmp_path / "mine", *wanted)
    assert built.exit_code == 0, built.output
    pack = Pack.load(tmp_path / "mine")
    assert pack.manifest.meta["levels"] == {"PG": {"easy": 1}}
    assert pack.manifest.meta["is_robust"]
    assert pack.manifest.meta["rejected"]["candidates"]["tried"] >= 1
    (row,) = (json.loads(line) for line in (pack.folder / "facts.jsonl").read_text().splitlines())
    assert (row["level"], row["is_robust"]) == ("easy", True)
    assert pack.episodes[0].id in (tmp_path / "drafts.checks.jsonl").read_text()
    assert [each.level for each in read_pack_levels(pack.folder).values()] == ["easy"]
    short = vigil(*build, "--name", "far", "--out", tmp_path / "far", "--per-family", "40", "--level", "easy,extreme")
    assert isinstance(short.exception, EpisodeError)
    assert "PG extreme" in str(short.exception)
    wrong = vigil(*build, "--name", "far", "--out", tmp_path / "far", "--level", "hrad")
    assert "Did you mean 'hard'" in str(wrong.exception)


@pytest.mark.parametrize("option", [["--level", "hard"], ["--robust"], ["--hardest-of", "3"]])
def test_a_suite_has_no_levels(tmp_path: Path, option: list[str]) -> None:
    suite = ["--suite", "closure", "--seed", "1", "--name", "s", "--out", tmp_path / "s"]
    told = vigil("pack", "make", *suite, *option)
    assert f"--suite and {option[0]} exclude each other" in str(told.exception)
