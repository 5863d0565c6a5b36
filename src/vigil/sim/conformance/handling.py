"""Conformance checks of handling: reach, opening, switching, picking, placing, dropping, and things that move along."""

from vigil.base.geometry import Vec3, floor_distance
from vigil.errors import EpisodeError
from vigil.protocol.world import ObjectSetup, Placement, Setup
from vigil.sim.conformance.harness import (
    Harness,
    expect,
    expect_error,
    expect_near,
    expect_refused,
    holding,
    opened,
    placed,
)
from vigil.sim.conformance.reference_house import DOOR, DRAWER, DRESSER, LOWEST, NORTH, SIBLING, SOUTH, WATCH, WEST

FREE_COUNTER = Vec3(3.65, 0.9225, 4.55)
"""A point on the counter where nothing lies."""
FRONT = (8.0, 1.5)
"""Place (x, z) of the agent in front of the dresser."""
MOVED_M = 0.3
"""Distance (m) by which the dresser is moved."""


def reaches_a_metre_and_a_half(harness: Harness) -> None:
    """On an object more than 1.5 m away, the only intent that is carried out is `ground` (pointing at the object)."""
    harness.face(1.4, 4.2, "Apple|1")
    effect = harness.click("pick", "Apple|1")
    expect(effect.too_far and effect.hit == "Apple|1", f"an apple 1.75 m away was not too far: {effect}")
    expect_refused(effect, "too_far")
    expect(harness.held is None, "picked from too far")
    effect = harness.click("ground", "Apple|1")
    expect(not effect.too_far and effect.hit == "Apple|1" and "Apple|1" in effect.near, f"ground failed: {effect}")
    expect_refused(effect, None)
    harness.go("forward", 2)
    harness.pitch(20)
    expect_refused(harness.click("pick", "Apple|1"), None)


def picks_and_places_where_clicked(harness: Harness) -> None:
    """The hand takes the clicked apple. A click on the counter then puts the apple at the clicked point."""
    harness.face(1.4, 3.3, "Apple|1")
    effect = harness.click("pick", "Apple|1")
    expect_refused(effect, None)
    expect(harness.held == "Apple|1" and effect.changed == ("Apple|1",), f"the apple is not held: {effect}")
    state = harness.state("Apple|1")
    expect(state.is_held and state.parent is None and state.visible_px == 0, f"a held apple's state: {state}")
    expect(state.box_distance_m < 0.5, "a held object does not follow the agent")
    harness.look_at(3.4, 3.6, FREE_COUNTER, holding("Apple|1"))
    effect = harness.click_at("place", FREE_COUNTER)
    expect_refused(effect, None)
    state = harness.state("Apple|1")
    expect(harness.held is None and state.parent == "CounterTop|1", f"the apple is not on the counter: {state}")
    expect(floor_distance(state.position, FREE_COUNTER) < 0.03, f"not at the clicked point: {state.position}")
    expect_near(state.box.bottom, FREE_COUNTER.y, 0.01, "bottom of the placed apple")
    expect(state.visible_px > 0, "a placed apple is not seen")


def refuses_with_the_reason(harness: Harness) -> None:
    """Impossible interactions change nothing, and the reason for each refusal is recorded."""
    harness.face(1.2, 1.0, "FloorLamp|1")
    expect_refused(harness.click("open_access", "FloorLamp|1"), "not_openable")
    expect_refused(harness.click("pick", "FloorLamp|1"), "not_pickupable")
    effect = harness.click("deactivate", "FloorLamp|1")
    expect_refused(effect, "already_so")
    expect(effect.hit == "FloorLamp|1", f"what a refused click hit is not recorded: {effect}")
    expect_refused(harness.click("place", "FloorLamp|1"), "hand_empty")
    expect_refused(harness.drop(), "hand_empty")
    harness.face(1.2, 1.0, "FloorLamp|1", holding("Apple|1"))
    expect_refused(harness.click("place", "FloorLamp|1"), "not_a_receptacle")
    harness.face(2.4, 3.1, "Mug|1", holding("Apple|1"))
    expect_refused(harness.click("pick", "Mug|1"), "hand_full")
    expect_refused(harness.click("activate", "DiningTable|1"), "not_toggleable")
    harness.look_at(3.5, 2.0, Vec3(3.5, 0.0, 3.0), holding("Apple|1"))
    expect_refused(harness.click_at("place", Vec3(3.5, 0.0, 3.0)), "nothing_hit")
    expect(harness.held == "Apple|1", "a refused place emptied the hand")


