"""Rays that pass over what they cannot meet: the same hits as without."""

import math

import numpy as np
import pytest

from vigil.assets.database import AssetDatabase
from vigil.base.geometry import Vec3
from vigil.packs.pack import Pack
from vigil.scene.build import build_scene
from vigil.scene.things import Scene
from vigil.sim.core.sight import boxes_of, farthest_m
from vigil.sim.engines.mujoco import rays
from vigil.sim.engines.mujoco.engine import MujocoEngine

RAYS = 300


@pytest.fixture(scope="module")
def furnished() -> tuple[Scene, MujocoEngine, Vec3]:
    """A house of several rooms, and an eye in it."""
    pack = Pack.load("starter")
    episode = max(pack.episodes, key=lambda each: len(pack.house_of(each).document.rooms))
    scene, engine = build_scene(pack.house_of(episode), AssetDatabase.default()), MujocoEngine()
    engine.load(scene)
    return scene, engine, episode.start.eye


def cone(half_angle_deg: float, seed: int) -> np.ndarray:
    """Unit directions about a random level axis."""
    rng = np.random.default_rng(seed)
    yaw = rng.uniform(0.0, 2 * math.pi)
    towards = np.array([math.sin(yaw), -0.2, math.cos(yaw)])
    found = towards + math.tan(math.radians(half_angle_deg)) * rng.uniform(-1.0, 1.0, size=(RAYS, 3))
    return found / np.linalg.norm(found, axis=1, keepdims=True)


@pytest.mark.parametrize("half_angle_deg", [1.0, 10.0, 45.0, 85.0])
@pytest.mark.parametrize("through_glass", [False, True])
def test_what_is_beside_the_rays_changes_no_hit(
    furnished: tuple[Scene, MujocoEngine, Vec3],
    half_angle_deg: float,
    through_glass: bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    _, engine, eye = furnished
    for seed in range(6):
        directions = cone(half_angle_deg, seed)
        pruned = engine.cast(eye, directions, through_glass=through_glass)
        with monkeypatch.context() as patch:
            patch.setattr(rays, "PRUNED_FROM", RAYS + 1)
            every = engine.cast(eye, directions, through_glass=through_glass)
        assert (pruned.things == every.things).all()
        assert (pruned.roles == every.roles).all()
        assert (pruned.distances == every.distances).all()


def test_what_is_beyond_a_distance_alone_may_be_missed(furnished: tuple[Scene, MujocoEngine, Vec3]) -> None:
    _, engine, eye = furnished
    within_m, missed = 1.5, 0
    for seed in range(6):
        directions = cone(60.0, seed)
        every = engine.cast(eye, directions, through_glass=True)
        near = engine.cast(eye, directions, through_glass=True, within_m=within_m)
        is_near = every.distances <= within_m
        assert (near.things[is_near] == every.things[is_near]).all()
        assert (near.distances[is_near] == every.distances[is_near]).all()
        assert (near.distances[~is_near] > within_m).all()
        missed += int((near.things != every.things).sum())
    assert missed


def test_nothing_is_left_hidden_after_a_cast(furnished: tuple[Scene, MujocoEngine, Vec3]) -> None:
    _, engine, eye = furnished
    before = engine.model.groups.copy()
    engine.cast(eye, cone(5.0, 0), through_glass=True, within_m=1.0)
    assert (engine.model.groups == before).all()


def test_no_ray_meets_a_thing_farther_than_its_farthest_part(furnished: tuple[Scene, MujocoEngine, Vec3]) -> None:
    scene, engine, eye = furnished
    met = 0
    for seed in range(6):
        hits = engine.cast(eye, cone(80.0, seed), through_glass=True)
        for index in np.unique(hits.things[hits.things >= 0]):
            thing = list(scene.things.values())[index]
            distances = hits.distances[hits.things == index]
            met += len(distances)
            assert distances.max() <= farthest_m(eye, boxes_of([thing]))
    assert met > RAYS // 2


def test_what_has_moved_is_met_where_it_is_now(
    furnished: tuple[Scene, MujocoEngine, Vec3], monkeypatch: pytest.MonkeyPatch
) -> None:
    scene, engine, eye = furnished
    engine.cast(eye, cone(10.0, 0), through_glass=True)
    thing = next(thing for thing in scene.things.values() if thing.is_pickupable)
    before, thing.position = thing.position, Vec3(eye.x, eye.y, eye.z + 0.5)
    engine.update(scene, {thing.id})
    towards = np.array([[0.0, 0.0, 1.0]] * rays.PRUNED_FROM)
    there = engine.cast(eye, towards, through_glass=True, within_m=2.0)
    thing.position = before
    engine.update(scene, {thing.id})
    gone = engine.cast(eye, towards, through_glass=True, within_m=2.0)
    index = list(scene.things).index(thing.id)
    assert (there.things == index).all()
    assert (gone.things != index).all()


def test_rays_go_on_behind_what_they_are_cast_without(furnished: tuple[Scene, MujocoEngine, Vec3]) -> None:
    scene, engine, eye = furnished
    directions, names = cone(45.0, 0), list(scene.things)
    every = engine.cast(eye, directions, through_glass=True)
    first = np.bincount(every.things[every.things >= 0]).argmax()
    rest = engine.cast(eye, directions, through_glass=True, without=[names[first]])
    alone = engine.cast(eye, directions, through_glass=False, only=names[first])
    was_met = every.things == first
    assert was_met.any()
    assert (rest.things != first).all()
    assert (rest.distances[was_met] >= every.distances[was_met]).all()
    assert (rest.things[~was_met] == every.things[~was_met]).all()
    assert (alone.distances[was_met] == every.distances[was_met]).all()
