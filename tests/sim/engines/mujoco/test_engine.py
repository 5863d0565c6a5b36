import hashlib
import subprocess
import sys
import threading

import numpy as np
import pytest

from tests.support import cabinet_scene
from tests.support.waiting import HANGS_AFTER_S
from vigil.base.geometry import Pose, Vec3
from vigil.errors import SimulatorError
from vigil.rendering.painter import Painter
from vigil.scene.things import Scene
from vigil.sim.core.engine import BEARS_OPEN, BEARS_TOGGLE
from vigil.sim.engines.mujoco.camera import FOVY_DEG
from vigil.sim.engines.mujoco.compiled import frames
from vigil.sim.engines.mujoco.engine import MujocoEngine

CABINET, CUBE = 0, 1


def pixel_rays(agent: Pose, stride: int = 1) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return rows, columns and unit directions (n, 3) in THOR's frame of every `stride`th pixel."""
    v, u = (index.ravel() for index in np.mgrid[0:480:stride, 0:640:stride])
    focal = 240.0 / np.tan(np.radians(FOVY_DEG / 2))
    right, up, back = frames.mujoco_camera_axes(agent).T
    rays = np.outer(u + 0.5 - 320.0, right) - np.outer(v + 0.5 - 240.0, up) - focal * back
    return v, u, frames.points(rays / np.linalg.norm(rays, axis=1, keepdims=True))


def towards(engine: MujocoEngine, origin: Vec3, target: Vec3, *, through_glass: bool = False, only: str | None = None):
    direction = np.subtract(target, origin)
    direction = direction / np.linalg.norm(direction)
    return engine.cast(origin, direction[None], through_glass=through_glass, only=only)


@pytest.mark.usefixtures("drawing")
def test_rays_meet_what_the_pixels_show(engine: MujocoEngine, agent: Pose) -> None:
    shown = engine.model.geom_things[engine.camera.segment(agent)]
    v, u, directions = pixel_rays(agent, stride=2)
    met = engine.cast(agent.eye, directions, through_glass=False).things
    differs = met != shown[v, u]
    assert differs.mean() < 1e-3
    inside = np.ones(shown.shape, dtype=bool)
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            inside &= np.roll(shown, (dy, dx), (0, 1)) == shown
    assert not (differs & inside[v, u]).any()
    assert set(np.unique(met)) == {-1, 0, 1, 2}


def test_glass_belongs_to_its_owner_and_lets_sight_through(engine: MujocoEngine, agent: Pose) -> None:
    pane = Vec3(-0.2, 0.4, 0.3)  # the cabinet faces the agent, so its left is the agent's right
    click = towards(engine, agent.eye, pane)
    sight = towards(engine, agent.eye, pane, through_glass=True)
    assert click.things[0] == sight.things[0] == CABINET
    assert sight.distances[0] > click.distances[0] + 0.05


def test_only_meets_one_thing_and_leaves_no_trace(engine: MujocoEngine, agent: Pose) -> None:
    behind = Vec3(1.3, 0.45, 1.3)
    before = towards(engine, agent.eye, behind)
    alone = towards(engine, agent.eye, behind, only="big")
    assert alone.things[0] == 2
    assert towards(engine, agent.eye, behind, only="cube").things[0] == -1
    after = towards(engine, agent.eye, behind)
    assert before.things[0] == after.things[0]
    assert before.distances[0] == after.distances[0]


def test_roles_tell_leaf_from_screen_from_body(engine: MujocoEngine, agent: Pose) -> None:
    assert towards(engine, agent.eye, Vec3(0.2, 0.3, 0.3)).roles[0] == BEARS_OPEN
    assert towards(engine, agent.eye, Vec3(0.0, 0.95, 0.5)).roles[0] == BEARS_TOGGLE
    assert towards(engine, agent.eye, Vec3(-1.0, 0.1, 0.0)).roles[0] == 0


