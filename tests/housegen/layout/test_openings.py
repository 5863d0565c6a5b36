import pytest

from vigil.assets.database import AssetDatabase
from vigil.assets.making import make
from vigil.base.geometry import Vec3
from vigil.housegen.base.randomness import generator
from vigil.housegen.base.spec import spec_for
from vigil.housegen.generate import generate
from vigil.housegen.layout.floorplan import RoomLayout, plan_rooms
from vigil.housegen.layout.openings import DOOR_HEIGHT, DOOR_VARIANTS, PlannedOpening, cut_openings
from vigil.housegen.layout.walls import room_edges, wall_pieces
from vigil.scene.build import build_scene
from vigil.scene.geometry import moving_prisms_of
from vigil.scene.outlines import floor_of, polygon_of
from vigil.scene.walls import DOOR_DEPTH_M


def planned(rooms: int, seed: int) -> tuple[RoomLayout, list[PlannedOpening]]:
    plan = plan_rooms(spec_for(str(rooms)), generator("openings", rooms, seed))
    openings = cut_openings(plan, generator("cut", rooms, seed))
    assert openings is not None
    return plan, openings


@pytest.mark.parametrize("rooms", [1, 2, 4, 8])
def test_wall_pieces_cover_the_edges_and_pair_up(rooms):
    plan, _ = planned(rooms, 1)
    pieces = wall_pieces(plan)
    for room in plan.rooms:
        length = sum(piece.length for piece in pieces if piece.room == room.number)
        assert length == pytest.approx(sum(edge.length for edge in room_edges(room)), abs=0.01)
    inner = {(piece.start, piece.end, piece.room, piece.behind) for piece in pieces if piece.behind is not None}
    assert all((end, start, behind, room) in inner for start, end, room, behind in inner)


@pytest.mark.parametrize("seed", range(6))
def test_every_link_has_a_door_and_the_house_a_front_door(seed):
    plan, openings = planned(4, seed)
    ids = {opening.id for opening in openings}
    assert {f"door|{a}|{b}" for a, b in plan.links} <= ids
    front = [opening for opening in openings if opening.id.startswith("door|1|")]
    assert len(front) <= 1
    assert all(door.openable is False and door.other is None for door in front)


@pytest.mark.parametrize("seed", range(6))
def test_holes_lie_in_their_walls_apart_from_each_other(seed):
    plan, openings = planned(4, seed)
    spans: dict[tuple, list[tuple[float, float]]] = {}
    for opening in openings:
        assert 0.0 <= opening.left < opening.right <= opening.wall.length
        assert 0.0 <= opening.bottom < opening.top < plan.height_m
        here = spans.setdefault((opening.wall.start, opening.wall.end), [])
        assert all(opening.right <= left or opening.left >= right for left, right in here)
        here.append((opening.left, opening.right))


def test_windows_are_in_outer_walls_only():
    for seed in range(6):
        _, openings = planned(4, seed)
        assert all(opening.wall.behind is None for opening in openings if not opening.is_door)


def test_leaves_and_open_frames_both_occur_with_both_states():
    doors = [opening for seed in range(20) for opening in planned(4, seed)[1] if opening.other is not None]
    leaves = [door for door in doors if door.category == "Doorway"]
    assert {door.openness for door in leaves} == {0.0, 1.0}
    assert any(door.category == "Doorframe" for door in doors)


def test_a_hole_is_the_same_place_seen_from_both_rooms():
    _, openings = planned(2, 3)
    door = next(opening for opening in openings if opening.other is not None)
    assert door.other is not None
    near, far = door.span_in(door.wall.room), door.span_in(door.other.room)
    assert near is not None
    assert far is not None
    assert near[0].at(near[1]) == pytest.approx(far[0].at(far[2]), abs=1e-6)


@pytest.mark.parametrize("seed", [0, 1])
def test_leaves_swing_into_the_first_room_that_their_door_names(seed):
    house = generate(seed, spec_for("4"))
    floors = {room.id: floor_of(room) for room in house.document.rooms}
    things = build_scene(house, AssetDatabase.default()).things
    swung = [
        (door, leaf)
        for door in house.document.doors
        if door.openable
        for leaf in moving_prisms_of(things[door.id], 1.0)
    ]
    assert swung
    for door, leaf in swung:
        assert floors[door.room0].contains(polygon_of(leaf).centroid)


@pytest.mark.parametrize("width", [0.9, 1.0, 1.04])
def test_the_number_of_a_door_says_on_which_side_its_leaf_hangs(width):
    """+x is on the left, seen from the room that the door looks into (docs/houses.md)."""
    size = Vec3(width, DOOR_HEIGHT, DOOR_DEPTH_M)
    joints = [make("Doorway", size, number).joints[0] for number in range(DOOR_VARIANTS)]
    assert {number for number, joint in enumerate(joints) if joint.origin.x > 0} == {1, 4, 7, 9, 11}
    assert all(abs(joint.travel) == 90.0 for joint in joints)
