"""Sweeps, reachable places and obstacles that change."""

import math

import numpy as np
import pytest
import shapely

from vigil.assets.database import AssetDatabase
from vigil.base.geometry import Vec3
from vigil.scene.build import build_scene
from vigil.scene.outlines import thing_shapes, wall_prisms
from vigil.sim.conformance.reference_house import DOOR, reference_house
from vigil.sim.core.motion import EXTERIOR, CollisionMap


@pytest.fixture
def scene():
    return build_scene(reference_house(), AssetDatabase.default())


@pytest.fixture
def plan(scene):
    return CollisionMap(scene)


def at(x: float, z: float) -> Vec3:
    return Vec3(x, 0.0, z)


def test_panels_leave_their_holes_free(scene):
    panel = next(panel for panel in scene.panels if panel.id == "wall|2|w")
    left = {
        (round(float(prism.polygon[0][1]), 3), round(float(prism.polygon[1][1]), 3), prism.bottom, prism.top)
        for prism in wall_prisms(panel)
    }
    assert left == {
        (0.0, 0.5, 0.0, 2.5),
        (0.5, 1.5, 0.0, 0.9),
        (0.5, 1.5, 2.0, 2.5),
        (1.5, 2.0, 0.0, 2.5),
        (2.0, 3.0, 2.1, 2.5),
        (3.0, 5.0, 0.0, 2.5),
    }


def test_long_sweeps_do_not_tunnel(plan):
    assert plan.blocker(at(3.5, 2.2), at(0.5, 2.2)) == "DiningTable|1"
    assert plan.blocker(at(5.0, 4.0), at(9.0, 4.0)) is not None


def test_the_nearest_blocker_is_named(plan):
    assert plan.blocker(at(4.0, 2.5), at(9.5, 2.5)) == DOOR


def test_exact_contact_is_free(plan):
    assert plan.can_stand(at(3.5, 4.0 - 1e-9))
    assert not plan.can_stand(at(0.199, 2.5))
    assert plan.can_stand(at(0.2, 2.5))


def test_leaving_the_house_is_blocked_even_without_walls(scene):
    scene.panels.clear()
    scene.things.clear()
    plan = CollisionMap(scene)
    assert plan.blocker(at(5.0, 2.0), at(5.0, 5.3)) == EXTERIOR
    assert plan.blocker(at(5.0, 2.0), at(7.0, 2.0)) is None


def test_refreshing_sees_what_moved_and_what_is_held(scene, plan):
    box = scene.things["Box|1"]
    assert plan.blocker(at(4.5, 2.0), at(4.5, 3.0)) is None
    box.position = Vec3(4.5, 0.152, 2.5)
    plan.refresh({"Box|1"})
    assert plan.blocker(at(4.5, 2.0), at(4.5, 3.0)) == "Box|1"
    box.is_held = True
    plan.refresh({"Box|1"})
    assert plan.blocker(at(4.5, 2.0), at(4.5, 3.0)) is None


def test_touching_blocks_going_deeper_only(plan):
    touching = at(2.62, 2.2)  # 0.1 m from the table
    assert not plan.can_stand(touching)
    assert plan.blocker(touching, at(3.0, 2.2)) is None
    assert plan.blocker(touching, at(2.62, 2.4)) is None
    assert plan.blocker(touching, at(2.6, 2.2)) == "DiningTable|1"


def test_reachable_places_are_free_and_joined_through_open_doors_only(scene, plan):
    closed = plan.reachable(at(3.5, 2.5))
    assert closed[:, 0].max() < 6.0
    assert all(plan.can_stand(at(x, z)) for x, z in closed)
    assert [3.5, 2.5] in closed.tolist()
    scene.things[DOOR].openness = 1.0
    plan.refresh({DOOR})
    opened = plan.reachable(at(3.5, 2.5))
    assert opened[:, 0].max() > 8.0
    assert len(opened) > len(closed)


def test_reachable_starts_where_the_body_touches_something(plan):
    places = plan.reachable(at(2.62, 2.2))
    assert len(places) > 50


def test_a_start_outside_reaches_nothing_and_one_without_neighbours_itself(plan):
    assert plan.reachable(at(-50.0, 2.5)).shape == (0, 2)
    assert plan.reachable(at(2.62, 2.2), step_m=20.0).tolist() == [[2.62, 2.2]]


def test_steps_between_reachable_neighbours_are_free_but_past_a_corner(plan):
    """Both ends of a step may be free while its middle is not: only at the bin's corner in the trial house."""
    places = plan.reachable(at(3.5, 2.5)).tolist()
    steps = [((x, z), (x + dx, z + dz)) for x, z in places for dx, dz in ((0.25, 0.0), (0.0, 0.25))]
    joined = [step for step in steps if list(step[1]) in places]
    assert len(joined) > len(places)
    blockers = {step: plan.blocker(at(*step[0]), at(*step[1])) for step in joined}
    assert {step: name for step, name in blockers.items() if name} == {((0.25, 4.25), (0.5, 4.25)): "GarbageCan|1"}
    assert all(
        (plan.blocker(at(*start), at(*end)) is None) is (name is None) for (start, end), name in blockers.items()
    )


def test_free_space_agrees_with_distances(scene, plan):
    shapes = [shape for thing in scene.things.values() for shape in thing_shapes(thing)]
    rng = np.random.default_rng(7)
    for x, z in rng.uniform((0.3, 0.3), (5.7, 4.7), size=(200, 2)):
        gap = min(shape.distance(shapely.Point(x, z)) for shape in shapes)
        walls = min(x, z, 5.0 - z, 6.0 - x)
        if not math.isclose(gap, 0.2, abs_tol=1e-6) and walls > 0.2:
            assert plan.can_stand(at(x, z)) == (gap > 0.2)
