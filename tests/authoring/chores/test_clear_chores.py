"""Chores that agents can understand and check: clear names, visible tops, full stands, states to remember."""

from itertools import islice

import numpy as np
import pytest

from vigil.authoring.chores import placements
from vigil.authoring.chores.compose import pool_of
from vigil.authoring.chores.placements import hidden, no_room
from vigil.authoring.chores.proposed import MAX_SEARCHED, names_other_drawers, other_drawers
from vigil.authoring.chores.remembered import Group, remembered
from vigil.authoring.chores.states import every_drawer
from vigil.authoring.drafting.house_context import HouseContext
from vigil.authoring.drafting.sources import GeneratedHouse
from vigil.authoring.language.referring import Phrase, mentions
from vigil.authoring.review.containers import may_hold
from vigil.authoring.solving.evidence import surface_evidence
from vigil.authoring.solving.goal_actions import closed_containers_around
from vigil.protocol.goals import ObjectAtReceptacle, ObjectInState
from vigil.protocol.world import Setup
from vigil.scene.supports import drawers_of, level_surfaces
from vigil.sim.privileged import PrivilegedSimulator


@pytest.fixture(scope="module")
def dressers(simulator: PrivilegedSimulator) -> HouseContext:
    """A home with a dresser of three rows, and a TV stand of two rows."""
    return HouseContext(simulator, GeneratedHouse(9009, "3").house(), np.random.default_rng(0))


@pytest.fixture(scope="module")
def home(simulator: PrivilegedSimulator) -> HouseContext:
    return HouseContext(simulator, GeneratedHouse(9013, "7").house(), np.random.default_rng(0))


def meant_by(context: HouseContext, phrase: Phrase) -> list[str]:
    return list(other_drawers(context.view.scene, context.items, [phrase]))


def test_a_position_in_a_chest_must_be_false_of_drawers_of_similar_furniture(dressers: HouseContext) -> None:
    assert meant_by(dressers, Phrase("right drawer in the second row from above of the dresser"))
    assert meant_by(dressers, Phrase("upper left drawer of the TV stand"))
    assert not meant_by(dressers, Phrase("right drawer in the third row from above of the dresser"))
    assert not meant_by(dressers, Phrase("lower left drawer of the TV stand", room="living room"))


def test_the_drawer_that_names_the_place_of_an_object_must_be_clear_too(dressers: HouseContext) -> None:
    assert meant_by(dressers, Phrase("pen", support="upper left drawer of the TV stand"))


def test_no_offered_chore_names_a_drawer_that_could_be_another(dressers: HouseContext) -> None:
    chores = [chore for offers in pool_of(dressers).offers.values() for group in offers for chore in group]
    assert chores
    assert not any(names_other_drawers(dressers, chore) for chore in chores)


def test_every_drawer_of_a_chest_is_meant(home: HouseContext) -> None:
    chores = list(every_drawer(home))
    assert chores
    for chore in chores:
        (phrase,) = mentions(chore.sentence, [item.name for item in home.items.values()])
        chest = next(thing for thing in home.view.scene.things.values() if home.phrase(thing.id) == phrase)
        assert chore.chore.ids() == chore.meant == {each.id for each in drawers_of(home.view.scene, chest)}
        states = {change.openness for change in chore.changes.values()}
        assert 1.0 in states
        assert all(isinstance(part, ObjectInState) and not part.value for part in chore.chore.parts)


def test_a_top_to_put_things_on_can_be_seen_from_above(home: HouseContext) -> None:
    chores = [group[0] for offers in pool_of(home).offers.values() for group in offers]
    goals = [part for chore in chores for part in chore.chore.parts if isinstance(part, ObjectAtReceptacle)]
    tops = [home.thing(goal.receptacle_id) for goal in goals if not goal.inside]
    assert tops
    for thing in tops:
        surfaces = [surface.name for surface, _ in level_surfaces(thing) if not surface.is_inside]
        assert any(surface_evidence(thing, name) for name in surfaces)


def test_a_full_stand_looks_full_and_the_object_is_in_its_room(home: HouseContext) -> None:
    chores = list(islice(no_room(home), 2))
    assert chores
    for chore in chores:
        part = chore.chore.parts[0]
        assert isinstance(part, ObjectAtReceptacle)
        target, stand = home.thing(part.object_id), home.thing(part.receptacle_id)
        assert home.view.room_at(target.position) == home.view.room_at(stand.position)
        assert len(list(level_surfaces(stand))) == 1


def test_an_object_that_might_fit_makes_no_full_stand(home: HouseContext, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(placements, "CLEARLY_LARGER", 1000.0)
    assert list(no_room(home)) == []


@pytest.fixture(scope="module")
def groups(home: HouseContext) -> list[Group]:
    return list(remembered(home))


def test_the_state_to_remember_is_changed_or_kept_by_the_other_chores(groups: list[Group]) -> None:
    assert {len(group) for group in groups} == {2, 3}
    for *others, last in groups:
        assert last.chore.condition is not None
        assert last.kind == "conditional"
        asked = last.chore.condition.object_id
        assert any(asked in other.chore.ids() for other in others)
        assert asked not in {part.object_id for part in last.chore.parts}
        assert all(other.changes == last.changes for other in others)
        start = last.changes[asked]
        is_so = bool(start.openness) if last.chore.condition.state == "is_open" else bool(start.is_toggled)
        assert is_so is last.chore.is_met


def test_both_answers_occur(groups: list[Group]) -> None:
    assert {group[-1].chore.is_met for group in groups} == {True, False}


def test_a_hidden_object_lies_in_a_closed_container_that_the_sentence_does_not_name(home: HouseContext) -> None:
    chores = list(hidden(home))
    assert chores
    for chore in chores:
        target = chore.chore.parts[0].object_id
        assert chore.kind == "hidden"
        assert home.can_begin(Setup(objects=dict(chore.changes)))
        (container,) = closed_containers_around(home.view, target)
        item = home.items[target]
        assert item.support is not None
        assert item.support not in chore.sentence
        assert container in chore.changes
        likely = may_hold(home.view, home.items, home.thing(target), None)
        assert len(likely) <= MAX_SEARCHED or f"{item.name} in the {item.room}" in chore.sentence
        home.begin(Setup())


def test_an_object_in_too_many_possible_containers_is_not_hidden(
    home: HouseContext, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(placements, "MAX_SEARCHED", 0)
    assert list(hidden(home)) == []
