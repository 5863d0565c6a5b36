"""Conformance checks of what is visible (pixels, glass, clicks, frames), of exact resets and replays, and of setups."""

from functools import partial

import numpy as np

from vigil.base.geometry import Vec3, distance
from vigil.errors import EpisodeError
from vigil.protocol.world import ObjectSetup, Setup, WorldState
from vigil.sim.conformance.harness import (
    NOTHING,
    Harness,
    expect,
    expect_error,
    expect_near,
    expect_refused,
    holding,
    opened,
    placed,
)
from vigil.sim.conformance.reference_house import DOOR, DRAWER, EAST, PANE, WEST


def counts_visible_pixels(harness: Harness) -> None:
    """An object has more visible pixels if the agent is near it than if the agent is far away.

    An object behind a wall and an absent object have no visible pixels.
    """
    harness.face(1.4, 3.2, "Apple|1")
    near = harness.state("Apple|1")
    harness.face(4.6, 2.4, "Apple|1")
    far = harness.state("Apple|1")
    expect(near.visible, f"an apple at {near.nearest_visible_m} m is not visible")
    expect(near.visible_px > 4 * far.visible_px > 0, f"{near.visible_px} px near, {far.visible_px} px far")
    expect(near.nearest_visible_m is not None, "a seen apple has no distance")
    centre_m = distance(Vec3(1.4, 1.576, 3.2), near.position)
    expect_near(near.nearest_visible_m or 0.0, centre_m - 0.04, 0.03, "camera to the apple's nearest point")
    harness.stand(8.0, 2.5, WEST)
    expect(harness.state("Apple|1").visible_px == 0, "an apple is seen through a wall")
    harness.face(1.4, 3.2, "Apple|1", Setup(objects={"Apple|1": ObjectSetup(is_absent=True)}))
    gone = harness.state("Apple|1")
    expect(gone.visible_px == 0 and not gone.visible and gone.nearest_visible_m is None, f"an absent apple: {gone}")
    expect("Apple|1" not in harness.simulator.object_ids(), "an absent apple is listed")


def counts_what_hides_a_thing(harness: Harness) -> None:
    """A box in front of an apple hides more than half of the apple's pixels."""
    free = placed("Apple|1", 3.5, 0.045, 3.2)
    harness.stand(3.5, 1.4, 0.0, 30.0, free)
    whole = harness.state("Apple|1").visible_px
    hidden = Setup(objects={**free.objects, **placed("Box|1", 3.5, 0.152, 2.9).objects})
    harness.stand(3.5, 1.4, 0.0, 30.0, hidden)
    expect(harness.state("Apple|1").visible_px < whole / 2, "a box before an apple hides nothing")


def counts_state_pixels(harness: Harness) -> None:
    """The pixels counted for a state are those of parts that show the state; a table has no such parts."""
    harness.face(5.2, 3.1, "Fridge|1")
    fridge = harness.state("Fridge|1")
    expect(0 < fridge.open_px <= fridge.visible_px, f"a fridge's pixels: {fridge.open_px} of {fridge.visible_px}")
    harness.face(3.6, 2.4, "DiningTable|1")
    table = harness.state("DiningTable|1")
    expect(table.open_px == table.toggle_px == 0, "a table has state pixels")
    harness.face(1.6, 1.2, "FloorLamp|1")
    expect(harness.state("FloorLamp|1").toggle_px > 0, "a lamp has no state pixels")


def sees_through_glass_but_clicks_it(harness: Harness) -> None:
    """A lamp behind the inner window is visible, but a click on the lamp hits the window."""
    harness.look_at(5.0, 1.0, Vec3(6.9, 1.2, 1.0))
    expect(harness.state("FloorLamp|2").visible_px > 100, "a lamp is not seen through a window")
    effect = harness.click_at("ground", Vec3(6.9, 1.2, 1.0))
    expect(effect.hit == PANE, f"a click on a pane hit {effect.hit}")