def places_beside_what_is_in_the_way(harness: Harness) -> None:
    """An object that does not fit at the clicked point is put at the nearest free spot within 0.3 m. Without such a
    spot, the action is refused."""
    beside = Vec3(2.6 + 0.26, 0.9225, 4.5)
    harness.look_at(2.9, 3.6, beside, holding("Apple|1"))
    expect_refused(harness.click_at("place", beside), None)
    state = harness.state("Apple|1")
    expect(0.01 < floor_distance(state.position, beside) <= 0.31, f"not the nearest free spot: {state.position}")
    harness.face(3.3, 3.6, "Plate|1", holding("Pillow|1"))
    expect_refused(harness.click("place", "Plate|1"), "no_room")
    expect(harness.held == "Pillow|1", "a pillow without room left the hand")


def stacks_and_counts_supports(harness: Harness) -> None:
    """An apple on a plate on the counter is above both and has both in its chain of supports."""
    harness.face(3.3, 3.6, "Plate|1", holding("Apple|1"))
    expect_refused(harness.click("place", "Plate|1"), None)
    objects = harness.simulator.world(["Apple|1", "Plate|1", "CounterTop|1"]).objects
    apple = objects["Apple|1"]
    expect(apple.support_chain == ("Plate|1", "CounterTop|1"), f"support chain: {apple.support_chain}")
    expect(set(apple.over) == {"Plate|1", "CounterTop|1"}, f"over: {apple.over}")
    harness.stand(3.5, 3.0, setup=placed("Apple|1", 1.8, 0.04, 2.2))
    under = harness.simulator.world(["Apple|1", "DiningTable|1"]).objects["Apple|1"]
    expect(under.over == () and under.parent is None, f"an apple under the table: {under}")


def drops_straight_down(harness: Harness) -> None:
    """An object drops 0.4 m ahead of the body, onto the floor or onto furniture there, and never through a wall."""
    harness.stand(3.5, 2.5, NORTH, setup=holding("Apple|1"))
    expect_refused(harness.drop(), None)
    state = harness.state("Apple|1")
    expect(state.parent is None and harness.held is None, f"dropped on the floor: {state}")
    expect_near(state.position.z, 2.9, 1e-6, "z of the dropped apple")
    expect_near(state.box.bottom, 0.0, 1e-3, "bottom of the dropped apple")
    harness.stand(1.6, 2.84, SOUTH, setup=holding("Pillow|1"))
    harness.stand(1.6, 2.84, SOUTH, setup=holding("Watch|1"))
    expect_refused(harness.drop(), None)
    expect(harness.state("Watch|1").parent == "DiningTable|1", f"over the table: {harness.state('Watch|1')}")
    harness.stand(0.21, 2.5, WEST, setup=holding("Apple|1"))
    expect_refused(harness.drop(), "no_room")


def opens_and_closes(harness: Harness) -> None:
    """Things in a fridge are visible only while the fridge is open; nothing can be put into a closed fridge."""
    harness.face(5.2, 3.1, "Lettuce|1")
    closed = harness.state("Lettuce|1")
    expect(closed.visible_px == 0 and not closed.visible, "a lettuce is seen through a closed door")
    expect_refused(harness.click("close_access", "Fridge|1"), "already_so")
    effect = harness.click("open_access", "Fridge|1")
    expect_refused(effect, None)
    expect(effect.changed == ("Fridge|1",), f"changed by opening: {effect.changed}")
    expect_near(harness.state("Fridge|1").openness or 0.0, 1.0, 1e-9, "openness")
    expect(harness.state("Lettuce|1").visible_px > 0, "a lettuce in an open fridge is not seen")
    expect(harness.state("Lettuce|1").not_on == ("Fridge|1",), "a lettuce in an open fridge lies on it")
    expect_refused(harness.click("pick", "Lettuce|1"), None)
    shelf = Vec3(5.2, closed.box.bottom + 0.005, 4.5)
    expect_refused(harness.click_at("place", shelf), None)
    expect(harness.state("Lettuce|1").parent == "Fridge|1", "the lettuce is not back in the fridge")
    expect_refused(harness.click("close_access", "Fridge|1"), None)
    harness.face(5.2, 3.1, "Fridge|1", holding("Apple|1"))
    expect_refused(harness.click("place", "Fridge|1"), "receptacle_closed")


