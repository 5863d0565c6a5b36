"""Episodes say what they need and refuse what their family does not know."""

from dataclasses import replace

import pytest
from pydantic import ValidationError

from tests.support.builders import GOALS, episode
from vigil.base.geometry import Vec3
from vigil.errors import SettingError
from vigil.protocol.actions import Navigate, Report
from vigil.protocol.episode import Episode, Solution
from vigil.protocol.families import FAMILIES, PACKAGED_FAMILIES, parse_families, register_family
from vigil.protocol.family import StreamGrading
from vigil.protocol.goals import ObjectHeld, ObjectInState
from vigil.protocol.world import ObjectSetup, Placement, Setup


@pytest.mark.parametrize(
    ("name", "kinds", "message"),
    [
        ("AI", ("object_held",), "Family 'AI' is 'Approach and Interact' already"),
        ("sa", ("object_held",), "must be two capital letters"),
        ("ZZ", ("object_hold",), "Did you mean 'object_held'"),
    ],
)
def test_a_family_that_cannot_be_is_not_registered(name: str, kinds: tuple[str, ...], message: str):
    with pytest.raises(SettingError, match=message):
        register_family(replace(FAMILIES["PG"], code=name, name="Mine", goal_kinds=kinds))
    assert set(FAMILIES) == PACKAGED_FAMILIES


def test_a_grading_whose_bounds_do_not_rise_is_not_registered():
    with pytest.raises(SettingError, match=r"0 < easy <= medium; got 3 and 2"):
        register_family(replace(FAMILIES["PG"], code="ZZ", grading=StreamGrading("actions", easy=3, medium=2)))
    assert "ZZ" not in FAMILIES


def test_a_family_may_be_registered_again_and_an_unknown_one_is_named():
    register_family(FAMILIES["AI"])
    with pytest.raises(ValidationError, match="there is no family 'ZZ'; the families are PG, DA"):
        Episode.model_validate(episode("AI").model_dump() | {"family": "ZZ"})


@pytest.mark.parametrize("family", FAMILIES)
def test_every_family_has_an_episode_that_comes_back_as_written(family):
    written = episode(family)
    assert Episode.model_validate_json(written.model_dump_json()) == written


def test_start_horizon_is_thirty_where_looking_is_not_expected():
    assert {"VS", "SV", "SI"} <= {family for family, spec in FAMILIES.items() if spec.start_horizon is None}
    assert all(spec.start_horizon in (None, 30.0) for spec in FAMILIES.values())


def test_bound_ids_are_all_that_is_named_and_sorted():
    made = episode("CR", bindings={"target": "target", "shelf": "zebra"}, setup=Setup(held="cup"))
    assert made.bound_ids() == ["cup", "obstacle", "target", "zebra"]


@pytest.mark.parametrize(
    ("family", "facts", "message"),
    [
        ("PG", {"goal": GOALS["DA"]}, "needs a goal of kind target_grounded, not agent_near_target"),
        ("AI", {"goal": GOALS["CR"]}, "constraint in family CR, and must not"),
        ("CR", {"goal": ObjectHeld(object_id="target")}, "constraint in family CR, and must not"),
        ("SM", {"goal": ObjectHeld(object_id="target")}, "chain in family SM, and must not"),
        (
            "VS",
            {"goal": ObjectInState(object_id="x", state="is_open", chain=(ObjectHeld(object_id="y"),))},
            "chain in family SM",
        ),
        ("AI", {"instruction": ""}, "instruction"),
        ("AI", {"id": "../x"}, "id"),
        ("AI", {"max_steps": 0}, "max_steps"),
        ("AI", {"reward": 1}, "reward"),
    ],
)
def test_what_makes_no_sense_is_refused(family, facts, message):
    with pytest.raises(ValidationError, match=message):
        episode(family, **facts)


def placed(parent: str | None = None, **facts) -> ObjectSetup:
    return ObjectSetup(placement=Placement(position=Vec3(1, 1, 1), parent=parent), **facts)


