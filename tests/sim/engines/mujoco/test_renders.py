import numpy as np
import pytest

from vigil.scene.things import Scene
from vigil.sim.graphics_check import check_graphics
from vigil.sim.pictures.renders import render_asset, render_birdseye

pytestmark = pytest.mark.usefixtures("drawing")


def test_an_asset_fills_its_stage_and_shows_its_state(scene: Scene) -> None:
    asset = scene.things["cabinet"].asset
    closed = render_asset(asset).astype(int)
    assert closed.shape == (480, 640, 3)
    for changed in (render_asset(asset, openness=1.0), render_asset(asset, is_toggled=True)):
        assert (np.abs(changed - closed).max(axis=2) > 20).sum() > 2000
    red = (closed[..., 0] > closed[..., 2] + 40).sum()
    assert red > 5000, "its front, with the red leaf, faces the eye"


def test_a_house_is_seen_from_above_with_north_up(scene: Scene) -> None:
    picture = render_birdseye(scene, "fast").astype(int)
    blue = np.argwhere((picture[..., 2] > picture[..., 0] + 60) & (picture[..., 2] > picture[..., 1] + 60))
    green = np.argwhere((picture[..., 1] > picture[..., 0] + 60) & (picture[..., 1] > picture[..., 2] + 60))
    assert len(blue) > 100
    assert len(green) > 20
    # The blue cube stands at +x, +z of the green one: further right and further up.
    assert blue[:, 1].mean() > green[:, 1].mean() + 50
    assert blue[:, 0].mean() < green[:, 0].mean() - 30


def test_the_doctor_draws_and_names_the_driver() -> None:
    found = check_graphics()
    assert found["ok"], found["fault"]
    assert found["frame"].shape == (480, 640, 3)
    assert found["gl_renderer"]
    assert 0 < found["frame_s"] < found["first_frame_s"] + 5
