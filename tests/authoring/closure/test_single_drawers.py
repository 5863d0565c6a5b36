"""All drawers of a room, asked for at once."""

import numpy as np
import pytest

from vigil.authoring.closure.certify import Certifier
from vigil.authoring.closure.kinds.all_of.tasks import all_of
from vigil.authoring.closure.tasks import ClosureTask
from vigil.authoring.drafting.house_context import HouseContext
from vigil.housegen.base.spec import spec_for
from vigil.housegen.generate import generate
from vigil.sim.privileged import PrivilegedSimulator


def test_every_drawer_of_a_room_may_be_meant(simulator: PrivilegedSimulator) -> None:
    house = generate(0, spec_for("living-room"))
    context = HouseContext(simulator, house, np.random.default_rng(3))
    drawers = {thing.id for thing in context.view.scene.things.values() if thing.is_drawer}
    assert len(drawers) == 4  # of a TV stand
    for task in all_of(context):
        if isinstance(task, ClosureTask) and "every drawer in the living room" in task.episodes[0].instruction:
            assert set(task.episodes[0].bindings.values()) == drawers
            sides, findings = Certifier(simulator).certify(task, house)
            assert findings == []
            assert len(sides) == 1
            return
    pytest.fail("nobody is asked to open or close every drawer")
