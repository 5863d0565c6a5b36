"""What a program that directs a scene may do: pictures from anywhere, changes at any time."""

import numpy as np
import pytest

from vigil.assets.database import AssetDatabase
from vigil.base.geometry import EYE_HEIGHT_M, Pose, Vec3
from vigil.errors import EpisodeError
from vigil.protocol.world import ObjectSetup, Placement, Setup
from vigil.sim import make_simulator
from vigil.sim.conformance.reference_house import reference_house
from vigil.sim.core.views import project_to_view, rays_of
from vigil.sim.scene_editor import CameraView, Layer, SceneEditor

START = Pose(position=Vec3(3.5, 0.0, 2.5), rotation=30.0, horizon=20.0)
ALL: frozenset[Layer] = frozenset({"rgb", "depth", "things"})


@pytest.fixture(scope="module", params=["fake", "mujoco"])
def loaded(request) -> SceneEditor:
    simulator = make_simulator(request.param, assets=AssetDatabase.default(), quality="fast")
    assert isinstance(simulator, SceneEditor)
    simulator.load(reference_house())
    return simulator


@pytest.fixture
def editor(loaded: SceneEditor) -> SceneEditor:
    loaded.reset(START, Setup())
    return loaded


def view(width: int, height: int, fovy_deg: float = 90.0) -> CameraView:
    x, y, z = START.position
    return CameraView(Vec3(x, y + EYE_HEIGHT_M, z), START.rotation, START.horizon, fovy_deg, width, height)


@pytest.mark.usefixtures("drawing")
def test_a_picture_agrees_with_rays(editor: SceneEditor):
    camera = view(96, 48, 70.0)
    picture = editor.render_view(camera, ALL, with_hand=True)
    assert picture.rgb is not None
    assert picture.depth is not None
    assert picture.things is not None
    assert picture.rgb.shape == (48, 96, 3)
    rays, along = rays_of(camera)
    things, distances = editor.meets(camera.eye, rays, through_glass=True)
    assert (np.maximum(picture.things, -1).ravel() == things).mean() > 0.85
    is_met = np.isfinite(distances)
    errors = np.abs(picture.depth.ravel() - distances * along)[is_met]
    assert np.median(errors) < (1e-4 if editor.name.startswith("mujoco") else 0.3)


def test_only_the_layers_that_were_asked_for(editor: SceneEditor):
    picture = editor.render_view(view(16, 16), frozenset[Layer](), with_hand=False)
    assert picture.rgb is picture.depth is picture.things is None


def test_the_middle_of_a_view_projects_to_its_middle():
    camera = view(300, 200, 60.0)
    rays, _ = rays_of(CameraView(camera.eye, camera.yaw, camera.pitch, camera.fovy_deg, 1, 1))
    assert np.allclose(project_to_view(camera, np.array(camera.eye) + 2.0 * rays), [[0.5, 0.5, 2.0]])


def test_the_agent_stands_where_it_is_put(editor: SceneEditor):
    pose = START.model_copy(update={"position": Vec3(1.0, 0.0, 1.0), "rotation": 77.0})
    editor.stand(pose)
    assert editor.world([]).agent == pose


def test_a_thing_is_placed_and_opened_without_a_reset(editor: SceneEditor):
    there = Placement(position=Vec3(3.5, 0.1, 2.0))
    editor.apply_changes(
        Setup(objects={"Apple|1": ObjectSetup(placement=there), "Fridge|1": ObjectSetup(openness=1.0)})
    )
    found = editor.world(["Apple|1", "Fridge|1"])
    assert found.agent == START
    assert found.objects["Apple|1"].position == there.position
    assert found.objects["Fridge|1"].openness == 1.0


def test_a_change_that_cannot_be_leaves_all_as_it_was(editor: SceneEditor):
    before = editor.world(editor.object_ids())
    wrong = {"Fridge|1": ObjectSetup(openness=1.0), "Apple|1": ObjectSetup(is_toggled=True)}
    with pytest.raises(EpisodeError, match="cannot be switched"):
        editor.apply_changes(Setup(objects=wrong))
    assert editor.world(editor.object_ids()) == before


def test_what_is_held_and_placed_is_held_no_more(editor: SceneEditor):
    assert editor.apply_intent("pick", "Apple|1", START.position).refusal is None
    editor.apply_changes(Setup(objects={"Apple|1": ObjectSetup(placement=Placement(position=Vec3(3.0, 0.1, 2.0)))}))
    assert editor.world([]).held is None


def test_a_thing_taken_out_comes_back(editor: SceneEditor):
    editor.apply_changes(Setup(objects={"Apple|1": ObjectSetup(is_absent=True)}))
    assert "Apple|1" not in editor.object_ids()
    editor.restore_object("Apple|1")
    assert "Apple|1" in editor.object_ids()


def test_a_leaf_opens_part_of_the_way(editor: SceneEditor):
    assert editor.open_to("Fridge|1", 0.5).changed[0] == "Fridge|1"
    assert editor.world(["Fridge|1"]).objects["Fridge|1"].openness == 0.5
    assert editor.open_to("Apple|1", 0.5).refusal == "not_openable"


def test_walks_and_reachable_places_agree(editor: SceneEditor):
    places = editor.reachable(START.position, 0.25)
    x, _, z = START.position
    assert [x, z] in places.tolist()
    assert (editor.blocker(START.position, Vec3(x + 0.25, 0.0, z)) is None) == ([x + 0.25, z] in places.tolist())
    assert editor.blocker(START.position, Vec3(x + 20.0, 0.0, z)) is not None
