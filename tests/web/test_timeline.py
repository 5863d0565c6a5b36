"""The viewer's data for a list of chores: each chore ticked off while it holds, with the hidden truth and the claim."""

from tests.support.builders import RecordBuilder, episode, thing
from tests.support.chore_lists import RIGHT, Claims, a_list, closed, story
from vigil.protocol.profile import ITEMISED_REPORT, Profile
from vigil.web.timeline import timeline_of

ITEMISED = Profile(name=ITEMISED_REPORT)


def test_a_list_is_ticked_off_step_by_step_beside_the_claims() -> None:
    record = closed(story().switch().look().switch(is_on=True), {**RIGHT, 6: "unknown"}, c4="no way")
    found = timeline_of(a_list(), record, ITEMISED, None)["hidden"]["chores"]
    assert [chore["words"] for chore in found][:2] == [
        "Turn off the floor lamp.",
        "Find the television and say whether it is on.",
    ]
    assert found[0]["rows"] == [False, True, True, False, False]
    assert found[1]["rows"] == [False, False, False, True, True]
    assert [chore["answer"] for chore in found] == [None, "on", None, None, None, None]
    assert [chore["claim"] for chore in found] == ["success", "on", "success", "no way", "success", "unknown"]


def test_chores_without_a_claim_are_unclaimed_only_where_claims_were_asked_for() -> None:
    cases: tuple[tuple[Claims | None, str | None], ...] = (({1: "success"}, "unclaimed"), (None, None))
    for claims, said in cases:
        record = closed(story(), claims)
        assert timeline_of(a_list(), record, ITEMISED, None)["hidden"]["chores"][5]["claim"] == said


def test_other_goals_have_no_list() -> None:
    record = RecordBuilder(target=thing(is_toggled=True), table=thing()).report()
    assert timeline_of(episode("AI"), record, Profile(), None)["hidden"]["chores"] == []
