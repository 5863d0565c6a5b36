"""The tables of actions agree with the types, and a reply carries any text."""

from typing import get_args

import pytest

from vigil.actions import (
    INTENT_ALIASES,
    INTENTS,
    SKILLS,
    STATUSES,
    Intent,
    InteractPixel,
    Look,
    LookDirection,
    Navigate,
    NavigateMode,
    Reply,
    Report,
    SkillName,
    Status,
)

TYPES = {"navigate": Navigate, "look": Look, "interact_pixel": InteractPixel, "report": Report}


def test_tables_and_types_list_the_same_words():
    assert tuple(SKILLS) == get_args(SkillName)
    assert tuple(INTENTS) == get_args(Intent)
    assert tuple(STATUSES) == get_args(Status)
    values = {(skill, argument.name): argument.values for skill, spec in SKILLS.items() for argument in spec}
    assert values["navigate", "mode"] == get_args(NavigateMode)
    assert values["look", "direction"] == get_args(LookDirection)
    assert values["interact_pixel", "intent"] == tuple(INTENTS)
    assert values["report", "status"] == tuple(STATUSES)


@pytest.mark.parametrize("skill", SKILLS)
def test_every_argument_is_a_field_of_its_action(skill: SkillName):
    fields = set(TYPES[skill].model_fields) - {"skill_name", "raw_status"}
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
