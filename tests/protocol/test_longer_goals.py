"""Goals of several places and states at once, which sequences end in."""

import pytest
from pydantic import ValidationError

from tests.support.builders import RecordBuilder, episode, thing
from vigil.packs.pack import protocol_faults
from vigil.protocol.goals import AllOf, ObjectAtReceptacle, ObjectHeld, ObjectInState
from vigil.scoring.goal_check import check
from vigil.scoring.goal_words import describe_goal

PUT = ObjectAtReceptacle(object_id="apple", receptacle_id="fridge", inside=True)
CLOSED = ObjectInState(object_id="fridge", state="is_open", value=False)
CHAIN = (
    ObjectInState(object_id="fridge", state="is_open"),
    ObjectHeld(object_id="apple"),
    PUT,
)
PUT_AND_CLOSE = AllOf(object_id="apple", parts=(PUT, CLOSED), chain=CHAIN)


def kitchen() -> RecordBuilder:
    return RecordBuilder(apple=thing(), fridge=thing(openness=0.0, is_toggled=None))


def test_a_place_and_a_state_must_hold_together() -> None:
    story = kitchen().do(fridge={"openness": 1.0}).do(apple={"is_held": True})
    story.do(apple={"is_held": False, "parent": "fridge", "support_chain": ("fridge",), "inside": ("fridge",)})
    rows = check(PUT_AND_CLOSE, story.do(fridge={"openness": 0.0}).report()).rows
    assert [(row.semantic, row.strict) for row in rows] == [(False, False)] * 4 + [(True, True)] * 2
    assert [row.progress for row in rows] == pytest.approx([0.0, 0.25, 0.5, 0.75, 1.0, 1.0])


def test_a_thing_left_outside_does_not_count_though_the_door_is_closed() -> None:
    assert not check(PUT_AND_CLOSE, kitchen().do().report()).semantic


def test_the_words_name_every_part() -> None:
    assert describe_goal(PUT_AND_CLOSE).startswith(
        "apple is inside fridge and fridge is closed; for progress alone: fridge is open"
    )
    assert PUT_AND_CLOSE.ids() == {"apple", "fridge"}


def test_sequences_may_end_in_several_facts_in_any_pack_and_other_families_not() -> None:
    assert not protocol_faults(episode("SM", goal=PUT_AND_CLOSE))
    with pytest.raises(ValidationError, match="all_of"):
        episode("AI", goal=PUT_AND_CLOSE.model_copy(update={"chain": ()}))


def test_to_be_seen_is_no_part_of_it() -> None:
    with pytest.raises(ValidationError, match="of `all_of`"):
        AllOf(object_id="apple", parts=(PUT, ObjectInState(object_id="fridge", state="is_visible")))
