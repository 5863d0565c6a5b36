"""Conformance checks of the guarantees that `vigil.sim.privileged` gives to solvers and authoring."""

from dataclasses import fields

import numpy as np

from vigil.base.geometry import Pose, Vec3
from vigil.errors import EpisodeError, SimulatorError
from vigil.protocol.world import ObjectSetup, Setup
from vigil.scene.things import Thing
from vigil.sim.conformance.harness import NOTHING, Harness, expect, expect_error, expect_refused, holding, opened
from vigil.sim.conformance.reference_house import BEDROOM, DOOR, DRAWER, EAST, KITCHEN, PANE, WEST
from vigil.sim.privileged import PrivilegedSimulator

HERE = Vec3(3.5, 0.0, 2.5)
"""A place on the kitchen's free floor."""
THERE = Pose(position=Vec3(8.0, 0.0, 1.5), rotation=180.0, horizon=30.0)
"""A pose in the bedroom, in front of the dresser."""
APPLE_FROM = Vec3(1.4, 1.576, 3.2)
"""Position of an eye from which the apple is visible."""


def keeps_the_privileged_protocol(harness: Harness) -> None:
    """The backend has every member of `PrivilegedSimulator`."""
    expect(
        isinstance(harness.simulator, PrivilegedSimulator), f"{harness.simulator.name} lacks a member of the protocol"
    )


def shows_the_scene_as_it_is(harness: Harness) -> None:
    """Until the next `load`, every call returns the same `Scene`, and its things always have their present states."""
    harness.stand(HERE.x, HERE.z)
    scene = harness.simulator.scene()
    setup = opened("Fridge|1").model_copy(update={"held": "Mug|1"})
    absent = {"Statue|1": ObjectSetup(is_absent=True), "FloorLamp|1": ObjectSetup(is_toggled=True)}
    harness.face(5.2, 3.1, "Lettuce|1", Setup(objects={**setup.objects, **absent}, held="Mug|1"))
    expect(harness.simulator.scene() is scene, "a reset made another scene")
    ids = harness.simulator.object_ids()
    present = sorted(thing.id for thing in scene.things.values() if thing.is_present)
    expect(ids == present and "Statue|1" not in ids and "Mug|1" in ids, f"object_ids: {ids}, in the scene: {present}")
    for object_id, state in harness.simulator.world(ids).objects.items():
        thing = scene.things[object_id]
        in_scene = (thing.category, thing.position, thing.parent, thing.is_held)
        in_world = (state.category, state.position, state.parent, state.is_held)
        expect(in_scene == in_world, f"{object_id} in the scene: {in_scene}, in the world: {in_world}")
        expect(state.openness in (None, thing.openness), f"openness of {object_id}: {state.openness}")
        expect(state.is_toggled in (None, thing.is_toggled), f"{object_id} is_toggled: {state.is_toggled}")
    expect(scene.things["Fridge|1"].openness == 1.0 and scene.things["FloorLamp|1"].is_toggled, "the setup is not seen")
    expect({room.id for room in scene.rooms} == {KITCHEN, BEDROOM}, "rooms of the scene")


def finds_the_room_of_a_place(harness: Harness) -> None:
    """The room of a position is the room whose floor is below the position, at any height; None outside all rooms."""
    rooms = {HERE: KITCHEN, Vec3(3.5, 1.7, 2.5): KITCHEN, THERE.position: BEDROOM, Vec3(-1.0, 0.0, 2.5): None}
    for place, room in rooms.items():
        found = harness.simulator.room_at(place)
        expect(found == room, f"{place} is in {found}, not in {room}")


def lists_pixels_in_the_frame(harness: Harness) -> None:
    """Clickable pixels are integers (n, 2) inside the frame; objects out of view, hidden, held or absent have none."""
    harness.face(1.4, 3.2, "Apple|1")
    pixels = harness.simulator.pixels_of("Apple|1")
    expect(pixels.ndim == 2 and pixels.shape[1] == 2 and pixels.dtype.kind == "i", f"{pixels.shape} {pixels.dtype}")
    expect(bool(((pixels >= 0) & (pixels < [640, 480])).all()), "pixels outside of the frame")
    without = Setup(objects={"Apple|1": ObjectSetup(is_absent=True)})
    cases = {"behind the agent": ("Fridge|1", NOTHING), "held": ("Apple|1", holding("Apple|1")),
             "absent": ("Apple|1", without), "in a closed fridge": ("Lettuce|1", NOTHING)}  # fmt: skip
    for what, (object_id, setup) in cases.items():
        harness.stand(1.4, 3.2, WEST, setup=setup)
        expect(harness.simulator.pixels_of(object_id).shape == (0, 2), f"{object_id}, {what}, has pixels")