def leaves_stop_at_what_is_in_the_way(harness: Harness) -> None:
    """A leaf (door, lid or drawer) that would hit the agent's body or a thing does not move at all."""
    harness.face(5.2, 3.7, "Fridge|1")
    effect = harness.click("open_access", "Fridge|1")
    expect_refused(effect, "blocked_by_agent")
    expect(harness.state("Fridge|1").openness == 0.0, "a blocked leaf moved")
    harness.face(5.2, 3.1, "Fridge|1", placed("Box|1", 5.2, 0.152, 3.95))
    effect = harness.click("open_access", "Fridge|1")
    expect_refused(effect, "blocked_by_object")
    expect(effect.blocked_by == "Box|1", f"blocked by {effect.blocked_by}")


def doors_open_and_close(harness: Harness) -> None:
    """A door opens and closes when the agent's body is not in the way of its leaf."""
    harness.face(4.8, 2.2, DOOR)
    expect_refused(harness.click("open_access", DOOR), None)
    expect(not harness.go("backward", 1).path_blocked, "cannot step back from an open door")
    expect_refused(harness.click("close_access", DOOR), None)
    expect(harness.state(DOOR).openness == 0.0, "the door is not closed")


# Furniture whose drawers open one by one.


def open_one_by_one(harness: Harness) -> None:
    """A click on a drawer opens only this drawer, with the things in it; the dresser itself does not open."""
    harness.face(*FRONT, DRAWER)
    before = harness.state(WATCH)
    expect(before.visible_px == 0 and before.parent == DRAWER, f"a watch in a closed drawer: {before}")
    expect_refused(harness.click("open_access", DRESSER), "not_openable")
    effect = harness.click("open_access", DRAWER)
    expect_refused(effect, None)
    expect(effect.changed == tuple(sorted((DRAWER, WATCH))), f"changed by opening: {effect.changed}")
    expect(harness.state(DRAWER).openness == 1.0 and harness.state(SIBLING).openness == 0.0, "another drawer opened")
    after = harness.state(WATCH)
    expect(after.visible_px > 0, "a watch in an open drawer is not seen")
    expect(after.position.z > before.position.z + 0.1, "the watch did not come along")
    expect_refused(harness.click("open_access", SIBLING), None)
    expect_refused(harness.click("close_access", DRAWER), None)
    expect(harness.state(SIBLING).openness == 1.0, "another drawer closed")
    expect_near(harness.state(WATCH).position.z, before.position.z, 1e-9, "z of the watch, closed again")


def hold_their_own_things(harness: Harness) -> None:
    """Objects can be put into an open drawer, but not into a shut drawer.

    An object in a drawer also counts as in the furniture that has the drawer.
    """
    harness.face(*FRONT, DRAWER, holding("Pen|1"))
    expect_refused(harness.click("place", DRAWER), "receptacle_closed")
    harness.face(*FRONT, WATCH, opened(DRAWER).model_copy(update={"held": "Pen|1"}))
    expect_refused(harness.click("place", SIBLING), "receptacle_closed")
    watch = harness.state(WATCH).position
    expect_refused(harness.click_at("place", Vec3(watch.x + 0.08, watch.y, watch.z)), None)
    pen = harness.simulator.world(["Pen|1", DRAWER, DRESSER]).objects["Pen|1"]
    expect(pen.parent == DRAWER and pen.support_chain == (DRAWER, DRESSER), f"a pen in a drawer: {pen}")
    expect(pen.inside == (DRAWER, DRESSER) and pen.over_inside == (DRAWER,), f"a pen in a drawer: {pen}")
    expect(pen.not_on == (DRAWER, DRESSER), f"a pen in a drawer lies on it: {pen}")
    expect_refused(harness.click("pick", WATCH), None)
    top = Vec3(8.0, 0.8438, 0.3)
    harness.look_at(*FRONT, top, holding("Pen|1"))
    expect_refused(harness.click_at("place", top), None)
    pen = harness.state("Pen|1")
    expect(pen.parent == DRESSER and pen.inside == () and pen.not_on == (), f"a pen on a dresser: {pen}")


def stop_at_what_is_in_the_way(harness: Harness) -> None:
    """A drawer that would hit the body or an object does not move; another drawer of the same dresser still does."""
    harness.face(7.76, 0.72, LOWEST)
    expect_refused(harness.click("open_access", LOWEST), "blocked_by_agent")
    in_front = placed("Box|1", 7.76, 0.152, 0.75)
    harness.face(8.3, 1.5, LOWEST, in_front)
    effect = harness.click("open_access", LOWEST)
    expect_refused(effect, "blocked_by_object")
    expect(effect.blocked_by == "Box|1" and harness.state(LOWEST).openness == 0.0, f"not blocked: {effect}")
    expect_refused(harness.click("open_access", DRAWER), None)