def test_nothing_met_is_infinitely_far(engine: MujocoEngine) -> None:
    up = engine.cast(Vec3(0.0, 5.0, 0.0), np.array([[0.0, 1.0, 0.0]]), through_glass=False)
    assert up.things[0] == -1
    assert np.isinf(up.distances[0])
    none = engine.cast(Vec3(0.0, 1.0, 0.0), np.empty((0, 3)), through_glass=True)
    assert len(none.things) == len(none.distances) == 0


def test_absent_and_held_things_are_never_met(engine: MujocoEngine, scene: Scene, agent: Pose) -> None:
    cube = Vec3(-1.0, 0.1, 0.0)
    assert towards(engine, agent.eye, cube).things[0] == CUBE
    scene.things["cube"].is_held = True
    engine.update(scene, {"cube"})
    assert towards(engine, agent.eye, cube).things[0] == -1
    assert towards(engine, agent.eye, cube, only="cube").things[0] == -1
    scene.things["cube"].is_held, scene.things["cube"].is_present = False, False
    engine.update(scene, {"cube"})
    assert towards(engine, agent.eye, cube).things[0] == -1


def test_opening_moves_the_leaf_out_of_the_way(engine: MujocoEngine, scene: Scene, agent: Pose) -> None:
    front = Vec3(0.2, 0.3, 0.3)
    closed = towards(engine, agent.eye, front)
    scene.things["cabinet"].openness = 1.0
    engine.update(scene, {"cabinet"})
    opened = towards(engine, agent.eye, front)
    assert opened.distances[0] > closed.distances[0] + 0.05
    leaf = towards(engine, Vec3(-0.5, 0.4, 0.1), Vec3(1.0, 0.4, 0.1))
    assert leaf.roles[0] == BEARS_OPEN
    assert leaf.distances[0] == pytest.approx(0.85, abs=0.01)


def test_holes_are_seen_through(engine: MujocoEngine) -> None:
    eye = Vec3(1.35, 1.53, 0.0)
    assert towards(engine, eye, Vec3(1.35, 1.47, 2.0)).distances[0] > 10.0
    assert towards(engine, eye, Vec3(0.51, 1.47, 2.0)).distances[0] < 2.5


@pytest.mark.usefixtures("drawing")
def test_states_show_and_are_taken_back(engine: MujocoEngine, scene: Scene, agent: Pose) -> None:
    def frame_with(**state: float | bool) -> np.ndarray:
        for name, value in state.items():
            setattr(scene.things["cabinet"], name, value)
        engine.update(scene, {"cabinet"})
        return engine.draw(agent, None)

    at_rest = frame_with()
    assert at_rest.shape == (480, 640, 3)
    assert at_rest.dtype == np.uint8
    opened, on = frame_with(openness=1.0), frame_with(openness=0.0, is_toggled=True)
    for other in (opened, on):
        assert (np.abs(other.astype(int) - at_rest).max(axis=2) > 20).sum() > 2000
    assert np.array_equal(frame_with(is_toggled=False), at_rest)


@pytest.mark.usefixtures("drawing")
@pytest.mark.parametrize("name", ["cube", "big", "cabinet"])
def test_held_things_are_drawn_small_at_the_bottom_centre(
    name: str, engine: MujocoEngine, scene: Scene, agent: Pose
) -> None:
    thing = scene.things[name]
    thing.is_present = False
    engine.update(scene, {name})
    without = engine.draw(agent, None)
    thing.is_present, thing.is_held = True, True
    engine.update(scene, {name})
    changed = (engine.draw(agent, name) != without).any(axis=2)
    columns, rows = np.flatnonzero(changed.any(axis=0)), np.flatnonzero(changed.any(axis=1))
    assert 60 < np.ptp(columns) <= 160
    assert abs((columns[0] + columns[-1]) / 2 - 320) < 25
    assert rows[-1] > 440
    assert rows[0] > 290


