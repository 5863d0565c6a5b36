"""The back end over AI2-THOR's own client, unmodified, with our engine. Nothing here was run in Unity."""

from pathlib import Path

import pytest

from vigil.assets.database import AssetDatabase
from vigil.base.geometry import Pose, Vec3
from vigil.errors import SimulatorError
from vigil.protocol.actions import InteractPixel, Navigate
from vigil.protocol.world import ObjectSetup, Setup
from vigil.sim import make_simulator
from vigil.sim.conformance.reference_house import reference_house
from vigil.sim.thor.simulator import ThorSimulator
from vigil.sim.thor.start import ENGINE_VARIABLE

pytest.importorskip("ai2thor", reason="ai2thor is not installed: pip install vigil-bench[thor]")
pytestmark = pytest.mark.filterwarnings("ignore")
BEFORE_FRIDGE = Pose(position=Vec3(5.2, 0.0, 3.1), rotation=0.0, horizon=20.0)


@pytest.fixture
def simulator(monkeypatch, tmp_path):
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    monkeypatch.setenv(ENGINE_VARIABLE, "vigil:fake")
    made = make_simulator("thor", assets=AssetDatabase.default())
    assert isinstance(made, ThorSimulator)
    made.load(reference_house())
    yield made
    made.close()
    assert [each for each in Path(tmp_path).iterdir() if each.name != ".ai2thor"] == []


def test_an_episode_is_played_and_an_engine_that_is_killed_is_replaced(simulator):
    assert simulator.name == "thor/5.0.0 vigil-fake masks"
    open_lamp = Setup(objects={"FloorLamp|1": ObjectSetup(is_toggled=True)}, held="Mug|1")
    simulator.reset(BEFORE_FRIDGE, open_lamp)
    assert simulator.frame().shape == (480, 640, 3)
    x, y = (int(value) for value in simulator.pixels_of("Fridge|1").mean(axis=0))
    effect = simulator.step(InteractPixel(intent="open_access", x=x, y=y))
    assert (effect.hit, effect.refusal, effect.changed) == ("Fridge|1", None, ("Fridge|1",))
    world = simulator.world(["Fridge|1", "FloorLamp|1", "Mug|1"])
    assert world.agent == BEFORE_FRIDGE
    assert world.held == "Mug|1"
    assert world.objects["Fridge|1"].openness == 1.0
    assert world.objects["Fridge|1"].visible_px > 1000
    assert world.objects["FloorLamp|1"].is_toggled
    with simulator.rollback():
        simulator.step(InteractPixel(intent="drop"))
        simulator.step(Navigate(mode="backward", magnitude=2))
        assert simulator.world([]) != world
    assert simulator.world(["Fridge|1", "FloorLamp|1", "Mug|1"]) == world
    simulator.load(reference_house())
    simulator.reset(BEFORE_FRIDGE, Setup())
    assert simulator.world(["Fridge|1"]).objects["Fridge|1"].openness == 0.0
    simulator._client._controller.server.unity_proc.kill()
    with pytest.raises(SimulatorError):
        simulator.step(Navigate(mode="backward", magnitude=1))
    simulator.load(reference_house())
    simulator.reset(BEFORE_FRIDGE, Setup())
    assert simulator.step(Navigate(mode="backward", magnitude=1)).moved_m == 0.25
