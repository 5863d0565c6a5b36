"""Levels of packs: measured in as many processes as one likes, and shared out evenly when a pack is assembled."""

from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest

from vigil.authoring.drafting.drafts import Draft, DraftFacts, DraftsFile, FamilyDone, Header
from vigil.authoring.packing.assemble import assemble
from vigil.authoring.packing.episode_measures import measured_levels, pack_levels
from vigil.authoring.packing.requests import PackRequest
from vigil.authoring.packing.selection import Candidate, TooFewDrafts, select
from vigil.authoring.packing.verify import VerificationSettings, VerificationTask, house_batches
from vigil.packs.freeze import freeze
from vigil.packs.pack import Pack
from vigil.protocol.actions import Report
from vigil.protocol.episode import Episode
from vigil.scoring.levels import LEVELS, LEVELS_FILE, Level, LevelMeasures, grade_episode, read_pack_levels

FACTS = DraftFacts(category="Mug", rooms=1, area_m2=20.0, distance_m=2.0, is_seen_by_turning=False)
PLAIN = LevelMeasures(
    path_m=0.0, turns=0, doors=0, rooms=1, look_alikes=0, target_px=9000, containers=0, occlusion=0.0, slack=1.0,
    reference_words=1,
)  # fmt: skip


@pytest.fixture(scope="module")
def small(starter: Pack, tmp_path_factory: pytest.TempPathFactory) -> Pack:
    """Two episodes of the starter pack, in two houses."""
    chosen = list({episode.house.name: episode for episode in starter.episodes if episode.family == "PG"}.values())[:2]
    solutions = [starter.solutions[episode.id] for episode in chosen]
    houses = [starter.house_of(episode) for episode in chosen]
    return freeze(tmp_path_factory.mktemp("small") / "pack", chosen, solutions, houses, name="small")


def candidate(episode: Episode, number: int, level: Level | None) -> Candidate:
    """A copy of an episode under another id in a house of its own, said to be of a level."""
    ref = episode.house.model_copy(update={"name": f"h{number}"})
    named = episode.model_copy(update={"id": f"procthor_x_seed001_{number:04d}", "house": ref})
    draft = Draft(kind="", episode=named, actions=(Report(status="success", summary=""),), facts=FACTS)
    return Candidate(draft, level=level)


def test_workers_make_no_difference(small: Pack) -> None:
    told: list[tuple[int, int]] = []
    alone = pack_levels(small, VerificationSettings(), lambda done, of: told.append((done, of)))
    assert pack_levels(small, VerificationSettings(workers=2)) == alone
    assert [each.episode_id for each in alone] == [episode.id for episode in small.episodes]
    assert told == [(1, 2), (2, 2)]


def test_what_has_no_solution_has_no_level(small: Pack) -> None:
    work = house_batches([VerificationTask(small.episodes[:1], (None,))], small.house_of)
    assert measured_levels(work, VerificationSettings()) == []


def test_levels_are_shared_out_evenly(starter: Pack) -> None:
    episode = next(e for e in starter.episodes if e.family == "AI")
    pool = [candidate(episode, n, "easy" if n < 20 else LEVELS[n % 4]) for n in range(40)]
    chosen = select(pool, PackRequest("p", 10, families=("AI",), levels=LEVELS))
    assert Counter(each.level for each in chosen) == {"easy": 3, "medium": 3, "hard": 2, "extreme": 2}
    hard = select(pool, PackRequest("p", 5, families=("AI",), levels=("hard",)))
    assert {each.level for each in hard} == {"hard"}


def test_small_targets_come_first_in_the_upper_levels_until_their_kind_has_its_share(starter: Pack) -> None:
    episodes = {size: next(e for e in starter.episodes if e.target_size == size) for size in ("small", "large")}
    kinds = [("small", 100), ("small", 5000), ("large", 5000)]
    pool = [
        replace(candidate(episodes[size], 100 * kind + number, LEVELS[number % 4]), target_px=target_px)
        for kind, (size, target_px) in enumerate(kinds)
        for number in range(40)
    ]
    chosen = select(pool, PackRequest("p", 16, families=("PG",), levels=LEVELS))
    assert Counter(each.episode.target_size for each in chosen) == {"small": 8, "large": 8}
    upper = [each for each in chosen if each.level in ("hard", "extreme")]
    assert all(each.target_px == 100 for each in upper if each.episode.target_size == "small")
    assert sum(each.target_px == 100 for each in upper) > len(upper) / 2


def test_a_level_that_cannot_be_filled_is_named_not_replaced(starter: Pack) -> None:
    episode = next(e for e in starter.episodes if e.family == "AI")
    pool = [candidate(episode, n, "easy" if n else "hard") for n in range(20)]
    with pytest.raises(TooFewDrafts, match=r"only AI hard 1 of 3 \(of 1 drafts\)\. Propose in more") as short:
        select(pool, PackRequest("p", 6, families=("AI",), levels=("easy", "hard")))
    (missing,) = short.value.missing
    assert (missing.group, missing.level, missing.found, missing.asked) == ("AI", "hard", 1, 3)


def test_the_same_bytes_without_levels_and_a_file_with_them(starter: Pack, tmp_path: Path) -> None:
    file = DraftsFile(tmp_path / "drafts.jsonl")
    episodes = [episode for episode in starter.episodes if episode.family == "VS"]
    with file.writing(Header(author="grammar", seed=0, simulator="mujoco", per_house=1, tried=1)) as writer:
        for episode in episodes:
            line = Draft(kind="", episode=episode, actions=starter.solutions[episode.id].actions, facts=FACTS)
            done = FamilyDone(family="VS", house=episode.house.name, kept=1, rejected={}, seconds=0.0)
            writer.add(starter.house_of(episode), [line, done])
    turns = {episode.id: PLAIN.model_copy(update={"turns": 28 * (n % 2)}) for n, episode in enumerate(episodes)}
    levels = {episode.id: grade_episode(episode, turns[episode.id]) for episode in episodes}
    wanted = PackRequest("p", 4, families=("VS",), levels=("easy", "medium"))
    pack, _ = assemble(tmp_path / "a", [file], [], wanted, lambda chosen: {}, levels=levels)
    assert pack.manifest.meta["levels"] == {"VS": {"easy": 2, "medium": 2}}
    assert LEVELS_FILE in pack.manifest.files
    assert read_pack_levels(pack.folder) == {episode.id: levels[episode.id] for episode in pack.episodes}
    assert "| VS | 2 | 2 |" in (pack.folder / "README.md").read_text()
    plain, _ = assemble(tmp_path / "b", [file], [], PackRequest("p", 4, families=("VS",)), lambda chosen: {})
    assert LEVELS_FILE not in plain.manifest.files
    assert "levels" not in plain.manifest.meta
