"""Placing, dropping, leaves and contents, beyond what the conformance checks try."""

import itertools

import numpy as np
import pytest

from vigil.assets.catalog import CATALOG
from vigil.assets.database import AssetDatabase
from vigil.assets.making import make
from vigil.base.geometry import Pose, Vec3, floor_distance
from vigil.errors import EpisodeError
from vigil.protocol.actions import InteractPixel
from vigil.protocol.house import MaterialRef
from vigil.protocol.world import ObjectSetup, Placement, Setup
from vigil.scene.geometry import penetration, prisms_of
from vigil.scene.supports import ancestors, contents
from vigil.scene.things import RoomShape, Scene, Thing
from vigil.sim import make_simulator
from vigil.sim.conformance.reference_house import DRESSER, SIBLING, reference_house
from vigil.sim.core.motion import CollisionMap
from vigil.sim.core.opening import TOLERANCE_M, opening_blocker, set_openness
from vigil.sim.core.placing import OWN_SLACK_M, held_box_of, open_surfaces, put_down, spot_below, spot_on
from vigil.sim.core.state import SceneState

PLAIN = MaterialRef(name="plaster/white")


@pytest.fixture(scope="module")
def simulator():
    made = make_simulator("fake", assets=AssetDatabase.default())
    made.load(reference_house())
    return made


def stand(simulator, x: float = 3.5, z: float = 2.5, setup: Setup | None = None, yaw: float = 0.0):
    """Return the simulator's state after a reset."""
    simulator.reset(Pose(position=Vec3(x, 0, z), rotation=yaw), setup or Setup())
    return simulator._require_loaded().state


def overlaps(state, thing_id: str) -> list[str]:
    own = state.prisms(state.scene.things[thing_id])
    ignored = {thing_id, state.scene.things[thing_id].parent or ""}
    return sorted({owner for owner, other in state.solids(ignored) for mine in own if penetration(mine, other) > 0.006})


def test_things_placed_one_after_another_never_overlap(simulator):
    state = stand(simulator)
    table = state.scene.things["DiningTable|1"]
    for thing_id in ("Watch|1", "Statue|1", "Lettuce|1", "Box|1"):
        state.take(state.scene.things[thing_id])
        spot = spot_on(state, state.scene.things[thing_id], table, Vec3(1.75, 0.7111, 2.15))
        assert spot is not None, thing_id
        put_down(state, spot)
        assert overlaps(state, thing_id) == [], thing_id
        assert floor_distance(state.scene.things[thing_id].position, Vec3(1.75, 0.0, 2.15)) <= 0.3 + 1e-6
    assert {thing.id for thing in contents(state.scene, "DiningTable|1")} >= {"Watch|1", "Statue|1", "Box|1"}


def test_a_full_neighbourhood_has_no_room(simulator):
    plate = Placement(position=Vec3(3.3, 1.2, 4.6), parent="Plate|1")
    state = stand(simulator, setup=Setup(objects={"Lettuce|1": ObjectSetup(placement=plate)}, held="Statue|1"))
    statue = state.scene.things["Statue|1"]
    assert spot_on(state, statue, state.scene.things["Plate|1"], Vec3(3.3, 0.94, 4.6)) is None


def test_yaw_is_kept_where_it_fits_else_turned_to_the_surface(simulator):
    held = Setup(objects={"Book|1": ObjectSetup(placement=Placement(position=Vec3(4, 1, 1), rotation=Vec3(0, 30, 0)))})
    state = stand(simulator, setup=held)
    book = state.scene.things["Book|1"]
    state.scene.things["Pen|1"].parent = None
    state.take(book)
    table = spot_on(state, book, state.scene.things["DiningTable|1"], Vec3(1.8, 0.7111, 2.1))
    assert table is not None
    assert table.yaw == pytest.approx(30.0)
    edge = spot_on(state, book, state.scene.things["DiningTable|1"], Vec3(1.8, 0.7111, 2.62))
    assert edge is not None  # slides in from the edge
    assert edge.position.z < 2.6


def test_clearance_keeps_tall_things_out(simulator):
    state = stand(simulator, setup=Setup(objects={"Fridge|1": ObjectSetup(openness=1.0)}, held="Statue|1"))
    fridge, statue = state.scene.things["Fridge|1"], state.scene.things["Statue|1"]
    assert held_box_of(state, statue).height == pytest.approx(0.36, abs=0.01)
    assert spot_on(state, statue, fridge, Vec3(5.2, 0.75, 4.6)) is None
    assert len(open_surfaces(fridge)) == len(fridge.asset.surfaces)
    set_openness(state, fridge, 0.0)
    assert [surface.name for surface, _ in open_surfaces(fridge)] == ["top"]


