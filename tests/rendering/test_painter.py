"""Frames, with mirrors, lamps and what is held."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support.cabinet_scene import block, cube
from vigil.assets.kernel.asset import Asset, Glow, Part
from vigil.base.geometry import Pose, Vec3
from vigil.protocol.observation import Quality
from vigil.rendering.mirrors import box_of
from vigil.rendering.viewer import Viewer
from vigil.scene.things import Scene, Thing
from vigil.sim.engines.mujoco.compiled import model_cache
from vigil.sim.engines.mujoco.engine import MujocoEngine

LOOK = Pose(position=Vec3(0.0, 0.0, -1.5), rotation=0.0, horizon=20.0)


def draw(scene: Scene, agent: Pose = LOOK, held: str | None = None, quality: Quality = "default") -> np.ndarray:
    engine = MujocoEngine(quality)
    engine.load(scene)
    try:
        return engine.draw(agent, held)
    finally:
        engine.close()


def is_red(frame: np.ndarray) -> np.ndarray:
    red, green, blue = (frame[..., number].astype(int) for number in range(3))
    return (red > 90) & (red > 2 * green) & (red > 2 * blue)


@pytest.mark.usefixtures("drawing")
@pytest.mark.parametrize("quality", ["default", "fast"])
def test_frames_are_the_same_bytes_again(scene: Scene, quality) -> None:
    assert np.array_equal(draw(scene, quality=quality), draw(scene, quality=quality))


@pytest.mark.usefixtures("drawing")
@pytest.mark.parametrize("quality", ["default", "fast"])
def test_a_frame_does_not_depend_on_the_setups_drawn_before_it(scene: Scene, quality) -> None:
    home, aside = scene.things["big"].position, Vec3(-1.2, 0.45, 1.2)
    setups = [{"big": home}, {"big": aside}, {"big": aside, "cube": home}, {"big": home, "cube": aside}]
    cube = scene.things["cube"].position

    def frames(order: list[int]) -> dict[int, np.ndarray]:
        model_cache.clear()
        engine = MujocoEngine(quality)
        engine.load(scene)
        drawn = {}
        for number in order:
            for thing_id, position in ({"big": home, "cube": cube} | setups[number]).items():
                scene.things[thing_id].position = position
            engine.update(scene, {"big", "cube"})
            drawn[number] = engine.draw(LOOK, None)
        engine.close()
        scene.things["big"].position, scene.things["cube"].position = home, cube
        return drawn

    fresh = [frames([number])[number] for number in range(len(setups))]
    for order in ([0, 1, 2, 3], [3, 2, 1, 0]):
        drawn = frames(order)
        assert [np.array_equal(drawn[number], fresh[number]) for number in range(len(setups))] == [True] * len(setups)


def test_of_a_mirrored_picture_only_what_is_seen_of_the_mirror_is_drawn() -> None:
    viewer = Viewer(np.zeros(3), np.eye(3), 90.0, 640, 480)  # it looks along -z: 240 pixels for each metre at one
    assert box_of(np.array([(0.002, 0.002, -1.0), (0.99, 0.49, -1.0)]), viewer) == (319, 239, 240, 120)
    assert box_of(np.array([(0.0, 0.0, -1.0), (0.0, 0.0, 1.0)]), viewer) == (0, 0, 640, 480)
    assert box_of(np.array([(9.0, 0.0, -1.0), (9.5, 0.5, -1.0)]), viewer)[2] == 0


@pytest.mark.usefixtures("drawing")
def test_a_mirror_shows_what_stands_before_it(scene: Scene) -> None:
    pane = Part("pane", block((-0.6, -0.6, -0.01), (0.6, 0.6, 0.01)), "mirror")
    mirror = Thing(
        "mirror",
        "Mirror",
        Asset("Mirror", Vec3(1.2, 1.2, 0.02), (pane,), ()),
        Vec3(0.0, 1.5, 1.9),
        Vec3(0.0, 180.0, 0.0),
    )
    behind = Thing("red", "Cube", cube(0.5, "plastic/#dd1111"), Vec3(0.0, 1.5, -1.7), Vec3(0.0, 0.0, 0.0))
    del scene.things["cabinet"], scene.things["big"], scene.things["cube"]
    agent = Pose(position=Vec3(0.0, 0.0, 0.2), rotation=0.0)
    scene.things["mirror"] = mirror
    without = is_red(draw(scene, agent))
    scene.things["red"] = behind
    shown = is_red(draw(scene, agent))
    assert not without.any()
    assert shown.sum() > 500
    _, columns = np.nonzero(shown)
    assert abs(columns.mean() - 320) < 20
    turned = Pose(position=Vec3(0.0, 0.0, 0.2), rotation=180.0)
    assert is_red(draw(scene, turned)).sum() > shown.sum()  # nearer without the mirror


@pytest.mark.usefixtures("drawing")
@pytest.mark.parametrize("quality", ["default", "fast"])
def test_what_is_held_is_between_the_fingers_of_a_hand(scene: Scene, quality) -> None:
    def orange(frame: np.ndarray) -> int:
        red, green, blue = (frame[300:, 120:520, number].astype(int) for number in range(3))
        return int(((red > 140) & (green > 50) & (green < 0.6 * red) & (blue < 0.3 * red)).sum())

    empty = draw(scene, quality=quality)
    scene.things["cube"].is_held = True
    held = draw(scene, held="cube", quality=quality)
    assert orange(held) > orange(empty) + 150
    assert not np.array_equal(held[400:, 200:440], empty[400:, 200:440])


@pytest.mark.usefixtures("drawing")
def test_a_lamp_that_is_on_lights_what_is_near(scene: Scene) -> None:
    lamp = scene.things["cube"]
    lamp.asset = replace(lamp.asset, glow=Glow(Vec3(0.0, 0.3, 0.0), (1.0, 0.9, 0.7), 1.0))
    dark = draw(scene).astype(int)
    lamp.is_toggled = True
    lit = draw(scene).astype(int)
    brighter = (lit - dark).sum(axis=2)
    assert brighter.min() >= -6
    assert np.count_nonzero(brighter > 20) > 2000
    _, columns = np.nonzero(brighter > 0.7 * brighter.max())
    assert columns.mean() < 320  # it stands to the left
