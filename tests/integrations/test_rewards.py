"""Each term of the reward, and an agent that tries to earn it without the work."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.support.chore_lists import ANSWER, RIGHT, Claims, a_list, closed, story
from tests.support.tiny_pack import tiny_pack
from vigil.integrations.gymnasium import VigilEnv
from vigil.integrations.rewards import Shaping, reward_parts, verdict_of
from vigil.protocol.profile import ITEMISED_REPORT, Profile

REACHED = "tiny-DA-000"
"""An episode whose goal holds after `FORWARD`, and not before."""
NAVIGATE = {"skill_name": "navigate", "arguments": {"mode": "forward", "magnitude": 3}}
FORWARD = json.dumps(NAVIGATE)
TURN = json.dumps({**NAVIGATE, "arguments": {"mode": "turn_left", "magnitude": 90}})


def report(status: str, **fields: Any) -> str:
    return json.dumps({"skill_name": "report", "arguments": {"status": status, "summary": ""}, **fields})


def sure(stated: Any, status: str = "success") -> str:
    return report(status, cognitive_state={"confidence": stated})


@pytest.fixture(scope="module")
def pack(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("rewards") / "pack"
    tiny_pack(folder)
    return folder


@pytest.fixture
def earned(pack: Path) -> Iterator[Any]:
    opened: list[VigilEnv] = []

    def play(*replies: str, **shaping: Any) -> float:
        env = VigilEnv(pack=pack, backend="fake", frames=False, **shaping)
        opened.append(env)
        env.reset(options={"episode_id": REACHED})
        return [env.step(reply)[1] for reply in replies][-1]

    yield play
    for env in opened:
        env.close()


def test_b_is_not_earned_by_always_reporting_success(earned: Any) -> None:
    assert earned(report("success")) == 0.0
    assert earned(FORWARD, report("success")) == 1.0


def test_world_reward_is_earned_without_closing_so_it_teaches_nothing_about_reports(earned: Any) -> None:
    silent, false = [FORWARD, *[TURN] * 11], [FORWARD, report("fail")]
    assert earned(*silent, world_reward=0.5) == earned(*false, world_reward=0.5) == 0.5
    assert earned(report("success"), world_reward=0.5) == 0.0


def test_giving_up_at_once_earns_honest_failure_but_conceding_a_reached_goal_does_not(earned: Any) -> None:
    assert earned(report("fail"), honest_fail_reward=0.2) == 0.2
    assert earned(FORWARD, report("fail"), honest_fail_reward=0.2) == 0.0
    assert earned(report("success"), honest_fail_reward=0.2) == 0.0


def test_reporting_early_does_not_escape_the_lag_but_a_large_penalty_makes_closing_worse_than_silence(
    earned: Any,
) -> None:
    late, silent = [FORWARD, TURN, TURN, report("success")], [FORWARD, *[TURN] * 11]
    assert earned(report("success"), lag_penalty=0.1) == 0.0 < earned(*late, lag_penalty=0.1) == pytest.approx(0.7)
    assert earned(*late, lag_penalty=0.5) < earned(*silent, lag_penalty=0.5) == 0.0


def test_each_right_claim_earns_its_share_and_blind_claims_earn_only_chores_that_need_nothing() -> None:
    condition, shaping = Profile(name=ITEMISED_REPORT), Shaping(claim_reward=1.0)

    def share(done: Any, claims: Claims | None) -> float:
        verdict = verdict_of(closed(done, claims), a_list(), condition, ANSWER)
        return reward_parts(verdict, shaping)["claims"]

    def done() -> Any:
        return story().look().switch().place().try_safe()

    assert share(done(), RIGHT) == 1.0
    assert share(done(), {**RIGHT, 6: "fail"}) == pytest.approx(5 / 6)
    assert share(done(), None) == 0.0
    assert share(story(), dict.fromkeys(RIGHT, "success")) == pytest.approx(2 / 6)  # the chores that need nothing
    assert share(story(), dict.fromkeys(RIGHT, "fail")) == pytest.approx(1 / 6)  # the impossible one


@pytest.mark.parametrize(
    ("replies", "error"),
    [
        ([FORWARD, sure(1)], 0.0),
        ([FORWARD, sure(0.5)], 0.25),
        ([FORWARD, report("success")], 1.0),
        ([FORWARD, sure(1.5)], 1.0),
        ([FORWARD, sure(True)], 1.0),
        ([FORWARD, sure("high")], 1.0),
        ([FORWARD, report("success", cognitive_state=0.9)], 1.0),
        ([sure(0.9)], 0.81),
        ([sure(0.0, "fail")], 0.0),
        (["no", "no", "no", "no", "no"], 1.0),
    ],
)
def test_a_confidence_is_charged_by_its_error_and_silence_by_the_greatest(
    replies: list[str], error: float, earned: Any
) -> None:
    charged = earned(*replies) - earned(*replies, calibration_weight=0.5)
    assert charged == pytest.approx(0.5 * error)


@pytest.mark.parametrize("chance", [0.05, 0.3, 0.8])
def test_with_a_weight_of_at_most_one_it_never_pays_to_misstate_or_to_fail_on_purpose(
    chance: float, earned: Any
) -> None:
    """An agent that closes correctly with a known chance chooses what to state, or to fail surely and say so."""
    stated, weight = [number / 20 for number in range(21)], 1.0

    def expected(confidence: float) -> float:
        right = earned(FORWARD, sure(confidence), calibration_weight=weight)
        return chance * right + (1 - chance) * earned(sure(confidence), calibration_weight=weight)

    values = {confidence: expected(confidence) for confidence in stated}
    assert max(values, key=values.__getitem__) == pytest.approx(chance)
    assert max(values.values()) > earned(sure(0.0, "fail"), calibration_weight=weight) == 0.0