def test_what_is_put_over_an_open_bin_sinks_to_its_bottom(simulator):
    state = stand(simulator, setup=Setup(held="Apple|1"))
    can, apple = state.scene.things["GarbageCan|1"], state.scene.things["Apple|1"]
    rim = Vec3(0.35, 0.48, 4.45)
    spot = spot_on(state, apple, can, rim)
    assert spot is not None
    assert spot.position.y < 0.2


@pytest.mark.parametrize(
    ("box_z", "landing_z"),
    [(None, 2.9), (3.1, 2.8), (2.95, None)],
    ids=["nothing in the way: 0.4 m ahead", "a box behind 0.3 m: there", "a box at all three distances: nowhere"],
)
def test_drops_prefer_the_first_free_distance(simulator, box_z: float | None, landing_z: float | None):
    """From z = 2.5 the distances 0.4 m, 0.3 m and 0.5 m ahead are tried in this order."""
    objects = {} if box_z is None else {"Box|1": ObjectSetup(placement=Placement(position=Vec3(3.5, 0.152, box_z)))}
    state = stand(simulator, setup=Setup(objects=objects, held="Apple|1"))
    spot = spot_below(state, state.scene.things["Apple|1"])
    assert (None if spot is None else spot.position.z) == (None if landing_z is None else pytest.approx(landing_z))


@pytest.mark.parametrize(("past_edge_m", "parent"), [(-0.01, "DiningTable|1"), (0.01, None)])
def test_nothing_thin_comes_to_rest_with_its_middle_over_the_edge(simulator, past_edge_m: float, parent: str | None):
    state = stand(simulator, setup=Setup(held="Pen|1"))
    edge = 1.8 + state.scene.things["DiningTable|1"].asset.surfaces[0].size_x / 2
    state.agent = Pose(position=Vec3(edge + past_edge_m, 0.0, 1.8), rotation=0.0)
    spot = spot_below(state, state.scene.things["Pen|1"])
    assert (None if spot is None else spot.parent) == parent


def test_nothing_is_dropped_onto_the_own_feet(simulator):
    state = stand(simulator, setup=Setup(held="Box|1"))  # 0.35 m deep: at 0.3 m it would touch the body
    spot = spot_below(state, state.scene.things["Box|1"])
    assert spot is not None
    assert spot.position.z - 0.3516 / 2 >= 2.7 - 0.004


def test_a_lid_with_something_on_it_stays(simulator):
    state = stand(simulator)
    assert opening_blocker(state, state.scene.things["Book|1"], 1.0) == "Pen|1"
    state.take(state.scene.things["Pen|1"])
    assert opening_blocker(state, state.scene.things["Book|1"], 1.0) is None


def test_neighbours_that_touch_keep_nothing_shut(simulator):
    side_by_side = Placement(position=Vec3(5.2 - 0.371 - 0.2156 - 0.002, 0.152, 4.6))
    state = stand(simulator, setup=Setup(objects={"Box|1": ObjectSetup(placement=side_by_side)}))
    assert opening_blocker(state, state.scene.things["Fridge|1"], 1.0) is None


def in_the_open_dresser(yaw: float, openness: float) -> Setup:
    """Return the setup of a book in an open drawer, with nothing on the drawer's cover."""
    place = Placement(position=Vec3(8.24, 0.5, 0.25), rotation=Vec3(0.0, yaw, 0.0), parent=SIBLING)
    changes = {
        "Book|1": ObjectSetup(placement=place, openness=openness),
        SIBLING: ObjectSetup(openness=1.0),
        "Pen|1": ObjectSetup(is_absent=True),
    }
    return Setup(objects=changes)


@pytest.mark.parametrize(("openness", "blocker"), [(1.0, "Book|1"), (0.0, None)])
def test_an_open_cover_in_a_drawer_does_not_go_through_the_carriers_body(simulator, openness: float, blocker):
    state = stand(simulator, setup=in_the_open_dresser(270.0, openness))
    assert state.scene.things["Book|1"].parent_joint is not None
    assert opening_blocker(state, state.scene.things[SIBLING], 0.0) == blocker


@pytest.mark.parametrize(("yaw", "refused"), [(180.0, True), (0.0, False)])
def test_a_setup_opens_no_cover_through_what_the_book_lies_in(simulator, yaw: float, refused: bool):
    shut = in_the_open_dresser(yaw, 0.0)
    stand(simulator, setup=shut)
    setup = in_the_open_dresser(yaw, 1.0)
    if not refused:
        stand(simulator, setup=setup)
        return
    with pytest.raises(EpisodeError, match=r"'Book\|1' \(Book\) sticks out of 'Dresser\|1'"):
        stand(simulator, setup=setup)


