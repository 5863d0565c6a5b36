"""Open leaves in the way: furniture is put beside them so that closing them is the only way."""

from itertools import islice

import numpy as np
import pytest

from vigil.authoring.drafting.house_context import HouseContext
from vigil.authoring.drafting.sources import GeneratedHouse
from vigil.authoring.families.cr.leaves import HEAVY_FURNITURE, LIGHT_FURNITURE, leaf_in_the_way
from vigil.authoring.review.validate import Validator
from vigil.errors import EpisodeError
from vigil.protocol.episode import Episode
from vigil.protocol.goals import Constraint
from vigil.protocol.house import House
from vigil.protocol.world import Setup
from vigil.sim.privileged import PrivilegedSimulator


@pytest.fixture(scope="module")
def house() -> House:
    return GeneratedHouse(6002, "3").house()


@pytest.fixture(scope="module")
def drafts(house: House, simulator: PrivilegedSimulator) -> list[Episode]:
    context = HouseContext(simulator, house, np.random.default_rng(0))
    context.begin(Setup())
    return list(islice(leaf_in_the_way(context), 2))


def test_a_leaf_that_bars_nothing_by_itself_is_made_to(
    drafts: list[Episode], house: House, simulator: PrivilegedSimulator
) -> None:
    verdicts = [Validator(simulator).validate(draft, house) for draft in drafts]
    assert any(verdict.is_valid for verdict in verdicts)


def test_what_is_moved_cannot_be_carried_off(drafts: list[Episode], house: House) -> None:
    placed = [name for draft in drafts for name, change in draft.setup.objects.items() if change.placement is not None]
    assert placed
    assert all(name.split("|")[0] in LIGHT_FURNITURE + HEAVY_FURNITURE for name in placed)


def test_the_leaf_starts_open_and_is_to_be_closed(drafts: list[Episode]) -> None:
    for draft in drafts:
        constraint = draft.goal.constraint
        assert isinstance(constraint, Constraint)
        assert constraint.kind == "object_closed"
        assert draft.setup.objects[constraint.object_id].openness == 1.0
        assert draft.bindings["obstacle"] == constraint.object_id != draft.goal.object_id


def test_without_the_furniture_nothing_is_in_the_way(
    drafts: list[Episode], house: House, simulator: PrivilegedSimulator
) -> None:
    draft = drafts[0]
    bare = {name: change for name, change in draft.setup.objects.items() if change.placement is None}
    free = draft.model_copy(update={"setup": Setup(objects=bare)})
    assert {finding.rule for finding in Validator(simulator).validate(free, house).findings} == {"constraint_holds"}


def test_where_nobody_can_stand_once_the_leaf_is_closed_nothing_is_proposed(
    house: House, simulator: PrivilegedSimulator, monkeypatch: pytest.MonkeyPatch
) -> None:
    context = HouseContext(simulator, house, np.random.default_rng(0))
    begin, closed = context.begin, []

    def refused(setup: Setup) -> None:
        if len(setup.objects) > 1 and any(change.openness == 0.0 for change in setup.objects.values()):
            closed.append(setup)
            raise EpisodeError("no free place to stand")
        begin(setup)

    monkeypatch.setattr(context, "begin", refused)
    begin(Setup())
    assert not list(leaf_in_the_way(context))
    assert closed
