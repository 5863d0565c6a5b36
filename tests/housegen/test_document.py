import json

from vigil.protocol.house import House, canonical_json


def test_doors_cut_both_panels_of_their_wall(house):
    walls = {wall.id: wall for wall in house.document.walls}
    for door in house.document.doors:
        near, far = walls[door.wall0], walls[door.wall1]
        ends = {(point.x, point.z) for point in near.polygon}
        assert ends == {(point.x, point.z) for point in far.polygon}
        assert ("exterior" in far.id) == (door.room0 == door.room1)


def test_outer_walls_have_an_outside(house):
    inner = {wall.id.split("|", 2)[2] for wall in house.document.walls if "exterior" not in wall.id}
    outer = {wall.id.split("|", 2)[2] for wall in house.document.walls if "exterior" in wall.id}
    assert outer
    assert outer <= inner
    assert all(window.wall1 is not None and "exterior" in window.wall1 for window in house.document.windows)


def test_walls_go_from_floor_to_ceiling(house):
    heights = {point.y for wall in house.document.walls for point in wall.polygon}
    assert len(heights) == 2
    assert min(heights) == 0
    assert 2.5 <= max(heights) <= 3.0


def test_every_room_has_its_light(house):
    lights = {light.id for light in house.document.procedural_parameters.lights}
    assert lights == {"DirectionalLight", *(f"light_{room.id.split('|')[1]}" for room in house.document.rooms)}


def test_a_saved_house_is_the_same_house(house, tmp_path):
    house.save(tmp_path / "one.json")
    again = House.load(tmp_path / "one.json")
    assert again.sha256 == house.sha256
    assert canonical_json(json.loads(canonical_json(house.data))) == canonical_json(house.data)
