"""The grammar of replies, and that no reply of any bytes raises."""

import json
from typing import Any

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from tests.support.narrowing import accepted, rejected
from vigil.base.json_text import MAX_DEPTH
from vigil.protocol.actions import (
    INTENT_ALIASES,
    INTENTS,
    STATUSES,
    InteractPixel,
    InvalidAction,
    Look,
    Navigate,
    ParsedReply,
    Reply,
    ReplyCut,
    Report,
)
from vigil.protocol.profile import Profile
from vigil.protocol.replies import MAX_REPLY_BYTES, parse_text, read_reply

WALK = '{"skill_name": "navigate", "arguments": {"mode": "forward", "magnitude": 2}}'


def reply(skill: Any, _extra: dict | None = None, /, **arguments: Any) -> str:
    return json.dumps({"skill_name": skill, "arguments": arguments, **(_extra or {})})


def action(text: str | bytes, **how: Any) -> Any:
    parsed = parse_text(text, **how)
    assert isinstance(parsed, ParsedReply), parsed
    return parsed.action


def fault(text: str | bytes, **how: Any) -> InvalidAction:
    parsed = parse_text(text, **how)
    assert isinstance(parsed, InvalidAction), parsed
    return parsed


def nested_lists(levels: int) -> str:
    return f'{WALK[:-1]}, "thought": {"[" * levels}{"]" * levels}}}'


def test_each_skill():
    assert action(WALK) == Navigate(mode="forward", magnitude=2.0)
    assert action(reply("look", direction="down", magnitude=30.5)) == Look(direction="down", magnitude=30.5)
    click = reply("interact_pixel", intent="pick", x=639, y=0)
    assert action(click) == InteractPixel(intent="pick", x=639, y=0)
    assert action(reply("report", status="closed", summary="")) == Report(status="closed", summary="")


@pytest.mark.parametrize(
    "text",
    [
        f"\n\t {WALK} \r\n",
        f"<think>I {'{'}wonder{'}'} if</think>\n{WALK}",
        f"  <think></think>{WALK}",
        f"Hm. <think></think>{WALK}",
        f"<think></think><think></think>{WALK}",
        f"{'x' * 100_000}</think>{WALK}",
        WALK.encode(),
        reply("NAVIGATE ", mode=" Forward\n", magnitude=2.0),
    ],
)
def test_what_may_stand_around_or_be_spelled_otherwise(text: str | bytes):
    assert action(text) == Navigate(mode="forward", magnitude=2.0)