def sees_from_anywhere(harness: Harness) -> None:
    """Rays from any eye find the visible points of an object, wherever the agent itself stands."""
    harness.stand(THERE.position.x, THERE.position.z)
    apple = harness.state("Apple|1").position
    points = np.array([apple, apple])
    sees = harness.simulator.points_visible_from
    seen = sees(APPLE_FROM, points, "Apple|1")
    expect(seen.shape == (2,) and seen.dtype == bool and bool(seen.all()), f"an apple seen from near: {seen}")
    expect(not sees(THERE.eye, points, "Apple|1").any(), "an apple is seen through a wall")
    expect(not sees(APPLE_FROM, points, "Mug|1").any(), "a point on another object counts")
    expect(sees(APPLE_FROM, np.empty((0, 3)), "Apple|1").shape == (0,), "no points gave an answer")
    eye, lamp = Vec3(5.0, 1.2, 1.0), harness.state("FloorLamp|2").position
    beyond = np.array([[lamp.x, 1.2, lamp.z]])
    expect(bool(sees(eye, beyond, PANE).all()), "a pane does not stop a ray")
    expect(
        bool(sees(eye, beyond, PANE, through_glass=True).all()), "an object's own glass does not count as the object"
    )
    expect(not sees(eye, beyond, "FloorLamp|2").any(), "a ray that stops at glass went through")
    harness.stand(THERE.position.x, THERE.position.z, setup=holding("Apple|1"))
    expect(not sees(APPLE_FROM, points, "Apple|1").any(), "what is held is met by rays")


def may_show_what_it_shows(harness: Harness) -> None:
    """`may_be_visible(object, n)` is true if at least n pixels of the object are visible.

    It is false if n is larger than the frame's number of pixels. `is_in_frame` is true if at least one pixel of the
    object is visible. Both are false for held or absent objects.
    """
    absent = {"Statue|1": ObjectSetup(is_absent=True)}
    harness.face(5.2, 3.1, "Fridge|1", Setup(objects=absent, held="Mug|1"))
    may_be_visible, is_in_frame = harness.simulator.may_be_visible, harness.simulator.is_in_frame
    for object_id, state in harness.simulator.world(harness.simulator.object_ids()).objects.items():
        expect(
            may_be_visible(object_id, state.visible_px),
            f"{state.visible_px} px of {object_id} are seen, but may not be",
        )
        expect(
            not may_be_visible(object_id, 640 * 480 + 1), f"more of {object_id} may be seen than the frame has pixels"
        )
        expect(is_in_frame(object_id) or not state.visible_px, f"{object_id} is seen, but not in the frame")
    for object_id, what in (("Mug|1", "held"), ("Statue|1", "absent")):
        expect(not may_be_visible(object_id, 1), f"what is {what} may be seen")
        expect(not is_in_frame(object_id), f"what is {what} is in the frame")


def sees_what_it_looks_at(harness: Harness) -> None:
    """In a context that looks at some objects, `world` says the same of these; others may count as not visible."""
    harness.face(5.2, 3.1, "Fridge|1")
    names = harness.simulator.object_ids()
    usual = harness.simulator.world(names).objects
    with harness.simulator.looking_at(["Fridge|1"]):
        found = harness.simulator.world(names).objects
    expect(found["Fridge|1"] == usual["Fridge|1"], f"looked at: {found['Fridge|1']}, otherwise: {usual['Fridge|1']}")
    unseen = {"visible": False, "visible_px": 0, "open_px": 0, "toggle_px": 0, "nearest_visible_m": None}
    for object_id, state in found.items():
        known = (usual[object_id], usual[object_id].model_copy(update=unseen))
        expect(state in known, f"{object_id}, not looked at: {state}, otherwise: {known[0]}")
    expect(harness.simulator.world(names).objects == usual, "the context did not end")


