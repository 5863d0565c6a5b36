"""What an episode may change before it starts, and what it is refused with: never a hang."""

import numpy as np
import pytest
from pydantic import ValidationError

from tests.support.tiny_pack import FRIDGE, HERE, MUG, TABLE, tiny_house
from vigil.assets.database import AssetDatabase
from vigil.assets.notice import notice_centre
from vigil.base.geometry import Vec3, heading
from vigil.errors import EpisodeError
from vigil.protocol.world import ObjectSetup, Placement, Setup
from vigil.scene.geometry import place_of
from vigil.sim import make_simulator
from vigil.sim.conformance.reference_house import reference_house
from vigil.sim.scene_editor import CameraView, SceneEditor


@pytest.fixture(scope="module")
def simulator():
    made = make_simulator("fake", assets=AssetDatabase.default())
    made.load(tiny_house())
    yield made
    made.close()


def on(parent: str) -> ObjectSetup:
    return ObjectSetup(placement=Placement(position=Vec3(1.0, 0.5, 1.0), parent=parent))


def unchecked(**objects: ObjectSetup) -> Setup:
    """A setup that no model has looked at."""
    return Setup.model_construct(objects=objects, held=None)


@pytest.mark.parametrize(
    "setup",
    [
        unchecked(**{TABLE: on(TABLE)}),
        unchecked(**{MUG: on(MUG)}),
        unchecked(**{TABLE: on(MUG)}),  # the mug stands on the table
        unchecked(**{TABLE: on(FRIDGE), FRIDGE: on(TABLE)}),
        unchecked(**{TABLE: on(FRIDGE), FRIDGE: on(MUG)}),
    ],
)
def test_what_would_rest_on_itself_is_refused(simulator, setup):
    with pytest.raises(EpisodeError, match=r"cannot rest on .*, because .* rests on .*\. Place it on something else"):
        simulator.reset(HERE, setup)


def test_the_next_episode_starts_as_if_nothing_had_been(simulator):
    with pytest.raises(EpisodeError):
        simulator.reset(HERE, unchecked(**{TABLE: on(MUG)}))
    simulator.reset(HERE, Setup())
    assert simulator.world([MUG]).objects[MUG].parent == TABLE


def test_what_is_placed_on_something_that_goes_is_refused(simulator):
    """The mug goes with the table that carries it."""
    setup = unchecked(**{FRIDGE: on(MUG), TABLE: ObjectSetup(is_absent=True)})
    with pytest.raises(
        EpisodeError, match=rf"'Fridge\|1\|2' is placed on .*{MUG[:3]}.* which is taken out of the scene"
    ):
        simulator.reset(HERE, setup)


def test_only_a_machine_that_stands_still_can_be_broken(simulator):
    with pytest.raises(
        EpisodeError, match=r"cannot be broken: only machines with a front .* Leave out its `is_broken`"
    ):
        simulator.reset(HERE, Setup(objects={MUG: ObjectSetup(is_broken=True)}))
    with pytest.raises(ValidationError, match="broken and also running"):
        Setup(objects={FRIDGE: ObjectSetup(is_broken=True, is_toggled=True)})


def test_what_is_not_broken_is_written_as_ever():
    """Episodes of older packs keep their bytes, and their ids."""
    assert "is_broken" not in ObjectSetup(openness=1.0).model_dump()
    assert ObjectSetup(is_broken=True).model_dump()["is_broken"] is True
    assert ObjectSetup.model_validate_json('{"is_broken":true}').is_broken


@pytest.mark.parametrize("backend", ["fake", "mujoco"])
def test_a_broken_machine_bears_a_notice_and_does_not_start(backend: str):
    simulator = make_simulator(backend, assets=AssetDatabase.default())
    house = reference_house()
    start = house.start
    assert start is not None
    simulator.load(house)
    assert isinstance(simulator, SceneEditor)
    microwave = simulator.scene().things["Microwave|1"]
    spot = notice_centre(microwave.asset)
    assert spot is not None
    ahead_x, ahead_z = heading(microwave.rotation.y)
    middle = Vec3(*(float(value) for value in place_of(microwave)(np.array(spot)[None])[0]))
    eye = Vec3(middle.x + ahead_x, middle.y, middle.z + ahead_z)
    view = CameraView(eye, microwave.rotation.y + 180.0, 0.0, 60.0, 160, 120)
    whole = Setup(objects={"Microwave|1": ObjectSetup(openness=0.0, is_toggled=False)})
    broken = Setup(objects={"Microwave|1": ObjectSetup(openness=0.0, is_toggled=False, is_broken=True)})
    pictures = []
    for setup, refusal in ((whole, None), (broken, "out_of_order"), (whole, None)):
        simulator.reset(start, setup)
        pictures.append(simulator.render_view(view, frozenset({"rgb"}), with_hand=False).rgb)
        assert simulator.apply_intent("activate", "Microwave|1", middle).refusal == refusal
    assert np.array_equal(pictures[0], pictures[2])
    assert not np.array_equal(pictures[0], pictures[1])
    simulator.close()
