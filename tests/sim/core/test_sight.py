"""Projection against rays, and counts against brute force."""

import numpy as np
import pytest

from vigil.assets.database import AssetDatabase
from vigil.assets.kernel.asset import Asset
from vigil.assets.making import make
from vigil.base.geometry import Pose, Vec3, yaw_towards
from vigil.protocol.actions import InteractPixel, Look
from vigil.protocol.world import ObjectSetup, Placement, Setup
from vigil.scene.build import build_scene
from vigil.scene.supports import drawers_of
from vigil.sim import make_simulator
from vigil.sim.conformance.reference_house import reference_house
from vigil.sim.core.embedded import EmbeddedSimulator
from vigil.sim.core.sight import (
    HEIGHT,
    WIDTH,
    PixelWindow,
    Sight,
    boxes_of,
    camera_axes,
    directions,
    pixel_of,
    project,
    window_of,
)
from vigil.sim.engines.fake import FakeEngine
from vigil.sim.engines.mujoco.engine import MujocoEngine

VIEWS = [
    Pose(position=Vec3(3.5, 0, 2.5), rotation=270, horizon=30),
    Pose(position=Vec3(5.2, 0, 3.1), rotation=0, horizon=15),
    Pose(position=Vec3(8.0, 0, 2.2), rotation=180, horizon=20),
    Pose(position=Vec3(1.8, 0, 2.9), rotation=180, horizon=60),
]


@pytest.fixture(scope="module")
def seen():
    scene = build_scene(reference_house(), AssetDatabase.default())
    engine = FakeEngine()
    engine.load(scene)
    return scene, engine, Sight(engine, scene)


def every_pixel() -> np.ndarray:
    return np.stack(np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT)), axis=-1).reshape(-1, 2)


def is_inside(window: PixelWindow, pixels: np.ndarray) -> np.ndarray:
    x, y = pixels.T
    return (x >= window.left) & (x < window.right) & (y >= window.top) & (y < window.bottom)


def test_the_camera_looks_along_yaw_and_down_by_horizon():
    right, up, forward = camera_axes(Pose(position=Vec3(0, 0, 0), rotation=90, horizon=30))
    assert forward == pytest.approx([np.cos(np.pi / 6), -0.5, 0.0])
    assert right == pytest.approx([0.0, 0.0, -1.0])
    assert np.cross(right, up) == pytest.approx(forward)  # as written in left-handed coordinates: x right, y up, z on


def test_the_vertical_field_of_view_is_90_degrees():
    top, bottom = directions(VIEWS[0].model_copy(update={"horizon": 0.0}), np.array([[319.5, -0.5], [319.5, 479.5]]))
    assert np.degrees(np.arccos(top @ bottom)) == pytest.approx(90.0)


@pytest.mark.parametrize("view", VIEWS)
def test_a_ray_through_a_pixel_projects_into_that_pixel(view):
    pixels = np.array([(0, 0), (639, 479), (320, 240), (17, 401)])
    points = np.array(view.eye) + 2.5 * directions(view, pixels)
    assert project(view, points)[:, :2] == pytest.approx(pixels + 0.5)
    assert [pixel_of(view, Vec3(*point)) for point in points] == [tuple(pixel) for pixel in pixels]


def test_points_behind_or_beside_have_no_pixel():
    view = VIEWS[0]
    assert pixel_of(view, Vec3(5.0, 1.0, 2.5)) is None
    assert pixel_of(view, Vec3(3.4, 1.5, 4.9)) is None


