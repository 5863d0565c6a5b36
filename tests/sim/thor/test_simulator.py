"""The back end over AI2-THOR, with this project's engine in this process in the place of the client's."""

import numpy as np
import pytest

from tests.support.narrowing import present
from tests.support.thor_client import InProcess, UnityLike, in_process
from vigil.assets.database import AssetDatabase
from vigil.base.geometry import Pose, Vec3
from vigil.errors import EpisodeError, SettingError, SimulatorError
from vigil.protocol.actions import InteractPixel, Look
from vigil.protocol.world import ObjectSetup, Placement, Setup
from vigil.sim import make_simulator
from vigil.sim.conformance import handling, moving, privileged, seeing
from vigil.sim.conformance.harness import Harness
from vigil.sim.conformance.reference_house import reference_house
from vigil.sim.thor import start
from vigil.sim.thor.requirements import Findings
from vigil.sim.thor.simulator import ThorSimulator
from vigil.sim.thor.start import ENGINE_VARIABLE, thor_simulator

HERE = Pose(position=Vec3(3.5, 0.0, 2.5), rotation=270.0)


@pytest.fixture(scope="module")
def fake() -> ThorSimulator:
    """Over rays alone: pictures are coarse."""
    simulator = in_process(backend="fake")
    simulator.load(reference_house())
    return simulator


def sent(simulator: ThorSimulator) -> list[dict]:
    assert isinstance(simulator._client, InProcess)
    return simulator._client.sent


def test_nothing_is_forced_for_an_agent_but_the_turn_of_its_head(fake):
    fake.reset(HERE, Setup())
    before = len(sent(fake))
    for action in (Look(direction="down", magnitude=33.33), InteractPixel(intent="drop")):
        fake.step(action)
    for x, y in ((320, 300), (100, 240), (500, 440)):
        for intent in ("open_access", "activate", "pick", "place"):
            fake.step(InteractPixel(intent=intent, x=x, y=y))
    forced = [each for each in sent(fake)[before:] if each.get("forceAction")]
    assert {each["action"] for each in forced} == {"Teleport"}
    assert all(set(each) == {"action", "horizon", "forceAction", "renderImage"} for each in forced)
    assert fake.world([]).agent.horizon == pytest.approx(33.33)


def test_the_agent_is_stood_last(fake):
    setup = Setup(objects={"Fridge|1": ObjectSetup(openness=1.0)}, held="Mug|1")
    before = len(sent(fake))
    fake.reset(HERE, setup)
    assert sent(fake)[-1]["action"] == "TeleportFull"
    assert {"OpenObject", "PickupObject"} <= {each["action"] for each in sent(fake)[before:]}
    fake.reset(HERE, Setup())


def test_a_reset_undoes_what_differs_and_nothing_else(fake):
    fake.reset(HERE, Setup(held="Mug|1"))
    before = len(sent(fake))
    fake.reset(HERE, Setup())
    assert [each["action"] for each in sent(fake)[before:]] == ["TeleportObject", "TeleportFull"]


def test_what_cannot_be_set_up_is_said(fake):
    placed = ObjectSetup(placement=Placement(position=Vec3(3.5, 0.9, 3.0)))
    with pytest.raises(EpisodeError, match=r"does not move 'Fridge\|1'"):
        fake.reset(HERE, Setup(objects={"Fridge|1": placed}))
    with pytest.raises(EpisodeError, match="inside an obstacle"):
        fake.reset(Pose(position=Vec3(1.8, 0.0, 2.2), rotation=0.0), Setup())


def test_an_engine_that_fails_is_started_again_by_the_next_load():
    simulator = in_process(backend="fake")
    simulator.load(reference_house())
    present(simulator._client).close()
    with pytest.raises(SimulatorError):
        simulator.reset(HERE, Setup())
    simulator.load(reference_house())
    simulator.reset(HERE, Setup())
    assert simulator.world([]).agent == HERE
    simulator.close()


@pytest.mark.parametrize(
    "check",
    [
        moving.stops_at_a_wall,
        handling.picks_and_places_where_clicked,
        handling.open_one_by_one,
        handling.contents_move_along,
        seeing.applies_setups,
        privileged.sees_from_anywhere,
        privileged.may_show_what_it_shows,
    ],
    ids=lambda check: check.__name__,
)
def test_unitys_ways_are_taken_too(unity_like: Harness, check):
    """Pivots off the middle, floors and all receptacles as carriers, masks with a frame alone, things that settle."""
    check(unity_like)


@pytest.fixture(scope="module")
def unity_like() -> Harness:
    return Harness(ThorSimulator("thor/unity-like", UnityLike, AssetDatabase.default()))


def test_the_name_tells_the_engine_and_how_pixels_are_counted(monkeypatch):
    names = set()
    for wanted in ("", "vigil", "vigil:fake", "/opt/engine --fast"):
        monkeypatch.setenv(ENGINE_VARIABLE, wanted)
        names.add(thor_simulator(AssetDatabase.default(), "default").name)
    assert len(names) == 4
    assert all(name.startswith("thor/5.0.0 ") and name.endswith(" masks") for name in names)
    assert make_simulator("fake", assets=AssetDatabase.default()).name not in names


def test_what_unitys_build_lacks_is_said_before_it_is_started(monkeypatch):
    monkeypatch.delenv(ENGINE_VARIABLE, raising=False)
    found = Findings("not installed", "absent", "Linux64", ("the client: pip install it",))
    monkeypatch.setattr(start, "examine", lambda: found)
    simulator = make_simulator("thor", assets=AssetDatabase.default())
    with pytest.raises(SettingError, match=r"the client: pip install it. VIGIL_THOR_ENGINE=vigil takes"):
        simulator.load(reference_house())


def test_frames_are_the_engines(fake):
    fake.reset(HERE, Setup())
    frame = fake.frame()
    assert frame.shape == (480, 640, 3)
    assert np.array_equal(frame, fake.frame())
