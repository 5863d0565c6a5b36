"""Every rule finds the fault that it is there for, and nothing is wrong with the starter pack."""

from collections.abc import Callable
from dataclasses import replace
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from vigil.agents.scripted import (
    BEST_PIXEL,
    BLIND_WALKS,
    CENTRE_ACTIONS,
    EXPLORE_ACTIONS,
    TURN_ACTIONS,
    WALK_ACTIONS,
)
from vigil.authoring.drafting.house_context import HouseContext
from vigil.authoring.drafting.proposals import shows_px
from vigil.authoring.review import validate as validation
from vigil.authoring.review.blind_trials import blind_trials
from vigil.authoring.review.rules import RULES
from vigil.authoring.review.validate import OTHER_RULES, Finding, Validator, reason_of
from vigil.base.geometry import Vec3
from vigil.errors import SettingError
from vigil.packs.pack import Pack
from vigil.protocol.actions import Action, Look, Navigate, Report
from vigil.protocol.episode import Episode
from vigil.protocol.families import FAMILIES
from vigil.protocol.goals import ObjectHeld
from vigil.protocol.house import House
from vigil.protocol.world import ObjectSetup, Setup
from vigil.scoring.goal_check import check
from vigil.sim.privileged import PrivilegedSimulator

Spoil = Callable[[Episode], Episode]


def first_of(starter: Pack, family: str, template: str | None = None) -> Episode:
    return next(
        episode
        for episode in starter.episodes
        if episode.family == family and template in (None, episode.provenance.template)
    )


def turned(episode: Episode, angle: float) -> Episode:
    start = episode.start
    return episode.model_copy(update={"start": start.model_copy(update={"rotation": (start.rotation + angle) % 360.0})})


def said(episode: Episode, instruction: str) -> Episode:
    return episode.model_copy(update={"instruction": instruction})


def with_setup(episode: Episode, **change: float | bool | None) -> Episode:
    objects = {**episode.setup.objects, episode.goal.object_id: ObjectSetup.model_validate(change)}
    return episode.model_copy(update={"setup": Setup(objects=objects, held=episode.setup.held)})


def standing_outside(episode: Episode) -> Episode:
    position = Vec3(-50.0, 0.0, -50.0)
    return episode.model_copy(update={"start": episode.start.model_copy(update={"position": position})})


def unbound(episode: Episode) -> Episode:
    return episode.model_copy(update={"bindings": {"target": episode.goal.object_id, "other": "Nothing|0|0"}})


def unobstructed(episode: Episode) -> Episode:
    assert episode.goal.constraint is not None
    objects = {key: value for key, value in episode.setup.objects.items() if key != episode.goal.constraint.object_id}
    return episode.model_copy(update={"setup": Setup(objects=objects)})


def relabelled(episode: Episode, template: str) -> Episode:
    return episode.model_copy(update={"provenance": episode.provenance.model_copy(update={"template": template})})


def of_no_template(episode: Episode) -> Episode:
    return relabelled(episode, "juggle")


def silent_about_its_container(episode: Episode) -> Episode:
    bindings = {role: bound for role, bound in episode.bindings.items() if role != "container"}
    return episode.model_copy(update={"bindings": bindings})


def inside(episode: Episode) -> Episode:
    return episode.model_copy(update={"goal": episode.goal.model_copy(update={"inside": True})})


def pinned_elsewhere(episode: Episode) -> Episode:
    return episode.model_copy(update={"house": episode.house.model_copy(update={"sha256": "0" * 64})})


def to_carry_a_machine(episode: Episode) -> Episode:
    goal = ObjectHeld(object_id=episode.goal.object_id, constraint=episode.goal.constraint)
    return episode.model_copy(update={"goal": goal})


