"""The tables of actions agree with the types, and a reply carries any text."""

from typing import get_args

import pytest
from pydantic import TypeAdapter, ValidationError

from vigil.protocol.actions import (
    INTENT_ALIASES,
    INTENTS,
    SKILLS,
    STATUSES,
    Action,
    Coordinates,
    Intent,
    InteractPixel,
    InvalidAction,
    Look,
    LookDirection,
    Navigate,
    NavigateMode,
    ParsedReply,
    PhysicalAction,
    Reply,
    ReplyPolicy,
    Report,
    SkillName,
    Status,
    Usage,
    skills_of,
)

TYPES = {"navigate": Navigate, "look": Look, "interact_pixel": InteractPixel, "report": Report}


def test_tables_and_types_list_the_same_words():
    assert tuple(SKILLS) == ("navigate", "look", "interact_pixel", "report")
    assert {*SKILLS, *skills_of(has_report=False, has_pixels=False)} == set(get_args(SkillName))
    assert tuple(INTENTS) == get_args(Intent)
    assert tuple(STATUSES) == get_args(Status)
    values = {(skill, argument.name): argument.values for skill, spec in SKILLS.items() for argument in spec}
    assert values["navigate", "mode"] == get_args(NavigateMode)
    assert values["look", "direction"] == get_args(LookDirection)
    assert values["interact_pixel", "intent"] == tuple(INTENTS)
    assert values["report", "status"] == tuple(STATUSES)


@pytest.mark.parametrize("skill", SKILLS)
def test_every_argument_is_a_field_of_its_action(skill: SkillName):
    fields = set(TYPES[skill].model_fields) - {"skill_name", "raw_status", "claims", "raw_claims", "object"}
    assert {argument.name for argument in SKILLS[skill]} == fields


def test_aliases_shadow_no_intent_and_are_folded():
    assert not set(INTENT_ALIASES) & set(INTENTS)
    assert all(word == word.strip().casefold() for word in INTENT_ALIASES)
    assert set(INTENT_ALIASES.values()) <= set(INTENTS)
    assert {"open": "open_access", "toggle_on": "activate"}.items() <= INTENT_ALIASES.items()


@pytest.mark.parametrize(
    ("text", "kept", "is_utf8"),
    [
        ("plain", "plain", True),
        ("é\U0001f600", "é\U0001f600", True),
        ("a\ud800b", "a\ufffd\ufffd\ufffdb", False),
        (b"a\xffb", "a\ufffdb", False),
        ("é".encode(), "é", True),
        ("\ud83d\ude00", "\ufffd" * 6, False),
    ],
)
def test_a_reply_carries_any_text(text: str | bytes, kept: str, is_utf8: bool):
    reply = Reply.model_validate({"text": text})
    assert (reply.text, reply.is_utf8) == (kept, is_utf8)
    assert Reply.model_validate_json(reply.model_dump_json()) == reply
    assert reply.raw == (text.encode("utf-8", "surrogatepass") if isinstance(text, str) else text)


@pytest.mark.parametrize(
    ("intent", "words"),
    [
        ("ground", {"click", "locate", "point", "point_at"}),
        ("open_access", {"open"}),
        ("close_access", {"close", "shut"}),
        ("activate", {"switch_on", "toggle_on", "turn_on"}),
        ("deactivate", {"switch_off", "toggle_off", "turn_off"}),
        ("pick", {"grab", "grasp", "pick_up", "pickup", "take"}),
        ("place", {"put", "put_down", "put_in", "put_on"}),
        ("drop", {"release"}),
    ],
)
def test_the_published_words_for_an_intent(intent: Intent, words: set[str]):
    assert {word for word, meant in INTENT_ALIASES.items() if meant == intent} == words


def test_only_drop_needs_no_pixel():
    assert [intent for intent, spec in INTENTS.items() if not spec.needs_pixel] == ["drop"]
    spared = [(skill, each.name) for skill, spec in SKILLS.items() for each in spec if each.unless_drop]
    assert spared == [("interact_pixel", "x"), ("interact_pixel", "y")]


def test_the_arguments_types_are_the_published_ones():
    assert [[argument.type for argument in spec] for spec in SKILLS.values()] == [
        ["enum", "number"],
        ["enum", "number"],
        ["enum", "int", "int"],
        ["enum", "string"],
    ]


@pytest.mark.parametrize("magnitude", [0, -1, float("nan"), float("inf")])
def test_an_action_has_a_finite_magnitude_above_zero(magnitude: float):
    with pytest.raises(ValidationError, match="magnitude"):
        Navigate(mode="forward", magnitude=magnitude)
    with pytest.raises(ValidationError, match="magnitude"):
        Look(direction="up", magnitude=magnitude)


@pytest.mark.parametrize(
    "action",
    [
        Navigate(mode="turn_right", magnitude=0.5),
        Look(direction="down", magnitude=0.5),
        InteractPixel(intent="place", x=1, y=2),
        InteractPixel(intent="drop"),
        Report(status="off", summary="It is off."),
        Report(status="invalid", summary="", raw_status="Done"),
    ],
)
def test_an_action_comes_back_from_its_skill_and_fields_and_never_changes(action):
    assert TypeAdapter(Action).validate_json(action.model_dump_json()) == action
    assert SKILLS[action.skill_name]
    with pytest.raises(ValidationError, match="frozen"):
        action.skill_name = "look"
    with pytest.raises(ValidationError, match="Extra inputs"):
        type(action).model_validate(action.model_dump() | {"speed": 1})


def test_a_reply_that_says_nothing_of_itself_comes_from_an_agent_and_is_sound():
    reply = Reply(text="x")
    assert reply.model_dump() == {
        "text": "x",
        "is_utf8": True,
        "raw_base64": None,
        "reply_source": "agent",
        "finish_reason": None,
        "reasoning_chars": 0,
        "usage": None,
        "seconds": 0.0,
        "provider_rejected": False,
        "agent_ended": "",
        "cut": None,
    }
    assert Usage().model_dump() == {"input_tokens": 0, "output_tokens": 0}
    for word in ("server", "library"):
        assert Reply.model_validate({"text": "", "reply_source": word}).reply_source == word
    with pytest.raises(ValidationError, match="reply_source"):
        Reply.model_validate({"text": "", "reply_source": "cache"})


@pytest.mark.parametrize("fields", ["text", {"text": 3}, {"text": None}, {}])
def test_a_reply_needs_text_or_bytes(fields):
    with pytest.raises(ValidationError):
        Reply.model_validate(fields)


def test_an_invalid_action_and_a_parsed_reply_say_no_more_than_they_know():
    assert InvalidAction(kind="malformed_action", reason="unknown_skill").model_dump() == {
        "kind": "malformed_action",
        "reason": "unknown_skill",
        "detail": "",
        "would_parse_leniently": False,
    }
    parsed = ParsedReply(action=Look(direction="up", magnitude=1))
    assert (parsed.thought, parsed.cognitive_state, parsed.ignored_keys) == (None, None, ())


def test_an_action_without_its_skill_is_none():
    with pytest.raises(ValidationError, match="Unable to extract tag"):
        TypeAdapter(Action).validate_python({"mode": "forward", "magnitude": 1})
    assert get_args(PhysicalAction) == (Navigate, Look, InteractPixel)
    assert Report(status="on", summary="").raw_status is None


def test_the_words_of_settings_stay():
    assert get_args(Coordinates) == ("pixel", "normalized_1000")
    assert get_args(ReplyPolicy) == ("strict", "lenient")
