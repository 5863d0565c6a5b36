import json
import math

import pytest

from vigil.base.json_text import MAX_DEPTH, MAX_INT_DIGITS, JsonFault, decode, extent, is_one_value, object_end


def nested(levels: int, inner: str = "") -> str:
    """An object with lists in it, `levels` deep in all."""
    return '{"a":' + "[" * (levels - 1) + inner + "]" * (levels - 1) + "}"


@pytest.mark.parametrize(
    ("text", "start", "end", "deepest"),
    [
        ("{}", 0, 2, 1),
        ("[]", 0, 2, 1),
        ("{[]}{}", 0, 4, 2),
        ("{}{}", 2, 4, 1),
        ("[[[]][]]]", 0, 8, 3),
        ('{"}":"]"} ', 0, 9, 1),
        ('{"\\"}": 1}', 0, 10, 1),
        ('{"a\n}": "\\\n}"}', 0, 14, 1),
        ("{[{", 0, -1, 3),
        ('{"never closed }', 0, -1, 1),
    ],
)
def test_extent_counts_brackets_outside_of_strings(text: str, start: int, end: int, deepest: int) -> None:
    assert extent(text, start) == (end, deepest)


def test_decode_takes_the_value_at_its_place_and_says_where_it_ends() -> None:
    assert decode('  {"a": [1]} x'[2:]) == ({"a": [1]}, 10)
    assert decode("x[1, 2]{", 1) == ([1, 2], 7)
    assert decode("{[" + "3", 2) == (3, 3)


@pytest.mark.parametrize("text", [nested(MAX_DEPTH), "[" * MAX_DEPTH + "]" * MAX_DEPTH])
def test_as_many_levels_as_allowed_are_decoded(text: str) -> None:
    assert decode(text) == (json.loads(text), len(text))
    assert decode("[" + text, 1)[1] == len(text) + 1


@pytest.mark.parametrize(
    ("text", "reason", "detail"),
    [
        (nested(MAX_DEPTH + 1), "too_deep", "more than 64 levels"),
        ("[" * (MAX_DEPTH + 1), "too_deep", "more than 64 levels"),
        ("{'a': 1}", "not_json", "Expecting property name enclosed in double quotes: line 1 column 2 (char 1)"),
        ('{"a": NaN}', "not_a_number", "NaN"),
        ('{"a": -Infinity}', "not_a_number", "-Infinity"),
        ('{"é": 1, "é": 1}', "duplicate_key", "'\\xe9'"),
        ('{"%s": 1, "%s": 2}' % (("k" * 100,) * 2), "duplicate_key", "'" + "k" * 79),
        ('{"a": "\\ud800"}', "lone_surrogate", ""),
        ('{"\\udfff": 1}', "lone_surrogate", ""),
        ('{"a": [["\\ud800"]]}', "lone_surrogate", ""),
        ('[{"a": "\\udfff"}]', "lone_surrogate", ""),
    ],
)
def test_a_fault_has_a_code_and_says_more_where_there_is_more(text: str, reason: str, detail: str) -> None:
    with pytest.raises(JsonFault, match=f"^{reason}$") as caught:
        decode(text)
    assert (caught.value.reason, caught.value.detail) == (reason, detail)


def test_every_fault_of_json_says_which_character_it_is() -> None:
    with pytest.raises(JsonFault) as caught:
        decode("[[1 2]]")
    assert caught.value.detail.endswith("(char 4)")


@pytest.mark.parametrize("char", ["\ud7ff", "\ue000", "é", "\U0001f600"])
def test_other_characters_beyond_ascii_are_welcome(char: str) -> None:
    assert decode(json.dumps([char]))[0] == [char]


def test_longer_integers_become_infinite_floats() -> None:
    assert decode("9" * MAX_INT_DIGITS)[0] == int("9" * MAX_INT_DIGITS)
    longest = decode("9" * (MAX_INT_DIGITS + 10))[0]
    assert isinstance(longest, float)
    assert math.isinf(longest)
    assert MAX_INT_DIGITS == 300


@pytest.mark.parametrize(
    ("text", "start", "end"),
    [
        ('{"a": 1} and', 0, 8),
        (' {"a": 1}', 1, 9),
        (' {"a": 1}', 0, -1),
        ("[1]", 0, -1),
        ('{"a": 1', 0, -1),
        ("{a}", 0, -1),
        ('{"a": 1]', 0, -1),
        ('{"a": 1, "a": NaN}', 0, 18),
        ("{}", 0, 2),
        (nested(MAX_DEPTH), 0, len(nested(MAX_DEPTH))),
        (nested(MAX_DEPTH, "no json"), 0, -1),
        (nested(MAX_DEPTH + 1, "no json"), 0, len(nested(MAX_DEPTH + 1, "no json"))),
        ("{" * 2000, 0, -1),
    ],
)
def test_the_end_of_an_object(text: str, start: int, end: int) -> None:
    assert object_end(text, start) == end


@pytest.mark.parametrize(
    ("text", "is_one"),
    [
        (' {"a": 1}\n', True),
        ("[1]", True),
        ("12", True),
        ("9" * 5000, True),
        ('"text"', True),
        ("NaN", True),
        ('{"a": 1, "a": 2}', True),
        (nested(MAX_DEPTH), True),
        (nested(MAX_DEPTH, "no json"), False),
        ("[" * MAX_DEPTH + "no json" + "]" * MAX_DEPTH, False),
        (nested(MAX_DEPTH + 1, "no json"), True),
        ("[" * 70 + "]" * 70, True),
        ("", False),
        ("  ", False),
        ("word", False),
        ("x", False),
        ("{}{}", False),
        ("[1] 2", False),
        ("12 13", False),
        ("{1}", False),
        ("[" * 70, False),
        ("[" * (MAX_DEPTH + 1) + "no json" + "]" * (MAX_DEPTH + 1), True),
    ],
)
def test_whether_a_text_is_one_value(text: str, is_one: bool) -> None:
    assert is_one_value(text) is is_one
