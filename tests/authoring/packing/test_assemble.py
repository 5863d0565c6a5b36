"""Assembly: even over strata, approved first, rejected never, the same each time."""

import json
from collections import Counter
from collections.abc import Sequence
from datetime import UTC, datetime
from itertools import product
from pathlib import Path

import pytest

from vigil.authoring.drafting.drafts import Draft, DraftFacts, DraftsFile, FamilyDone, Header
from vigil.authoring.packing.assemble import assemble
from vigil.authoring.packing.balance import text_guess
from vigil.authoring.packing.requests import PackRequest
from vigil.authoring.packing.selection import Candidate, candidates, select, select_valid
from vigil.authoring.review.reviews import Review, episode_sha256
from vigil.authoring.review.validate import Finding
from vigil.errors import EpisodeError
from vigil.packs.pack import Pack, find_pack
from vigil.protocol.actions import Report
from vigil.protocol.episode import Episode

NOW = datetime(2026, 1, 1, tzinfo=UTC)


def draft(episode: Episode, number: int, house: str, **facts: object) -> Draft:
    """A copy of an episode under another id, said to be in another house."""
    ref = episode.house.model_copy(update={"name": house})
    named = episode.model_copy(update={"id": f"procthor_x_seed001_{number:04d}", "house": ref})
    told = {"category": "Mug", "rooms": 1, "area_m2": 20.0, "distance_m": 2.0, "is_seen_by_turning": False, **facts}
    actions = (Report(status="success", summary=""),)
    return Draft(kind="", episode=named, actions=actions, facts=DraftFacts.model_validate(told))


def pool_of(drafts: list[Draft]) -> list[Candidate]:
    return [Candidate(each) for each in drafts]


@pytest.fixture(scope="module")
def search(starter: Pack) -> Episode:
    return next(episode for episode in starter.episodes if episode.family == "VS")


@pytest.fixture(scope="module")
def question(starter: Pack) -> Episode:
    return next(e for e in starter.episodes if e.family == "SV" and e.provenance.template == "on")


def test_searches_that_turning_ends_are_few(search: Episode) -> None:
    drafts = [draft(search, n, f"h{n}", is_seen_by_turning=n % 4 != 0) for n in range(40)]
    chosen = select(pool_of(drafts), PackRequest("p", 10, families=("VS",)))
    assert sum(candidate.draft.facts.is_seen_by_turning for candidate in chosen) == 4


def test_a_house_holds_a_few_of_a_family(search: Episode) -> None:
    drafts = [draft(search, n, f"h{n % 3}") for n in range(30)]
    chosen = select(pool_of(drafts), PackRequest("p", 6, max_per_house=2, families=("VS",)))
    assert set(Counter(candidate.episode.house.name for candidate in chosen).values()) == {2}
    with pytest.raises(EpisodeError, match=r"VS 6 of 7 \(of 30 drafts\).*more houses"):
        select(pool_of(drafts), PackRequest("p", 7, max_per_house=2, families=("VS",)))


def test_labels_are_even_within_each_category(question: Episode) -> None:
    asked = product(("Mug", "Lamp"), ("on", "off"), range(6))
    uneven = [(category, label) for category, label, n in asked if (category, label) != ("Lamp", "off") or n < 3]
    drafts = [draft(question, n, f"h{n}", category=c, label=label) for n, (c, label) in enumerate(uneven)]
    chosen = select(pool_of(drafts), PackRequest("p", 12, families=("SV",)))
    counts = Counter((candidate.draft.facts.category, candidate.draft.facts.label) for candidate in chosen)
    assert set(counts.values()) == {3}
    assert text_guess([(candidate.episode, candidate.draft.facts) for candidate in chosen]) == 0.5


def test_a_guess_from_words_finds_a_leak(question: Episode) -> None:
    leaky = [
        draft(question, n, "h", category=c, label=s) for n, (c, s) in enumerate([("Tv", "on"), ("Tap", "off")] * 4)
    ]
    assert text_guess([(each.episode, each.facts) for each in leaky]) == 1.0
    assert text_guess([]) is None


def test_the_same_drafts_in_any_order_give_the_same_selection(search: Episode) -> None:
    pool = pool_of([draft(search, n, f"h{n % 9}") for n in range(30)])
    pack_request = PackRequest("p", 8, families=("VS",))
    assert select(pool, pack_request) == select(pool[::-1], pack_request)
    assert select(pool, pack_request) != select(pool, PackRequest("p", 8, seed=1, families=("VS",)))


def test_what_does_not_hold_is_replaced(search: Episode) -> None:
    pool = pool_of([draft(search, n, f"h{n}") for n in range(12)])
    pack_request = PackRequest("p", 6, families=("VS",))
    spoiled = select(pool, pack_request)[0].episode.id

    def check(chosen: Sequence[Candidate]) -> dict[str, list[Finding]]:
        ids = {candidate.episode.id for candidate in chosen}
        return {spoiled: [Finding(spoiled, "solvable", "no")]} if spoiled in ids else {}

    chosen, bad, tried = select_valid(pool, pack_request, check)
    assert list(bad) == [spoiled]
    assert tried == 7
    assert len(chosen) == 6
    assert spoiled not in {candidate.episode.id for candidate in chosen}


