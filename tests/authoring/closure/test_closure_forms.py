"""What makes the forms of the suite's kinds: room on a receptacle, words that tell one of two things, quotas."""

import numpy as np
import pytest

from vigil.authoring.closure.kinds.look_alike.phrases import (
    by_bearing,
    by_size,
    by_state,
    is_clearly_larger,
    is_in_state,
    referents_in,
)
from vigil.authoring.closure.kinds.silent_refusal.tasks import obvious_surface
from vigil.authoring.closure.receptacle_space import fits_on, free_surfaces, refuses_clicks
from vigil.authoring.drafting.house_context import HouseContext
from vigil.authoring.drafting.sources import GeneratedHouse
from vigil.authoring.review.placements import placements_on
from vigil.authoring.review.synthetic_records import changed_setup
from vigil.cli.making.options import Content
from vigil.errors import SettingError
from vigil.protocol.world import ObjectSetup, Setup
from vigil.scoring.closure import KINDS, Kind
from vigil.sim.privileged import PrivilegedSimulator


@pytest.fixture(scope="module")
def context(simulator: PrivilegedSimulator) -> HouseContext:
    return HouseContext(simulator, GeneratedHouse(901, "kitchen").house(), np.random.default_rng(1))


def first_of(context: HouseContext, category: str) -> str:
    return next(thing.id for thing in context.view.scene.things.values() if thing.category == category)


def test_where_a_click_finds_room_the_search_finds_it_too(context: HouseContext) -> None:
    """It errs on the side of room, so that what it says has none has none."""
    fridge, cart = first_of(context, "Fridge"), first_of(context, "Cart")
    context.begin(Setup(objects={fridge: ObjectSetup(openness=1.0)}))
    scene, found = context.view.scene, 0
    for held in ("Bowl", "Apple", "Bread", "Pan"):
        for receptacle in (fridge, cart):
            obvious = obvious_surface(scene.things[receptacle])
            assert obvious is not None
            name = obvious[0].name
            if not refuses_clicks(scene, context.view.agent, first_of(context, held), receptacle, name):
                found += 1
                assert name in free_surfaces(scene, first_of(context, held), receptacle)
                assert fits_on(scene, first_of(context, held), receptacle)
    assert found
    context.begin(Setup())


def test_the_obvious_surface_is_the_one_at_the_height_of_the_hand(context: HouseContext) -> None:
    found = {
        category: obvious_surface(context.view.scene.things[first_of(context, category)])
        for category in ("Fridge", "Cart", "DiningTable")
    }
    assert {name: each and each[0].name for name, each in found.items()} == {
        "Fridge": "shelf3",
        "Cart": "tray2",
        "DiningTable": None,
    }


def test_a_thing_has_no_room_where_a_machine_takes_it_all_up(context: HouseContext) -> None:
    context.begin(Setup())
    scene, pan, bread = context.view.scene, first_of(context, "Pan"), first_of(context, "Bread")
    chair, microwave = scene.things[first_of(context, "Chair")], scene.things[first_of(context, "Microwave")]
    assert fits_on(scene, pan, chair.id, may_clear=False)
    place = next(placements_on(chair, microwave, inside=False))
    assert context.can_begin(changed_setup(Setup(), microwave.id, placement=place))
    assert not free_surfaces(scene, pan, chair.id)
    assert fits_on(scene, bread, chair.id), "what lies on or in the machine lies on the chair, too"
    context.begin(Setup())


def test_words_tell_one_of_two_things_by_size_state_and_what_it_bears(context: HouseContext) -> None:
    context.begin(Setup())
    scene, items = context.view.scene, context.items
    plates = [thing for thing in scene.things.values() if thing.category == "Plate"]
    assert len(plates) > 1
    small, large = sorted(plates[:2], key=lambda thing: max(thing.asset.size))
    words = by_size("plate", is_larger=True)
    meant = referents_in(f"Please pick up {words}.", items.values(), context.view)
    if len(plates) == 2 and is_clearly_larger(large, small):
        assert meant == {large.id}
    else:
        assert meant == {plate.id for plate in plates}
    apple = scene.things[first_of(context, "Apple")]
    bearer = plates[0]
    place = next(placements_on(bearer, apple, inside=False), None) or next(placements_on(bearer, apple, inside=True))
    assert context.can_begin(changed_setup(Setup(), apple.id, placement=place))
    words = by_bearing("plate", "apple", is_inside=False)
    assert referents_in(f"Pick up {words}.", context.items.values(), context.view) == {bearer.id}
    context.begin(Setup())
    assert referents_in("Pick up the plate.", context.items.values(), context.view) == set()


def test_a_thing_ajar_may_be_called_open_and_closed(context: HouseContext) -> None:
    fridge = context.view.scene.things[first_of(context, "Fridge")]
    before = fridge.openness
    try:
        for openness, labels in ((0.0, {"closed"}), (0.3, {"open", "closed"}), (1.0, {"open"})):
            fridge.openness = openness
            assert {label for label in ("open", "closed") if is_in_state(fridge, label)} == labels
    finally:
        fridge.openness = before
    assert by_state("laptop", "open") == "the laptop that is open"


def test_kinds_are_asked_for_by_number() -> None:
    def tasks_of(*kinds: str) -> dict[Kind, int]:
        return Content(name="p", suite="closure", kinds=kinds, per_family=5).tasks()

    assert tasks_of() == dict.fromkeys(KINDS, 5)
    assert tasks_of("look_alike", "impossible:70") == {"impossible": 70, "look_alike": 5}
    for wrong, said in (
        ("imposible", "Did you mean 'impossible'"),
        ("all_of:0", "not a number of tasks"),
        ("all_of:", "no"),
    ):
        with pytest.raises(SettingError, match=said):
            tasks_of(wrong)
