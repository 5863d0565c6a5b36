"""Claims of a report: what they mean, and why an argument is not an object of claims."""

import json
from typing import Any

import pytest

from vigil.protocol.actions import InvalidAction, ParsedReply, Reply, Report
from vigil.protocol.profile import ITEMISED_REPORT, Profile
from vigil.protocol.replies import parse_text, read_reply

ITEMISED = Profile(name=ITEMISED_REPORT)


def reply(claims: Any) -> str:
    return json.dumps({"skill_name": "report", "arguments": {"status": "fail", "summary": "", "claims": claims}})


def report(claims: Any) -> Report:
    parsed = parse_text(reply(claims), has_claims=True)
    assert isinstance(parsed, ParsedReply), parsed
    assert isinstance(parsed.action, Report)
    assert parsed.ignored_keys == ()
    return parsed.action


def faults(text: str) -> list[tuple[str, str, str]]:
    """Return the fault of a reply under both policies: alone, and in a code fence under the lenient one."""
    found = [
        parse_text(text, has_claims=True),
        parse_text(text, policy="lenient", has_claims=True),
        parse_text(f"```json\n{text}\n```", policy="lenient", has_claims=True),
    ]
    assert all(isinstance(each, InvalidAction) for each in found), found
    return [(each.kind, each.reason, each.detail) for each in found if isinstance(each, InvalidAction)]


def test_each_status_and_unknown_is_a_claim():
    words = ["success", "fail", "unsafe", "invalid", "on", "off", "open", "closed", "unknown"]
    claims = {str(number): word for number, word in enumerate(words, start=1)}
    assert report(claims).claims == dict(enumerate(words, start=1))
    assert report(claims).raw_claims == {}


def test_words_and_numbers_are_stripped_and_words_case_folded():
    assert report({" 2 ": " Success\n", "1": "OFF"}).claims == {1: "off", 2: "success"}


def test_no_claim_is_needed_and_a_chore_that_is_not_on_the_list_is_recorded():
    assert report({}).claims == {}
    assert report({"999": "success"}).claims == {999: "success"}


def test_a_word_outside_the_vocabulary_is_an_invalid_claim_with_its_word():
    found = report({"1": "Done!", "2": "success", "3": ""})
    assert found.claims == {1: "invalid", 2: "success", 3: "invalid"}
    assert found.raw_claims == {1: "Done!", 3: ""}


@pytest.mark.parametrize(
    ("claims", "reason", "detail"),
    [
        (["success"], "ill_typed", "claims: list"),
        ("success", "ill_typed", "claims: str"),
        (None, "ill_typed", "claims: NoneType"),
        ({"1": True}, "ill_typed", "claims.1: bool"),
        ({"2": 1}, "ill_typed", "claims.2: int"),
        ({"1": None}, "ill_typed", "claims.1: NoneType"),
        ({"1": {"status": "success"}}, "ill_typed", "claims.1: dict"),
        ({"0": "success"}, "not_a_chore", "claims: '0'"),
        ({"-1": "success"}, "not_a_chore", "claims: '-1'"),
        ({"01": "success"}, "not_a_chore", "claims: '01'"),
        ({"1.0": "success"}, "not_a_chore", "claims: '1.0'"),
        ({"1000": "success"}, "not_a_chore", "claims: '1000'"),
        ({"²": "success"}, "not_a_chore", "claims: '\\xb2'"),
        ({"the lamp": "on"}, "not_a_chore", "claims: 'the lamp'"),
        ({"": "on"}, "not_a_chore", "claims: ''"),
        ({"1": "success", "1 ": "fail"}, "duplicate_chore", "claims: 1"),
    ],
)
def test_a_malformed_object_of_claims_is_a_malformed_action(claims: Any, reason: str, detail: str):
    assert faults(reply(claims)) == [("malformed_action", reason, detail)] * 3


def test_a_report_without_claims_is_malformed_only_where_they_are_asked_for():
    text = '{"skill_name": "report", "arguments": {"status": "success", "summary": ""}}'
    assert faults(text) == [("malformed_action", "missing_argument", "claims")] * 3
    assert isinstance(parse_text(text), ParsedReply)


def test_a_number_that_is_written_twice_is_a_duplicate_key_like_any_other():
    text = reply({"1": "success"}).replace('"1": "success"', '"1": "success", "1": "fail"')
    reasons = ["duplicate_key", "duplicate_key", "code_fence"]
    assert [(kind, reason) for kind, reason, _ in faults(text)] == [("protocol_failure", each) for each in reasons]


def test_other_faults_of_the_report_come_first():
    text = '{"skill_name": "report", "arguments": {"status": 1, "summary": "", "claims": []}}'
    assert faults(text)[0] == ("malformed_action", "ill_typed", "status: int")


def test_the_profile_decides_whether_claims_are_read():
    itemised, baseline = (read_reply(Reply(text=reply({"1": "on"})), profile) for profile in (ITEMISED, Profile()))
    assert isinstance(itemised.action, Report)
    assert itemised.action.claims == {1: "on"}
    assert isinstance(baseline.action, Report)
    assert baseline.action.claims is None
    assert (itemised.ignored_keys, baseline.ignored_keys) == ((), ("arguments.claims",))


def test_a_report_in_a_record_has_claims_only_if_they_were_asked_for():
    plain = Report(status="success", summary="")
    assert plain.model_dump(mode="json") == {
        "skill_name": "report",
        "status": "success",
        "summary": "",
        "raw_status": None,
    }
    full = report({"2": "on", "1": "Done!"})
    assert json.loads(full.model_dump_json())["claims"] == {"1": "invalid", "2": "on"}
    assert Report.model_validate_json(full.model_dump_json()) == full
