"""Results by level of difficulty: each level's rates with intervals by houses, or no row where nothing was measured."""

from pathlib import Path

import pytest

from tests.support.published_runs import good, make_episodes, record_of, write_pack, write_run
from vigil.analysis.measures.rows import read_runs
from vigil.analysis.measures.study import study
from vigil.analysis.tables.registry import tables
from vigil.scoring.levels import EpisodeLevel, LevelMeasures

FIGURES = LevelMeasures(
    path_m=0.0, turns=0, doors=0, rooms=1, look_alikes=0, target_px=9000, containers=0, occlusion=0.0, slack=1.0,
    reference_words=1,
)  # fmt: skip


@pytest.fixture
def run(tmp_path: Path) -> Path:
    episodes = make_episodes(12)
    write_pack(tmp_path / "pack", episodes)
    records = {one.id: record_of(good(one.family)) for one in episodes}
    return write_run(tmp_path / "run", tmp_path / "pack", "vllm/model", records)


def levels() -> dict[str, EpisodeLevel]:
    return {
        one.id: EpisodeLevel(
            episode_id=one.id, level="easy" if one.family == "PG" else "extreme", index=2.0, measures=FIGURES
        )
        for one in make_episodes(12)
    }


def test_levels_stand_in_their_order_with_their_rates(run: Path) -> None:
    table = tables(study(read_runs([run], levels=levels())))["levels"]
    assert [row.cells["level"] for row in table.rows] == ["easy", "extreme"]
    assert [row.cells["n"] for row in table.rows] == [12, 84]
    easy = table.rows[0].cells
    assert (easy["houses"], easy["index"]) == (12, 2.0)
    assert easy["B"][0] == 100.0


def test_without_levels_there_is_no_row(run: Path) -> None:
    assert tables(study(read_runs([run])))["levels"].rows == ()