@pytest.mark.parametrize("view", VIEWS)
def test_counts_agree_with_every_pixel_of_the_frame(seen, view):
    """Against all pixels of the windows of small things, and every second each way of the rest of the frame."""
    scene, engine, sight = seen
    things = list(scene.things.values())
    windows = {thing.id: window_of(view, boxes_of([thing])) for thing in things}
    pixels = every_pixel()
    is_coarse = (pixels % 2 == 0).all(axis=1)
    small = [is_inside(window, pixels) for window in windows.values() if window is not None and window.stride <= 2]
    tried = np.any([is_coarse, *small], axis=0)
    pixels, is_coarse = pixels[tried], is_coarse[tried]
    rays = directions(view, pixels)
    hits = engine.cast(view.eye, rays, through_glass=True)
    sightings = sight.see(view, things)
    for index, thing in enumerate(things):
        window = windows[thing.id]
        inside = np.zeros(len(pixels), bool) if window is None else is_inside(window, pixels)
        assert not (hits.things[~inside] == index).any()
        if window is None:
            assert sightings[thing.id].visible_px == 0
            continue
        exact, is_small = window.stride == 1, window.stride <= 2
        inside &= is_small | is_coarse
        pieces = [thing, *drawers_of(scene, thing)]
        casts = [engine.cast(view.eye, rays[inside], through_glass=False, only=piece.id) for piece in pieces]
        own = np.min([cast.distances for cast in casts], axis=0)
        is_own = np.isin(hits.things[inside], [things.index(piece) for piece in pieces])
        is_seen = is_own | (own < hits.distances[inside])  # its own glass is of it
        found, true = sightings[thing.id].visible_px, int(is_seen.sum()) * (1 if is_small else 4)
        assert abs(found - true) <= (0 if exact else 25 + 0.12 * true), f"{thing.id}: {found} of {true}"
        if found:
            nearest = float(own[is_seen].min())
            assert sightings[thing.id].nearest_m == pytest.approx(nearest, abs=0 if exact else 0.1)


def test_windows_hold_all_pixels_of_a_thing_that_is_partly_behind_the_camera(seen):
    scene, engine, _ = seen
    view = Pose(position=Vec3(2.6, 0, 4.05), rotation=90, horizon=60)
    alone = engine.cast(view.eye, directions(view, every_pixel()), through_glass=True, only="CounterTop|1")
    pixels = every_pixel()[alone.things >= 0]
    window = window_of(view, boxes_of([scene.things["CounterTop|1"]]))
    assert window is not None
    assert not window.is_whole
    assert window.left <= pixels[:, 0].min()
    assert window.right > pixels[:, 0].max()
    assert window.top <= pixels[:, 1].min()
    assert window.bottom > pixels[:, 1].max()


def test_strictly_visible_needs_enough_of_the_thing():
    scene = build_scene(reference_house(), AssetDatabase.default())
    apple = scene.things["Apple|1"]
    apple.position = Vec3(1.4, 1.2, 2.4)  # clear of the table
    engine = FakeEngine()
    engine.load(scene)
    sight = Sight(engine, scene)
    place = Vec3(4.2, 0, 3.6)
    far = Pose(position=place, rotation=yaw_towards(place, apple.position), horizon=15)
    sighting = sight.see(far, [apple])["Apple|1"]
    assert 0 < sighting.visible_px < 200
    assert sighting.visible  # all of it is in view
    cut = sight.see(Pose(position=Vec3(1.4, 0, 3.4), rotation=180, horizon=-26.5), [apple])["Apple|1"]
    assert 0 < cut.visible_px < 200
    assert not cut.visible  # few pixels, at the frame's edge


def test_what_has_not_changed_is_not_looked_at_again(monkeypatch: pytest.MonkeyPatch):
    engine = FakeEngine()
    simulator = EmbeddedSimulator(engine, AssetDatabase.default())
    simulator.load(reference_house())
    start = Pose(position=Vec3(2.6, 0, 3.5), rotation=0, horizon=30)
    simulator.reset(start, Setup())
    casts: list[str | None] = []
    cast = engine.cast
    monkeypatch.setattr(
        engine, "cast", lambda *args, only=None, **kw: casts.append(only) or cast(*args, only=only, **kw)
    )
    first = simulator.world(["Microwave|1"])
    looked = len(casts)
    assert simulator.world(["Microwave|1"]) == first
    assert len(casts) == looked > 0
    x, y = pixel_of(start, first.objects["Microwave|1"].position) or (0, 0)
    assert simulator.step(InteractPixel(intent="open_access", x=x, y=y)).refusal is None
    opened = simulator.world(["Microwave|1"]).objects["Microwave|1"]
    assert opened.visible_px != first.objects["Microwave|1"].visible_px
    simulator.step(Look(direction="down", magnitude=15.0))
    assert simulator.world(["Microwave|1"]).objects["Microwave|1"].visible_px != opened.visible_px


