"""What an episode may change before it starts, and what it is refused with: never a hang."""

import pytest
from tiny_pack import FRIDGE, HERE, MUG, TABLE, tiny_house

from vigil.assets.sizes import AssetDatabase
from vigil.errors import EpisodeError
from vigil.pose import Vec3
from vigil.sim import make_simulator
from vigil.world import ObjectSetup, Placement, Setup


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
    with pytest.raises(EpisodeError, match=r"cannot rest on .*, which rests on it\. Place it on something else"):
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