BAD: dict[str, tuple[str, str | None, Spoil]] = {
    "house_pinned": ("AI", None, pinned_elsewhere),
    "protocol": ("AI", None, lambda e: e.model_copy(update={"max_steps": 7})),
    "objects_exist": ("AI", None, unbound),
    "start_free": ("AI", None, standing_outside),
    "goal_unmet": ("AI", "turn_on", lambda e: with_setup(e, is_toggled=True)),
    "visible_at_start": ("AI", None, lambda e: turned(e, 180.0)),
    "state_visible_at_start": ("SV", None, lambda e: turned(e, 180.0)),
    "clear_openness": ("AI", "close", lambda e: with_setup(e, openness=0.6)),
    "standard_in_words": ("DA", None, lambda e: said(e, e.instruction.replace("one and a half metres", "reach"))),
    "target_named": ("AI", None, lambda e: said(e, "Do it.")),
    "unambiguous": ("AI", None, lambda e: said(e, f"{e.instruction} Mind the window.")),
    "found_by_opening": ("SI", None, lambda e: relabelled(e, "pick_inside")),
    "look_alike_present": ("AI", None, lambda e: relabelled(e, "look_alike")),
    "constraint_implicit": ("CR", "obstacle", lambda e: relabelled(e, "obstacle_implicit")),
    "state_not_given_away": ("SV", "open", lambda e: said(e, e.instruction.replace("closed", "shut"))),
    "graded": ("PG", None, lambda e: e.model_copy(update={"target_size": None})),
    "chain_of_objects": ("SM", None, of_no_template),
    "not_shut_away": ("SM", "reveal_pick", silent_about_its_container),
    "inside_in_words": ("SM", "rearrange", inside),
    "constraint_holds": ("CR", "obstacle", unobstructed),
    "constraint_visible": ("CR", "obstacle", lambda e: turned(e, 180.0)),
    "solvable": ("CR", "interlock", to_carry_a_machine),
}
"""Rule -> a kind of episode and how to spoil it."""

BAD_STARTS: dict[str, tuple[str, tuple[float, float]]] = {
    "hidden_at_start": ("SI", (0.8, 6.0)),
    "in_reach_at_start": ("PG", (1.8, 6.0)),
    "out_of_reach_at_start": ("DA", (0.3, 1.3)),
}
"""Rule -> a family and from how far its target must not be seen at the start."""

BAD_SOLUTIONS: dict[str, Callable[[tuple[Action, ...]], tuple[Action, ...]]] = {
    "expected_skills": lambda good: (Look(direction="down", magnitude=5.0), Look(direction="up", magnitude=5.0), *good),
    "within_budget": lambda good: (*[Navigate(mode="turn_left", magnitude=90.0)] * 16, *good),
    "solution_holds": lambda good: (Report(status="success", summary=""),),
}
"""Rule -> how to spoil a solution."""

ELSEWHERE = {"near_sees_target", "margins", "not_blind_luck", "negative_controls_fail"}
"""Rules with a test of their own below; the last one's is `test_wrong_ways.py`."""


@pytest.fixture(scope="module")
def validator(simulator: PrivilegedSimulator) -> Validator:
    return Validator(simulator)


def rules_broken(validator: Validator, episode: Episode, house: House, actions: tuple[Action, ...] | None) -> set[str]:
    return {finding.rule for finding in validator.validate(episode, house, actions).findings}


def test_every_rule_is_tested_and_has_a_reason() -> None:
    assert {*BAD, *BAD_STARTS, *BAD_SOLUTIONS, *ELSEWHERE} == {*RULES, *OTHER_RULES}
    assert all(reason_of(rule) for rule in (*RULES, *OTHER_RULES))


@pytest.mark.parametrize("rule", BAD)
def test_a_bad_draft_is_rejected_by_its_rule(rule: str, starter: Pack, validator: Validator) -> None:
    family, template, spoil = BAD[rule]
    good = first_of(starter, family, template)
    house = starter.house_of(good)
    assert validator.validate(good, house, starter.solutions[good.id].actions).is_valid
    assert rule in rules_broken(validator, spoil(good), house, None)


@pytest.mark.parametrize("rule", BAD_STARTS)
def test_a_bad_start_is_rejected_by_its_rule(
    rule: str, starter: Pack, simulator: PrivilegedSimulator, validator: Validator
) -> None:
    family, away = BAD_STARTS[rule]
    good = first_of(starter, family)
    house = starter.house_of(good)
    context = HouseContext(simulator, house, np.random.default_rng(0))
    start = context.start_seeing(context.thing(good.goal.object_id), away, good.start.horizon, shows_px(200))
    assert start is not None
    assert rule in rules_broken(Validator(simulator), good.model_copy(update={"start": start}), house, None)