def test_thoughts_are_kept_verbatim_and_unknown_keys_recorded():
    parsed = parse_text(
        '{"skill_name":"look","arguments":{"direction":"up","magnitude":1,"speed":9},"thought":null,'
        '"cognitive_state":{"a":[1,{"b":2.5}]},"extra":1}'
    )
    assert isinstance(parsed, ParsedReply)
    assert (parsed.thought, parsed.cognitive_state) == (None, {"a": [1, {"b": 2.5}]})
    assert parsed.ignored_keys == ("extra", "arguments.speed")


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "empty"),
        ("   ", "empty"),
        ("I will walk.", "no_object"),
        (f"Sure: {WALK}", "text_around_object"),
        (f"{WALK} Done.", "text_around_object"),
        (f"```json\n{WALK}\n```", "code_fence"),
        (f"{WALK}\n{WALK}", "several_objects"),
        (f"{WALK}{WALK}", "several_objects"),
        (WALK[:-1], "not_json"),
        (WALK.replace('"', "'"), "not_json"),
        (WALK[:-1] + ",}", "not_json"),
        (f"[{WALK}]", "not_an_object"),
        ("null", "not_an_object"),
        ('{"skill_name": "look"}', "missing_key"),
        ('{"arguments": {}}', "missing_key"),
        (WALK.replace("2", "NaN"), "not_a_number"),
        (WALK.replace("2", "-Infinity"), "not_a_number"),
        (WALK.replace('"magnitude": 2', '"magnitude": 2, "magnitude": 3'), "duplicate_key"),
        (WALK[:-1] + ', "thought": {"a": 1, "a": 1}}', "duplicate_key"),
        (WALK[:-1] + ', "thought": "\\ud800"}', "lone_surrogate"),
        (WALK[:-1] + ', "\\udfff": 1}', "lone_surrogate"),
        (WALK[:-1] + ', "thought": ["a", "\\ud800"]}', "lone_surrogate"),
        (WALK[:-1] + ', "thought": [{"a": ["\\udfff"]}]}', "lone_surrogate"),
        (WALK[:-1] + ', "thought": {"a": {"\\ud800": 1}}}', "lone_surrogate"),
        (WALK + "\ud800", "not_utf8"),
        (WALK.encode() + b"\xff", "not_utf8"),
        (f"\ud800</think>{WALK}", "not_utf8"),
        (f"\ud800</think>{WALK}".encode("utf-8", "surrogatepass"), "not_utf8"),
        (WALK + " " * 10 + "x" * MAX_REPLY_BYTES, "too_long"),
        (WALK[:-1] + ', "thought": ' + "[" * 30000 + "]" * 30000 + "}", "too_deep"),
        (f"<think>and so on {WALK}", "unclosed_reasoning"),
        (f"{WALK}<think>hm</think>", "text_around_object"),
        (f"{WALK}\n</think>", "text_around_object"),
        (f"{WALK}<think>hm</think>{WALK}", "text_around_object"),
        (f"<think>a</think>{WALK}<think>b</think>{WALK}", "text_around_object"),
        (WALK.replace(', "arg', ', <think>hm</think> "arg'), "text_around_object"),
        (" " * MAX_REPLY_BYTES + WALK, "too_long"),
        (WALK + " " * 10_000_000, "too_long"),
        (f"<think>hm</think>{' ' * MAX_REPLY_BYTES}{WALK}", "too_long"),
    ],
)
def test_protocol_failures(text: str | bytes, reason: str):
    found = fault(text)
    assert (found.kind, found.reason) == ("protocol_failure", reason)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (reply("move", mode="forward", magnitude=1), "unknown_skill"),
        (reply(None), "unknown_skill"),
        (reply(["navigate"]), "unknown_skill"),
        ('{"skill_name": "look", "arguments": []}', "arguments_not_an_object"),
        ('{"skill_name": "look", "arguments": null}', "arguments_not_an_object"),
        (reply("navigate", mode="forward"), "missing_argument"),
        (reply("navigate", magnitude=1), "missing_argument"),
        (reply("navigate", mode="ahead", magnitude=1), "not_in_vocabulary"),
        (reply("navigate", mode=1, magnitude=1), "ill_typed"),
        (reply("navigate", mode="forward", magnitude="1"), "ill_typed"),
        (reply("navigate", mode="forward", magnitude=True), "ill_typed"),
        (reply("navigate", mode="forward", magnitude=None), "ill_typed"),
        (reply("navigate", mode="forward", magnitude=0), "out_of_range"),
        (reply("navigate", mode="forward", magnitude=-1), "out_of_range"),
        (WALK.replace("2", "1e999"), "out_of_range"),
        (WALK.replace("2", "9" * 5000), "out_of_range"),
        (reply("interact_pixel", intent="grasp it", x=1, y=1), "not_in_vocabulary"),
        (reply("interact_pixel", intent="pick", x=1), "missing_argument"),
        (reply("interact_pixel", intent="pick", x=1, y=None), "ill_typed"),
        (reply("interact_pixel", intent="pick", x=1, y=1.5), "ill_typed"),
        (reply("interact_pixel", intent="pick", x=True, y=1), "ill_typed"),
        (reply("interact_pixel", intent="pick", x="1", y=1), "ill_typed"),
        (reply("interact_pixel", intent="pick", x=640, y=1), "pixel_outside_frame"),
        (reply("interact_pixel", intent="pick", x=1, y=480), "pixel_outside_frame"),
        (reply("interact_pixel", intent="pick", x=-1, y=1), "pixel_outside_frame"),
        (reply("interact_pixel", intent="pick", x=10**299, y=1), "pixel_outside_frame"),
        (reply("report", summary="x"), "missing_argument"),
        (reply("report", status="success"), "missing_argument"),
        (reply("report", status=None, summary="x"), "ill_typed"),
        (reply("report", status="success", summary=3), "ill_typed"),
        (reply("report", status="great", summary=None), "ill_typed"),
    ],
)
def test_malformed_actions(text: str, reason: str):
    found = fault(text)
    assert (found.kind, found.reason, found.would_parse_leniently) == ("malformed_action", reason, False)


