"""Each fault of wording that readers found is found by its rule, and what is worded well breaks none."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any, cast

import pytest

from vigil.authoring.language.referring import DescribedThing, mentions, resolve_mentions
from vigil.authoring.review import wording_rules
from vigil.authoring.review.episode_start import EpisodeStart
from vigil.authoring.review.validate import Validator, reason_of
from vigil.authoring.review.wording_rules import WORDING_RULES, worded_badly
from vigil.packs.pack import Pack
from vigil.protocol.episode import Episode
from vigil.protocol.families import Family
from vigil.protocol.goals import Constraint, Goal, ObjectHeld, ObjectInState
from vigil.sim.privileged import PrivilegedSimulator

CABINET = DescribedThing("Cabinet|1", "Cabinet", "cabinet", ("red",), "room|1", "kitchen")
COUNTER = DescribedThing("CounterTop|1", "CounterTop", "countertop", (), "room|1", "kitchen")
STRIP = DescribedThing("CounterTop|2", "CounterTop", "countertop", (), "room|2", "bathroom")
PHONE = DescribedThing(
    "CellPhone|1", "CellPhone", "cell phone", (), "room|3", "bedroom", "TVStand|1", "TV stand", is_inside=True
)
STOOL = DescribedThing("Stool|1", "Stool", "stool", ("white",), "room|1", "kitchen")
OTHER_STOOL = DescribedThing("Stool|2", "Stool", "stool", ("navy",), "room|1", "kitchen")
PEN = DescribedThing("Pen|1", "Pen", "pen", (), "room|3", "bedroom")
DOOR = DescribedThing("door|1|3", "Doorway", "door between the bedroom and the kitchen")
BOOTS = DescribedThing("Boots|1", "Boots", "pair of boots", (), "room|1", "kitchen")
SINK = DescribedThing("Sink|1", "Sink", "sink", (), "room|1", "kitchen")
MOVED = Constraint(kind="object_moved", object_id="Boots|1", latched=True, distance_m=0.5)
PICKED: Goal = ObjectHeld(object_id="Pen|1", constraint=MOVED)
OPENED: Goal = ObjectInState(object_id="Cabinet|1", state="is_open")


@dataclass
class Worded:
    """An instruction, the things as the catalog calls them, and what who sees them would say otherwise."""

    family: Family
    instruction: str
    things: tuple[DescribedThing, ...] = ()
    seen: tuple[DescribedThing, ...] = ()
    goal: Goal = OPENED

    def rules(self, monkeypatch: pytest.MonkeyPatch) -> set[str]:
        """The rules that it breaks."""
        items = {thing.id: thing for thing in self.things}
        seen = items | {thing.id: thing for thing in self.seen}
        monkeypatch.setattr(wording_rules, "items_as_seen", lambda scene: seen)
        phrases = mentions(self.instruction, [*(thing.name for thing in self.things), "TV stand"])
        bindings = {"target": self.goal.object_id, "obstacle": "Boots|1"}
        episode = SimpleNamespace(family=self.family, instruction=self.instruction, goal=self.goal, bindings=bindings)
        case: Mapping[str, Any] = {
            "episode": episode,
            "items": items,
            "mentioned": list(zip(phrases, resolve_mentions(phrases, items.values()), strict=True)),
            "view": SimpleNamespace(scene=None),
        }
        return {rule for rule, _ in worded_badly(cast(EpisodeStart, SimpleNamespace(**case)))}


FAULTS: dict[str, list[tuple[Worded, Worded]]] = {
    "stop_can_be_checked": [
        (Worded("VS", f"Look around for the pen until {bad}.", (PEN,)), Worded("VS", good, (PEN,)))
        for bad, good in (
            ("you see it clearly", "Look around for the pen until you see it."),
            ("you have it in front of you", "Look around for the pen until it is in the picture."),
            ("you get a good view of it", "Bring the pen into view."),
            ("you are done", "Go looking for the pen; stop once it is in your picture."),
        )
    ]
    + [
        (
            Worded("DA", "Stand close by the pen, within about one and a half metres of it, within reach.", (PEN,)),
            Worded("DA", "Stand within about one and a half metres of the pen, within reach.", (PEN,)),
        ),
        (
            Worded("DA", "Go within about one and a half metres of the pen.", (PEN,)),
            Worded("DA", "Go within about one and a half metres of the pen, so that you could touch it.", (PEN,)),
        ),
    ],
    "no_second_answer": [
        (
            Worded("AI", "Open the cabinet.", (CABINET, COUNTER), (replace(COUNTER, alternative_names=("cabinet",)),)),
            Worded("AI", "Open the cabinet.", (CABINET, COUNTER)),
        )
    ],
    "called_as_it_looks": [
        (
            Worded("PG", "Point at the countertop.", (STRIP,), (replace(STRIP, has_misleading_name=True),)),
            Worded("PG", "Point at the countertop.", (COUNTER,)),
        )
    ],
    "one_such_room": [
        (
            Worded("SI", "Find the pen in the bedroom and pick it up.", (PEN,), (replace(PEN, is_room_one=False),)),
            Worded("SI", "Find the pen in the bedroom and pick it up.", (PEN,)),
        ),
        (
            Worded("AI", f"Close the {DOOR.name}.", (DOOR,), (replace(DOOR, has_misleading_name=True),)),
            Worded("AI", f"Close the {DOOR.name}.", (DOOR,)),
        ),
    ],
    "on_a_shelf": [
        (
            Worded("SI", f"Find the cell phone {bad} the TV stand.", (PHONE,), (seen,)),
            Worded("SI", "Find the cell phone on a shelf of the TV stand.", (PHONE,), (seen,)),
        )
        for seen in [replace(PHONE, is_inside=False, is_on_shelf=True)]
        for bad in ("in", "that lies inside")
    ],
    "colour_of_the_whole": [
        (
            Worded("PG", "Point at the white stool.", (STOOL, OTHER_STOOL), (replace(STOOL, colours=()),)),
            Worded("PG", "Point at the white stool.", (STOOL, OTHER_STOOL)),
        )
    ],
    "no_needless_colour": [
        (
            Worded("PG", "Point at the white stool.", (STOOL, PEN)),
            Worded("PG", "Point at the white stool.", (STOOL, OTHER_STOOL)),
        )
    ],
    "no_stacked_places": [
        (Worded("SM", f"Pick up the pen and put it {bad}.", (PEN, SINK)), Worded("SM", good, (PEN, SINK)))
        for bad, good in (
            ("in the sink in the kitchen", "Pick up the pen and put it into the sink in the kitchen."),
            ("there: take the pen in the bedroom in your hand", "Take the pen in the bedroom."),
        )
    ],
    "pairs_are_plural": [
        (Worded("CR", f"{bad} Then open the cabinet.", (BOOTS, CABINET)), Worded("CR", good, (BOOTS, CABINET)))
        for bad, good in (
            (
                "First move aside the pair of boots, which blocks the way.",
                "First move aside the pair of boots, which block the way.",
            ),
            ("The pair of boots is in the way: put it aside.", "The pair of boots is in the way: put them aside."),
        )
    ],
    "hand_is_freed": [
        (
            Worded("CR", "First pick up the pair of boots. Then pick up the pen.", (BOOTS, PEN), goal=PICKED),
            Worded("CR", f"First {good}. Then pick up the pen.", (BOOTS, PEN), goal=PICKED),
        )
        for good in ("move the pair of boots aside", "pick up the pair of boots and put them down elsewhere")
    ],
}
"""Rule -> what breaks it alone, each beside what breaks none."""


def test_every_rule_has_a_fault_and_a_reason() -> None:
    assert set(FAULTS) == set(WORDING_RULES)
    assert all(reason_of(rule) for rule in WORDING_RULES)


@pytest.mark.parametrize(
    ("rule", "bad", "good"), [(rule, *pair) for rule, pairs in FAULTS.items() for pair in pairs], ids=str
)
def test_a_fault_is_found_by_its_rule_alone(
    rule: str, bad: Worded, good: Worded, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert bad.rules(monkeypatch) == {rule}
    assert good.rules(monkeypatch) == set()


def test_drafts_are_held_to_the_rules_and_frozen_packs_are_not(starter: Pack, simulator: PrivilegedSimulator) -> None:
    good = next(episode for episode in starter.episodes if episode.family == "VS")
    said = f"{good.instruction} Stop when you see it clearly."
    vague: Episode = good.model_copy(update={"instruction": said})
    house, actions = starter.house_of(good), starter.solutions[good.id].actions
    assert Validator(simulator).validate(vague, house, actions).is_valid
    found = Validator(simulator, is_draft=True).validate(vague, house, actions).findings
    assert [finding.rule for finding in found] == ["stop_can_be_checked"]
