"""Inside and on top: what lies where, what a click on a receptacle means, and what counts for a goal."""

import numpy as np
import pytest

from vigil.assets.catalog import CATALOG
from vigil.assets.database import AssetDatabase
from vigil.assets.making import MAKERS, make
from vigil.base.geometry import Pose, Vec3
from vigil.protocol.goals import ObjectAtReceptacle
from vigil.protocol.house import MaterialRef
from vigil.protocol.world import ObjectSetup, Placement, Setup
from vigil.scene.build import build_scene
from vigil.scene.geometry import Motion
from vigil.scene.supports import containers_of, level_surfaces, receptacles_below, supports_not_lain_on
from vigil.scene.things import RoomShape, Scene, Thing
from vigil.sim import make_simulator
from vigil.sim.conformance.reference_house import DRAWER, DRESSER, WATCH, reference_house
from vigil.sim.core.click_target import target_kind
from vigil.sim.core.handling import interact
from vigil.sim.core.motion import CollisionMap
from vigil.sim.core.setup import apply_setup
from vigil.sim.core.state import SceneState

ORIGIN = Vec3(0, 0, 0)
FLOOR = np.array([(-4, -4), (4, -4), (4, 4), (-4, 4)])
ROOM = RoomShape("r", "Kitchen", FLOOR, 2.5, MaterialRef(name="plaster/white"), None, Vec3(0, 2.4, 0), (1, 1, 1))


def thing(name: str, at: Vec3 = ORIGIN, variant: int = 0, openness: float = 0.0) -> Thing:
    """A thing of the usual size that stands with the middle of its bottom at a place."""
    kind, asset = CATALOG[name], make(name, CATALOG[name].typical_size, variant)
    return Thing(
        id=name,
        category=name,
        asset=asset,
        position=at._replace(y=at.y + asset.size.y / 2),
        rotation=Vec3(0, 0, 0),
        is_pickupable=kind.is_pickupable,
        is_openable=kind.is_openable and asset.can_open,
        is_receptacle=kind.is_receptacle,
        openness=openness,
    )


def state_of(*things: Thing) -> SceneState:
    scene = Scene([ROOM], [], {each.id: each for each in things})
    return SceneState(scene, Pose(position=Vec3(0, 0, 1.2), rotation=180.0), CollisionMap(scene))


def middle(receptacle: Thing, *, inside: bool) -> Vec3:
    frame: Motion = next(frame for surface, frame in level_surfaces(receptacle) if surface.is_inside == inside)
    return Vec3(*(float(value) for value in frame.shift))


def put(state: SceneState, each: Thing, parent: Thing, spot: Vec3) -> None:
    place = Placement(position=spot._replace(y=spot.y + each.asset.size.y / 2), parent=parent.id)
    apply_setup(state, Setup(objects={each.id: ObjectSetup(placement=place)}), "here")


def is_over(each: Thing, receptacle: Thing, *, inside: bool = False) -> bool:
    return receptacle.id in receptacles_below(each, [receptacle])[inside]


INSIDE = {
    **dict.fromkeys(("Sink", "Bathtub", "GarbageCan", "Bowl", "Cup", "Mug", "Pot", "Pan"), "basin bottom floor inside"),
    **dict.fromkeys(("Box", "LaundryHamper", "Fridge", "Microwave", "Safe", "Cabinet"), "bottom floor turntable shelf"),
    **dict.fromkeys(("WashingMachine", "ClothesDryer", "Dresser", "Drawer", "Stove"), "drum drawer rack"),
    "TVStand": "floor shelf drawer",
    "Desk": "drawer",
    "SideTable": "drawer",
}
"""Category -> how the names of its interior surfaces begin; no other category has any."""


