"""Candidates of a robust pack: tried once, kept beside the drafts, counted by rule; drafts without levels."""

import json
from pathlib import Path

import pytest

from vigil.authoring.drafting.drafts import Draft, DraftFacts, DraftsFile, FamilyDone, Header, Rejection
from vigil.authoring.packing.assemble import assemble
from vigil.authoring.packing.requests import PackRequest
from vigil.authoring.packing.verify import (
    VerificationSettings,
    candidate_checker,
    check_log_of,
)
from vigil.authoring.review import robustness
from vigil.authoring.solving.goal_actions import expected_status
from vigil.authoring.solving.privileged_view import PrivilegedView
from vigil.errors import EpisodeError
from vigil.packs.pack import Pack
from vigil.protocol.actions import Report
from vigil.protocol.episode import Episode
from vigil.scoring.levels import LevelMeasures, grade_episode

FACTS = DraftFacts(category="Television", rooms=1, area_m2=20.0, distance_m=2.0, is_seen_by_turning=True)
PLAIN = LevelMeasures(
    path_m=0.0, turns=0, doors=0, rooms=1, look_alikes=0, target_px=9000, containers=0, occlusion=0.0, slack=1.0,
    reference_words=1,
)  # fmt: skip
ROBUST = VerificationSettings(is_robust=True)


@pytest.fixture(scope="module")
def questions(starter: Pack) -> list[Episode]:
    return sorted((each for each in starter.episodes if each.family == "SV"), key=lambda each: each.id)[:4]


@pytest.fixture
def drafts(questions: list[Episode], starter: Pack, tmp_path: Path) -> DraftsFile:
    """Questions about states, whose solution is a report, and one that was rejected when it was proposed."""
    file = DraftsFile(tmp_path / "drafts.jsonl")
    with file.writing(Header(author="grammar", seed=0, simulator="mujoco", per_house=1, tried=1)) as writer:
        for number, episode in enumerate(questions):
            house = starter.house_of(episode)
            line = Draft(kind="", episode=episode, actions=starter.solutions[episode.id].actions, facts=FACTS)
            refused = Rejection(family="SV", kind="", house=house.name, rule="unambiguous", message="two of them")
            done = FamilyDone(family="SV", house=f"{house.name}_{number}", kept=1, rejected={}, seconds=0.0)
            writer.add(house, [line, *([refused] if number == 0 else []), done])
    return file


@pytest.fixture
def tried(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The ids of the episodes that a body that errs has tried; the first of them it never closes truly."""
    seen: list[str] = []

    def solve(episode: Episode, view: PrivilegedView, _number: int):
        seen.append(episode.id)
        status = expected_status(episode.goal, view)
        yield Report(status="fail" if episode.id == seen[0] else status, summary="")

    monkeypatch.setattr(robustness, "solve_noisily", solve)
    return seen


def request(per_family: int) -> PackRequest:
    return PackRequest("p", per_family, families=("SV",), max_per_house=4, is_robust=True)


def test_what_was_tried_is_not_tried_again(
    drafts: DraftsFile, questions: list[Episode], tried: list[str], tmp_path: Path
) -> None:
    said: list[tuple[int, ...]] = []
    pack, bad = assemble(
        tmp_path / "a", [drafts], [], request(3), candidate_checker([drafts], ROBUST, lambda *now: said.append(now))
    )
    assert set(tried) == {episode.id for episode in questions}
    assert {name: {found.rule for found in findings} for name, findings in bad.items()} == {tried[0]: {"robust"}}
    assert said[-1][0] == said[-1][1]
    assert len(check_log_of(drafts).read_bytes().splitlines()) == 4
    tried.clear()
    again, bad_again = assemble(tmp_path / "b", [drafts], [], request(3), candidate_checker([drafts], ROBUST))
    assert not tried
    assert (again.sha256, bad_again) == (pack.sha256, bad)


def test_a_quick_check_keeps_nothing_beside_the_drafts(drafts: DraftsFile, tried: list[str], tmp_path: Path) -> None:
    plain = PackRequest("p", 4, families=("SV",), max_per_house=4)
    pack, _ = assemble(tmp_path / "a", [drafts], [], plain, candidate_checker([drafts], VerificationSettings()))
    assert not tried
    assert not check_log_of(drafts).exists()
    assert "rejected" not in pack.manifest.meta


def test_only_candidates_for_selection_are_tried(drafts: DraftsFile, tried: list[str], tmp_path: Path) -> None:
    pack, bad = assemble(tmp_path / "a", [drafts], [], request(1), candidate_checker([drafts], ROBUST))
    assert len(set(tried)) == 2 == 1 + len(bad)
    assert {episode.id for episode in pack.episodes} <= set(tried)


def test_a_robust_pack_says_what_was_rejected_by_which_rule(
    drafts: DraftsFile, questions: list[Episode], tried: list[str], tmp_path: Path
) -> None:
    levels = {episode.id: grade_episode(episode, PLAIN) for episode in questions}
    wanted = PackRequest("p", 3, families=("SV",), max_per_house=4, is_robust=True, levels=("easy",))
    pack, _ = assemble(tmp_path / "a", [drafts], [], wanted, candidate_checker([drafts], ROBUST), levels=levels)
    assert tried
    assert pack.manifest.meta["rejected"] == {
        "proposals": {"tried": 5, "rejected": 1, "by_rule": {"unambiguous": 1}},
        "candidates": {"tried": 4, "rejected": 1, "by_rule": {"robust": 1}},
    }
    card = (pack.folder / "README.md").read_text()
    assert "- Of 5 proposals 1 were rejected: `unambiguous` 1." in card
    assert "- Of 4 candidates 1 were rejected: `robust` 1." in card
    rows = [json.loads(line) for line in (pack.folder / "facts.jsonl").read_text().splitlines()]
    assert [(row["level"], row["is_robust"]) for row in rows] == [("easy", True)] * 3


def test_drafts_without_levels_are_refused_where_levels_are_asked_for(
    drafts: DraftsFile, questions: list[Episode], tmp_path: Path
) -> None:
    wanted = PackRequest("p", 2, families=("SV",), levels=("easy", "hard"))
    some = {questions[0].id: grade_episode(questions[0], PLAIN)}
    with pytest.raises(
        EpisodeError, match=r"3 of its 4 drafts do not have a level \(e\.g\. .*Measure all drafts first"
    ):
        assemble(tmp_path / "a", [drafts], [], wanted, lambda chosen: {}, levels=some)
    with pytest.raises(EpisodeError, match="4 of its 4 drafts do not have a level"):
        assemble(tmp_path / "b", [drafts], [], wanted, lambda chosen: {})
