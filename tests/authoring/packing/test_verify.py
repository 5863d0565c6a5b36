"""Verification of packs in worker processes, continued from a log, and comparison of two packs."""

from pathlib import Path

import pytest

from vigil.authoring.packing import verify
from vigil.authoring.packing.compare import compare
from vigil.authoring.packing.verify import (
    VerificationSettings,
    VerificationTask,
    key_of,
    verify_pack,
)
from vigil.authoring.review import robustness
from vigil.authoring.review.blind_trials import blind_trials
from vigil.authoring.review.rules import RULES, Rule
from vigil.errors import RecordError
from vigil.packs.freeze import freeze
from vigil.packs.pack import Pack
from vigil.protocol.actions import Report
from vigil.protocol.episode import Solution

CLAIM = Report(status="success", summary="")


@pytest.fixture(scope="module")
def small(starter: Pack, tmp_path_factory: pytest.TempPathFactory) -> Pack:
    """Four episodes of the starter pack, one of them with a solution that does nothing."""
    chosen = [e for e in starter.episodes if e.family in ("PG", "SV")][:4]
    lazy = next(episode for episode in chosen if episode.family == "PG")
    solutions = [starter.solutions[episode.id] for episode in chosen if episode != lazy]
    solutions.append(Solution(episode_id=lazy.id, actions=(Report(status="success", summary=""),)))
    houses = {episode.house.name: starter.house_of(episode) for episode in chosen}
    return freeze(tmp_path_factory.mktemp("small") / "pack", chosen, solutions, houses.values(), name="small")


@pytest.mark.parametrize("workers", [1, 2])
def test_what_does_not_hold_is_found_by_any_number_of_workers(small: Pack, workers: int) -> None:
    said: list[tuple[int, ...]] = []
    findings = verify_pack(small, VerificationSettings(workers=workers), on_progress=lambda *now: said.append(now))
    assert {finding.rule for finding in findings} == {"solution_holds"}
    assert len({finding.episode_id for finding in findings}) == 1
    assert said[-1] == (4, 4, 1)


def test_robustness_is_checked_only_when_asked_for(small: Pack, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(robustness, "solve_noisily", lambda episode, view, number: iter([CLAIM]))
    quick = {finding.episode_id for finding in verify_pack(small, VerificationSettings())}
    found = verify_pack(small, VerificationSettings(is_robust=True))
    pointing = {episode.id for episode in small.episodes if episode.family == "PG"}
    asking = {episode.id for episode in small.episodes if episode.family == "SV"}
    assert {each.episode_id for each in found if each.rule == "robust"} == (pointing | asking) - quick
    assert {each.rule for each in found} == {"robust", "solution_holds"}


def test_a_log_of_the_quick_verification_says_nothing_of_robustness(
    small: Pack, monkeypatch: pytest.MonkeyPatch
) -> None:
    episode = small.episodes[0]
    task = VerificationTask((episode,), (small.solutions[episode.id].actions,))
    quick, robust = VerificationSettings(), VerificationSettings(is_robust=True)
    assert key_of(task, quick) != key_of(task, robust)
    assert key_of(task, quick) == key_of(task, VerificationSettings(workers=2))


def test_a_log_says_nothing_of_rules_that_were_not_there(small: Pack, monkeypatch: pytest.MonkeyPatch) -> None:
    episode = small.episodes[0]
    task = VerificationTask((episode,), (None,))
    before = key_of(task, VerificationSettings())
    for families in (["CR"], [episode.family]):
        monkeypatch.setitem(RULES, "another", Rule(families.__contains__, "of another version", lambda case: iter(())))
        assert (key_of(task, VerificationSettings()) == before) == (episode.family not in families)


def test_a_log_says_nothing_of_blind_agents_that_were_not_tried(small: Pack, monkeypatch: pytest.MonkeyPatch) -> None:
    episode = small.episodes[0]
    task = VerificationTask((episode,), (None,))
    before = key_of(task, VerificationSettings())
    monkeypatch.setattr(verify, "blind_trials", lambda episode: [*blind_trials(episode), (CLAIM,)])
    assert key_of(task, VerificationSettings()) != before


def test_a_log_is_continued(small: Pack, tmp_path: Path) -> None:
    log = tmp_path / "log.jsonl"
    found = verify_pack(small, VerificationSettings(), log)
    lines = log.read_bytes().splitlines(keepends=True)
    log.write_bytes(b"".join(lines[:-1]) + lines[-1][:30])
    said: list[tuple[int, ...]] = []
    assert verify_pack(small, VerificationSettings(), log, lambda *now: said.append(now)) == found
    assert len(said) == 1
    assert log.read_bytes().splitlines(keepends=True) == lines
    assert verify_pack(small, VerificationSettings(), log, lambda *now: said.append(now)) == found
    assert len(said) == 1
    log.write_text("{}\n")
    with pytest.raises(RecordError, match="Remove it"):
        verify_pack(small, VerificationSettings(), log)


def test_two_packs_are_compared(small: Pack, starter: Pack, tmp_path: Path) -> None:
    assert compare(small, small).is_none
    kept = [episode for episode in starter.episodes if episode.id in {e.id for e in small.episodes}][1:]
    kept[0] = kept[0].model_copy(update={"instruction": "Look."})
    solutions = [starter.solutions[episode.id] for episode in kept]
    houses = {episode.house.name: starter.house_of(episode) for episode in kept}
    other = freeze(tmp_path / "pack", kept, solutions, houses.values(), name="other")
    found = compare(small, other)
    assert found.only_a == (small.episodes[0].id,)
    assert found.only_b == ()
    assert "instruction" in found.changed[kept[0].id]
    assert found.same + len(found.changed) == len(kept)
    assert compare(other, small).only_b == found.only_a
