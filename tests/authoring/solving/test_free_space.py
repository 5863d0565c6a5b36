"""Free regions of real scenes, and being cut off within them."""

import pytest
import shapely

from vigil.authoring.solving.privileged_view import PrivilegedView
from vigil.base.geometry import Box, Vec3
from vigil.packs.pack import Pack
from vigil.protocol.world import ObjectSetup, Setup
from vigil.scene.floor import FreeSpace, is_cut_off
from vigil.sim.privileged import PrivilegedSimulator

ROOM = shapely.box(0, 0, 6, 4)


def box_at(x: float, z: float) -> Box:
    return Box(center=Vec3(x, 0.5, z), size=Vec3(0.4, 1.0, 0.4))


def test_a_box_across_a_gap_is_cut_off_only_beyond_the_reach() -> None:
    free = ROOM.difference(shapely.box(2, 0, 3, 4))
    assert not is_cut_off(free, (1.0, 1.0), box_at(1.0, 3.0))
    assert is_cut_off(free, (1.0, 1.0), box_at(5.0, 3.0))
    assert not is_cut_off(free, (1.0, 1.0), box_at(3.4, 3.0))


def test_outside_every_free_place_nothing_is_claimed() -> None:
    assert not is_cut_off(ROOM, (9.0, 9.0), box_at(3.0, 3.0))


@pytest.mark.parametrize("family", ["AI", "CR"])
def test_planned_places_are_free_in_the_simulator(family: str, starter: Pack, simulator: PrivilegedSimulator) -> None:
    """What the plan allows, the simulator allows."""
    episode = next(episode for episode in starter.episodes if episode.family == family)
    simulator.load(starter.house_of(episode))
    simulator.reset(episode.start, episode.setup)
    plan = FreeSpace(simulator.scene()).plan()
    cells = plan.cells[::7]
    assert len(cells) > 50
    assert all(simulator.can_stand(Vec3(float(x), 0.0, float(z))) for x, z in cells)
    left, low, right, high = plan.tight.bounds
    for x in range(1, 20):
        for z in range(1, 20):
            place = Vec3(left + (right - left) * x / 20, 0.0, low + (high - low) * z / 20)
            assert simulator.can_stand(place) or not plan.can_stand((place.x, place.z))


def test_a_plan_is_of_the_moment_in_which_it_was_asked_for(starter: Pack, simulator: PrivilegedSimulator) -> None:
    episode = starter.episodes[0]
    simulator.load(starter.house_of(episode))
    simulator.reset(episode.start, Setup())
    standing = next(thing for thing in simulator.scene().things.values() if thing.category in ("Sofa", "DiningTable"))
    view = PrivilegedView(simulator)
    plan, floor, asked_at_once = view.plan(), view.bare_floor(), PrivilegedView(simulator).plan().roomy
    simulator.reset(episode.start, Setup(objects={standing.id: ObjectSetup(is_absent=True)}))
    assert plan.roomy.equals(asked_at_once)
    assert view.plan().roomy.area > asked_at_once.area + 0.3
    assert view.bare_floor().area > floor.area + 0.3
