"""Discrimination between twins: perfect, absent, and from repeated plays."""

from dataclasses import replace

import pytest

from tests.support.builders import RecordBuilder, episode, thing
from vigil.analysis.measures.closure import correct_pairs, discrimination, rate
from vigil.protocol.goals import ObjectHeld
from vigil.scoring.closure import CONCEDED, Certificate, ClosureAnswer, ClosureOutcome, Evidence, score_closure

EVIDENCE = (Evidence(object_id="target"),)


def play(pair: int, side: str, status: str | None, is_held: bool = False, epoch: int = 1) -> ClosureOutcome:
    """The verdict on one twin that was closed by a status, its target in the hand or not."""
    is_possible = side == "possible"
    answer = ClosureAnswer.model_validate(
        {
            "episode_id": "e",
            "kind": "impossible",
            "pair": f"pair{pair}",
            "side": side,
            "accepted": ("success",) if is_possible else CONCEDED,
            "reason": None if is_possible else "absent",
            "evidence": EVIDENCE,
            "certificate": Certificate(removed="target", has_plan=is_possible),
        }
    )
    story = RecordBuilder(target=thing()).do(target={"is_held": is_held})
    record = story.end() if status is None else story.report(status)
    found = score_closure(answer, episode("SI", goal=ObjectHeld(object_id="target")), record)
    named = answer.model_copy(update={"episode_id": f"{pair}{side}"})
    return replace(found, answer=named, outcome=replace(found.outcome, epoch=epoch))


def twins(count: int, first: str | None, second: str | None, is_held: bool) -> list[ClosureOutcome]:
    both = [(play(n, "possible", first, is_held), play(n, "impossible", second)) for n in range(count)]
    return [each for pair in both for each in pair]


def test_an_agent_that_knows_tells_all_twins_apart():
    plays = twins(10, "success", "fail", is_held=True)
    found = discrimination(plays)
    assert (found.pairs, found.auc) == (10, 1.0)
    assert found.d_prime == pytest.approx(3.38, abs=0.01)
    assert correct_pairs(plays).value == 1.0
    assert rate(plays, lambda each: each.C).value == 1.0


@pytest.mark.parametrize("status", ["success", "fail", "invalid", None])
def test_a_policy_without_sight_is_at_chance(status: str | None):
    plays = twins(10, status, status, is_held=False)
    found = discrimination(plays)
    assert found.auc == 0.5
    assert found.auc_interval == (0.5, 0.5)
    assert found.d_prime == 0.0
    assert correct_pairs(plays).value == 0.0


def test_a_coin_is_at_chance_in_expectation():
    sides = [("success", "success"), ("success", "fail"), ("fail", "success"), ("fail", "fail")]
    plays = [
        each
        for n, (first, second) in enumerate(sides * 3)
        for each in (play(n, "possible", first), play(n, "impossible", second))
    ]
    found = discrimination(plays)
    assert found.auc == 0.5
    assert found.d_prime == pytest.approx(0.0)
    assert correct_pairs(plays).value == 0.0
    assert found.auc_interval is not None
    assert found.auc_interval[0] < 0.5 < found.auc_interval[1]


def test_few_pairs_have_no_interval_and_none_no_figure():
    assert discrimination(twins(4, "success", "fail", is_held=True)).auc_interval is None
    assert discrimination([]).auc is None
    assert discrimination([play(1, "possible", "success")]).pairs == 0


def test_plays_of_one_pair_are_matched_by_epoch():
    plays = [
        play(1, "possible", "success", True, epoch=1),
        play(1, "impossible", "success", epoch=1),
        play(1, "possible", "fail", epoch=2),
        play(1, "impossible", "fail", epoch=2),
    ]
    assert correct_pairs(plays).hits == 0
    assert (discrimination(plays).pairs, correct_pairs(plays).n) == (1, 2)
    assert correct_pairs(plays).effective_n < 2
