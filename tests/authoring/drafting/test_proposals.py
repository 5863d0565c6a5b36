"""The grammar of proposals: natural, valid and the same each time."""

import re
import string
from collections.abc import Callable, Iterator
from itertools import islice

import numpy as np
import pytest

from vigil.authoring.drafting import proposals
from vigil.authoring.drafting.grammar import kinds_of
from vigil.authoring.drafting.hard_starts import naming_cost, start_cost
from vigil.authoring.drafting.house_context import HouseContext
from vigil.authoring.families.ai.drafts import acting
from vigil.authoring.families.cr.drafts import hand_full
from vigil.authoring.families.da.drafts import approaching
from vigil.authoring.families.pg.drafts import POINT, pointing
from vigil.authoring.families.si.drafts import seeking
from vigil.authoring.families.sv.drafts import verifying
from vigil.authoring.families.vs.drafts import searching
from vigil.authoring.language.disambiguation import confusable
from vigil.authoring.language.sentences import Forms
from vigil.authoring.review.validate import Validator
from vigil.base.geometry import Pose
from vigil.errors import EpisodeError
from vigil.packs.pack import Pack
from vigil.protocol.episode import Episode
from vigil.protocol.house import House
from vigil.protocol.world import Setup
from vigil.sim.privileged import PrivilegedSimulator

Proposals = Callable[[HouseContext], Iterator[Episode]]

GRAMMAR: dict[str, Proposals] = {
    "PG": lambda context: pointing(context, "medium"),
    "DA": approaching,
    "VS": lambda context: searching(context, by_turning=True),
    "SV": lambda context: verifying(context, "on"),
    "AI": lambda context: acting(context, "pick"),
    "SI": lambda context: seeking(context, "pick"),
    "SM": kinds_of("SM")["rearrange"],
    "CR": hand_full,
}
IN_A_BATHROOM = ("CR",)
"""Families that draft much sooner where there is little to look at."""


def room_of(starter: Pack, kind: str) -> House:
    """The first house of the pack that is one room of a kind."""
    names = sorted({episode.house.name for episode in starter.episodes if episode.house.name.startswith(f"{kind}_")})
    return starter.house_of(next(episode for episode in starter.episodes if episode.house.name == names[0]))


@pytest.fixture(scope="module")
def house(starter: Pack) -> House:
    """A house of one room with much in it."""
    return room_of(starter, "living-room")


def drafts(simulator: PrivilegedSimulator, house: House, family: str, seed: int, count: int = 8) -> list[Episode]:
    context = HouseContext(simulator, house, np.random.default_rng(seed))
    return list(islice(GRAMMAR[family](context), count))


@pytest.mark.parametrize("family", GRAMMAR)
def test_drafts_are_mostly_valid_and_reproducible(family: str, simulator: PrivilegedSimulator, starter: Pack) -> None:
    house = room_of(starter, "bathroom" if family in IN_A_BATHROOM else "living-room")
    first = drafts(simulator, house, family, 5)
    assert first
    assert drafts(simulator, house, family, 5) == first
    assert all(draft.family == family for draft in first)
    validator = Validator(simulator)
    assert any(validator.validate(draft, house).is_valid for draft in first)


@pytest.mark.parametrize("forms", ["public", "held_out"])
def test_drafts_speak_the_half_that_is_asked_for(forms: Forms, simulator: PrivilegedSimulator, house: House) -> None:
    context = HouseContext(simulator, house, np.random.default_rng(3))
    context.forms = forms
    said = [draft.instruction for draft in islice(pointing(context, "medium"), 6)]
    assert said
    for instruction in said:
        assert any(is_of(form, instruction) for form in POINT.of(forms))
        assert not any(is_of(form, instruction) for form in POINT.of("all") if form not in POINT.of(forms))


def is_of(form: str, instruction: str) -> bool:
    """Whether an instruction is a sentence form with its slots filled."""
    words = "".join(
        re.escape(text) + ("" if slot is None else "(?:[Tt]he .+|it|them)")
        for text, slot, _, _ in string.Formatter().parse(form)
    )
    return re.fullmatch(words, instruction) is not None


def test_another_seed_proposes_something_else(simulator: PrivilegedSimulator, house: House) -> None:
    assert drafts(simulator, house, "PG", 1, 3) != drafts(simulator, house, "PG", 2, 3)


def test_what_cannot_be_set_up_is_passed_over(
    simulator: PrivilegedSimulator, house: House, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A leaf that would reach through a wall, say: the things after it are proposed all the same."""
    monkeypatch.setitem(GRAMMAR, "AI", lambda context: acting(context, "open"))
    opened = {episode.goal.object_id for episode in drafts(simulator, house, "AI", 0)}
    first = min(opened)
    reset = simulator.reset

    def refuses(start: Pose, setup: Setup) -> None:
        if first in setup.objects:
            raise EpisodeError("it reaches through a wall")
        reset(start, setup)

    monkeypatch.setattr(simulator, "reset", refuses)
    assert {episode.goal.object_id for episode in drafts(simulator, house, "AI", 0)} == opened - {first}


def test_of_several_starts_the_hardest_is_kept(simulator: PrivilegedSimulator, house: House) -> None:
    """Of the same things in the same house: the starts of pointing tasks cost more, and hard names come first."""
    costs: dict[int, list[float]] = {}
    for compared in (1, 6):
        context = HouseContext(simulator, house, np.random.default_rng(5))
        context.compared_starts = compared
        items = context.items
        costs[compared] = []
        for episode in islice(pointing(context, "medium"), 8):
            target = context.thing(episode.goal.object_id)
            others = [other.id for other in confusable(items[target.id], items.values())]
            cost = start_cost(context.view, target, others, episode.start)
            costs[compared].append(cost + naming_cost(items[target.id], items.values()))
    assert costs[6]
    assert np.mean(costs[6]) > np.mean(costs[1])


def test_a_hard_start_may_show_as_little_of_its_target_as_the_rules_ask_for(
    simulator: PrivilegedSimulator, house: House
) -> None:
    shown: dict[int, list[int]] = {}
    for compared in (1, 12):
        context = HouseContext(simulator, house, np.random.default_rng(5))
        context.compared_starts = compared
        episodes = list(islice(acting(context, "pick"), 6))
        shown[compared] = []
        for each in episodes:
            with context.view.at_pose(each.start):
                shown[compared].append(context.view.state_of(each.goal.object_id).visible_px)
        assert all(context.has_room_to_move(each.start) for each in episodes)
    assert min(shown[1]) >= proposals.CLEAR_PX
    assert proposals.HARD_PX <= min(shown[12]) < proposals.CLEAR_PX


def test_things_that_are_hard_to_name_come_first(simulator: PrivilegedSimulator, house: House) -> None:
    context = HouseContext(simulator, house, np.random.default_rng(5))
    plain = context.things(proposals.is_target)
    context.compared_starts = 2
    ranked = context.things(proposals.is_target)
    costs = [naming_cost(context.items[thing.id], context.items.values()) for thing in ranked]
    assert costs == sorted(costs, reverse=True)
    assert costs[0] > costs[-1]
    assert {thing.id for thing in ranked if not thing.is_drawer} == {thing.id for thing in plain if not thing.is_drawer}
    pieces = [sorted(str(thing.parent) for thing in things if thing.is_drawer) for things in (ranked, plain)]
    assert pieces[0] == pieces[1]
