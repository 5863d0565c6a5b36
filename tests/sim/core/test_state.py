"""What is told of changes: things that are not as they were, and no others."""

from collections.abc import Iterator

import numpy as np
import pytest

from tests.support.tiny_pack import FRIDGE, HERE, MUG, TABLE, tiny_house
from vigil.assets.database import AssetDatabase
from vigil.protocol.world import ObjectSetup, Setup
from vigil.scene.things import Scene
from vigil.sim.core.embedded import EmbeddedSimulator
from vigil.sim.engines.fake import FakeEngine

OPEN = Setup(objects={FRIDGE: ObjectSetup(openness=1.0)})


class NotingEngine(FakeEngine):
    """Notes what it is told of."""

    def __init__(self) -> None:
        super().__init__()
        self.told: list[set[str]] = []

    def update(self, scene: Scene, ids: set[str]) -> None:
        self.told.append(set(ids))
        super().update(scene, ids)


@pytest.fixture
def engine() -> NotingEngine:
    return NotingEngine()


@pytest.fixture
def simulator(engine: NotingEngine) -> Iterator[EmbeddedSimulator]:
    made = EmbeddedSimulator(engine, AssetDatabase.default())
    made.load(tiny_house())
    yield made
    made.close()


def test_a_reset_to_the_same_start_tells_nothing(simulator: EmbeddedSimulator, engine: NotingEngine) -> None:
    simulator.reset(HERE, OPEN)
    assert engine.told == [{FRIDGE}]
    before = simulator.world([FRIDGE, MUG, TABLE])
    simulator.reset(HERE, OPEN)
    assert engine.told == [{FRIDGE}]
    assert simulator.world([FRIDGE, MUG, TABLE]) == before
    simulator.reset(HERE, Setup())
    assert engine.told == [{FRIDGE}, {FRIDGE}]


def test_what_is_held_is_told_when_it_leaves_the_hand(simulator: EmbeddedSimulator, engine: NotingEngine) -> None:
    simulator.reset(HERE, Setup())
    points = np.array([simulator.scene().things[MUG].position])
    eye = HERE.eye._replace(x=points[0, 0], z=points[0, 2])
    assert simulator.points_visible_from(eye, points, MUG).all()
    simulator.reset(HERE, Setup(held=MUG))
    assert not simulator.points_visible_from(eye, points, MUG).any()
    told = len(engine.told)
    with simulator.at_pose(HERE.model_copy(update={"rotation": HERE.rotation + 90.0})):
        assert simulator.world([MUG]).held == MUG
    assert len(engine.told) == told  # what is in the hand is met by no ray
    simulator.reset(HERE, Setup())
    assert engine.told[told:] == [{MUG}]
    assert simulator.points_visible_from(eye, points, MUG).all()