@pytest.mark.parametrize("rule", BAD_SOLUTIONS)
def test_a_bad_solution_is_rejected_by_its_rule(rule: str, starter: Pack, validator: Validator) -> None:
    good = first_of(starter, "AI")
    spoilt = BAD_SOLUTIONS[rule](starter.solutions[good.id].actions)
    assert rules_broken(validator, good, starter.house_of(good), spoilt) == {rule}


def test_a_sequence_starts_with_its_container_shut(starter: Pack, validator: Validator) -> None:
    good = first_of(starter, "SM", "reveal_pick")
    container = good.bindings["container"]
    ajar = {**good.setup.objects, container: ObjectSetup(openness=1.0)}
    bad = good.model_copy(update={"setup": Setup(objects=ajar)})
    assert "chain_of_objects" in rules_broken(validator, bad, starter.house_of(good), None)


def test_a_thin_margin_is_found(starter: Pack, validator: Validator, monkeypatch: pytest.MonkeyPatch) -> None:
    good = first_of(starter, "DA")
    monkeypatch.setattr(validation, "MARGIN_M", 0.7)
    actions = starter.solutions[good.id].actions
    assert rules_broken(validator, good, starter.house_of(good), actions) == {"margins"}


def test_what_an_agent_without_sight_completes_is_found(starter: Pack, simulator: PrivilegedSimulator) -> None:
    """Straight ahead to the target, three metres are as good as a look."""
    good = first_of(starter, "DA")
    house = starter.house_of(good)
    context = HouseContext(simulator, house, np.random.default_rng(0))
    thing = context.thing(good.goal.object_id)
    validator = Validator(simulator)
    found: set[str] = set()
    for place in islice(context.starts(context.away_from(thing, 2.0, 4.0)), 20):
        start = context.facing(place, thing, good.start.horizon, 0.0)
        found |= rules_broken(validator, good.model_copy(update={"start": start}), house, None)
        context.begin(Setup())
        if "not_blind_luck" in found:
            break
    assert "not_blind_luck" in found


def test_only_searches_by_turning_may_be_found_by_turning(starter: Pack) -> None:
    searched = first_of(starter, "VS", "turn")
    assert [bool(set(TURN_ACTIONS) & set(tried)) for tried in blind_trials(searched)] == [False, False, False]
    assert blind_trials(first_of(starter, "SV")) == []
    tried_walks = {tried[:-1] for tried in blind_trials(first_of(starter, "VS", "walk"))}
    assert {*BLIND_WALKS, TURN_ACTIONS, WALK_ACTIONS} < tried_walks


def test_a_search_that_any_blind_walk_completes_is_refused(starter: Pack, simulator: PrivilegedSimulator) -> None:
    """Starts from which one of the walks passes the target, but neither `explore` nor an agent that only turns."""
    good = first_of(starter, "VS", "walk")
    house, validator = starter.house_of(good), Validator(simulator)
    found: set[str] = set()
    for angle in range(0, 360, 20):
        episode = turned(good, angle)
        if validator.begin_fault(episode, house) is None and only_another_walk_sees(validator, episode, house):
            found |= rules_broken(validator, episode, house, None)
    assert found == {"not_blind_luck"}


def only_another_walk_sees(validator: Validator, episode: Episode, house: House) -> bool:
    report = Report(status="success", summary="")
    known = {TURN_ACTIONS, WALK_ACTIONS, EXPLORE_ACTIONS}
    seeing: set[tuple[Action, ...]] = set()
    for walk in {*known, *BLIND_WALKS}:
        record = validator.play(episode, house, (*walk, report))
        if any(row.semantic for row in check(episode.goal, record).rows):
            seeing.add(walk)
    return bool(seeing) and not seeing & known


@pytest.mark.parametrize(
    ("family", "template", "moves"), [("VS", "walk", 19), ("DA", None, 11), ("PG", None, 1), ("AI", None, 22)]
)
def test_episodes_are_held_to_the_strongest_blind_agent_of_their_family(
    family: str, template: str | None, moves: int, starter: Pack
) -> None:
    episode = first_of(starter, family, template)
    strongest = blind_trials(episode)[-1]
    assert len(strongest) - 1 == moves
    assert len(strongest) <= episode.max_steps