@pytest.mark.usefixtures("drawing")
def test_held_things_never_enter_a_wall(engine: MujocoEngine, scene: Scene) -> None:
    scene.things["big"].is_held = True
    engine.update(scene, {"big"})
    near = engine.draw(Pose(position=Vec3(-1.75, 0.0, 0.0), rotation=270.0), "big")
    far = engine.draw(Pose(position=Vec3(0.0, 0.0, 0.0), rotation=270.0), "big")
    patch = np.s_[400:460, 290:350]
    blue = (
        (near[patch][..., 2] > near[patch][..., 0] + 25).mean(),
        (far[patch][..., 2] > far[patch][..., 0] + 25).mean(),
    )
    assert min(blue) > 0.9


@pytest.mark.usefixtures("drawing")
def test_live_scenes_do_not_disturb_each_other(engine: MujocoEngine, scene: Scene, agent: Pose) -> None:
    alone = engine.draw(agent, None)
    other = MujocoEngine("default")
    other.load(scene)
    fine = other.draw(agent, None)
    assert np.array_equal(engine.draw(agent, None), alone)
    assert np.array_equal(other.draw(agent, None), fine)
    other.close()
    assert np.array_equal(engine.draw(agent, None), alone)


SCRIPT = """
import hashlib, importlib.util, sys
from vigil.base.geometry import Pose, Vec3
from vigil.sim.engines.mujoco.engine import MujocoEngine
spec = importlib.util.spec_from_file_location("scenes", sys.argv[1])
scenes = importlib.util.module_from_spec(spec)
spec.loader.exec_module(scenes)
engine = MujocoEngine("fast")
engine.load(scenes.make_scene())
frame = engine.draw(Pose(position=Vec3(0.0, 0.0, -1.5), rotation=0.0, horizon=20.0), None)
print(hashlib.sha256(frame.tobytes()).hexdigest(), *sorted({"scipy", "OpenGL.GL"} & set(sys.modules)))
"""


@pytest.mark.usefixtures("drawing")
def test_another_process_draws_the_same_bytes_and_leaves_quietly(engine: MujocoEngine, agent: Pose) -> None:
    """It needs none of the large libraries for it that take longest to load."""
    ours = hashlib.sha256(engine.draw(agent, None).tobytes()).hexdigest()
    command = [sys.executable, "-W", "error", "-c", SCRIPT, cabinet_scene.__file__]
    other = subprocess.run(command, capture_output=True, text=True, timeout=HANGS_AFTER_S, check=False)
    assert other.stderr == ""
    assert other.returncode == 0
    assert other.stdout.strip() == ours


@pytest.mark.usefixtures("drawing")
def test_drawing_in_a_second_thread_is_refused(engine: MujocoEngine, agent: Pose) -> None:
    engine.draw(agent, None)
    faults: list[Exception] = []

    def draw() -> None:
        try:
            engine.draw(agent, None)
        except SimulatorError as error:
            faults.append(error)

    thread = threading.Thread(target=draw)
    thread.start()
    thread.join()
    assert "second thread" in str(faults[0])


def test_an_engine_can_load_again_after_closing(engine: MujocoEngine, scene: Scene, agent: Pose) -> None:
    engine.close()
    engine.load(scene)
    assert towards(engine, agent.eye, Vec3(-1.0, 0.1, 0.0)).things[0] == CUBE


@pytest.mark.usefixtures("drawing")
def test_a_frame_with_equal_contents_is_drawn_once(
    engine: MujocoEngine, scene: Scene, agent: Pose, monkeypatch: pytest.MonkeyPatch
) -> None:
    painted: list[object] = []
    paint = Painter.paint
    monkeypatch.setattr(Painter, "paint", lambda *given: painted.append(1) or paint(*given))
    other = MujocoEngine("fast")
    other.load(scene)
    first = engine.draw(agent, None)
    wanted = first.copy()
    first[:] = 0  # the caller may change its frame
    assert np.array_equal(other.draw(agent, None), wanted)
    assert len(painted) == 1
    thing = next(iter(scene.things.values()))
    thing.is_present = False
    other.update(scene, {thing.id})
    assert not np.array_equal(other.draw(agent, None), wanted)
    assert np.array_equal(engine.draw(agent, None), wanted)
    assert len(painted) == 2
    other.close()
