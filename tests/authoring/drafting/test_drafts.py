"""Drafts files: what holds and what does not, kept and continued."""

from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from vigil.authoring.drafting.drafts import Draft, DraftsFile, Header, draft_id
from vigil.authoring.drafting.generation import (
    FAMILY_GRAMMAR,
    DraftWorker,
    GenerationProgress,
    GenerationSettings,
    generate_drafts,
)
from vigil.authoring.drafting.sources import (
    DRAWN_SEEDS,
    MIXED,
    GeneratedHouse,
    HouseInFile,
    houses_drawn_from,
    houses_from,
    houses_from_seeds,
)
from vigil.authoring.review.validate import Validator
from vigil.errors import HouseError, RecordError, SettingError
from vigil.housegen.base.spec import spec_for
from vigil.packs.pack import Pack
from vigil.protocol.episode import Episode
from vigil.protocol.families import Family
from vigil.protocol.house import House
from vigil.sim.privileged import PrivilegedSimulator

FAMILIES: tuple[Family, ...] = ("PG", "SV")
TERMS = GenerationSettings(FAMILIES, seed=3, per_house=3, tried=6)


@pytest.fixture(scope="module")
def source(starter: Pack) -> HouseInFile:
    """A small house in a file."""
    names = sorted(name for name in starter.manifest.files if name.startswith("houses/bathroom"))
    return HouseInFile(starter.folder / names[0])


@pytest.fixture(scope="module")
def written(source: HouseInFile, tmp_path_factory: pytest.TempPathFactory) -> DraftsFile:
    """A finished drafts file."""
    file = DraftsFile(tmp_path_factory.mktemp("drafts") / "drafts.jsonl")
    generate_drafts(file, [source], TERMS)
    return file


IDLE = replace(FAMILY_GRAMMAR, make_proposer=lambda seed: lambda context, family: iter(()))
"""A grammar that proposes nothing."""


def copies(source: HouseInFile, folder: Path, names: str) -> list[HouseInFile]:
    """The same house in several files."""
    files = [folder / f"{name}.json" for name in names]
    for path in files:
        path.write_bytes(source.path.read_bytes())
    return houses_from(map(str, files))


def test_drafts_hold_and_are_counted(written: DraftsFile, source: HouseInFile, simulator: PrivilegedSimulator) -> None:
    proposed = written.read()
    assert {draft.episode.family for draft in proposed.drafts} == set(FAMILIES)
    house, validator = written.house(source.name), Validator(simulator)
    for draft in proposed.drafts:
        assert validator.validate(draft.episode, house, draft.actions).is_valid
        assert draft.episode.provenance.validated
        assert draft.facts.rooms == 1
        assert draft.facts.category.lower() == draft.episode.id.split("_")[1]
        assert (draft.facts.label is not None) == (draft.episode.family == "SV")
    for row in proposed.done:
        assert row.kept == sum(draft.episode.family == row.family for draft in proposed.drafts)
        assert row.rejected == proposed.reasons.get(row.family, {})
    ids = [draft.episode.id for draft in proposed.drafts]
    assert len(set(ids)) == len(ids)


def test_the_same_settings_propose_the_same_after_an_interruption(
    written: DraftsFile, source: HouseInFile, tmp_path: Path
) -> None:
    whole = written.path.read_bytes()
    first_done = whole.index(b'"line":"done"')
    cut = whole.index(b"\n", first_done) + 40
    torn = DraftsFile(tmp_path / "drafts.jsonl")
    torn.path.write_bytes(whole[:cut])
    said: list[GenerationProgress] = []
    generate_drafts(torn, [source], TERMS, on_progress=said.append)
    assert torn.read().drafts == written.read().drafts
    assert [row.family for row in torn.read().done] == list(FAMILIES)
    assert (said[-1].houses, said[-1].of) == (1, 1)
    before = torn.path.read_bytes()
    generate_drafts(torn, [source], TERMS)
    assert torn.path.read_bytes() == before


