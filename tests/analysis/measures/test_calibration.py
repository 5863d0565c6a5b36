"""Calibration: runs of one pack become plays, and the index is held against what they say."""

from pathlib import Path

import numpy as np
import pytest

from tests.support.published_runs import (
    PUBLISHED,
    EpisodeScript,
    Write,
    good,
    make_episodes,
    record_of,
    small_records,
    write_pack,
    write_run,
)
from vigil.analysis.measures.calibration import calibrate_difficulty, success_table
from vigil.analysis.measures.rows import read_runs
from vigil.errors import RecordError
from vigil.protocol.episode import Episode
from vigil.scoring.levels import LEVELS, EpisodeLevel, LevelMeasures, dump_levels

PLAIN = LevelMeasures(
    path_m=0.0, turns=0, doors=0, rooms=1, look_alikes=0, target_px=9000, containers=0, occlusion=0.0, slack=1.0,
    reference_words=1,
)  # fmt: skip
PER_FAMILY = 8


def bad(family: str) -> EpisodeScript:
    return EpisodeScript(family, w=False, end="NR")


def levels_by_number(episodes: list[Episode]) -> dict[str, EpisodeLevel]:
    """Levels and an index that rise with the last number of the ids."""
    found = {}
    for one in episodes:
        number = int(one.id[-3:])
        level = LEVELS[min(number // 2, 3)]
        found[one.id] = EpisodeLevel(episode_id=one.id, level=level, index=float(number), measures=PLAIN)
    return found


@pytest.fixture
def runs(tmp_path: Path) -> list[Path]:
    """Six models; the model n completes the episodes whose number is below n + 1."""
    episodes = make_episodes(PER_FAMILY)
    write_pack(tmp_path / "pack", episodes)
    (tmp_path / "pack/levels.jsonl").write_bytes(dump_levels(levels_by_number(episodes).values()))
    plots = {family: (record_of(good(family)), record_of(bad(family))) for family in PUBLISHED}
    return [
        write_run(
            tmp_path / f"run{skill}",
            tmp_path / "pack",
            f"vllm/model{skill}",
            {one.id: plots[one.family][int(one.id[-3:]) > skill] for one in episodes},
        )
        for skill in range(1, 7)
    ]


def test_abilities_and_difficulties_stand_in_their_order(runs: list[Path]) -> None:
    found = calibrate_difficulty(read_runs(runs))
    assert found.fit.plays.agents == tuple(f"model{skill}" for skill in range(1, 7))
    assert list(found.fit.ability) == sorted(found.fit.ability)
    numbers = np.array([int(name[-3:]) for name in found.fit.plays.episodes])
    assert found.fit.difficulty[numbers == 6].min() > found.fit.difficulty[numbers == 2].max()


def test_the_index_is_held_against_the_fit(runs: list[Path]) -> None:
    found = calibrate_difficulty(read_runs(runs))
    assert found.overall.n == PER_FAMILY * len(PUBLISHED)
    assert found.overall.value > 0.95
    assert found.within_families.value > 0.95
    assert found.overall.interval is not None
    assert found.suspects == []


def test_levels_from_elsewhere_stand_in_for_the_packs_own(runs: list[Path]) -> None:
    backwards = {
        name: one.model_copy(update={"index": -one.index})
        for name, one in levels_by_number(make_episodes(PER_FAMILY)).items()
    }
    assert calibrate_difficulty(read_runs(runs, levels=backwards)).overall.value < -0.95
    none = calibrate_difficulty(read_runs(runs, levels={}))
    assert np.isnan(none.overall.value)
    assert none.overall.n == 0


def test_repeats_of_a_model_are_one_agent(runs: list[Path], tmp_path: Path) -> None:
    again = write_run(
        tmp_path / "again",
        tmp_path / "pack",
        "vllm/model1",
        {one.id: record_of(good(one.family)) for one in make_episodes(PER_FAMILY)},
    )
    scored_runs = read_runs([runs[0], again])
    plays = success_table(scored_runs, [one.id for one in make_episodes(PER_FAMILY)], "B")
    assert plays.agents == ("model1",)
    assert set(plays.plays.ravel()) == {2.0}
    assert set(plays.hits.ravel()) == {1.0, 2.0}


def test_runs_of_two_packs_are_refused(runs: list[Path], write: Write) -> None:
    other = write("other", small_records())
    with pytest.raises(RecordError, match=r"on 2 packs .*Give runs of one pack"):
        calibrate_difficulty(read_runs([runs[0], other]))
