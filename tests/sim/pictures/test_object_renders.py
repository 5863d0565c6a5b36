"""Single things as an agent would see them: where they stand, from how far."""

import numpy as np
import pytest

from vigil.assets.catalog import CATALOG
from vigil.scene.geometry import body_box, bounding_box
from vigil.sim.core.sight import directions, project
from vigil.sim.engines.mujoco.engine import MujocoEngine
from vigil.sim.pictures.object_renders import (
    FARTHEST_M,
    NEAREST_M,
    SPAN_PX,
    render_object,
    view_of,
)
from vigil.sim.pictures.places import HEIGHT_M, HOSTS, RAILS, host_of
from vigil.sim.pictures.staged_scenes import DEPTH_M, SUBJECT, WIDTH_M, SceneSubject, staged_scene, states_of


def _subject(category: str, variant: int = 1) -> SceneSubject:
    asset = SceneSubject(category, variant).asset
    return SceneSubject(category, variant, states_of(asset)[-1])


@pytest.mark.parametrize("category", sorted(CATALOG))
def test_a_thing_stands_on_what_carries_it_within_the_room(category: str) -> None:
    scene = staged_scene(_subject(category), np.random.default_rng(5))
    thing = scene.things[SUBJECT]
    box = bounding_box(thing)
    assert box.bottom > -1e-6
    assert box.top < HEIGHT_M + 1e-6
    assert 0.0 < box.center.x < WIDTH_M
    assert -0.1 < box.center.z < DEPTH_M


@pytest.mark.parametrize("category", sorted(name for name in CATALOG if host_of(name) in HOSTS))
def test_what_the_catalogue_says_carries_a_thing_stands_under_or_behind_it(category: str) -> None:
    scene = staged_scene(_subject(category), np.random.default_rng(5))
    thing, host = scene.things[SUBJECT], scene.things[host_of(category)]
    assert host.category in CATALOG[category].rests_on
    if host.category in RAILS:
        bar = host.position.y + (RAILS[host.category] - 0.5) * host.asset.size.y
        assert 0.0 < thing.position.y + thing.asset.size.y / 2 - bar < 0.03
        assert abs(thing.position.z - bounding_box(host).center.z) < host.asset.size.z / 2 + 1e-6
    elif category == "StoveKnob":
        assert bounding_box(host).bottom < thing.position.y < bounding_box(host).top
    else:
        tops = [host.position.y + surface.center.y for surface in host.asset.surfaces]
        assert min(abs(top - bounding_box(thing).bottom) for top in tops) < 1e-6
        assert body_box(host).floor_distance(thing.position) == 0.0


@pytest.mark.parametrize(
    ("category", "others"),
    [
        ("Faucet", {"Sink", "CounterTop"}),
        ("Sink", {"Faucet", "CounterTop"}),
        ("Towel", {"TowelHolder"}),
        ("HandTowel", {"HandTowelHolder"}),
        ("StoveBurner", {"Stove"}),
        ("StoveKnob", {"Stove"}),
        ("ToiletPaper", {"Toilet"}),
        ("Pillow", {"Bed"}),
        ("ShowerHead", {"Bathtub"}),
        ("Curtains", {"Window"}),
        ("Fridge", set()),
    ],
)
def test_a_thing_has_its_host_and_companions_with_it_and_nothing_else(category: str, others: set[str]) -> None:
    things = staged_scene(_subject(category), np.random.default_rng(5)).things
    assert {thing.category for thing in things.values() if thing.id != SUBJECT} == others


@pytest.mark.parametrize("category", sorted(CATALOG))
def test_it_spans_about_120_pixels_or_is_as_near_or_far_as_one_may_stand(category: str) -> None:
    thing = staged_scene(_subject(category), np.random.default_rng(5)).things[SUBJECT]
    view = view_of(thing, 20.0)
    assert NEAREST_M <= view.distance_m < FARTHEST_M + 0.05
    if view.distance_m < NEAREST_M + 0.02:
        assert view.span_px <= SPAN_PX
    elif view.distance_m < FARTHEST_M:
        assert view.span_px == pytest.approx(SPAN_PX, abs=6)
    else:
        assert view.span_px >= SPAN_PX - 6
    middle = project(view.agent, np.array([thing.position]))[0]
    assert middle[:2] == pytest.approx([320, 240], abs=1)
    far = view_of(thing, 0.0, 4.0)
    assert far.distance_m == pytest.approx(4.0, abs=0.02)
    assert 0.0 < far.agent.eye.z < DEPTH_M


@pytest.mark.parametrize(
    "category", ["Mug", "Pen", "Fridge", "Doorway", "Blinds", "CeilingLamp", "StoveKnob", "Painting"]
)
def test_the_thing_is_in_the_middle_of_the_picture(category: str) -> None:
    scene = staged_scene(SceneSubject(category, 2, "closed"), np.random.default_rng(5))
    engine = MujocoEngine("fast")
    engine.load(scene)
    view = view_of(scene.things[SUBJECT], 10.0)
    box = np.stack(np.meshgrid(range(280, 360, 4), range(200, 280, 4)), axis=-1).reshape(-1, 2)
    hits = engine.cast(view.agent.eye, directions(view.agent, box), through_glass=False)
    assert (hits.things == list(scene.things).index(SUBJECT)).sum() > 10


@pytest.mark.usefixtures("drawing")
def test_same_subject_same_picture_another_state_another_picture() -> None:
    on, off = (
        render_object(SceneSubject("DeskLamp", 4, state), 7, quality="fast").astype(int) for state in ("on", "off")
    )
    assert (np.abs(on - off).max(axis=2) > 30).sum() > 500
    assert (render_object(SceneSubject("DeskLamp", 4, "off"), 7, quality="fast") == off).all()