NAN = float("nan")


@pytest.mark.parametrize(
    ("facts", "message"),
    [
        ({"start": {"position": (0, 500, 0), "rotation": 0, "horizon": 30}}, r"start.position.y is 500 m; .* floor"),
        ({"start": {"position": (0, 0, 0), "rotation": 0, "horizon": 1e9}}, r"start.horizon is 1e\+09 degrees"),
        ({"start": {"position": (1e6, 0, 0), "rotation": 0, "horizon": 30}}, r"start.position is 1e\+06, 0; no house"),
        ({"start": {"position": (0, 0, 0), "rotation": 1e6, "horizon": 30}}, r"start.rotation is 1e\+06 degrees"),
        ({"start": {"position": (NAN, 0, 0), "rotation": 0, "horizon": 30}}, r"start.position.*\n.*finite number"),
        ({"start": {"position": (0, 0, 0), "rotation": NAN, "horizon": 30}}, r"start.rotation\n.*finite number"),
        ({"setup": {"objects": {"x": {"placement": {"position": (0, NAN, 0)}}}}}, r"placement.position.*\n.*finite"),
        ({"setup": {"objects": {"x": {"openness": NAN}}}}, r"openness\n"),
        (
            {"setup": {"objects": {"x": {"placement": {"position": (0, 900, 0)}}}}},
            r"objects.x.placement.position is 0, 900",
        ),
        (
            {"setup": {"objects": {"x": {"placement": {"position": (0, 0, 0), "rotation": (0, 721, 0)}}}}},
            r"objects.x.placement.rotation is 0, 721, 0 degrees",
        ),
    ],
)
def test_numbers_that_are_no_place_are_named(facts, message):
    with pytest.raises(ValidationError, match=message):
        episode("AI", **facts)


def test_a_number_that_is_none_is_refused_in_a_file_too():
    text = episode("AI").model_dump_json()
    with pytest.raises(ValidationError, match=r"start\.rotation"):
        Episode.model_validate_json(text.replace('"rotation":0.0', '"rotation":NaN', 1))


@pytest.mark.parametrize(
    ("objects", "held", "message"),
    [
        ({"a": placed("a")}, None, "'a' on 'a': a thing cannot be placed on itself"),
        ({"a": placed("b"), "b": placed("a")}, None, "'a' on 'b' on 'a'"),
        ({"a": placed("b"), "b": placed("c"), "c": placed("b")}, None, "'a' on 'b' on 'c' on 'b'"),
        ({"a": placed("b"), "b": ObjectSetup(is_absent=True)}, None, "on 'b', because 'b' is absent"),
        ({"a": placed(is_absent=True)}, None, "'a' cannot be both placed and absent"),
        ({"a": placed("b")}, "b", "on 'b', because 'b' is in the hand"),
        ({"a": placed()}, "a", "'a' cannot be in the hand and also absent or placed elsewhere"),
        ({"a": ObjectSetup(is_absent=True)}, "a", "'a' cannot be in the hand and also absent or placed elsewhere"),
    ],
)
def test_a_setup_that_cannot_be_is_refused(objects, held, message):
    with pytest.raises(ValidationError, match=message):
        Setup(objects=objects, held=held)


def test_a_chain_of_placements_is_fine():
    assert Setup(objects={"a": placed("b"), "b": placed("c"), "c": placed()}, held="d").held == "d"


def test_a_solution_comes_back_with_its_actions():
    solution = Solution(
        episode_id="e", actions=(Navigate(mode="forward", magnitude=1), Report(status="success", summary=""))
    )
    assert Solution.model_validate_json(solution.model_dump_json()) == solution


def test_families_are_named_in_any_order_and_case():
    assert parse_families(["sm,PG", " sv"]) == ("PG", "SV", "SM")
    with pytest.raises(SettingError, match="Family 'XY' does not exist"):
        parse_families(["XY"])
