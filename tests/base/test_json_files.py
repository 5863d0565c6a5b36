"""What is JSON and what is not, at a depth that does not hang on Python's stack."""

import sys

import pytest

from vigil.base.json_files import read_json


@pytest.mark.parametrize(
    ("data", "said"),
    [
        ('{"a": NaN}', "NaN and Infinity are not JSON"),
        (b"[-Infinity]", "NaN and Infinity are not JSON"),
        (b"[" * 202 + b"]" * 202, "recursion limit exceeded"),
        (b'{"a":' * 100_000, "recursion limit exceeded"),
        (b"\xff", "line 1 column 1"),
        ('"\ud800"', "an unpaired surrogate"),
        (b'"\\ud800"', "hex escape"),
        (b"\xef\xbb\xbf{}", "byte order mark: save it as UTF-8 without one"),
        ("{}".encode("utf-16"), "byte order mark: save it as UTF-8 without one"),
        (b"{", "EOF"),
        (b"", "EOF"),
        (b"1 2", "trailing characters"),
    ],
)
def test_what_is_no_json_is_named(data, said):
    with pytest.raises(ValueError, match=said):
        read_json(data)


def test_what_is_json_is_read():
    assert read_json('{"a": [1, 2.5, null, true, "ä"], "b": {}}') == {"a": [1, 2.5, None, True, "ä"], "b": {}}
    assert read_json(b"9" * 30) == int("9" * 30)


def test_the_bound_does_not_hang_on_pythons_stack():
    deep = b"[" * 201 + b"]" * 201
    limit = sys.getrecursionlimit()
    try:
        sys.setrecursionlimit(len_of_stack() + 60)
        assert read_json(deep)
    finally:
        sys.setrecursionlimit(limit)


def len_of_stack() -> int:
    frame, depth = sys._getframe(), 0
    while frame is not None:
        frame, depth = frame.f_back, depth + 1
    return depth
