"""Results by stratum: every episode in one stratum of each way that concerns it, with intervals."""

import json
from pathlib import Path

import pytest

from tests.support.builders import thing
from tests.support.published_runs import good as plot_of
from tests.support.published_runs import make_episodes, record_of, write_pack, write_run
from vigil.analysis.measures.rows import read_runs
from vigil.analysis.measures.strata import STRATA, by_stratum
from vigil.analysis.measures.study import study
from vigil.analysis.tables.registry import tables
from vigil.errors import PackMismatch
from vigil.protocol.episode import Episode, Provenance
from vigil.records.record import EpisodeRecord
from vigil.scoring.rates import wilson

TEMPLATE = next(name for name in STRATA if name.startswith("Template"))
TEMPLATES = {"VS": "walk", "SV": "on", "AI": "open", "SI": "pick", "SM": "put_into", "CR": "swing"}


def marked(episode: Episode) -> Episode:
    template = TEMPLATES.get(episode.family, "")
    size = "large" if episode.family == "PG" else None
    return episode.model_copy(update={"provenance": Provenance(template=template), "target_size": size})


def begun(record: EpisodeRecord, category: str, distance_m: float) -> EpisodeRecord:
    """The record as if its target had been such a thing, so far away, at the start."""
    assert record.initial is not None
    target = thing(**{**dict(record.initial.objects["target"]), "category": category, "box_distance_m": distance_m})
    objects = {**record.initial.objects, "target": target}
    return record.model_copy(update={"initial": record.initial.model_copy(update={"objects": objects})})


@pytest.fixture
def run(tmp_path: Path) -> Path:
    episodes = [marked(one) for one in make_episodes(2)]
    houses = {f"house_{number}": json.dumps({"rooms": [{}] * rooms}).encode() for number, rooms in ((0, 1), (1, 4))}
    write_pack(tmp_path / "pack", episodes, houses)
    records = {}
    for one in episodes:
        is_first = one.id.endswith("0")
        records[one.id] = begun(
            record_of(plot_of(one.family)), "Cabinet" if is_first else "Chair", 2.5 if is_first else 4.5
        )
    return write_run(tmp_path / "run", tmp_path / "pack", "vllm/model", records)


def test_each_way_has_the_strata_of_its_episodes(run: Path):
    (found,) = read_runs([run])
    sizes = {way: {part.name: part.counts.n for part in parts} for way, parts in by_stratum(found.rows).items()}
    assert sizes == {
        "Target size (PG)": {"large": 1, "medium": 1},
        TEMPLATE: {
            "VS walk": 2,
            "SV on": 2,
            "AI open": 2,
            "SI pick": 2,
            "SM put_into": 2,
        },
        "Constraint (CR)": {"swing": 2},
        "Rooms of the house (all families)": {"1": 8, "4": 8},
        "Distance from start to target (DA)": {"under 3 m": 1, "over 4 m": 1},
        "Distance from start to target (all families)": {"under 3 m": 8, "over 4 m": 8},
    }


def test_sizes_and_bands_stand_in_their_order(run: Path):
    (found,) = read_runs([run])
    parts = by_stratum(found.rows)
    assert [part.name for part in parts["Distance from start to target (DA)"]] == ["under 3 m", "over 4 m"]
    templates = [part.name for part in parts[TEMPLATE]]
    assert templates == ["VS walk", "SV on", "AI open", "SI pick", "SM put_into"]


def test_the_table_has_every_rate_with_its_interval(run: Path):
    table = tables(study(read_runs([run])))["strata"]
    row = next(row for row in table.rows if row.cells["stratum"] == "4")
    low, high = wilson(8, 8)
    assert row.cells["B"] == pytest.approx((100.0, 100 * low, 100 * high))
    assert row.group == "Rooms of the house (all families)"


def test_a_pack_without_houses_tells_no_rooms(tmp_path: Path):
    episodes = make_episodes(1)
    write_pack(tmp_path / "pack", episodes)
    records = {one.id: record_of(plot_of(one.family)) for one in episodes}
    (found,) = read_runs([write_run(tmp_path / "run", tmp_path / "pack", "vllm/model", records)])
    assert by_stratum(found.rows)["Rooms of the house (all families)"] == []


def test_a_damaged_house_is_named(run: Path):
    (run.parent / "pack/houses/house_1.json").write_text('{"walls": []}', encoding="utf-8")
    with pytest.raises(PackMismatch, match=r"houses/house_1\.json has SHA-256"):
        read_runs([run])
