"""What lights a picture: lamps that are on and switches that are off, where they are seen in it, and nowhere else."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from vigil.assets.catalog import CATALOG
from vigil.assets.database import AssetDatabase
from vigil.assets.kernel.asset import Glow
from vigil.assets.making import make
from vigil.base.geometry import Pose, Vec3
from vigil.protocol.world import ObjectSetup, Setup
from vigil.scene.things import Scene, Thing
from vigil.sim import make_simulator
from vigil.sim.conformance.reference_house import reference_house
from vigil.sim.core.embedded import EmbeddedSimulator
from vigil.sim.core.sight import AGENT_LENS
from vigil.sim.engines.mujoco import light_sources
from vigil.sim.engines.mujoco.engine import MujocoEngine
from vigil.sim.scene_editor import CameraView

pytestmark = pytest.mark.usefixtures("drawing")
AHEAD = Pose(position=Vec3(0.0, 0.0, -1.5), rotation=0.0, horizon=20.0)
BACK = AHEAD.model_copy(update={"rotation": 180.0})
SHINING = Glow(Vec3(0.0, 0.0, 0.0), (1.0, 0.9, 0.7), 1.0)


def light_switch() -> Thing:
    """Return a switch on the far wall, opposite the agent."""
    size = CATALOG["LightSwitch"].typical_size
    return Thing("switch", "LightSwitch", make("LightSwitch", size, 0), Vec3(-0.8, 1.2, 1.98), Vec3(0.0, 180.0, 0.0))


def frames(scene: Scene, thing_id: str, agent: Pose, held: str | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Return the frames in which a thing is off and on."""
    engine, found = MujocoEngine("fast"), []
    engine.load(scene)
    for is_toggled in (False, True):
        scene.things[thing_id].is_toggled = is_toggled
        engine.update(scene, {thing_id})
        found.append(engine.draw(agent, held).astype(int))
    engine.close()
    return found[0], found[1]


def with_lamp(scene: Scene, position: Vec3) -> Scene:
    """Return the scene with its cube as a lamp somewhere."""
    cube = scene.things["cube"]
    cube.asset, cube.position = replace(cube.asset, glow=SHINING), position
    return scene


@pytest.mark.parametrize(
    ("position", "agent"),
    [
        (Vec3(-1.0, 0.1, 0.0), BACK),
        (Vec3(0.2, 0.4, 0.45), AHEAD),  # in the cabinet, behind its leaf
        (Vec3(1.8, 0.1, 1.8), AHEAD),  # behind the large cube
        (Vec3(-1.0, 0.1, 2.5), AHEAD),  # behind the wall
    ],
)
def test_a_lamp_out_of_view_lights_nothing(scene: Scene, position: Vec3, agent: Pose) -> None:
    off, on = frames(with_lamp(scene, position), "cube", agent)
    assert np.array_equal(off, on)


def test_a_lamp_in_view_lights_what_is_near(scene: Scene) -> None:
    off, on = frames(with_lamp(scene, Vec3(-1.0, 0.1, 0.0)), "cube", AHEAD)
    assert np.count_nonzero((on - off).max(axis=2) > 4) > 2000


def test_a_lamp_in_the_hand_shines(scene: Scene) -> None:
    scene.things["cube"].is_held = True
    off, on = frames(with_lamp(scene, Vec3(0.0, 0.8, -1.0)), "cube", AHEAD, held="cube")
    assert np.count_nonzero((on - off).max(axis=2) > 4) > 2000


def test_a_room_is_dim_where_its_switch_is_seen_and_off(scene: Scene) -> None:
    scene.things["switch"] = light_switch()
    off, on = frames(scene, "switch", AHEAD)
    assert off.mean() < 0.9 * on.mean()
    off, on = frames(scene, "switch", BACK)
    assert np.array_equal(off, on)


def test_what_another_camera_does_not_show_lights_nothing_in_it(scene: Scene) -> None:
    engine, found = MujocoEngine("fast"), []
    with_lamp(scene, Vec3(-1.0, 0.1, 0.0))
    engine.load(scene)
    narrow = CameraView(AHEAD.eye, 25.0, 20.0, 40.0, 200, 300)
    wide = replace(narrow, fovy_deg=100.0, width=600)
    for view in (narrow, wide):
        for is_toggled in (False, True):
            scene.things["cube"].is_toggled = is_toggled
            engine.update(scene, {"cube"})
            found.append(engine.render_view(view, frozenset({"rgb"}), None).rgb)
    engine.close()
    assert np.array_equal(found[0], found[1])
    assert not np.array_equal(found[2], found[3])


@pytest.fixture(scope="module")
def simulator() -> Iterator[EmbeddedSimulator]:
    made = make_simulator("mujoco", assets=AssetDatabase.default())
    assert isinstance(made, EmbeddedSimulator)
    yield made
    made.close()


def test_what_lights_a_frame_is_counted_as_seen(simulator: EmbeddedSimulator) -> None:
    house = reference_house()
    simulator.load(house)
    assert house.start is not None
    simulator.reset(house.start, Setup())
    things = [thing for thing in simulator.scene().things.values() if thing.is_toggleable]
    engine, both = simulator._engine, set()
    assert isinstance(engine, MujocoEngine)
    for x, z in simulator.reachable(house.start.position, 1.0).tolist():
        for yaw in (0.0, 75.0, 150.0, 225.0, 300.0):
            pose = Pose(position=Vec3(x, 0.0, z), rotation=yaw, horizon=15.0)
            simulator.stand(pose)
            counted = simulator.world([thing.id for thing in things]).objects
            for thing in things:
                is_seen = light_sources.is_seen(engine.model, thing, pose, AGENT_LENS)
                both.add(is_seen)
                assert counted[thing.id].visible_px > 0 or not is_seen
                assert counted[thing.id].visible_px < 2000 or is_seen
    assert both == {False, True}


@pytest.mark.parametrize(
    ("lamp", "start"),
    [
        ("FloorLamp|1", Pose(position=Vec3(2.0, 0.0, 1.0), rotation=45.0)),  # behind the agent
        ("FloorLamp|2", Pose(position=Vec3(5.2, 0.0, 3.5), rotation=140.0)),  # behind a shut door
    ],
)
def test_first_frames_tell_nothing_of_what_is_out_of_view(simulator: EmbeddedSimulator, lamp: str, start: Pose) -> None:
    simulator.load(reference_house())
    found = []
    for is_toggled in (False, True):
        simulator.reset(start, Setup(objects={lamp: ObjectSetup(is_toggled=is_toggled)}))
        assert simulator.world([lamp]).objects[lamp].visible_px == 0
        found.append(simulator.frame())
    assert np.array_equal(*found)