def test_a_whole_float_is_an_int_and_a_huge_int_a_number():
    assert action(reply("interact_pixel", intent="place", x=320.0, y=4.79e2)) == InteractPixel(
        intent="place", x=320, y=479
    )
    assert action(reply("navigate", mode="turn_left", magnitude=10**299)).magnitude == 1e299


@pytest.mark.parametrize("extra", [{}, {"x": 5, "y": 9}, {"x": "left", "y": -7}])
def test_drop_needs_no_pixel_and_may_carry_one(extra: dict):
    parsed = parse_text(reply("interact_pixel", intent="drop", **extra))
    assert isinstance(parsed, ParsedReply)
    assert parsed.action == InteractPixel(intent="drop")
    assert parsed.ignored_keys == tuple(f"arguments.{key}" for key in extra)


@pytest.mark.parametrize(("word", "intent"), [*INTENT_ALIASES.items(), *((name, name) for name in INTENTS)])
def test_intents_and_their_aliases(word: str, intent: str):
    assert action(reply("interact_pixel", intent=f" {word.upper()} ", x=1, y=2)).intent == intent


@pytest.mark.parametrize("status", STATUSES)
def test_statuses_have_no_aliases_but_are_folded(status: str):
    assert action(reply("report", status=f" {status.title()}\n", summary="")).status == status
    odd = action(reply("report", status=f"{status}ed!", summary=""))
    assert (odd.status, odd.raw_status) == ("invalid", f"{status}ed!")


@pytest.mark.parametrize("raw", [" Great Success ", "DONE\n", "", "On."])
def test_a_status_outside_of_the_vocabulary_is_kept_to_the_letter(raw: str):
    assert action(reply("report", status=raw, summary=" As It Is ")) == Report(
        status="invalid", summary=" As It Is ", raw_status=raw
    )
    assert action(reply("report", status="SUCCESS ", summary="")).raw_status is None


def test_normalized_coordinates():
    def at(x: Any, y: Any) -> Any:
        return parse_text(reply("interact_pixel", intent="ground", x=x, y=y), "normalized_1000")

    for given_xy, pixel in [
        ((0, 0), (0, 0)),
        ((1000, 1000), (639, 479)),
        ((500, 500), (320, 240)),
        ((999, 1), (639, 0)),
        ((1, 999), (0, 479)),
        ((3, 4), (1, 1)),
        ((701, 702), (448, 336)),
    ]:
        parsed = at(*given_xy)
        assert isinstance(parsed, ParsedReply)
        assert parsed.action == InteractPixel(intent="ground", x=pixel[0], y=pixel[1])
    assert at(1001, 0).reason == "pixel_outside_frame"
    assert at(0.5, 0).reason == "ill_typed"


@pytest.mark.parametrize(
    ("text", "is_loose"),
    [
        (f"```json\n{WALK}\n```", True),
        (f"```\n{WALK}```", True),
        (f"I think {{so}}.\n```json\n{WALK}\n```\nGood.", True),
        (f"Sure: {WALK}. That is it", True),
        (f"{WALK} {WALK}", False),
        ("no object at all", False),
        ('Sure: {"skill_name": "fly", "arguments": {}}', False),
        (WALK[:-1], False),
        (f'{{"plan": "first", "next": {WALK}, "then": "tur', False),
        (f'{{"plan": 1, "plan": 2, "next": {WALK}}}', False),
        (f'{{"plan": NaN, "next": {WALK}}}', False),
        (f"[{WALK}]", False),
        (f"[1] {WALK}", True),
        (f"I {{think}} so: {WALK}", True),
        (f"A {{set {{of}} braces}}, then {WALK}", True),
        (f"{WALK.replace('2', 'NaN')}", False),
    ],
)
def test_the_lenient_policy_is_a_variant_and_the_strict_one_says_what_it_would_do(text: str, is_loose: bool):
    assert fault(text).would_parse_leniently is is_loose
    assert isinstance(parse_text(text, policy="lenient"), ParsedReply) is is_loose
    if is_loose:
        assert action(text, policy="lenient") == action(WALK)