def test_worker_processes_write_the_same_drafts(source: HouseInFile, tmp_path: Path) -> None:
    terms, houses = replace(TERMS, families=("SV",)), copies(source, tmp_path, "ab")
    files = [DraftsFile(tmp_path / f"{workers}.jsonl") for workers in (1, 2)]
    for workers, file in enumerate(files, start=1):
        generate_drafts(file, houses, terms, workers=workers)
    alone, together = (file.read() for file in files)
    assert [row.house for row in together.done] == ["a", "b"]
    assert together.drafts == alone.drafts != ()


def test_other_settings_are_refused(written: DraftsFile) -> None:
    other = Header(author="grammar", seed=4, simulator="mujoco", per_house=3, tried=6)
    with pytest.raises(SettingError, match=r"seed 3, now 4"), written.writing(other):
        pass


def test_two_campaigns_cannot_write_one_file(tmp_path: Path) -> None:
    file, header = DraftsFile(tmp_path / "drafts.jsonl"), TERMS.header()
    with (
        file.writing(header),
        pytest.raises(RecordError, match="being written by another process"),
        DraftsFile(file.path).writing(header),
    ):
        pass


def test_a_house_that_cannot_be_had_is_a_rejection(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(self: GeneratedHouse) -> None:
        raise HouseError(f"no house {self.name}")

    monkeypatch.setattr(GeneratedHouse, "house", refuse)
    file = DraftsFile(tmp_path / "drafts.jsonl")
    generate_drafts(file, [GeneratedHouse(1, "bathroom")], TERMS)
    assert file.read().reasons == {family: {"house_holds_episodes": 1} for family in sorted(FAMILIES)}
    assert not list(file.houses.iterdir())


def test_ids_have_the_papers_form_and_follow_the_content(starter: Pack) -> None:
    episode = starter.episodes[0]
    moved = episode.model_copy(update={"instruction": "Something else."})
    house = starter.house_of(episode)
    name = draft_id(episode, "Fridge", house)
    assert name.startswith(f"vigil_fridge_seed{episode.provenance.seed:03d}_{episode.family.lower()}_")
    other = episode.model_copy(update={"id": "other"})
    assert name == draft_id(other, "Fridge", house) != draft_id(moved, "Fridge", house)
    Episode.model_validate({**dict(episode), "id": name})


@pytest.mark.parametrize(
    ("metadata", "name", "begins"),
    [
        ({"schema": "1.0.0", "roomSpecId": "kitchen"}, "procthor-10k_val_7", "procthor_fridge_house007_"),
        ({"schema": "1.0.0", "roomSpecId": "kitchen"}, "mine", "procthor_fridge_house000_"),
        ({"schema": "1.0.0", "roomSpecId": "x", "generator": {"name": "other"}}, "h_12345", "house_fridge_house12345_"),
        ({}, "made_by_hand_2", "house_fridge_house002_"),
    ],
)
def test_ids_say_who_made_the_house(starter: Pack, metadata: dict, name: str, begins: str) -> None:
    episode = starter.episodes[0]
    provenance = episode.provenance.model_copy(update={"seed": None})
    house = House(name, {**starter.house_of(episode).data, "metadata": metadata})
    assert draft_id(episode.model_copy(update={"provenance": provenance}), "Fridge", house).startswith(begins)


def test_spread_houses_are_asked_for_one_family_each(source: HouseInFile, tmp_path: Path) -> None:
    drafts = DraftsFile(tmp_path / "drafts.jsonl")
    settings = GenerationSettings(("PG", "SV"), per_house=1, tried=1, one_family_per_house=True, grammar=IDLE)
    generate_drafts(drafts, copies(source, tmp_path, "abc"), settings)
    assert [(row.house, row.family) for row in drafts.read().done] == [("a", "PG"), ("b", "SV"), ("c", "PG")]


def test_seeds_take_their_specs_in_turn() -> None:
    found = houses_from_seeds("7:10", ["kitchen", "2"])
    assert [source.name for source in found] == ["kitchen_7", "2-room_8", "kitchen_9"]
    for bad in ("7", "7:7", "a:b", "9:7"):
        with pytest.raises(SettingError, match="FIRST:END"):
            houses_from_seeds(bad, ["kitchen"])


def test_mixed_houses_are_mostly_of_several_rooms() -> None:
    rooms = [
        len(spec_for(source.name.rpartition("_")[0]).choices[0]) for source in houses_from_seeds("1:21", ["mixed"])
    ]
    assert len(rooms) == len(MIXED)
    assert Counter(min(count, 5) for count in rooms) == {1: 4, 2: 6, 3: 4, 4: 4, 5: 2}


def test_a_secret_seed_draws_houses_that_more_of_them_begin_with() -> None:
    few, many = houses_drawn_from(7, 5, ["mixed"]), houses_drawn_from(7, 9, ["mixed"])
    assert many[:5] == few
    assert len({source.name for source in many}) == 9
    assert all(isinstance(source, GeneratedHouse) and source.seed in DRAWN_SEEDS for source in many)
    assert not {source.name for source in houses_drawn_from(8, 9, ["mixed"])} & {source.name for source in many}


def test_houses_come_from_files_and_lines(starter: Pack, tmp_path: Path) -> None:
    houses = sorted((starter.folder / "houses").iterdir())[:2]
    lines = tmp_path / "many.jsonl"
    lines.write_bytes(b"".join(path.read_bytes() for path in houses))
    found = houses_from([str(lines)])
    assert [source.name for source in found] == ["many_1", "many_2"]
    assert found[1].house().data == houses_from([str(houses[1])])[0].house().data
    assert len(houses_from([str(lines)], limit=1)) == 1
    with pytest.raises(SettingError, match="does not exist"):
        houses_from([str(tmp_path / "no.json")])


def test_a_seed_changes_what_is_proposed(written: DraftsFile, source: HouseInFile) -> None:
    other = GenerationSettings(("PG",), seed=4, per_house=3, tried=6)
    _, lines = DraftWorker(other).work(source, ("PG",))
    ids = {line.episode.id for line in lines if isinstance(line, Draft)}
    assert ids
    assert ids != {draft.episode.id for draft in written.read().drafts if draft.episode.family == "PG"}
    assert np.isfinite([line.facts.distance_m for line in lines if isinstance(line, Draft)]).all()


def test_a_header_that_a_kill_has_cut_is_written_again(tmp_path: Path) -> None:
    file, header = DraftsFile(tmp_path / "drafts.jsonl"), TERMS.header()
    with file.writing(header):
        whole = file.path.read_bytes()
    for size in (0, 1, len(whole) - 1, len(whole)):
        file.path.write_bytes(whole[:size])
        with file.writing(header) as writer:
            assert writer.done == frozenset()
        assert file.path.read_bytes() == whole


@pytest.mark.parametrize("text", ["notes without a line break", "notes\nof many\nlines\n"])
def test_a_file_of_something_else_is_left_as_it_is(text: str, tmp_path: Path) -> None:
    path = tmp_path / "notes.txt"
    path.write_text(text)
    header = TERMS.header()
    with pytest.raises(SettingError, match=r"notes\.txt"), DraftsFile(path).writing(header):
        pass
    assert path.read_text() == text


def test_how_many_starts_were_compared_is_told_where_they_were(tmp_path: Path) -> None:
    plain, hard = (GenerationSettings(FAMILIES, starts=starts).header() for starts in (1, 4))
    for name, header in (("plain", plain), ("hard", hard)):
        with DraftsFile(tmp_path / f"{name}.jsonl").writing(header):
            pass
    assert b"starts" not in (tmp_path / "plain.jsonl").read_bytes()
    assert DraftsFile(tmp_path / "plain.jsonl").read().header.starts == 1
    assert DraftsFile(tmp_path / "hard.jsonl").read().header.starts == 4
    with pytest.raises(SettingError, match="starts 4, now 1"), DraftsFile(tmp_path / "hard.jsonl").writing(plain):
        pass


def test_hard_starts_give_other_drafts_that_hold(source: HouseInFile, tmp_path: Path) -> None:
    file = DraftsFile(tmp_path / "hard.jsonl")
    generate_drafts(file, [source], replace(TERMS, families=("PG",), starts=4))
    again = DraftsFile(tmp_path / "again.jsonl")
    generate_drafts(again, [source], replace(TERMS, families=("PG",), starts=4))
    assert file.read().drafts == again.read().drafts != ()
