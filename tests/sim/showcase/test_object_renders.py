"""Single things as an agent would see them: where they stand, from how far, and that the key stays apart."""

import json
from pathlib import Path

import numpy as np
import pytest

from vigil.assets.catalog import CATALOG
from vigil.scene.geometry import body_box, bounding_box
from vigil.sim.core.sight import directions, project
from vigil.sim.engines.mujoco.engine import MujocoEngine
from vigil.sim.showcase import object_renders as showcase
from vigil.sim.showcase.object_renders import (
    FARTHEST_M,
    NEAREST_M,
    SPAN_PX,
    draw_subjects,
    marked,
    render_object,
    view_of,
    write_blind,
)
from vigil.sim.showcase.places import HEIGHT_M, HOSTS, RAILS, host_of
from vigil.sim.showcase.staged_scenes import DEPTH_M, SUBJECT, WIDTH_M, SceneSubject, staged_scene, states_of


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


def test_lots_show_every_category_in_other_variants_and_states() -> None:
    lots = draw_subjects(3 * len(CATALOG), 2)
    assert lots == draw_subjects(3 * len(CATALOG), 2) != draw_subjects(3 * len(CATALOG), 3)
    for category in CATALOG:
        drawn = [lot for lot in lots if lot.category == category]
        assert len({lot.variant for lot in drawn}) == 3
    assert {lot.state for lot in lots if lot.category == "Fridge"} == {"open", "closed"}
    assert {lot.state for lot in lots if lot.category == "Microwave"} == {"open", "closed", "on"}


def test_lots_are_drawn_until_so_many_suit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(showcase, "CATALOG", {name: CATALOG[name] for name in ("Egg", "Fork")})
    lots = draw_subjects(9, 2, lambda subject: subject.category == "Egg")
    assert {lot.category for lot in lots} == {"Egg"}
    assert len({lot.variant for lot in lots}) == 9
    with pytest.raises(ValueError, match="ask for fewer"):
        draw_subjects(1, 2, lambda _: False)


@pytest.mark.usefixtures("drawing")
def test_blind_pictures_carry_no_names_and_the_key_lies_outside(tmp_path: Path) -> None:
    lots = draw_subjects(2, 9)
    key = write_blind(tmp_path / "round", lots, 9)
    assert sorted(path.name for path in (tmp_path / "round").iterdir()) == ["001.png", "002.png"]
    assert key.parent == tmp_path
    shown = json.loads(key.read_text())["pictures"]
    assert [SceneSubject(**shown[name]) for name in sorted(shown)] == lots


def test_marks_lie_around_the_box_and_within_the_picture() -> None:
    plain = np.full((480, 640, 3), 128, np.uint8)
    drawn = (np.asarray(marked(plain, (300.0, 200.0, 340.0, 230.0))) != 128).any(axis=2)
    assert drawn.any()
    assert not drawn[200:231, 300:341].any()
    rows, columns = np.nonzero(drawn)
    assert (rows.min() > 185, rows.max() < 245, columns.min() > 285, columns.max() < 355) == (True,) * 4
    assert marked(plain, (-50.0, -50.0, 900.0, 700.0)).size == (640, 480)
