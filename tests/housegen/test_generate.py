import subprocess
import sys
from collections import Counter

from shapely import Point, Polygon

from vigil.assets.catalog import CATALOG
from vigil.assets.database import AssetDatabase
from vigil.assets.drawers import split_drawer_id
from vigil.housegen.base.spec import spec_for
from vigil.housegen.checking.check import check_house
from vigil.housegen.furnishing.inventory import limit_of
from vigil.housegen.generate import generate
from vigil.protocol.house import House

AGAIN = """
from vigil.housegen.base.spec import spec_for
from vigil.housegen.generate import generate
print(generate(1, spec_for("2")).sha256)
"""


def categories(house: House) -> list[str]:
    """Return the category of every object except drawers."""
    return [node.id.split("|")[0] for node, _ in house.objects() if split_drawer_id(node.asset_id) is None]


def test_no_faults(house):
    assert check_house(house, AssetDatabase.default()) == []


def test_rooms_have_what_makes_them(house):
    present = set(categories(house))
    needs = {
        "Kitchen": {"Fridge", "CounterTop", "Stove", "Sink"},
        "LivingRoom": {"Sofa", "Television"},
        "Bedroom": {"Bed"},
        "Bathroom": {"Toilet", "Sink"},
    }
    for room in house.document.rooms:
        assert needs[room.room_type] <= present


def test_few_things_come_twice(house):
    counts = Counter(categories(house))
    assert all(number <= limit_of(category) for category, number in counts.items())


def test_ids_name_category_and_room(house):
    rooms = {room.id for room in house.document.rooms}
    for node, _ in house.objects():
        category, room, *numbers = node.id.split("|")
        assert category in CATALOG
        assert f"room|{room}" in rooms
        assert len(numbers) == (1 if split_drawer_id(node.asset_id) is None else 2)


def test_the_start_is_in_a_room(house):
    floors = [Polygon([(point.x, point.z) for point in room.floor_polygon]) for room in house.document.rooms]
    assert house.start is not None
    assert house.start.horizon == 30
    assert any(floor.contains(Point(house.start.position.x, house.start.position.z)) for floor in floors)


def test_states_are_clear(house):
    for node, _ in house.objects():
        assert node.openness is None or node.openness <= 0.02 or node.openness >= 0.8
    for door in house.document.doors:
        assert door.openness in (None, 0.0, 1.0)


def test_only_loose_things_may_move(house):
    for node, parent in house.objects():
        assert node.kinematic != CATALOG[node.id.split("|")[0]].is_pickupable
        if parent is None and not CATALOG[node.id.split("|")[0]].is_pickupable:
            assert node.position.y > 0


def test_same_seed_same_bytes_in_another_process():
    done = subprocess.run([sys.executable, "-c", AGAIN], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == generate(1, spec_for("2")).sha256


def test_other_seeds_give_other_houses():
    assert len({generate(seed, spec_for("kitchen")).sha256 for seed in range(4)}) == 4


def test_a_dozen_houses_cover_many_categories():
    found: set[str] = set()
    for spec in ("kitchen", "living-room", "bedroom", "bathroom"):
        for seed in range(3):
            found |= set(categories(generate(seed, spec_for(spec))))
    assert len(found) >= 80


def test_things_lie_inside_what_can_be_opened():
    inside = 0
    for seed in range(3):
        house = generate(seed, spec_for("kitchen"))
        for node, parent in house.objects():
            inside += parent is not None and parent.startswith(("Fridge", "Cabinet")) and not node.openness
    assert inside >= 3