def test_a_thing_half_in_the_swing_blocks_opening_and_closing(simulator):
    before = Placement(position=Vec3(5.2, 0.152, 3.95))
    state = stand(simulator, 3.0, 2.0, Setup(objects={"Box|1": ObjectSetup(placement=before)}))
    fridge = state.scene.things["Fridge|1"]
    assert opening_blocker(state, fridge, 1.0) == "Box|1"
    fridge.openness = 1.0
    state.mark_changed(fridge)
    assert opening_blocker(state, fridge, 0.0) == "Box|1"


def test_a_stack_on_a_drawers_content_comes_along(simulator):
    inside = Placement(position=Vec3(8.24, 0.5, 0.25), parent=SIBLING)
    state = stand(simulator, setup=Setup(objects={"Bowl|1": ObjectSetup(placement=inside)}))
    bowl, egg = state.scene.things["Bowl|1"], state.scene.things["Egg|1"]
    assert bowl.parent_joint is not None
    gap = np.subtract(egg.position, bowl.position)
    moved = set_openness(state, state.scene.things[SIBLING], 1.0)
    assert {thing.id for thing in moved} == {SIBLING, "Bowl|1", "Egg|1"}
    assert np.subtract(egg.position, bowl.position) == pytest.approx(gap)
    assert [below.id for below in ancestors(state.scene, egg)] == ["Bowl|1", SIBLING, DRESSER]


def facts(simulator) -> list[tuple]:
    return [
        (thing.id, thing.position, thing.rotation, thing.parent, thing.surface, thing.openness, thing.is_toggled)
        for thing in simulator.scene().things.values()
    ]


def test_every_refusal_leaves_the_world_as_it_was(simulator):
    """Clicks all intents on all things in view from two places."""
    intents = ("open_access", "close_access", "activate", "deactivate", "pick", "place", "drop", "ground")
    for x, z, yaw in ((3.0, 3.5, 0.0), (8.0, 1.4, 180.0)):
        pose = Pose(position=Vec3(x, 0, z), rotation=yaw, horizon=35)
        simulator.reset(pose, Setup())
        clicks = {thing_id: simulator.pixels_of(thing_id) for thing_id in simulator.object_ids()}
        seen = [(thing_id, pixels[0]) for thing_id, pixels in clicks.items() if len(pixels)]
        for (thing_id, (u, v)), intent in itertools.product(seen, intents):
            simulator.reset(pose, Setup())
            before = facts(simulator)
            effect = simulator.step(InteractPixel(intent=intent, x=int(u), y=int(v)))
            is_idle = effect.refusal is not None or intent == "ground"
            assert is_idle == (not effect.changed), (thing_id, intent)
            assert is_idle == (facts(simulator) == before), (thing_id, intent)


def test_nothing_is_put_into_the_back_of_a_seat():
    chair = Thing("chair", "Chair", make("Chair", CATALOG["Chair"].typical_size, 1), Vec3(0, 0.45, 0), Vec3(0, 0, 0))
    bottle = Thing("b", "Bottle", make("Bottle", CATALOG["Bottle"].typical_size, 0), Vec3(2, 1, 2), Vec3(0, 0, 0))
    floor = np.array([(-3, -3), (3, -3), (3, 3), (-3, 3)])
    room = RoomShape("r", "Kitchen", floor, 2.5, PLAIN, None, Vec3(0, 2.4, 0), (1, 1, 1))
    scene = Scene([room], [], {"chair": chair, "b": bottle})
    state = SceneState(scene, Pose(position=Vec3(0, 0, 1), rotation=180.0), CollisionMap(scene))
    state.take(bottle)
    seat = 0.45 + chair.asset.surfaces[0].center.y
    for x in (-0.15, 0.0, 0.15):
        spot = spot_on(state, bottle, chair, Vec3(x, seat, -0.2))
        assert spot is not None
        put_down(state, spot)
        back = [prism for prism in state.prisms(chair) if prism.top > seat + 0.01]
        assert back
        assert max(penetration(mine, its) for mine in state.prisms(bottle) for its in back) < OWN_SLACK_M + 0.005
        state.take(bottle)


def test_no_lid_opens_into_the_body_that_stands_over_it(simulator):
    answers = set()
    for z in np.arange(2.8, 3.0, 0.01):
        on_floor = Placement(position=Vec3(3.5, 0.01, float(z)), rotation=Vec3(0.0, 90.0, 0.0))
        state = stand(simulator, setup=Setup(objects={"Laptop|1": ObjectSetup(placement=on_floor)}))
        assert state.collision_map.can_stand(state.agent.position)  # it lies flat
        laptop = state.scene.things["Laptop|1"]
        blocker = opening_blocker(state, laptop, 1.0)
        swing = [prism for openness in np.linspace(0, 1, 60) for prism in prisms_of(laptop, openness)]
        deepest = max(penetration(prism, state.body()) for prism in swing)
        assert blocker == "agent" or deepest < TOLERANCE_M + 0.001
        answers.add(blocker)
    assert answers == {"agent", None}
