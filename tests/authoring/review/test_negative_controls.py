"""The obvious wrong ways of every family are played, none wins, and each would be found if the goals let it win."""

from collections.abc import Callable

import pytest

from vigil.authoring.families.sm.drafts import SEQUENCES, sequence_forms
from vigil.authoring.language.sentences import FORMS, Forms
from vigil.authoring.language.wording import asks_inside
from vigil.authoring.review.validate import ValidationResult, Validator
from vigil.packs.pack import Pack
from vigil.protocol import goals
from vigil.protocol.episode import Episode
from vigil.protocol.goals import Goal, ObjectAtReceptacle
from vigil.protocol.world import ObjectState
from vigil.scoring import goal_check
from vigil.sim.privileged import PrivilegedSimulator

CHANGED = {"changed, and reported as changed", "changed, and reported as it was"}
PLACES = {"on top instead of inside", "within it instead of on it"}
PLAYED: dict[str, set[str]] = {
    "PG": {"the neighbour instead", "done and undone"},
    "DA": {"stopped short", "done and undone"},
    "SV": {*CHANGED, "done and undone", "reported with the back to it"},
    "AI": {"the neighbour instead", "done and undone"},
    "SI": {"the neighbour instead", "done and undone"},
    "CR": {"done and undone", "the constraint is not resolved"},
    "SM": {"put there and taken again", "the neighbour instead", "done and undone", *PLACES},
}
"""Family -> wrong ways that are possible in the houses of the starter pack."""


@pytest.fixture(scope="module")
def validator(simulator: PrivilegedSimulator) -> Validator:
    return Validator(simulator)


def meant_inside(episode: Episode) -> Episode:
    """The episode with the goal that its words ask for."""
    goal = episode.goal
    if isinstance(goal, ObjectAtReceptacle) and asks_inside(episode.instruction):
        return episode.model_copy(update={"goal": goal.model_copy(update={"inside": True})})
    return episode


def judged(
    validator: Validator, starter: Pack, family: str, is_wanted: Callable[[Goal], bool] = bool
) -> list[ValidationResult]:
    found = [meant_inside(episode) for episode in starter.episodes if episode.family == family]
    found = [episode for episode in found if is_wanted(episode.goal)][:4]
    return [validator.validate(episode, starter.house_of(episode)) for episode in found]


@pytest.mark.parametrize("family", PLAYED)
def test_wrong_ways_are_played_and_fail(family: str, validator: Validator, starter: Pack) -> None:
    verdicts = judged(validator, starter, family)
    if family == "SM":
        verdicts += judged(validator, starter, family, _is_inside)
        verdicts += judged(validator, starter, family, _is_on_drawers)
    names = {way.name for verdict in verdicts for way in verdict.negative_controls if way.record is not None}
    assert [verdict.findings for verdict in verdicts] == [()] * len(verdicts)
    assert names >= PLAYED[family]


def _is_inside(goal: Goal) -> bool:
    return isinstance(goal, ObjectAtReceptacle) and goal.inside


def _is_on_drawers(goal: Goal) -> bool:
    furniture = ("TVStand", "Desk", "SideTable", "Dresser", "CounterTop")
    return isinstance(goal, ObjectAtReceptacle) and not goal.inside and goal.receptacle_id.startswith(furniture)


def anywhere(goal: ObjectAtReceptacle, state: ObjectState) -> tuple[bool, bool]:
    """What counted for every goal before inside was told from on top."""
    return not state.is_held and goal.receptacle_id in state.support_chain, state.parent == goal.receptacle_id


def test_what_is_won_on_top_instead_of_inside_is_found(
    validator: Validator, starter: Pack, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(goals, "_at_receptacle", anywhere)
    found = [finding for verdict in judged(validator, starter, "SM", _is_inside) for finding in verdict.findings]
    assert {(finding.rule, finding.message) for finding in found} == {
        ("negative_controls_fail", "on top instead of inside")
    }


def test_what_is_won_within_instead_of_on_is_found(
    validator: Validator, starter: Pack, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(goals, "_at_receptacle", anywhere)
    found = [finding for verdict in judged(validator, starter, "SM", _is_on_drawers) for finding in verdict.findings]
    assert {(finding.rule, finding.message) for finding in found} == {
        ("negative_controls_fail", "within it instead of on it")
    }


def test_what_is_won_by_doing_and_undoing_is_found(
    validator: Validator, starter: Pack, monkeypatch: pytest.MonkeyPatch
) -> None:
    truth = goal_check.goal_truth
    monkeypatch.setattr(goal_check, "goal_truth", lambda goal, moments: tuple(map(goals.latched, truth(goal, moments))))
    found = [finding for verdict in judged(validator, starter, "AI") for finding in verdict.findings]
    assert {(finding.rule, finding.message) for finding in found} == {("negative_controls_fail", "done and undone")}


@pytest.mark.parametrize(
    ("instruction", "is_inside"),
    [
        ("Put the apple into the fridge.", True),
        ("Bring the bowl to the sink in the kitchen and put it in.", True),
        ("Open the safe, pick up the watch and put it inside.", True),
        ("First open the microwave, then pick up the mug and place it in the sink in the kitchen.", True),
        ("Get the apple from inside the fridge and put it on the table in the living room.", False),
        ("The set of keys is in the dresser. Open it, take the set of keys out and put it on the cart.", False),
        ("Move the vase to the TV stand in the living room.", False),
    ],
)
def test_words_that_ask_for_inside(instruction: str, is_inside: bool) -> None:
    assert asks_inside(instruction) == is_inside


@pytest.mark.parametrize("forms", FORMS)
@pytest.mark.parametrize("template", ["put_into", "put_into_closed", "rearrange", "open_pick_place"])
def test_every_sentence_for_inside_says_so(template: str, forms: Forms) -> None:
    chosen = sequence_forms(template, forms, inside=True)
    assert len(chosen) >= 3
    assert sequence_forms(template, forms, inside=False) == SEQUENCES[template].of(forms)
