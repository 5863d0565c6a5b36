"""Every command and program that README.md and the docs show can be parsed, and every mark means something."""

import ast
import json

import pytest

from scripts.markdown_pages import read
from tests.support.doc_commands import (
    PAGES,
    ROOT,
    SHELL,
    all_commands,
    blocks_of,
    is_script,
    marks_of,
    name_of,
    parsed,
    texts_of,
    vigil_calls,
    wrong_with,
)

LANGUAGES = {"", "text", "python", "pycon", "json", "yaml", "toml", *SHELL}
CALLS = {" ".join(words): words for command in all_commands() for words in vigil_calls(command.text)}
BLOCKS = {f"{name_of(page)}:{block.line}": (page, block) for page in PAGES for block in blocks_of(page)}
OTHERS = {command.place: command for command in all_commands() if not vigil_calls(command.text)}
SAVED = {mark.text for _, block in BLOCKS.values() for mark in marks_of(block) if mark.kind == "saved as"}
RUN_HERE = ("vigil", "python")
"""Programs that the tests of the pages run; of others a mark says why they are not."""


def test_the_pages_show_commands() -> None:
    assert len(CALLS) > 40


@pytest.mark.parametrize("call", CALLS)
def test_a_call_of_vigil_is_understood(call: str) -> None:
    words = [word for word in CALLS[call] if word != "..."]
    if words != CALLS[call]:
        words += ["--out", "somewhere"]  # "..." stands for the options of the command above it
    verb, values = parsed(words)
    given = {word for word in words[len(verb) :] if not word.startswith("-")}
    assert given <= texts_of([*values.values()])


def test_a_program_of_the_project_has_what_a_command_gives_it() -> None:
    wrong = {one.place: wrong_with(one.words) for one in OTHERS.values() if one.words and not set(one.words) & SAVED}
    assert {place: said for place, said in wrong.items() if said} == {}


def test_what_the_tests_do_not_run_says_why() -> None:
    blocks = [block for _, block in BLOCKS.values() if is_script(block)]
    assert all(any(mark.kind == "run by" for mark in marks_of(block)) for block in blocks)
    scripts = {line for block in blocks for line in block.text.splitlines()}
    unmarked = [one for one in OTHERS.values() if one.is_run and one.text not in scripts]
    assert [one.place for one in unmarked if one.words and one.words[0] not in RUN_HERE] == []


@pytest.mark.parametrize("place", BLOCKS)
def test_a_block_says_its_language_and_is_written_in_it(place: str) -> None:
    _, block = BLOCKS[place]
    assert block.language in LANGUAGES, f"name one of {sorted(LANGUAGES)} after the ticks"
    match block.language:
        case "python":
            ast.parse(block.text)
        case "pycon":
            ast.parse("\n".join(line[4:] for line in block.text.splitlines() if line.startswith((">>>", "..."))))
        case "json":
            for line in _documents(block.text):
                json.loads(line)
        case "":
            calls = [line for line in block.text.splitlines() if line.startswith(("vigil ", "$ "))]
            assert not calls, "commands stand in a block of sh, or of console with what is answered"


def _documents(text: str) -> list[str]:
    """Return the JSON documents of a block: one, or one for each line."""
    lines = text.strip().splitlines()
    return lines if all(line.startswith("{") and line.endswith("}") for line in lines) else [text]


@pytest.mark.parametrize("place", [place for place, (_, block) in BLOCKS.items() if marks_of(block)])
def test_a_mark_is_of_use(place: str) -> None:
    page, block = BLOCKS[place]
    commands = [one.text for one in all_commands() if one.place.startswith(f"{name_of(page)}:")]
    for mark in marks_of(block):
        assert not mark.start or any(text.startswith(mark.start) for text in commands), mark
        if mark.kind == "run by":
            assert page.name in read(ROOT / mark.text), mark


def test_a_comment_that_looks_like_a_mark_is_one() -> None:
    kinds = ("parsed", "run by", "saved", "exits")
    odd = [
        (place, text)
        for place, (_, block) in BLOCKS.items()
        if len(marks_of(block)) < len([text for text in block.comments if text.startswith(kinds)])
        for text in block.comments
    ]
    assert odd == []
