import time
from typing import get_args

import pytest

from vigil.protocol.reasoning import Thinking, is_unclosed, split_reasoning

A = '{"skill_name": "look", "arguments": {"direction": "up", "magnitude": 1}}'
B = '{"skill_name": "look", "arguments": {"direction": "down", "magnitude": 2}}'


@pytest.mark.parametrize(
    ("head", "chars"),
    [
        ("<think>abc</think>", 3),
        ("\n<think>abc</think>\n", 3),
        ("abc</think>", 3),
        ("◁think▷abc◁/think▷", 3),
        ("abc◁/think▷", 3),
        ('<think mode="deep">abc</think>', 3),
        ("<think>ab</think><think>c</think>", 3),
        ("<think>a<think>b</think>c</think>", 3),
        ("<think>a</think>\nb<think>c</think>", 4),
        (f"<think>{A}</think>", len(A)),
        (f"{A}</think>", len(A)),
        (f"draft {A} and so on</think>", len(A) + 16),
        (f"<think>a</think>{A} no</think>", len(A) + 4),
        (f"{A}<think>b</think></think>", len(A) + 1),
        ("<think>{</think>", 1),
        ("<think>no { end</think>", 8),
    ],
)
def test_what_stands_before_the_object_up_to_a_closing_marker_is_reasoning(head: str, chars: int) -> None:
    quoting = B.replace("down", "◁/think▷ {")
    for answer in (B, f" {B} ", f"{B} text", B.replace("down", "</think>"), quoting, f"  {quoting}"):
        found, count = split_reasoning(head.rstrip("\n") + answer)
        assert found == answer
        assert count == chars


@pytest.mark.parametrize(
    "text",
    [
        "",
        "no marker",
        "<think>never closed",
        A,
        A.replace("up", "<think>x</think>"),
        A.replace("up", "</think>" + A.replace('"', '\\"')),
        f"  [{A.replace('up', '</think>')}]\n",
        '"<think>x</think>"',
        "[" * 2000 + '"</think>"' + "]" * 2000,
        f"{A}<think>x</think>",
        f"{A}</think>",
        f"{A} </think> and",
        f"{A}<think>x</think>{B}",
        f"{A}<think>x</think><think>y</think>{B}",
        f"{A} <think>x</think> {A}",
    ],
)
def test_what_stands_after_or_inside_the_object_is_none(text: str) -> None:
    assert split_reasoning(text) == (text, 0)


@pytest.mark.parametrize(
    ("text", "answer"),
    [
        (f"<think>a</think>{A}<think>b</think>{B}", f"{A}<think>b</think>{B}"),
        (f"<think>a</think>{A}</think>", f"{A}</think>"),
        ("<think>a</think>I cannot.", "I cannot."),
        ("a</think>b</think>", ""),
        ("<think>a</think>```json\n{}\n```</think>", "```json\n{}\n```</think>"),
        ('<think>a</think>{"thought": "</think>', '{"thought": "</think>'),
    ],
)
def test_what_is_left_when_the_answer_is_none(text: str, answer: str) -> None:
    assert split_reasoning(text)[0] == answer


def test_a_reasoning_may_begin_without_an_end() -> None:
    assert is_unclosed(f" <think>and {A}")
    assert is_unclosed("◁think▷")
    assert not is_unclosed("<think>x</think>")
    assert not is_unclosed("<thinker>")
    assert not is_unclosed("◁think▷abc◁/think▷")


def test_a_run_asks_for_reasoning_or_not_or_leaves_it_to_the_provider() -> None:
    assert get_args(Thinking) == ("on", "off", "default")


@pytest.mark.parametrize(
    "piece", ["{</think>", '{"</think>', "</think>{}", "<think>{[", '{"a":</think>', '"\\', "<think "]
)
def test_hostile_texts_take_no_time(piece: str) -> None:
    started = time.process_time()
    split_reasoning(piece * 20_000)
    split_reasoning(piece * 20_000 + "</think>" + A)
    assert time.process_time() - started < 3


@pytest.mark.parametrize(("later", "is_found"), [(63, True), (64, False)])
def test_the_last_64_closing_markers_are_looked_at(later: int, is_found: bool) -> None:
    behind = f"{A}{'<think>b</think>' * later}"
    assert split_reasoning(f"a</think>{behind}")[0] == (behind if is_found else "")