@pytest.fixture
def drafts_file(starter: Pack, tmp_path: Path) -> DraftsFile:
    """The starter pack's searches as a drafts file."""
    file = DraftsFile(tmp_path / "drafts.jsonl")
    searches = [episode for episode in starter.episodes if episode.family == "VS"]
    with file.writing(Header(author="grammar", seed=0, simulator="mujoco", per_house=1, tried=1)) as writer:
        for episode in searches:
            told = draft(episode, 0, "").facts
            line = Draft(kind="", episode=episode, actions=starter.solutions[episode.id].actions, facts=told)
            done = FamilyDone(family="VS", house=episode.house.name, kept=1, rejected={}, seconds=0.0)
            writer.add(starter.house_of(episode), [line, done])
    return file


def review(episode: Episode, verdict: str, **more: str) -> Review:
    fields = {"at": NOW, "reviewer": "anna", "episode_id": episode.id, "verdict": verdict, **more}
    return Review.model_validate({**fields, "episode_sha256": episode_sha256(episode)})


def test_what_is_kept_of_an_earlier_version_enters_first(drafts_file: DraftsFile, tmp_path: Path) -> None:
    pack_request = PackRequest("p", 5, families=("VS",))
    drafts = drafts_file.read().drafts
    usual = {candidate.episode.id for candidate in select(candidates([drafts_file], []), pack_request)}
    old = DraftsFile(tmp_path / "kept.jsonl")
    unlucky = [line for line in drafts if line.episode.id not in usual][:3]
    with old.writing(drafts_file.read().header) as writer:
        for line in unlucky:
            done = FamilyDone(family="VS", house=line.episode.house.name, kept=1, rejected={}, seconds=0.0)
            writer.add(drafts_file.house(line.episode.house.name), [line, done])
    chosen = {candidate.episode.id for candidate in select(candidates([old, drafts_file], [], old), pack_request)}
    assert {line.episode.id for line in unlucky} < chosen
    assert len(chosen) == 5


def test_approved_enter_first_and_rejected_never(drafts_file: DraftsFile) -> None:
    pack_request = PackRequest("p", 5, families=("VS",))
    episodes = [each.episode for each in drafts_file.read().drafts]
    usual = {candidate.episode.id for candidate in select(candidates([drafts_file], []), pack_request)}
    unlucky = [episode for episode in episodes if episode.id not in usual][:3]
    lucky = next(episode for episode in episodes if episode.id in usual)
    given = [review(episode, "approve") for episode in unlucky] + [review(lucky, "reject")]
    chosen = {candidate.episode.id: candidate for candidate in select(candidates([drafts_file], given), pack_request)}
    assert {episode.id for episode in unlucky} <= chosen.keys()
    assert lucky.id not in chosen
    assert chosen[unlucky[0].id].episode.provenance.reviewed == "approved"


def test_a_pack_is_frozen_with_its_card_and_the_truth_about_reviews(drafts_file: DraftsFile, tmp_path: Path) -> None:
    episodes = [each.episode for each in drafts_file.read().drafts]
    given = [
        review(episodes[0], "approve"),
        review(episodes[1], "approve", reviewer_kind="model", reviewer="model: checker"),
        review(episodes[0], "edit", instruction=f"Please: {episodes[0].instruction}"),
    ]
    pack_request = PackRequest("mine", 5, aliases=("ours",), description="A few searches.", families=("VS",))
    pack, bad = assemble(tmp_path / "a", [drafts_file], given, pack_request, lambda chosen: {})
    again, _ = assemble(tmp_path / "b", [drafts_file], given, pack_request, lambda chosen: {})
    assert not bad
    assert pack.sha256 == again.sha256
    assert pack.manifest.meta["reviews"] == {"person": 1, "model": 1, "none": 3}
    assert pack.episode(episodes[0].id).instruction.startswith("Please: ")
    card = (pack.folder / "README.md").read_text()
    assert "configs:" in card
    assert "Reviewed by a person: 1; by models only: 1; by nobody: 3." in card
    rows = [json.loads(line) for line in (pack.folder / "facts.jsonl").read_text().splitlines()]
    assert [row["episode_id"] for row in rows] == [episode.id for episode in pack.episodes]
    assert "facts.jsonl" in pack.manifest.files
    assert "README.md" not in pack.manifest.files


def test_a_packaged_pack_answers_to_its_aliases(
    drafts_file: DraftsFile, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pack_request = PackRequest("mine", 2, aliases=("ours",), families=("VS",))
    folder = tmp_path / "packs" / "mine"
    assemble(folder, [drafts_file], [], pack_request, lambda chosen: {})
    monkeypatch.setattr("vigil.packs.pack.PACKAGED", tmp_path / "packs")
    assert find_pack("ours") == find_pack("mine") == folder
