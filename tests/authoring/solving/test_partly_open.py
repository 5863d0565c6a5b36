"""What stands ajar: over the threshold of open, told from near by, and counted where all drawers and doors are."""

import math
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from vigil.authoring.closure.certify import Certifier
from vigil.authoring.closure.kinds.all_of.tasks import all_of
from vigil.authoring.closure.kinds.already.tasks import already
from vigil.authoring.closure.kinds.if_so.tasks import if_so
from vigil.authoring.closure.tasks import ClosureTask, Tasks
from vigil.authoring.drafting.house_context import HouseContext
from vigil.authoring.drafting.sources import GeneratedHouse
from vigil.authoring.review.synthetic_records import changed_setup
from vigil.authoring.solving.evidence import (
    DRAWERS_AND_DOORS,
    MIN_GAP_M,
    PARTLY_OPEN,
    can_be_partly_open,
    gap_evidence,
    is_partly_open,
    opening_gap_m,
    random_partial_openness,
)
from vigil.base.geometry import distance
from vigil.protocol.goals import AllOf
from vigil.protocol.world import CLOSED_BELOW, OPEN_ABOVE, Setup
from vigil.scene.things import Thing
from vigil.sim.privileged import PrivilegedSimulator

SEED = 541


@pytest.fixture(scope="module")
def context(simulator: PrivilegedSimulator) -> HouseContext:
    return HouseContext(simulator, GeneratedHouse(SEED, "2").house(), np.random.default_rng(1))


def tasks(found: Tasks, count: int) -> list[ClosureTask]:
    return list(islice((each for each in found if isinstance(each, ClosureTask)), count))


def closable(context: HouseContext) -> list[Thing]:
    context.begin(Setup())
    return [each for each in context.view.scene.things.values() if each.category in DRAWERS_AND_DOORS]


def test_ajar_is_open_by_the_protocol_and_nowhere_near_wide_open(context: HouseContext) -> None:
    assert CLOSED_BELOW < PARTLY_OPEN[0] < PARTLY_OPEN[1] < OPEN_ABOVE
    for thing in (each for each in closable(context) if can_be_partly_open(each)):
        drawn = [random_partial_openness(thing, np.random.default_rng(seed)) for seed in range(50)]
        assert all(is_partly_open(each) for each in drawn)
        assert len(set(drawn)) > 3
        assert min(drawn) / PARTLY_OPEN[0] * opening_gap_m(thing) >= MIN_GAP_M * 0.99


def test_the_gap_is_where_a_drawer_or_a_door_comes_out(context: HouseContext) -> None:
    found = [each for each in closable(context) if can_be_partly_open(each)]
    assert {each.category for each in found} >= {"Drawer", "Safe"}
    for thing in found:
        closed, ajar = (gap_evidence(replace(thing), openness).spot for openness in (0.0, PARTLY_OPEN[0]))
        assert closed is not None
        assert ajar is not None
        assert 0.8 * opening_gap_m(thing) - 0.002 <= distance(closed, ajar) <= opening_gap_m(thing) + 0.002
        if thing.category == "Drawer":
            joint = thing.asset.joints[0]
            assert opening_gap_m(thing) == pytest.approx(joint.travel * PARTLY_OPEN[0], rel=1e-6)
        assert math.dist((ajar.x, ajar.z), (thing.position.x, thing.position.z)) < 1.0


def test_twins_about_a_room_leave_one_drawer_or_door_ajar_and_name_the_place_to_look_at(context: HouseContext) -> None:
    found = [each for each in tasks(already(context), 40) if each.form in ("closed_room", "closed_home")]
    assert {each.form for each in found} == {"closed_room", "closed_home"}
    for task in found:
        first, second = task.episodes
        assert isinstance(first.goal, AllOf)
        ids = {part.object_id for part in first.goal.parts}
        assert {context.thing(each).category for each in ids} <= DRAWERS_AND_DOORS
        openness = {name: change.openness or 0.0 for name, change in first.setup.objects.items() if name in ids}
        assert [name for name, value in openness.items() if value] == [task.removed]
        assert openness[task.removed] == 1.0 or is_partly_open(openness[task.removed])
        assert second.setup.objects[task.removed].openness == 0.0
        assert task.evidence[0].spot is not None or not can_be_partly_open(context.thing(task.removed))


def test_a_condition_is_asked_about_something_ajar(context: HouseContext) -> None:
    found = [each for each in tasks(if_so(context), 12) if each.form.startswith("close")]
    ajar = [each for each in found if is_partly_open(each.episodes[0].setup.objects[each.removed].openness or 0.0)]
    assert ajar
    assert all("open, even a little" in each.episodes[0].instruction for each in found)


def test_what_is_neither_closed_nor_ajar_nor_wide_open_is_refused(
    context: HouseContext, simulator: PrivilegedSimulator
) -> None:
    certifier = Certifier(simulator)
    for task in tasks(all_of(context), 30):
        if task.form != "open_home":
            continue
        house = GeneratedHouse(SEED, "2").house()
        if certifier.certify(task, house)[1]:
            continue
        episode = task.episodes[0]
        target = episode.goal.object_id
        half = episode.model_copy(update={"setup": changed_setup(episode.setup, target, openness=0.45)})
        assert certifier.certify(replace(task, episodes=(half,)), house)[1][0].rule == "gap_visible"
        return
    pytest.fail("no task about a whole home holds in this house")
