"""Conformance checks of movement: walking, blocking, doors, turning and pitch."""

from vigil.base.geometry import Vec3
from vigil.sim.conformance.harness import Harness, expect, expect_near, expect_refused, opened, placed
from vigil.sim.conformance.reference_house import DOOR, EAST, NORTH, SOUTH


def walks_whole_steps_then_the_fraction(harness: Harness) -> None:
    """A walk of n steps is n moves of 0.25 m, followed by a shorter move for the fraction of a step.

    Walking backward does not change the yaw.
    """
    harness.stand(3.5, 1.5, NORTH)
    effect = harness.go("forward", 3.5)
    expect_near(effect.moved_m, 0.875, 1e-9, "moved")
    expect_near(harness.agent.position.z, 2.375, 1e-9, "z after walking")
    expect(not effect.path_blocked and effect.refusal is None, f"a free walk was blocked: {effect}")
    harness.go("backward", 2)
    expect_near(harness.agent.position.z, 1.875, 1e-9, "z after walking back")
    expect_near(harness.agent.rotation, NORTH, 1e-9, "yaw")


def stops_at_a_wall(harness: Harness) -> None:
    """A walk ends at the first blocked step; earlier steps count.

    The body's axis never gets nearer than 0.2 m to a wall.
    """
    harness.stand(3.5, 3.5, SOUTH)
    harness.go("turn_left", 90)
    effect = harness.go("forward", 20)
    expect(effect.path_blocked and effect.blocked_by is not None, f"a wall did not block: {effect}")
    expect_near(effect.moved_m, 2.25, 1e-9, "moved before the wall (whole sweeps alone)")
    expect_near(harness.agent.position.x, 5.75, 1e-9, "x at the wall")
    again = harness.go("forward", 1)
    expect(again.path_blocked and again.moved_m == 0.0, f"walked into the wall: {again}")
    fraction = harness.go("forward", 0.1)
    expect(not fraction.path_blocked, f"a sweep of 2.5 cm fits: {fraction}")


def caps_long_actions(harness: Harness) -> None:
    """An action of more than 40 steps or 360 degrees is cut to this limit and recorded as capped."""
    harness.stand(3.5, 2.5, EAST)
    effect = harness.go("turn_right", 725)
    expect(effect.capped, "a turn of 725 degrees was not recorded as capped")
    expect_near(effect.turned_deg, 360, 1e-9, "turned")
    expect_near(harness.agent.rotation, EAST, 1e-6, "yaw after a full turn")
    expect(harness.go("forward", 41).capped, "41 steps were not recorded as capped")
    expect(not harness.go("backward", 40).capped, "40 steps were recorded as capped")
    expect(harness.pitch(400).capped, "a pitch of 400 degrees was not recorded as capped")
    expect(not harness.pitch(-90).capped, "a pitch of 90 degrees was recorded as capped")


def turns_by_any_angle(harness: Harness) -> None:
    """A turn to the left is anticlockwise as seen from above; the yaw stays in [0, 360)."""
    harness.stand(3.5, 2.5, 10.0)
    harness.go("turn_left", 22.5)
    expect_near(harness.agent.rotation, 347.5, 1e-9, "yaw after turning left")
    harness.go("turn_right", 102.5)
    expect_near(harness.agent.rotation, EAST, 1e-9, "yaw after turning right")
    harness.go("forward", 1)
    expect_near(harness.agent.position.x, 3.75, 1e-9, "x after a step east")


def clamps_the_pitch(harness: Harness) -> None:
    """The pitch is between 30 degrees up and 60 degrees down."""
    harness.stand(3.5, 2.5, horizon=30)
    expect_near(harness.pitch(45).pitched_deg, 30, 1e-9, "pitched down")
    expect_near(harness.agent.horizon, 60, 1e-9, "horizon, looking down")
    harness.pitch(-200)
    expect_near(harness.agent.horizon, -30, 1e-9, "horizon, looking up")


def doors_stop_and_let_through(harness: Harness) -> None:
    """A closed door blocks the body, and its id is reported; an open door lets the body through."""
    harness.stand(5.0, 2.5, EAST)
    effect = harness.go("forward", 8)
    expect(effect.path_blocked and effect.blocked_by == DOOR, f"a closed door did not block: {effect}")
    harness.stand(5.0, 2.5, EAST, setup=opened(DOOR))
    effect = harness.go("forward", 8)
    expect(not effect.path_blocked, f"an open door blocked: {effect}")
    expect_near(harness.agent.position.x, 7.0, 1e-9, "x in the other room")


def open_leaves_are_obstacles(harness: Harness) -> None:
    """A fridge's open door stops the body at a place where the body could pass while the fridge was closed."""
    harness.stand(4.2, 3.8, EAST)
    expect(not harness.go("forward", 6).path_blocked, "the way past the closed fridge is blocked")
    harness.stand(4.2, 3.8, EAST, setup=opened("Fridge|1"))
    effect = harness.go("forward", 6)
    expect(effect.path_blocked and effect.blocked_by == "Fridge|1", f"an open leaf did not block: {effect}")


def things_block_by_their_parts(harness: Harness) -> None:
    """Rugs and ceiling lamps do not block the body; a table and a box on the floor do."""
    harness.stand(4.2, 0.6, NORTH)
    expect(not harness.go("forward", 6).path_blocked, "a rug blocked")
    harness.stand(3.5, 1.5, NORTH)
    expect(not harness.go("forward", 6).path_blocked, "a ceiling lamp blocked")
    harness.stand(3.5, 2.2, 270.0)
    expect(harness.go("forward", 10).blocked_by == "DiningTable|1", "the table did not block")
    harness.stand(4.2, 0.6, NORTH, setup=placed("Box|1", 4.2, 0.152, 1.8))
    expect(harness.go("forward", 6).blocked_by == "Box|1", "a box in the way did not block")


def knows_where_the_body_fits(harness: Harness) -> None:
    """`can_stand` is true on free floor, and in a doorway once its door is open."""
    harness.stand(3.5, 2.5)
    sees = harness.simulator
    expect(sees.can_stand(Vec3(3.5, 0.0, 2.5)), "free floor was refused")
    for place in (Vec3(1.8, 0.0, 2.2), Vec3(0.1, 0.0, 2.5), Vec3(-1.0, 0.0, 2.5), Vec3(6.0, 0.0, 2.5)):
        expect(not sees.can_stand(place), f"{place} is in a thing, a wall, outside or in a closed door")
    harness.stand(3.5, 2.5, setup=opened(DOOR))
    expect(sees.can_stand(Vec3(6.0, 0.0, 2.5)), "an open doorway was refused")


def touching_is_no_trap(harness: Harness) -> None:
    """A body that starts nearer to an obstacle than its radius can walk away from the obstacle, but not towards it."""
    harness.stand(2.62, 2.2, EAST)
    expect(harness.go("backward", 1).path_blocked, "walked into the table")
    effect = harness.go("forward", 1)
    expect(not effect.path_blocked, f"stuck at the table: {effect}")
    expect_refused(effect, None)