def test_leniently_found_malformed_actions_are_malformed():
    text = 'Sure: {"skill_name": "fly", "arguments": {}}'
    assert fault(text, policy="lenient").kind == "malformed_action"
    assert fault(text).kind == "protocol_failure"


def test_what_the_provider_said_counts():
    def of(text: str | bytes, **facts: Any) -> Any:
        return read_reply(Reply.model_validate({"text": text, **facts})).parsed

    assert of(WALK, provider_rejected=True).reason == "provider_rejected"
    assert of(WALK[:-3], finish_reason="length").reason == "truncated"
    assert of(WALK[:-3], finish_reason="stop").reason == "not_json"
    assert of(reply("fly"), finish_reason="max_tokens").reason == "unknown_skill"
    assert isinstance(of(WALK, finish_reason="length"), ParsedReply)
    assert of(WALK.encode() + b"\xff").reason == "not_utf8"


@pytest.mark.parametrize(
    "word", ["length", "max_tokens", "MAX_TOKENS", "model_length", "max_output_tokens", "model_context_window_exceeded"]
)
def test_every_providers_word_for_a_cut_makes_a_torn_reply_truncated(word: str):
    found = read_reply(Reply(text=WALK[:-3], finish_reason=word)).parsed
    assert isinstance(found, InvalidAction)
    assert (found.kind, found.reason) == ("protocol_failure", "truncated")
    assert found.detail.startswith("not_json ")
    empty = read_reply(Reply(text="", finish_reason=word)).parsed
    assert isinstance(empty, InvalidAction)
    assert empty.detail.split()[0] == "empty"


def test_what_a_program_did_instead_of_answering_is_its_failure():
    found = read_reply(Reply(text=WALK, agent_ended="it hung")).parsed
    assert isinstance(found, InvalidAction)
    assert (found.kind, found.reason, found.detail) == ("protocol_failure", "agent_ended", "it hung")


@pytest.mark.parametrize(("answer_bytes", "reason"), [(MAX_REPLY_BYTES, None), (MAX_REPLY_BYTES + 1, "too_long")])
def test_a_reply_cut_for_the_record_is_judged_by_its_length_before(answer_bytes: int, reason: str | None):
    cut = ReplyCut(text_bytes=10**6, answer_bytes=answer_bytes, sha256="0" * 64)
    found = read_reply(Reply(text=WALK, cut=cut)).parsed
    assert (found.reason if isinstance(found, InvalidAction) else None) == reason


def test_modes_and_policy_are_handed_on():
    click = reply("interact_pixel", intent="ground", x=1000, y=1000)
    found = read_reply(Reply(text=click), Profile(coordinates="normalized_1000")).parsed
    assert isinstance(found, ParsedReply)
    assert found.action == InteractPixel(intent="ground", x=639, y=479)
    assert isinstance(read_reply(Reply(text=f"Sure: {WALK}"), Profile(reply_policy="lenient")).parsed, ParsedReply)
    assert isinstance(read_reply(Reply(text=click)).parsed, InvalidAction)


@pytest.mark.parametrize(
    ("text", "detail"),
    [
        ('{"skill_name": "look"}', "arguments"),
        ('{"arguments": {}}', "skill_name"),
        ("[]", "list"),
        (WALK.replace("2", "NaN"), "NaN"),
        (WALK.replace("2", "-Infinity"), "-Infinity"),
        (WALK[:-1] + ', "thought": {"a": 1, "a": 1}}', "'a'"),
        (WALK[:-1] + ', "thought": {"' + "b" * 100 + '": 1, "' + "b" * 100 + '": 1}}', "'" + "b" * 79),
        (nested_lists(64), "more than 64 levels"),
        (WALK + " " * MAX_REPLY_BYTES, f"{len(WALK) + MAX_REPLY_BYTES} bytes, more than 65536"),
        (reply("fly"), "'fly'"),
        (reply("x" * 100), "'" + "x" * 79),
        (reply([1]), "list"),
        (reply(3), "3"),
        ('{"skill_name": "look", "arguments": null}', "NoneType"),
        (reply("look", magnitude=1), "direction"),
        (reply("look", direction="left", magnitude=1), "direction: 'left'"),
        (reply("look", direction="up", magnitude=-2), "magnitude: -2"),
        (reply("look", direction="up", magnitude="2"), "magnitude: str"),
        (reply("interact_pixel", intent="hit", x=1, y=1), "intent: 'hit'"),
        (reply("interact_pixel", intent="pick", x=1, y=480), "y: 480"),
        (reply("report", status=1, summary=""), "status: int"),
    ],
)
def test_an_invalid_reply_says_what_was_wrong_with_it(text: str, detail: str):
    assert fault(text).detail == detail