def are_seen_as_part_of_their_furniture(harness: Harness) -> None:
    """Pixels of a drawer count as pixels of its dresser, and a click on a drawer counts as near the dresser."""
    harness.face(*FRONT, DRESSER)
    whole, *drawers = (harness.state(name).visible_px for name in (DRESSER, DRAWER, SIBLING))
    parts = sum(drawers)
    expect(0 < parts < whole, f"two drawers show {parts} px, their dresser {whole}")
    effect = harness.click("ground", DRAWER)
    expect(effect.hit == DRAWER and DRESSER in effect.near, f"pointed at a drawer: {effect}")


def move_with_their_furniture(harness: Harness) -> None:
    """A dresser that a setup moves takes its drawers along; a drawer cannot be moved alone."""
    harness.stand(7.0, 2.5)
    dresser, before = harness.state(DRESSER).position, harness.state(WATCH).position
    elsewhere = Placement(position=dresser._replace(x=dresser.x + MOVED_M))
    harness.stand(7.0, 2.5, setup=Setup(objects={DRESSER: ObjectSetup(placement=elsewhere)}))
    expect_near(harness.state(WATCH).position.x, before.x + MOVED_M, 1e-6, "x of the watch, moved with the dresser")
    alone = Setup(objects={DRAWER: ObjectSetup(placement=elsewhere)})
    try:
        expect_error(EpisodeError, lambda: harness.stand(7.0, 2.5, setup=alone))
    finally:
        harness.simulator.load(harness.house)


def appliances_interlock(harness: Harness) -> None:
    """A microwave neither opens while it runs nor starts while it is open."""
    harness.face(2.6, 3.4, "Microwave|1")
    expect_refused(harness.click("activate", "Microwave|1"), None)
    expect(harness.state("Microwave|1").is_toggled is True, "the microwave does not run")
    expect_refused(harness.click("open_access", "Microwave|1"), "interlock")
    expect_refused(harness.click("activate", "Microwave|1"), "already_so")
    expect_refused(harness.click("deactivate", "Microwave|1"), None)
    expect_refused(harness.click("open_access", "Microwave|1"), None)
    expect_refused(harness.click("activate", "Microwave|1"), "interlock")
    expect_refused(harness.click("close_access", "Microwave|1"), None)
    expect_refused(harness.click("activate", "Microwave|1"), None)


def contents_move_along(harness: Harness) -> None:
    """An egg moves along with its bowl; a book with a pen on it is not picked up."""
    harness.face(2.4, 3.1, "Bowl|1")
    before = harness.simulator.world(["Bowl|1", "Egg|1"]).objects
    effect = harness.click("pick", "Bowl|1")
    expect_refused(effect, None)
    expect(harness.held == "Bowl|1" and effect.changed == ("Bowl|1", "Egg|1"), f"changed by picking: {effect.changed}")
    carried = harness.state("Egg|1")
    expect(not carried.is_held and carried.parent == "Bowl|1", f"an egg in a held bowl: {carried}")
    harness.look_at(3.4, 3.6, FREE_COUNTER, holding("Bowl|1"))
    expect_refused(harness.click_at("place", FREE_COUNTER), None)
    after = harness.simulator.world(["Bowl|1", "Egg|1"]).objects
    for axis in range(3):
        shift = after["Bowl|1"].position[axis] - before["Bowl|1"].position[axis]
        expect_near(after["Egg|1"].position[axis] - before["Egg|1"].position[axis], shift, 1e-6, "shift of the egg")
    expect(after["Egg|1"].support_chain == ("Bowl|1", "CounterTop|1"), f"chain: {after['Egg|1'].support_chain}")
    expect(after["Egg|1"].not_on == (), f"an egg in a bowl on a counter does not lie on it: {after['Egg|1']}")
    harness.face(8.7, 2.4, "Book|1")
    expect_refused(harness.click("pick", "Book|1"), "object_occupied")


def switches_change_the_state(harness: Harness) -> None:
    """A lamp can be switched on and off. A setup can start an episode with the lamp on."""
    harness.face(1.2, 1.0, "FloorLamp|1")
    expect_refused(harness.click("activate", "FloorLamp|1"), None)
    expect(harness.state("FloorLamp|1").is_toggled is True, "the lamp is not on")
    harness.face(1.2, 1.0, "FloorLamp|1", Setup(objects={"FloorLamp|1": ObjectSetup(is_toggled=True)}))
    expect_refused(harness.click("activate", "FloorLamp|1"), "already_so")
    expect_refused(harness.click("deactivate", "FloorLamp|1"), None)
    expect(harness.state("FloorLamp|1").is_toggled is False, "the lamp is not off")