@pytest.mark.parametrize("family", ["SI", "SM", "CR"])
def test_what_is_out_of_view_or_barred_is_clicked_on_only_at_the_centre(family: str, starter: Pack) -> None:
    waiting, centre = blind_trials(first_of(starter, family))
    assert len(waiting) == 1
    assert centre[:-1] == CENTRE_ACTIONS


CENTRE_PIXEL = (CENTRE_ACTIONS[0].x, CENTRE_ACTIONS[0].y)


@pytest.mark.parametrize(("pixel", "other"), [(BEST_PIXEL, CENTRE_PIXEL), (CENTRE_PIXEL, BEST_PIXEL)])
def test_an_episode_that_one_blind_click_completes_is_refused(
    pixel: tuple[int, int], other: tuple[int, int], starter: Pack, simulator: PrivilegedSimulator
) -> None:
    """A start from which the target lies under a pixel that a blind agent clicks on, and not under the other."""
    found: set[str] = set()
    for good in [episode for episode in starter.episodes if episode.family == "PG"]:
        house = starter.house_of(good)
        simulator.load(house)
        for angle in range(-45, 46, 3):
            episode = turned(good, angle)
            simulator.reset(episode.start, episode.setup)
            if simulator.object_at(*pixel) == good.goal.object_id != simulator.object_at(*other):
                found |= rules_broken(Validator(simulator), episode, house, None)
                break
    assert "not_blind_luck" in found


@pytest.mark.parametrize("family", ["PG", "AI", "SI", "SM", "CR"])
def test_what_walking_cannot_change_is_tried_by_waiting_alone(
    family: str, starter: Pack, simulator: PrivilegedSimulator
) -> None:
    episode = first_of(starter, family)
    waiting = blind_trials(episode)[0]
    tries = [waiting, *((*moves, *waiting) for moves in (TURN_ACTIONS, WALK_ACTIONS))]
    validator = Validator(simulator)
    records = [validator.play(episode, starter.house_of(episode), tried) for tried in tries]
    assert len({row.semantic for record in records for row in check(episode.goal, record).rows}) == 1


def test_near_behind_a_wall_is_no_arrival(starter: Pack, simulator: PrivilegedSimulator) -> None:
    """Some target of some house of two rooms is near a blind place in the other room."""
    validator = Validator(simulator)
    good = next(e for e in starter.episodes if e.family == "DA" and len(starter.house_of(e).document.rooms) == 2)
    house = starter.house_of(good)
    context = HouseContext(simulator, house, np.random.default_rng(0))
    shared = {opening.wall0 for opening in house.document.doors if opening.room0 != opening.room1}
    assert shared
    found: set[str] = set()
    for thing in context.things(lambda thing: thing.parent is None and not thing.is_structure):
        goal = good.goal.model_copy(update={"object_id": thing.id})
        draft = good.model_copy(update={"goal": goal, "bindings": {"target": thing.id}})
        found |= rules_broken(validator, draft, house, None)
        if "near_sees_target" in found:
            break
    assert "near_sees_target" in found


def test_nothing_is_wrong_with_a_sample_of_the_starter_pack(starter: Pack, simulator: PrivilegedSimulator) -> None:
    validator = Validator(simulator)
    for episode in starter.episodes[::5]:
        actions = starter.solutions[episode.id].actions
        assert validator.validate(episode, starter.house_of(episode), actions).findings == ()


def test_a_finding_names_episode_rule_and_reason() -> None:
    text = str(Finding("procthor_fridge_seed001", "within_budget", "30 steps"))
    assert "procthor_fridge_seed001" in text
    assert "within_budget" in text
    assert OTHER_RULES["within_budget"] in text


def test_the_documents_name_every_rule_with_its_reason():
    text = (Path(__file__).parents[3] / "docs" / "packs.md").read_text(encoding="utf-8")
    for name in (*RULES, *OTHER_RULES):
        assert f"| `{name}` | " in text
        assert f" | {reason_of(name)} |" in text


def test_a_family_that_names_an_unknown_rule_is_refused(
    simulator: PrivilegedSimulator, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(FAMILIES, "ZZ", replace(FAMILIES["PG"], code="ZZ", rules=("gradded",)))
    with pytest.raises(SettingError, match=r"Family 'ZZ' names rule 'gradded'.*Did you mean 'graded'"):
        Validator(simulator)