def test_near_clicks_list_what_is_within_three_pixels(seen):
    _, _, sight = seen
    view = Pose(position=Vec3(1.4, 0, 3.3), rotation=180, horizon=40)
    x, y = pixel_of(view, Vec3(1.4, 0.75, 2.4)) or (0, 0)
    assert sight.ids_near_pixel(view, x, y) == ("Apple|1",)
    edge = next(column for column in range(x, x + 200) if "DiningTable|1" in sight.ids_near_pixel(view, column, y))
    assert set(sight.ids_near_pixel(view, edge, y)) == {"Apple|1", "DiningTable|1"}
    thing, _ = sight.click(view, edge, y)
    assert thing is not None
    assert thing.id == "Apple|1"
    assert sight.ids_near_pixel(view, 0, 0) == sight.ids_near_pixel(view, 0, 0)


def in_microwave(openness: float) -> Setup:
    inside = ObjectSetup(placement=Placement(position=Vec3(2.65, 1.0, 4.6), parent="Microwave|1"))
    return Setup(objects={"Egg|1": inside, "Microwave|1": ObjectSetup(openness=openness)})


def test_what_is_behind_a_pane_is_seen_but_not_clicked():
    simulator = make_simulator("mujoco", assets=AssetDatabase.default())
    simulator.load(reference_house())
    before = Pose(position=Vec3(2.6, 0, 3.5), rotation=0, horizon=30)
    simulator.reset(before, in_microwave(0.0))
    egg = simulator.world(["Egg|1"]).objects["Egg|1"]
    assert egg.parent == "Microwave|1"
    assert egg.visible_px > 40
    assert not len(simulator.pixels_of("Egg|1"))
    x, y = pixel_of(before, egg.position) or (0, 0)
    effect = simulator.step(InteractPixel(intent="pick", x=x, y=y))
    assert (effect.hit, effect.refusal) == ("Microwave|1", "not_pickupable")
    simulator.reset(before, in_microwave(1.0))
    assert len(simulator.pixels_of("Egg|1"))


def test_what_is_all_of_glass_is_seen():
    scene = build_scene(reference_house(), AssetDatabase.default())
    lettuce, apple = scene.things["Lettuce|1"], scene.things["Apple|1"]
    lettuce.asset = next(
        asset for asset in (make("Vase", Vec3(0.2, 0.4, 0.2), n) for n in range(60)) if is_clear(asset)
    )
    lettuce.position, apple.position = Vec3(3.5, 1.2, 3.5), Vec3(3.5, 1.2, 4.0)
    engine = MujocoEngine()
    engine.load(scene)
    sight = Sight(engine, scene)
    view = Pose(position=Vec3(3.5, 0, 2.5), rotation=0, horizon=15)
    seen = sight.see(view, [lettuce, apple])
    assert seen["Lettuce|1"].visible_px > 1000
    assert seen["Apple|1"].visible_px > 100  # through it
    towards = directions(view, np.array([pixel_of(view, lettuce.position)]))
    assert sight.meets(view.eye, towards, lettuce, through_glass=True).all()
    lettuce.position, apple.position = apple.position, lettuce.position
    engine.update(scene, {"Lettuce|1", "Apple|1"})
    sight.clear_cache()
    behind = sight.see(view, [lettuce])["Lettuce|1"]
    assert 0 < behind.visible_px < seen["Lettuce|1"].visible_px
    towards = directions(view, np.array([pixel_of(view, apple.position)]))
    assert not sight.meets(view.eye, towards, lettuce, through_glass=True).any()


def is_clear(asset: Asset) -> bool:
    return all(part.is_glass for part in asset.parts)


def test_what_was_seen_from_a_pose_is_kept_until_something_changes(seen, monkeypatch):
    scene, engine, sight = seen
    things = list(scene.things.values())[:3]
    sight.clear_cache()
    together = sight.see(VIEWS[0], things)
    casts: list[str | None] = []
    cast = engine.cast

    def counted(*arguments, only=None, **options):
        casts.append(only)
        return cast(*arguments, only=only, **options)

    monkeypatch.setattr(engine, "cast", counted)
    assert sight.see(VIEWS[0], things[1:]) == {thing.id: together[thing.id] for thing in things[1:]}
    assert not casts
    sight.clear_cache()
    assert {name: sighting for thing in things for name, sighting in sight.see(VIEWS[0], [thing]).items()} == together
    assert {name for name in casts if name} <= {thing.id for thing in things}
    assert casts