def clicks_agree_with_pixels(harness: Harness) -> None:
    """A click on any pixel of an object hits the object; a click on structure such as a wall hits nothing (None)."""
    harness.face(3.4, 3.2, "Microwave|1")
    for object_id in ("Microwave|1", "Plate|1", "CounterTop|1"):
        pixels = harness.simulator.pixels_of(object_id)
        expect(len(pixels) > 0, f"{object_id} has no pixel")
        for x, y in pixels[:: max(1, len(pixels) // 7)]:
            found = harness.simulator.object_at(int(x), int(y))
            expect(found == object_id, f"pixel {x}, {y} of {object_id} is {found}'s")
    harness.stand(3.5, 1.5, EAST, 60.0)
    expect(harness.simulator.object_at(320, 470) in (None, "Rug|1"), "the floor has an id")


def says_where_things_are(harness: Harness) -> None:
    """The world state gives the true distances, boxes, openness and switch states of things."""
    harness.stand(3.5, 2.5, WEST)
    world = harness.simulator.world(["DiningTable|1", "Fridge|1", "FloorLamp|1"])
    table, fridge, lamp = (world.objects[object_id] for object_id in ("DiningTable|1", "Fridge|1", "FloorLamp|1"))
    expect_near(table.box_distance_m, 3.5 - 1.8 - 1.4437 / 2, 0.01, "floor distance to the table's box")
    expect_near(table.center_distance_m, distance(Vec3(3.5, 0.0, 2.5), table.position), 1e-9, "centre distance")
    expect(table.openness is None and fridge.openness == 0.0, "openness")
    expect(lamp.is_toggled is False and table.is_toggled is None, "is_toggled")
    harness.stand(3.5, 2.5, WEST, setup=opened("Fridge|1"))
    expect(harness.state("Fridge|1").box == fridge.box, "an open leaf changed the body's box")


def draws_frames(harness: Harness) -> None:
    """A frame is (480, 640, 3) uint8. Another view gives another frame, and the same view gives the same frame."""
    harness.stand(3.5, 2.5, WEST)
    first = harness.simulator.frame()
    expect(first.shape == (480, 640, 3) and first.dtype == np.uint8, f"frame: {first.shape}, {first.dtype}")
    expect(bool((harness.simulator.frame() == first).all()), "the same view gave another frame")
    harness.go("turn_right", 90)
    expect(bool((harness.simulator.frame() != first).any()), "a turn changed nothing in the frame")
    harness.stand(3.5, 2.5, WEST, setup=holding("Apple|1"))
    held = harness.simulator.frame()
    expect(bool((held[300:, 200:440] != first[300:, 200:440]).any()), "a held apple is not drawn")


def _several_actions(harness: Harness) -> list[WorldState]:
    """Carry out actions of all kinds; return the states of the world during and after them."""
    worlds: list[WorldState] = []
    ids = harness.simulator.object_ids()
    harness.face(5.2, 3.1, "Fridge|1")
    harness.click("open_access", "Fridge|1")
    harness.click("pick", "Lettuce|1")
    worlds.append(harness.simulator.world(ids))
    harness.go("turn_left", 100)
    harness.go("forward", 3)
    harness.drop()
    worlds.append(harness.simulator.world(ids))
    harness.face(8.0, 1.5, DRAWER)
    harness.click("open_access", DRAWER)
    harness.click("activate", "DeskLamp|1")
    worlds.append(harness.simulator.world(ids))
    return worlds


def resets_exactly(harness: Harness) -> None:
    """Whatever was done before, a reset gives exactly the same world."""
    ids = harness.simulator.object_ids()
    harness.stand(3.5, 2.5, WEST)
    first = harness.simulator.world(ids)
    _several_actions(harness)
    harness.stand(3.5, 2.5, WEST)
    expect(harness.simulator.world(ids) == first, "a reset did not restore the house")


def repeats_itself(harness: Harness) -> None:
    """The same actions give the same worlds to the last bit."""
    first = [world.model_dump_json() for world in _several_actions(harness)]
    harness.simulator.load(harness.house)
    again = [world.model_dump_json() for world in _several_actions(harness)]
    expect(first == again, "the same actions gave other worlds")


def applies_setups(harness: Harness) -> None:
    """After a reset with a setup, openness, switches, positions, absent objects and the hand are as the setup says."""
    setup = Setup(
        objects={
            DOOR: ObjectSetup(openness=0.8),
            "FloorLamp|1": ObjectSetup(is_toggled=True),
            "Statue|1": ObjectSetup(is_absent=True),
            **placed("Bowl|1", 3.5, 0.04, 3.5).objects,
        },
        held="Mug|1",
    )
    harness.stand(3.5, 2.5, WEST, setup=setup)
    expect_near(harness.state(DOOR).openness or 0.0, 0.8, 1e-9, "openness of the door")
    expect(harness.state("FloorLamp|1").is_toggled is True, "the lamp is off")
    expect(harness.held == "Mug|1" and harness.state("Mug|1").is_held, "the mug is not held")
    expect_near(harness.state("Egg|1").position.z, 3.5, 0.05, "z of the egg, moved with its bowl")
    expect("Statue|1" not in harness.simulator.object_ids(), "the statue is there")
    expect_refused(harness.drop(), None)


def refuses_impossible_setups(harness: Harness) -> None:
    """A setup that the house does not allow raises an error that says what to do."""
    faults = {
        "Did you mean 'Apple|1'?": Setup(objects={"Apple|2": ObjectSetup(is_toggled=True)}),
        "cannot be switched": Setup(objects={"Apple|1": ObjectSetup(is_toggled=True)}),
        "no part that opens": Setup(objects={"Apple|1": ObjectSetup(openness=1.0)}),
        "cannot be held": holding("DiningTable|1"),
    }
    for words, setup in faults.items():
        expect_error(EpisodeError, partial(harness.stand, 3.5, 2.5, setup=setup), words)
    harness.stand(3.5, 2.5, setup=NOTHING)
    expect_error(EpisodeError, lambda: harness.simulator.world(["Aple|1"]), "Did you mean 'Apple|1'?")
