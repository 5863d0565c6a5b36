"""AI2-THOR's own client, unmodified, with our engine. Nothing here was run in Unity."""

import os
from pathlib import Path

import numpy as np
import pytest

from tests.support.thor_exchange import golden, played
from tests.support.waiting import HANGS_AFTER_S
from vigil.sim.conformance.reference_house import reference_house
from vigil.thor.launch import thor_engine

pytest.importorskip("ai2thor", reason="ai2thor is not installed: pip install vigil-bench[thor]")
pytestmark = pytest.mark.filterwarnings("ignore")
PICTURES = {"renderDepthImage": True, "renderInstanceSegmentation": True, "renderSemanticSegmentation": True}


@pytest.fixture(scope="module", params=["FIFO", "WSGI"])
def controller(request, tmp_path_factory):
    from ai2thor.controller import Controller  # noqa: PLC0415  # pyright: ignore[reportMissingImports] - may be absent
    from ai2thor.fifo_server import FifoServer  # noqa: PLC0415  # pyright: ignore[reportMissingImports] - may be absent
    from ai2thor.wsgi_server import WsgiServer  # noqa: PLC0415  # pyright: ignore[reportMissingImports] - may be absent

    home = tmp_path_factory.mktemp("home")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("HOME", str(home))
        patch.delenv("DISPLAY", raising=False)
        server = {"FIFO": FifoServer, "WSGI": WsgiServer}[request.param]
        command = thor_engine(backend="fake")
        made = Controller(
            local_executable_path=command,
            scene=reference_house().data,
            width=320,
            height=304,
            snapToGrid=False,
            server_class=server,
            **PICTURES,
        )
        process, pipes = made.server.unity_proc, getattr(made.server, "server_pipe_path", None)
        yield made
        made.stop()
        assert process.wait(timeout=HANGS_AFTER_S) is not None
        if pipes is not None:
            made.server.tmp_dir.cleanup()
            assert not Path(pipes).exists()


def test_the_client_sees_the_house(controller):
    event = controller.step("TeleportFull", **reference_house().data["metadata"]["agent"])
    assert event
    assert event.frame.shape == (304, 320, 3)
    assert event.depth_frame.shape == (304, 320)
    assert 0.0 < event.depth_frame.min() < event.depth_frame.max() <= 20.0
    assert set(event.instance_masks) <= {each["objectId"] for each in event.metadata["objects"]}
    assert "Floor" not in event.instance_masks
    assert os.environ["DISPLAY"]


def test_a_mask_covers_what_a_click_hits(controller):
    poses = controller.step("GetInteractablePoses", objectId="Fridge|1", maxPoses=1).metadata["actionReturn"]
    event = controller.step("TeleportFull", **poses[0])
    ys, xs = np.nonzero(event.instance_masks["Fridge|1"])
    middle = len(xs) // 2
    place = {"x": (float(xs[middle]) + 0.5) / 320, "y": (float(ys[middle]) + 0.5) / 304}
    assert controller.step("GetObjectInFrame", **place).metadata["actionReturn"] == "Fridge|1"
    assert controller.step("OpenObject", objectId="Fridge|1")
    assert controller.last_event.get_object("Fridge|1")["isOpen"]


def test_what_the_client_raises_on_is_raised(controller):
    with pytest.raises(ValueError, match="Invalid action: Fly"):
        controller.step("Fly")
    with pytest.raises(ValueError, match="called with invalid argument: 'speed'"):
        controller.step("MoveAhead", speed=3)
    with pytest.raises(RuntimeError, match="moveMagnitude must be > 0"):
        controller.step("MoveAhead", moveMagnitude=0, raise_for_failure=True)


def test_a_reset_changes_the_size(controller):
    event = controller.reset(reference_house().data, width=64, height=48, fieldOfView=60)
    assert event.frame.shape == (48, 64, 3)
    assert event.metadata["fov"] == 60
    controller.step("AddThirdPartyCamera", position={"x": 3, "y": 2, "z": 2}, rotation={"x": 60, "y": 0, "z": 0})
    assert [frame.shape for frame in controller.last_event.third_party_camera_frames] == [(48, 64, 3)]
    assert len(controller.last_event.third_party_depth_frames) == 1


def test_the_exchange_is_the_one_that_is_kept(monkeypatch, tmp_path):
    monkeypatch.setenv("HOME", str(tmp_path))
    assert played(reference_house().data, thor_engine(backend="fake")) == golden()