@pytest.mark.parametrize("category", sorted(name for name in MAKERS if name in CATALOG))
def test_makers_tell_the_inside_from_tops_rims_and_racks(category):
    begins = tuple(INSIDE.get(category, "").split())
    for variant in range(6):
        for surface in make(category, CATALOG[category].typical_size, variant).surfaces:
            is_inside = bool(begins) and surface.name.startswith(begins)
            assert surface.is_inside == is_inside, (category, variant, surface.name)


CLOSED = ("Fridge", "Cabinet", "Dresser", "Microwave", "Safe", "WashingMachine", "ClothesDryer", "Stove")


@pytest.mark.parametrize("category", CLOSED)
@pytest.mark.parametrize("variant", range(4))
def test_a_click_on_a_shut_container_means_its_top_or_what_is_shut(category, variant):
    shut = thing(category, variant=variant)
    size = shut.asset.size
    top = middle(shut, inside=False)
    assert target_kind(shut, top) == "on"
    front = max(prism_z for solid in shut.asset.solids if solid.joint for _, prism_z in solid.polygon)
    leaf = next(solid for solid in shut.asset.solids if solid.joint)
    x = sum(x for x, _ in leaf.polygon) / len(leaf.polygon)
    face = Vec3(x, size.y / 2 + (leaf.bottom + leaf.top) / 2, front)
    assert target_kind(shut, face) == "shut"
    assert target_kind(shut, Vec3(size.x / 2, size.y - 0.06, 0.0)) == "on"


@pytest.mark.parametrize("category", CLOSED)
def test_a_click_on_an_open_container_means_what_it_is_on(category):
    wide = thing(category, openness=1.0)
    for surface, frame in level_surfaces(wide):
        point = Vec3(*(float(value) for value in frame.shift + np.array([0.0, 0.01, 0.0])))
        assert target_kind(wide, point) == ("inside" if surface.is_inside else "on"), surface.name


@pytest.mark.parametrize("category", ["Sink", "Bathtub"])
def test_the_rim_is_a_place_of_its_own(category):
    hollow = thing(category)
    assert target_kind(hollow, middle(hollow, inside=True)) == "inside"
    assert target_kind(hollow, middle(hollow, inside=False)) == "on"


@pytest.mark.parametrize("category", ["Bowl", "GarbageCan", "Pan"])
def test_what_has_no_top_is_always_meant_inside(category):
    hollow = thing(category)
    assert target_kind(hollow, Vec3(hollow.asset.size.x / 2, hollow.asset.size.y, 0.0)) == "inside"


def test_a_shut_container_takes_on_its_top_and_refuses_its_inside():
    dresser, watch = thing("Dresser"), thing("Watch", Vec3(2, 0, 2))
    state = state_of(dresser, watch)
    state.take(watch)
    front = Vec3(0.2, 0.8 * dresser.asset.size.y, dresser.asset.size.z / 2 - 0.03)
    assert interact(state, "place", dresser, front).refusal == "receptacle_closed"
    assert state.held == "Watch"
    assert interact(state, "place", dresser, middle(dresser, inside=False)).refusal is None
    assert (watch.parent, watch.surface) == ("Dresser", "top")
    assert containers_of(state.scene, watch) == []


def test_a_full_top_does_not_send_a_thing_inside():
    """The top shelf of an open cabinet is less than 0.3 m below its top."""
    cabinet, statue = thing("Cabinet", openness=1.0), thing("Statue", Vec3(2, 0, 2))
    box = thing("Box", Vec3(2, 0, -2))
    state = state_of(cabinet, statue, box)
    top = middle(cabinet, inside=False)
    put(state, box, cabinet, top)
    assert box.parent == "Cabinet"
    state.take(statue)
    interact(state, "place", cabinet, top)
    assert statue.surface in ("top", None)


