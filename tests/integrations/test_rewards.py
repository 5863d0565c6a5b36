"""The reward of a list of chores: B of the whole list, and a share for each chore that is closed correctly."""

import pytest

from tests.support.chore_lists import ANSWER, RIGHT, a_list, closed, story
from vigil.integrations.rewards import Shaping, reward_parts, verdict_on
from vigil.protocol.actions import ChoreClaim


@pytest.mark.parametrize(
    ("claims", "B", "closed_chores", "truth"),
    [
        (RIGHT, 1.0, 6, 1.0),
        ({**RIGHT, 4: "success"}, 0.0, 5, 5 / 6),
        ({**RIGHT, 2: "off", 4: "success"}, 0.0, 4, 4 / 6),
        ({}, 0.0, 0, 0.0),
    ],
)
def test_each_claim_has_its_share_of_the_reward(
    claims: dict[int, ChoreClaim], B: float, closed_chores: int, truth: float
) -> None:
    record = closed(story().look().switch().place(), claims)
    verdict = verdict_on(a_list(), record, ANSWER, has_claims=True)
    assert verdict.of_list is not None
    assert pytest.approx([truth]) == [verdict.of_list.T]
    parts = reward_parts(verdict.outcome, Shaping(claim_reward=3.0), verdict.of_list)
    assert parts["B"] == B
    assert parts["claims"] == pytest.approx(3.0 * closed_chores / 6)


def test_an_episode_that_is_not_a_list_has_no_reward_of_claims() -> None:
    record = closed(story().look().switch().place(), RIGHT)
    verdict = verdict_on(a_list(), record, None, has_claims=False)
    assert verdict.of_list is None
    assert "claims" not in reward_parts(verdict.outcome, Shaping(claim_reward=3.0), verdict.of_list)
