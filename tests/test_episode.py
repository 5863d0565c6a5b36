"""Episodes say what they need and refuse what their family does not know."""

import pytest
from pydantic import ValidationError
from stories import GOALS, episode

from vigil.actions import Navigate, Report
from vigil.episode import FAMILIES, Episode, Solution
from vigil.goals import ObjectHeld, ObjectInState
from vigil.world import Setup


@pytest.mark.parametrize("family", FAMILIES)
def test_every_family_has_an_episode_that_comes_back_as_written(family):
    written = episode(family)
    assert Episode.model_validate_json(written.model_dump_json()) == written


def test_start_horizon_is_thirty_where_looking_is_not_expected():
    assert {family for family, spec in FAMILIES.items() if spec.start_horizon is None} == {"VS", "SV", "SI"}
    assert all(spec.start_horizon in (None, 30.0) for spec in FAMILIES.values())


def test_bound_ids_are_all_that_is_named_and_sorted():
    made = episode("CR", bindings={"target": "target", "shelf": "zebra"}, setup=Setup(held="cup"))
    assert made.bound_ids() == ["cup", "obstacle", "target", "zebra"]


@pytest.mark.parametrize(
    ("family", "facts", "message"),
    [
        ("PG", {"goal": GOALS["DA"]}, "asks for a goal of kind target_grounded, not agent_near_target"),
        ("AI", {"goal": GOALS["CR"]}, "constraint in family CR, and only there"),
        ("CR", {"goal": ObjectHeld(object_id="target")}, "constraint in family CR, and only there"),
        ("SM", {"goal": ObjectHeld(object_id="target")}, "chain in family SM, and only there"),
        ("VS", {"goal": ObjectInState(object_id="x", state="is_open", chain=(GOALS["AI"],))}, "chain in family SM"),
        ("AI", {"instruction": ""}, "instruction"),
        ("AI", {"id": "../x"}, "id"),
        ("AI", {"max_steps": 0}, "max_steps"),
        ("AI", {"reward": 1}, "reward"),
    ],
)
def test_what_makes_no_sense_is_refused(family, facts, message):
    with pytest.raises(ValidationError, match=message):
        episode(family, **facts)


def test_a_solution_comes_back_with_its_actions():
    solution = Solution(
        episode_id="e", actions=(Navigate(mode="forward", magnitude=1), Report(status="success", summary=""))
    )
    assert Solution.model_validate_json(solution.model_dump_json()) == solution