def test_the_chain_of_supports_says_what_a_thing_is_inside_of():
    fridge, bowl, spoon = thing("Fridge", openness=1.0), thing("Bowl", Vec3(2, 0, 2)), thing("Spoon", Vec3(2, 0, -2))
    state = state_of(fridge, bowl, spoon)
    put(state, bowl, fridge, middle(fridge, inside=True))
    put(state, spoon, bowl, middle(bowl, inside=True))
    assert [each.id for each in containers_of(state.scene, spoon)] == ["Bowl", "Fridge"]
    put(state, bowl, fridge, middle(fridge, inside=False))
    assert [each.id for each in containers_of(state.scene, spoon)] == ["Bowl"]


def bowl_in(hollow: Thing, *others: Thing) -> tuple[SceneState, Thing]:
    bowl = thing("Bowl", Vec3(2, 0, 2))
    state = state_of(hollow, bowl, *others)
    put(state, bowl, hollow, middle(hollow, inside=True))
    assert bowl.parent == hollow.id
    return state, bowl


HOLLOWS = ("Drawer", "Dresser", "Sink", "Bathtub", "LaundryHamper", "WashingMachine", "Fridge", "Microwave")


@pytest.mark.parametrize("category", HOLLOWS)
def test_a_dish_takes_what_it_takes_wherever_it_lies_inside(category):
    egg = thing("Egg", Vec3(2, 0, -2))
    state, bowl = bowl_in(thing(category, openness=1.0), egg)
    state.take(egg)
    assert interact(state, "place", bowl, middle(bowl, inside=True)).refusal is None
    assert [each.id for each in containers_of(state.scene, egg)] == ["Bowl", category]


def test_a_dish_in_the_drawer_of_a_dresser_takes_too():
    scene = build_scene(reference_house(), AssetDatabase.default())
    drawer, bowl, egg = scene.things[DRAWER], thing("Bowl", Vec3(2, 0, 2)), thing("Egg", Vec3(2, 0, 1))
    del scene.things[WATCH]
    scene.things |= {"Bowl": bowl, "Egg": egg}
    drawer.openness = 1.0
    state = SceneState(scene, Pose(position=Vec3(7.5, 0, 1.5), rotation=180.0), CollisionMap(scene))
    put(state, bowl, drawer, middle(drawer, inside=True))
    state.take(egg)
    assert interact(state, "place", bowl, middle(bowl, inside=True)).refusal is None
    assert [each.id for each in containers_of(scene, egg)] == ["Bowl", DRAWER, DRESSER]


@pytest.mark.parametrize(("category", "held"), [("Drawer", "Kettle"), ("Microwave", "Statue")])
def test_what_stands_out_of_the_hollow_has_no_room_on_a_dish_in_it(category, held):
    tall = thing(held, Vec3(2, 0, -2))
    state, bowl = bowl_in(thing(category, openness=1.0), tall)
    state.take(tall)
    assert interact(state, "place", bowl, middle(bowl, inside=True)).refusal == "no_room"


@pytest.mark.parametrize(("dropped", "refusal"), [("Egg", None), ("Kettle", "no_room")])
def test_what_is_dropped_falls_onto_a_dish_in_a_basin(dropped, refusal):
    falling = thing(dropped, Vec3(2, 0, -2))
    state, _ = bowl_in(thing("Sink", Vec3(0, 0, 0.8)), falling)
    state.take(falling)
    assert interact(state, "drop", None, None).refusal == refusal
    assert falling.parent == (None if refusal else "Bowl")


def not_on(state: SceneState, each: Thing) -> list[str]:
    return list(supports_not_lain_on(state.scene, each, state.scene.things.values()))