def test_what_was_known_of_a_thing_is_forgotten_once_it_changes():
    scene = build_scene(reference_house(), AssetDatabase.default())
    engine = MujocoEngine()
    engine.load(scene)
    sight = Sight(engine, scene)
    for thing in [thing for thing in scene.things.values() if thing.is_pickupable or thing.asset.can_open]:
        sight.see(VIEWS[0], [thing])
        position, openness = thing.position, thing.openness
        thing.position, thing.openness = Vec3(position.x, position.y + 0.3, position.z), 1.0 - openness
        engine.update(scene, {thing.id})
        sight.clear_cache()
        assert sight.see(VIEWS[0], [thing]) == Sight(engine, scene).see(VIEWS[0], [thing]), thing.id
        thing.position, thing.openness = position, openness
        engine.update(scene, {thing.id})
        sight.clear_cache()


def test_what_is_in_the_hand_has_no_place_that_is_kept():
    scene = build_scene(reference_house(), AssetDatabase.default())
    engine = MujocoEngine()
    engine.load(scene)
    sight, apple = Sight(engine, scene), scene.things["Apple|1"]
    apple.is_held = True
    engine.update(scene, {apple.id})
    rays = directions(VIEWS[0], np.array([[320, 240]]))
    sight.meets(VIEWS[0].eye, rays, apple, through_glass=True)
    assert not sight._boxes


@pytest.mark.parametrize("view", VIEWS)
def test_what_is_seen_may_be_shown_and_is_the_same_after_asking(seen, view):
    scene, engine, sight = seen
    things = list(scene.things.values())
    asked = Sight(engine, scene)
    for thing_id, sighting in sight.see(view, things).items():
        thing = scene.things[thing_id]
        assert asked.may_be_visible(view, thing, sighting.visible_px)
        assert asked.see(view, [thing])[thing_id] == sighting


@pytest.mark.parametrize(
    ("place", "horizon", "rotation", "thing_id"),
    [((3.5, 2.5), 30, 59.0, "FloorLamp|2"), ((5.2, 3.1), 15, 79.0, "Fridge|1"), ((5.2, 3.1), 15, 83.0, "Fridge|1")],
)
def test_a_sliver_between_the_sampled_pixels_is_in_the_frame(place, horizon, rotation, thing_id):
    scene = build_scene(reference_house(), AssetDatabase.default())
    engine = MujocoEngine()
    engine.load(scene)
    sight, thing = Sight(engine, scene), scene.things[thing_id]
    view = Pose(position=Vec3(place[0], 0, place[1]), rotation=rotation, horizon=horizon)
    met = engine.cast(view.eye, directions(view, every_pixel()), through_glass=True).things
    shown_px = int((met == list(scene.things).index(thing_id)).sum())
    assert sight.see(view, [thing])[thing_id].visible_px == 0
    assert sight.is_in_frame(view, thing) == (shown_px > 0)
    assert (shown_px > 0) == (rotation != 83.0)


@pytest.mark.parametrize("view", VIEWS)
def test_what_is_counted_is_in_the_frame(seen, view):
    scene, _, sight = seen
    things = list(scene.things.values())
    for thing_id, sighting in sight.see(view, things).items():
        assert sight.is_in_frame(view, scene.things[thing_id]) or not sighting.visible_px


def test_no_more_may_be_shown_than_an_outline_has(seen):
    scene, engine, _ = seen
    sight, fridge = Sight(engine, scene), scene.things["Fridge|1"]
    view = VIEWS[1].model_copy(update={"rotation": yaw_towards(VIEWS[1].position, fridge.position)})
    window = window_of(view, boxes_of([fridge]))
    assert window is not None
    assert window.most_px == len(window.pixels()) * window.stride**2
    met = engine.cast(view.eye, directions(view, window.pixels()), through_glass=False, only=fridge.id)
    outline_px = int(np.isfinite(met.distances).sum()) * window.stride**2
    assert sight.may_be_visible(view, fridge, outline_px)
    assert not sight.may_be_visible(view, fridge, outline_px + 1)
