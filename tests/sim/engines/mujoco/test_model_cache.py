"""Models kept for scenes that are loaded again, and geoms left out of frames: neither may ever be seen."""

import inspect
from dataclasses import replace
from weakref import WeakSet

import numpy as np
import pytest
from cachetools import LRUCache

from tests.support.drawing_everything import draw_everything
from vigil.assets.database import AssetDatabase
from vigil.base.geometry import Pose, Vec3
from vigil.protocol.actions import InteractPixel, Navigate
from vigil.protocol.house import MaterialRef
from vigil.protocol.world import Setup, WorldState
from vigil.rendering import surfaces
from vigil.rendering.culling import in_view
from vigil.scene.things import Scene
from vigil.sim import make_simulator
from vigil.sim.conformance.reference_house import reference_house
from vigil.sim.engines.mujoco import rays
from vigil.sim.engines.mujoco.compiled import builder, model_cache
from vigil.sim.engines.mujoco.compiled.model import CompiledModel, build
from vigil.sim.privileged import PrivilegedSimulator


@pytest.fixture(autouse=True)
def _empty_store():
    model_cache.clear()
    yield
    model_cache.clear()


def test_a_kept_model_is_handed_out_as_an_equal_copy(scene: Scene) -> None:
    first, second = model_cache.model_of(scene), model_cache.model_of(scene)
    fresh = build(scene)
    for model in (first, second):
        for name in ("mesh_vert", "tex_data", "light_pos", "geom_dataid"):
            assert np.array_equal(getattr(model.native, name), getattr(fresh.native, name)), name
        for name in ("groups", "materials"):
            assert np.array_equal(getattr(model, name), getattr(fresh, name)), name
        assert np.array_equal(model.data.geom_xpos, fresh.data.geom_xpos)
    assert first.native is second.native, "the large part is shared"
    assert first.data is not second.data
    assert first.lamps is not second.lamps


def test_rays_meet_what_is_shown_in_their_own_copy(scene: Scene) -> None:
    first, second = model_cache.model_of(scene), model_cache.model_of(scene)
    cube = scene.things["cube"]
    eye, down = cube.position._replace(y=cube.position.y + 1.0), np.array([[0.0, -1.0, 0.0]])
    scene.things["cube"].is_present = False
    first.place(cube)
    scene.things["cube"].is_present = True
    met = [rays.cast(model, eye, down, through_glass=False).things[0] for model in (second, first, second)]
    assert met[0] == met[2] == list(scene.things).index("cube")
    assert met[1] != met[0]


def test_a_model_is_the_same_when_pieces_are_made_anew_for_every_thing(scene: Scene, monkeypatch) -> None:
    """As two threads may make them that build at once: only one's are kept."""
    usual = build(scene)
    monkeypatch.setattr(builder, "pieces_of", inspect.unwrap(builder.pieces_of))
    for copy_number in range(20):
        cube = scene.things["cube"]
        scene.things[f"cube{copy_number}"] = replace(cube, id=f"cube{copy_number}", position=Vec3(-1.5, 0.1, 0.0))
    anew = build(scene)
    for thing_id in usual.things:
        for before, after in zip(usual.things[thing_id].geoms, anew.things[thing_id].geoms, strict=True):
            assert np.array_equal(_shape(usual, before), _shape(anew, after))
    assert len({_shape(anew, anew.things[f"cube{n}"].geoms[0]).tobytes() for n in range(20)}) == 1


def _shape(model: CompiledModel, geom: int) -> np.ndarray:
    """Return the vertices of a geom's mesh."""
    mesh = model.native.geom_dataid[geom]
    first = model.native.mesh_vertadr[mesh]
    return model.native.mesh_vert[first : first + model.native.mesh_vertnum[mesh]]


def test_what_happens_in_one_scene_stays_there(scene: Scene) -> None:
    first = model_cache.model_of(scene)
    cabinet = scene.things["cabinet"]
    before = first.data.geom_xpos.copy()
    cabinet.openness, cabinet.is_toggled = 1.0, True
    first.place(cabinet)
    first.update_kinematics()
    first.lamps.dim_rooms = frozenset({0})
    assert not np.array_equal(first.data.geom_xpos, before)
    cabinet.openness, cabinet.is_toggled = 0.0, False
    second = model_cache.model_of(scene)
    assert np.array_equal(second.data.geom_xpos, before)
    assert np.array_equal(second.materials, build(scene).materials)
    assert not second.lamps.dim_rooms


def _other_wall(scene: Scene) -> None:
    scene.panels[0] = replace(scene.panels[0], material=MaterialRef(name="brick"))


def _other_floor(scene: Scene) -> None:
    scene.rooms[0] = replace(scene.rooms[0], polygon=scene.rooms[0].polygon * 1.1)


def _other_place(scene: Scene) -> None:
    scene.things["cube"].position = Vec3(0.5, 0.1, 0.0)


def _other_state(scene: Scene) -> None:
    scene.things["cabinet"].openness = 0.5


def _other_asset(scene: Scene) -> None:
    scene.things["cube"].asset = scene.things["big"].asset


def _one_less(scene: Scene) -> None:
    del scene.things["cube"]