def test_what_lies_in_a_drawer_a_shut_box_or_a_basin_does_not_lie_on_what_bears_them():
    stand, table, watch = thing("TVStand", variant=1), thing("DiningTable", Vec3(2, 0, 2)), thing("Watch")
    box, microwave, bowl, sink = (thing(name, Vec3(2, 0, -2)) for name in ("Box", "Microwave", "Bowl", "Sink"))
    state = state_of(stand, table, watch, box, microwave, bowl, sink)
    for carried in (box, microwave, bowl, sink):
        put(state, carried, table, middle(table, inside=False))
    found = {}
    for bearer in (box, microwave, bowl, sink):
        put(state, watch, bearer, middle(bearer, inside=True))
        found[bearer.id] = not_on(state, watch)
    assert found == {
        "Box": ["Box", "DiningTable"],
        "Microwave": ["Microwave", "DiningTable"],
        "Bowl": [],
        "Sink": ["DiningTable"],
    }
    for surface, frame in level_surfaces(stand):
        put(state, watch, stand, Vec3(*(float(value) for value in frame.shift)))
        assert watch.surface == surface.name
        assert not_on(state, watch) == (["TVStand"] if surface.needs_opening else [])
        watch.parent = watch.surface = None
        assert is_over(watch, stand)
        assert not_on(state, watch) == (["TVStand"] if surface.needs_opening else [])
    assert {surface.needs_opening for surface in stand.asset.surfaces} == {True, False}


def test_the_tolerance_of_inside_stays_in_the_hollow():
    """Nothing at the rim, beside the walls, under the floor or on the lid of what is low is inside it."""
    pan, egg = thing("Pan"), thing("Egg")
    half, low = pan.asset.size.x / 2, egg.asset.size.y / 2
    surface = pan.asset.surfaces[0]
    floor, rim = pan.position.y + surface.center.y, pan.asset.size.y
    x, z = pan.position.x + surface.center.x, pan.position.z + surface.center.z
    egg.position = Vec3(x, floor + low + 0.01, z)
    assert is_over(egg, pan, inside=True)
    for spot in (Vec3(x, rim + low, z), Vec3(x + half + 0.02, floor + low + 0.01, z), Vec3(x, floor + low - 0.01, z)):
        egg.position = spot
        assert not is_over(egg, pan, inside=True), spot


def test_a_thing_on_the_neighbour_is_not_at_a_receptacle():
    """The hob beside a countertop, a few centimetres away and as high; a thing that hovers there still counts."""
    counter, hob, pot = thing("CounterTop"), thing("Stove"), thing("Pot")
    hob.position = Vec3(counter.asset.size.x / 2 + hob.asset.size.x / 2, hob.position.y, 0.0)
    state = state_of(counter, hob, pot)
    side_by_side = Vec3(counter.asset.size.x / 2 + 0.05, counter.asset.size.y, 0.0)
    pot.position = side_by_side._replace(y=side_by_side.y + pot.asset.size.y / 2)
    assert is_over(pot, counter)
    put(state, pot, hob, side_by_side._replace(y=hob.asset.size.y))
    assert pot.parent == "Stove"
    pot.position = side_by_side._replace(y=side_by_side.y + pot.asset.size.y / 2)
    assert not is_over(pot, counter)


@pytest.mark.parametrize(("spot", "expected"), [("inside", True), ("top", False)])
def test_the_hidden_state_says_inside_and_the_goal_asks_for_it(spot, expected):
    simulator = make_simulator("fake", assets=AssetDatabase.default())
    simulator.load(reference_house())
    surfaces = simulator.scene().things["Fridge|1"]
    at = middle(surfaces, inside=expected)
    place = Placement(position=at._replace(y=at.y + 0.04), parent="Fridge|1")
    setup = Setup(objects={"Apple|1": ObjectSetup(placement=place)})
    simulator.reset(Pose(position=Vec3(3.5, 0, 2.5), rotation=0.0), setup)
    state = simulator.world(["Apple|1", "Fridge|1"]).objects["Apple|1"]
    assert state.parent == "Fridge|1"
    assert ("Fridge|1" in state.inside, "Fridge|1" in state.over_inside) == (expected, expected)
    goal = ObjectAtReceptacle(object_id="Apple|1", receptacle_id="Fridge|1", inside=True)
    assert goal.model_dump()["inside"] is True