@pytest.mark.parametrize(("others", "is_found"), [(62, True), (63, False)])
def test_leniently_no_more_than_63_objects_are_looked_at(others: int, is_found: bool):
    text = "Well: " + "{} " * others + WALK
    assert isinstance(parse_text(text, policy="lenient"), ParsedReply) is is_found


def nested(levels: int, inner: str = "1") -> str:
    """A walk whose thought makes the reply `levels` deep."""
    return f'{WALK[:-1]}, "thought": {"[" * (levels - 1)}{inner}{"]" * (levels - 1)}}}'


@pytest.mark.parametrize("policy", ["strict", "lenient"])
@pytest.mark.parametrize("depth", [0, 500])
def test_a_reply_is_at_most_64_levels_deep_however_deep_the_stack_is(policy: Any, depth: int):
    if depth:
        return test_a_reply_is_at_most_64_levels_deep_however_deep_the_stack_is(policy, depth - 1)
    assert MAX_DEPTH == 64
    parsed = parse_text(nested(64, '"[[[[{{{"'), policy=policy)
    assert isinstance(parsed, ParsedReply)
    assert ParsedReply.model_validate_json(parsed.model_dump_json()) == parsed
    for text in (nested(65), nested(987), nested(30_000), nested(65, ""), "[" * 65, "<think>x</think>" + nested(65)):
        assert fault(text, policy=policy).reason == "too_deep"
        assert not fault(text, policy=policy).would_parse_leniently
    assert not fault(f"Sure: {nested(65)}", policy=policy).would_parse_leniently
    assert isinstance(parse_text(f"Sure: {nested(64)}", policy="lenient"), ParsedReply)
    return None


def test_the_limit_on_the_length_counts_all_but_the_reasoning():
    fits = WALK + " " * (MAX_REPLY_BYTES - len(WALK))
    assert action(fits) == action(WALK)
    assert fault(fits + " ").reason == "too_long"
    assert action(f"<think>{'x' * MAX_REPLY_BYTES}</think>{fits}") == action(WALK)


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=9), inner, max_size=3),
    max_leaves=8,
)
WORDS = st.sampled_from([*INTENTS, *STATUSES, "forward", "turn_left", "up", "open", "x", ""]) | st.text(max_size=5)
ARGUMENTS = st.dictionaries(
    st.sampled_from(["mode", "magnitude", "direction", "intent", "x", "y", "status", "summary", "z"]), WORDS | JSON
)
OBJECTS = st.fixed_dictionaries(
    {"skill_name": st.sampled_from(["navigate", "look", "interact_pixel", "report", "fly"]), "arguments": ARGUMENTS},
    optional={"thought": JSON, "cognitive_state": JSON},
)


@given(
    text=st.text(alphabet=st.characters()) | st.binary() | JSON.map(json.dumps) | OBJECTS.map(json.dumps),
    policy=st.sampled_from(["strict", "lenient"]),
    coordinates=st.sampled_from(["pixel", "normalized_1000"]),
)
@example("\ud800", "strict", "pixel")
@example('{"a":' * 12000, "lenient", "pixel")
@example("[" * 60000, "lenient", "pixel")
@example("{" * 60000, "lenient", "pixel")
@example('{"skill_name":"look","arguments":{"direction":"up","magnitude":' + "9" * 60000 + "}}", "strict", "pixel")
@example(b"\x00\xff\xfe", "strict", "pixel")
def test_no_reply_ever_raises(text: str | bytes, policy: Any, coordinates: Any):
    parsed = parse_text(text, coordinates, policy)
    assert isinstance(parsed, ParsedReply | InvalidAction)
    answer = Reply.model_validate({"text": text})
    assert isinstance(
        read_reply(answer, Profile(coordinates=coordinates, reply_policy=policy)).parsed, ParsedReply | InvalidAction
    )
    assert Reply.model_validate_json(answer.model_dump_json()) == answer
    if isinstance(parsed, InvalidAction):
        assert parsed.model_dump_json()
    else:
        assert type(parsed.action).model_validate_json(parsed.action.model_dump_json()) == parsed.action


