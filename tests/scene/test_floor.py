"""Shortest walks in the floor plane."""

import math

import pytest
import shapely
from shapely.geometry.base import BaseGeometry

from vigil.assets.database import AssetDatabase
from vigil.base.geometry import Vec3
from vigil.packs.pack import Pack
from vigil.scene.build import build_scene
from vigil.scene.floor import ARC_SEGMENTS, MARGIN_M, PATH_CACHE_SIZE, FreeSpace, ShortestPaths, WalkableMap
from vigil.scene.outlines import BODY_RADIUS_M, floor_of_rooms, thing_shapes, wall_shapes

ROOM = shapely.box(0, 0, 6, 4)
WALL = shapely.box(2.9, 0, 3.1, 3)


def free(obstacle: BaseGeometry, radius: float = 0.25) -> BaseGeometry:
    return ROOM.buffer(-radius).difference(obstacle.buffer(radius))


def cell_at(plan: WalkableMap, x: float, z: float) -> int:
    return int(((plan.cells[:, 0] - x) ** 2 + (plan.cells[:, 1] - z) ** 2).argmin())


def test_straight_walk_is_one_stretch() -> None:
    plan = WalkableMap(ROOM.buffer(-0.25))
    cell = cell_at(plan, 5, 3)
    corners = plan.walks_from((1.0, 1.0)).corners_to(cell)
    assert corners == [tuple(plan.cells[cell])]


def test_walk_goes_round_a_wall_and_stays_free() -> None:
    region = free(WALL)
    plan = WalkableMap(region)
    walks = plan.walks_from((1.0, 1.0))
    cell = cell_at(plan, 5, 1)
    corners = walks.corners_to(cell)
    assert corners is not None
    assert 2 <= len(corners) <= 5
    line = shapely.LineString([(1.0, 1.0), *corners])
    assert region.buffer(1e-9).covers(line)
    shortest = 2 * math.dist((1, 1), (2.65, 3.1)) + 0.7
    assert line.length < 1.1 * shortest
    assert walks.lengths[cell] >= line.length - 1e-6


def test_no_way_through_a_closed_wall() -> None:
    plan = WalkableMap(free(shapely.box(2.9, 0, 3.1, 4)))
    walks = plan.walks_from((1.0, 1.0))
    cell = cell_at(plan, 5, 1)
    assert math.isinf(walks.lengths[cell])
    assert walks.corners_to(cell) is None
    assert walks.corners_to(cell_at(plan, 1, 3)) is not None


def test_start_inside_the_margin_is_left_first() -> None:
    plan = WalkableMap(ROOM.buffer(-0.25), ROOM.buffer(-0.2))
    walks = plan.walks_from((0.21, 2.0))
    assert walks.corners_to(cell_at(plan, 5, 2)) is not None
    assert plan.can_stand((0.21, 2.0))
    assert not plan.can_stand((0.1, 2.0))


def test_start_outside_everything_goes_nowhere() -> None:
    plan = WalkableMap(ROOM.buffer(-0.25))
    assert all(math.isinf(length) for length in plan.walks_from((-3.0, 0.0)).lengths)


def test_empty_region() -> None:
    plan = WalkableMap(shapely.Polygon())
    assert len(plan.cells) == 0
    assert plan.entry((0.0, 0.0)) is None


@pytest.mark.parametrize("diagonal", [1, -1])
def test_walk_cuts_no_corner(diagonal: int) -> None:
    block = shapely.box(0, 0, 3, 2) if diagonal > 0 else shapely.box(3, 0, 6, 2)
    region = free(block)
    plan = WalkableMap(region, cell_m=0.1)
    start = (1.0, 3.0) if diagonal > 0 else (5.0, 3.0)
    corners = plan.walks_from(start).corners_to(cell_at(plan, 5 if diagonal > 0 else 1, 0.5))
    assert corners is not None
    assert region.buffer(1e-9).covers(shapely.LineString([start, *corners]))


def test_walks_are_kept_from_a_few_places_each_its_own() -> None:
    plan = WalkableMap(free(WALL))
    starts = [(0.5 + 0.25 * number, 1.0) for number in range(PATH_CACHE_SIZE + 2)]
    for start in starts:
        walks = plan.walks_from(start)
        assert walks is plan.walks_from(start)
        assert walks.start == start
        assert (walks.lengths == ShortestPaths(plan, start).lengths).all()
    assert len(plan._walks) == PATH_CACHE_SIZE


def test_things_that_lie_within_what_they_rest_on_do_not_change_the_free_floor() -> None:
    pack = Pack.load("vigil_smoke_v6")
    scene = build_scene(pack.house_of(pack.episodes[0]), AssetDatabase.from_file(None))
    space = FreeSpace(scene)
    before = space.plan()
    shapes = [
        shapely.unary_union(thing_shapes(thing)).buffer(BODY_RADIUS_M + MARGIN_M, quad_segs=ARC_SEGMENTS)
        for thing in scene.things.values()
        if thing.is_present and not thing.is_held
    ]
    walls = shapely.unary_union([shape for panel in scene.panels for shape in wall_shapes(panel)])
    taken = shapely.unary_union([walls.buffer(BODY_RADIUS_M + MARGIN_M, quad_segs=ARC_SEGMENTS), *shapes])
    expected = floor_of_rooms(scene.rooms).difference(taken)
    assert before.roomy.symmetric_difference(expected).area < 1e-9
    small = next(
        thing
        for thing in scene.things.values()
        if thing.is_pickupable and thing.parent is not None and not scene.things[thing.parent].is_pickupable
    )
    x, y, z = small.position
    small.position = Vec3(x + 0.001, y, z)
    assert space.plan() is before
    chair = next(thing for thing in scene.things.values() if thing.category in ("Chair", "DiningTable", "Sofa", "Bed"))
    x, y, z = chair.position
    chair.position = Vec3(x + 0.1, y, z)
    assert space.plan() is not before


def test_a_thing_in_a_gap_of_what_it_rests_on_takes_floor(monkeypatch: pytest.MonkeyPatch) -> None:
    pack = Pack.load("vigil_smoke_v6")
    scene = build_scene(pack.house_of(pack.episodes[0]), AssetDatabase.from_file(None))
    table = next(thing for thing in scene.things.values() if thing.is_receptacle and not thing.is_pickupable)
    vase = next(thing for thing in scene.things.values() if thing.is_pickupable)
    vase.parent = table.id
    middle = floor_of_rooms(scene.rooms).representative_point()
    gap = shapely.box(middle.x - 0.05, middle.y - 0.5, middle.x + 0.05, middle.y + 0.5)
    shapes = {table.id: [gap.buffer(0.3).difference(gap)], vase.id: [gap]}
    monkeypatch.setattr("vigil.scene.floor.thing_shapes", lambda thing: shapes.get(thing.id, []))
    space = FreeSpace(scene)
    assert space.bare().intersection(gap).area == 0.0
    vase.is_present = False
    assert space.bare().intersection(gap).area > 0.0
    vase.is_present, table.is_present = True, False
    assert space.bare().intersection(gap).area == 0.0