def rolls_back(harness: Harness) -> None:
    """A rollback restores the world to the last bit, even if rollbacks are nested or an exception was raised."""
    harness.face(5.2, 3.1, "Fridge|1", holding("Mug|1"))
    before = _answers(harness)
    with harness.simulator.rollback():
        expect_refused(harness.click("open_access", "Fridge|1"), None)
        harness.go("turn_left", 100)
        middle = _answers(harness)
        expect(middle != before, "nothing changed inside the rollback")
        with harness.simulator.rollback():
            harness.go("forward", 2)
            expect_refused(harness.drop(), None)
            expect(harness.held is None, "a drop inside a rollback left the hand full")
        expect(_answers(harness) == middle, "an inner rollback did not restore the world")
    expect(_answers(harness) == before, "a rollback did not restore the world")
    try:
        with harness.simulator.rollback():
            harness.go("turn_right", 30)
            raise ZeroDivisionError
    except ZeroDivisionError:
        expect(_answers(harness) == before, "a rollback did not restore the world after an exception")
    else:
        raise AssertionError("a rollback suppressed an exception that was raised inside it")
    expect_refused(harness.click("open_access", "Fridge|1"), None)


def moves_the_agent_temporarily(harness: Harness) -> None:
    """At a temporary pose, the world is the same as after a reset at this pose with the same object in the hand.

    Afterwards the world is the same as before.
    """
    harness.stand(THERE.position.x, THERE.position.z, THERE.rotation, THERE.horizon, holding("Mug|1"))
    wanted = _answers(harness)
    harness.stand(HERE.x, HERE.z, EAST, setup=holding("Mug|1"))
    before = _answers(harness)
    with harness.simulator.at_pose(THERE):
        expect(
            harness.agent == THERE and harness.held == "Mug|1",
            f"the agent is at {harness.agent}, holding {harness.held}",
        )
        expect(_answers(harness) == wanted, "at a temporary pose the world is not as after a reset there")
        expect_refused(harness.click("open_access", DRAWER), None)
    expect(_answers(harness) == before, "the agent, or what it changed at a temporary pose, was not restored")
    with harness.simulator.at_pose(Pose(position=Vec3(1.8, 0.0, 2.2), rotation=0.0)):
        expect(harness.agent.position == Vec3(1.8, 0.0, 2.2), "a place in a table was refused")
    expect(_answers(harness) == before, "the agent was not moved back")


def refuses_unknown_ids(harness: Harness) -> None:
    """An id that the house does not have raises EpisodeError."""
    harness.stand(HERE.x, HERE.z)
    points = np.zeros((1, 3))
    expect_error(EpisodeError, lambda: harness.simulator.pixels_of("Aple|1"))
    expect_error(EpisodeError, lambda: harness.simulator.points_visible_from(HERE, points, "Aple|1"))


def needs_a_house(harness: Harness) -> None:
    """After `close`, every member raises SimulatorError until the next `load`."""
    simulator = harness.simulator
    simulator.close()
    try:
        for ask in (
            simulator.object_ids,
            simulator.scene,
            lambda: simulator.room_at(HERE),
            lambda: simulator.can_stand(HERE),
            lambda: simulator.pixels_of(DOOR),
            lambda: simulator.points_visible_from(HERE, np.zeros((1, 3)), DOOR),
            lambda: simulator.looking_at([DOOR]).__enter__(),
            lambda: simulator.rollback().__enter__(),
            lambda: simulator.at_pose(THERE).__enter__(),
        ):
            expect_error(SimulatorError, ask)
    finally:
        simulator.load(harness.house)
    harness.stand(HERE.x, HERE.z)
    expect(simulator.can_stand(HERE), "a simulator that was closed does not load again")


def _answers(harness: Harness) -> tuple[object, ...]:
    """Return the hidden state of everything in the world, and the answers to some privileged queries."""
    simulator = harness.simulator
    names = [each.name for each in fields(Thing) if each.name != "asset"]  # an asset is large and never changes
    return (
        simulator.world(simulator.object_ids()),
        [tuple(getattr(thing, name) for name in names) for thing in simulator.scene().things.values()],
        simulator.can_stand(HERE),
        simulator.can_stand(THERE.position),
        simulator.pixels_of("Fridge|1").tolist(),
        simulator.object_at(320, 240),
    )