@pytest.mark.parametrize(
    "change", [_other_wall, _other_floor, _other_place, _other_state, _other_asset, _one_less], ids=lambda f: f.__name__
)
def test_a_scene_that_differs_in_anything_gets_a_model_of_its_own(scene: Scene, change, monkeypatch) -> None:
    built = []
    monkeypatch.setattr(model_cache, "build", lambda wanted: built.append(wanted) or build(wanted))
    model_cache.model_of(scene)
    model_cache.model_of(scene)
    assert len(built) == 1
    change(scene)
    changed = model_cache.model_of(scene)
    assert len(built) == 2
    assert np.array_equal(changed.data.geom_xpos, build(scene).data.geom_xpos)


def test_only_the_latest_scenes_are_kept(scene: Scene, monkeypatch) -> None:
    built = []
    monkeypatch.setattr(model_cache, "build", lambda wanted: built.append(wanted) or build(wanted))
    for number in range(model_cache.MAX_CACHED + 1):
        scene.things["cube"].position = Vec3(0.1 * number, 0.1, 0.0)
        model_cache.model_of(scene)
    model_cache.model_of(scene)
    assert len(built) == model_cache.MAX_CACHED + 1
    scene.things["cube"].position = Vec3(0.0, 0.1, 0.0)
    model_cache.model_of(scene)
    assert len(built) == model_cache.MAX_CACHED + 2


def test_fewer_large_scenes_are_kept(scene: Scene, monkeypatch) -> None:
    most = build(scene).native.nbuffer * 5 // 2
    monkeypatch.setattr(model_cache, "MAX_CACHED_BYTES", most)
    monkeypatch.setattr(model_cache, "_cached", LRUCache(most, getsizeof=model_cache._size))
    for number in range(4):
        scene.things["cube"].position = Vec3(0.1 * number, 0.1, 0.0)
        model_cache.model_of(scene)
    assert len(model_cache._cached) == 2
    monkeypatch.setattr(model_cache, "MAX_CACHED_BYTES", 1)
    assert model_cache._size(build(scene)) == 1, "a model that is larger than the cache would not be kept at all"


def test_prepared_models_wait_for_their_engines(scene: Scene, monkeypatch) -> None:
    monkeypatch.setattr(model_cache, "_engines", WeakSet())
    engines = [type("Engine", (), {})() for _ in range(model_cache.MAX_CACHED + 2)]
    for engine in engines:
        model_cache.register_engine(engine)
    places = [Vec3(0.1 * number, 0.1, 0.0) for number in range(len(engines) + 1)]
    for place in places:
        scene.things["cube"].position = place
        model_cache.prepare(scene)
    built: list[Scene] = []
    monkeypatch.setattr(model_cache, "build", lambda wanted: built.append(wanted) or build(wanted))
    for place in places[1:]:
        scene.things["cube"].position = place
        model_cache.model_of(scene)
    assert not built, "as many models as there are engines were kept"
    scene.things["cube"].position = places[0]
    model_cache.model_of(scene)
    assert len(built) == 1, "the model that was prepared first had to go"


def _play(simulator: PrivilegedSimulator, *, drawn: bool) -> tuple[list[WorldState], list[bytes]]:
    """Return the states and frames of a short walk with some opening, picking and dropping."""
    house = reference_house()
    simulator.load(house)
    simulator.reset(Pose(position=Vec3(1.4, 0.0, 3.2), rotation=180.0, horizon=30.0), Setup())
    ids = simulator.object_ids()
    states, frames = [simulator.world(ids)], []
    for turn in range(4):
        seen = {thing_id: simulator.pixels_of(thing_id) for thing_id in ids}
        for pixels in seen.values():
            for intent in ("open_access", "activate", "pick") if len(pixels) else ():
                x, y = (int(value) for value in pixels[len(pixels) // 2])
                simulator.step(InteractPixel(intent=intent, x=x, y=y))
        simulator.step(Navigate(mode="forward", magnitude=1.0 + turn))
        simulator.step(Navigate(mode="turn_right", magnitude=80.0))
        states.append(simulator.world(ids))
        if drawn:
            frames.append(simulator.frame().tobytes())
    simulator.close()
    return states, frames


@pytest.mark.usefixtures("drawing")
def test_a_house_loaded_again_has_the_same_states_and_frames(monkeypatch) -> None:
    first = _play(make_simulator("mujoco", assets=AssetDatabase.default(), quality="fast"), drawn=True)
    monkeypatch.setattr(model_cache, "build", None)  # the second time, nothing is built
    again = _play(make_simulator("mujoco", assets=AssetDatabase.default(), quality="fast"), drawn=True)
    assert again == first
    assert any(state.held for state in first[0])
    assert len(set(first[1])) == len(first[1])


@pytest.mark.usefixtures("drawing")
def test_frames_are_the_same_with_all_geoms_drawn(monkeypatch) -> None:
    simulator = make_simulator("mujoco", assets=AssetDatabase.default(), quality="fast")
    left_out: list[float] = []

    def counted(triangles, state, viewer):
        shown = in_view(triangles, state, viewer)
        drawn = sum(map(len, shown.groups()))
        left_out.append(1.0 - drawn / len(triangles.geometry.faces))
        return shown

    monkeypatch.setattr(surfaces, "in_view", counted)
    _, frames = _play(simulator, drawn=True)
    assert min(left_out) > 0.5
    draw_everything(monkeypatch)
    left_out.clear()
    assert _play(simulator, drawn=True)[1] == frames
    assert max(left_out) < 0.2  # what is not visible in any picture
