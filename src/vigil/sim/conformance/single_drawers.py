"""Conformance checks of furniture whose drawers open one by one."""

from vigil.base.geometry import Vec3
from vigil.errors import EpisodeError
from vigil.protocol.world import ObjectSetup, Placement, Setup
from vigil.sim.conformance.harness import Harness, expect, expect_near, expect_refused, opened, placed
from vigil.sim.conformance.reference_house import DRAWER, DRESSER, LOWEST, SIBLING, WATCH

FRONT = (8.0, 1.5)
"""Place (x, z) of the agent in front of the dresser."""
MOVED_M = 0.3
"""Distance (m) by which the dresser is moved."""


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
    holding = Setup(held="Pen|1")
    harness.face(*FRONT, DRAWER, holding)
    expect_refused(harness.click("place", DRAWER), "receptacle_closed")
    harness.face(*FRONT, WATCH, holding.model_copy(update={"objects": opened(DRAWER).objects}))
    expect_refused(harness.click("place", SIBLING), "receptacle_closed")
    watch = harness.state(WATCH).position
    expect_refused(harness.click_at("place", Vec3(watch.x + 0.08, watch.y, watch.z)), None)
    pen = harness.simulator.world(["Pen|1", DRAWER, DRESSER]).objects["Pen|1"]
    expect(pen.parent == DRAWER and pen.support_chain == (DRAWER, DRESSER), f"a pen in a drawer: {pen}")
    expect(pen.inside == (DRAWER, DRESSER) and pen.over_inside == (DRAWER,), f"a pen in a drawer: {pen}")
    expect(pen.not_on == (DRAWER, DRESSER), f"a pen in a drawer lies on it: {pen}")
    expect_refused(harness.click("pick", WATCH), None)
    top = Vec3(8.0, 0.8438, 0.3)
    harness.look_at(*FRONT, top, holding)
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
    whole, parts = (
        harness.state(DRESSER).visible_px,
        harness.state(DRAWER).visible_px + harness.state(SIBLING).visible_px,
    )
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
    try:
        harness.stand(7.0, 2.5, setup=Setup(objects={DRAWER: ObjectSetup(placement=elsewhere)}))
    except EpisodeError:
        return
    finally:
        harness.simulator.load(harness.house)
    raise AssertionError("a drawer was placed without its dresser")