@given(OBJECTS, st.sampled_from(["```json\n{}\n```", "Sure: {}", "{} ok"]))
def test_lenient_agrees_with_strict_on_what_it_strips(fields: dict, frame: str):
    text = json.dumps(fields)
    bare, framed = parse_text(text), parse_text(frame.replace("{}", text), policy="lenient")
    if isinstance(bare, ParsedReply) and isinstance(framed, ParsedReply):
        assert bare.action == framed.action


LOOK = '{"skill_name": "look", "arguments": {"direction": "up", "magnitude": 1}}'


@pytest.mark.parametrize(
    "text",
    [
        LOOK.replace(", ", ",\n").join(("```json\n", "\n```")),
        f"```\n{LOOK}\n``` is better than {LOOK.replace('up', 'down')}",
    ],
)
def test_one_fence_holds_the_answer_on_any_number_of_lines(text: str):
    assert rejected(parse_text(text, "pixel", "strict")).would_parse_leniently
    assert accepted(parse_text(text, "pixel", "lenient")).action == accepted(parse_text(LOOK, "pixel", "strict")).action


def test_details_name_what_was_given_instead():
    assert rejected(parse_text('{"skill_name": "look", "arguments": [1]}')).detail == "list"
    two = rejected(parse_text(LOOK + WALK))
    assert (two.reason, two.detail) == ("several_objects", "")
    cut = ReplyCut(text_bytes=90_000, answer_bytes=80_000, sha256="0" * 64)
    too_long = rejected(read_reply(Reply(text="{", cut=cut)).parsed)
    assert (too_long.detail, too_long.would_parse_leniently) == ("80000 bytes, more than 65536", False)


def test_a_stray_brace_before_a_torn_object_is_no_part_of_it():
    assert fault(f"}} {{torn {WALK}}}", policy="lenient").kind == "protocol_failure"


def test_an_empty_answer_after_reasoning_says_so_and_no_other_does():
    empty = rejected(read_reply(Reply(text=" ", reasoning_chars=9)).parsed)
    assert (empty.reason, empty.detail) == ("empty", "all 9 characters came as reasoning, and no answer followed")
    assert "came as reasoning" not in rejected(read_reply(Reply(text=" ")).parsed).detail
    torn = rejected(read_reply(Reply(text="{", reasoning_chars=9)).parsed)
    assert "came as reasoning" not in torn.detail
    assert read_reply(Reply(text=LOOK, reasoning_chars=9)).parsed == parse_text(LOOK)


def test_one_malformed_object_is_not_searched_for_another():
    inner = '{"skill_name":"navigate","arguments":{"mode":"forward","magnitude":1}}'
    text = f'{{"thought":"``` ","x":{inner},"y":"```","skill_name":"fly","arguments":{{}}}}'
    assert rejected(parse_text(text, policy="lenient")).reason == "unknown_skill"
    assert not rejected(parse_text(text)).would_parse_leniently


def test_a_list_in_a_fence_is_no_answer():
    assert not rejected(parse_text(f"```json\n[{LOOK}]\n```")).would_parse_leniently


def test_a_fenced_click_points_as_the_profile_says():
    click = '{"skill_name": "interact_pixel", "arguments": {"intent": "pick", "x": 1000, "y": 0}}'
    assert parse_text(f"```\n{click}\n```", "normalized_1000", "lenient") == parse_text(click, "normalized_1000")
    assert rejected(parse_text(f"```\n{click}\n```", "pixel", "lenient")).reason == "pixel_outside_frame"
    assert not rejected(parse_text(f"```\n{click}\n```", "pixel")).would_parse_leniently
    assert rejected(parse_text(f"```\n{click}\n```", "normalized_1000")).would_parse_leniently


def test_a_thought_is_kept_and_an_ill_typed_pixel_is_named():
    assert accepted(parse_text(LOOK.replace("{", '{"thought": "t", ', 1))).thought == "t"
    click = '{"skill_name": "interact_pixel", "arguments": {"intent": "pick", "x": "7", "y": 0}}'
    assert rejected(parse_text(click)).detail == "x: str"
