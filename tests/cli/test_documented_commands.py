"""Every command that README.md and the docs show is one that `vigil` takes."""

import re
import shlex
from pathlib import Path
from typing import Any

import pytest
from typer.main import get_command

from vigil.cli import app

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
FENCED = re.compile(r"^```[a-z]*\n(.*?)^```", re.DOTALL | re.MULTILINE)
VARIABLE = re.compile(r"\$\w+")
"""Of the shell: any value will do, and no further arguments."""
COMMAND = re.compile(r"(?:[A-Z_]+=\S+ )*vigil (.*)$")


def commands() -> dict[str, list[str]]:
    """Returns the lines of code blocks that call `vigil`, and the words of each."""
    blocks = [block for page in PAGES for block in FENCED.findall(page.read_text(encoding="utf-8"))]
    lines = [line.strip() for block in blocks for line in block.replace("\\\n", " ").splitlines()]
    found = [match[1] for line in lines if (match := COMMAND.match(line.removeprefix("$ ")))]
    return {
        " ".join(words): words
        for line in found
        if (words := shlex.split(VARIABLE.sub("1", line.replace('"$@"', "")), comments=True))
    }


def parsed(words: list[str]) -> tuple[list[str], dict[str, Any]]:
    """Returns the verb, and what its options and arguments are read as; nothing is run."""
    command: Any = get_command(app)
    context = command.make_context("vigil", list(words))
    verb = []
    while hasattr(command, "resolve_command"):
        name, command, rest = command.resolve_command(context, [*context._protected_args, *context.args])
        verb.append(name)
        context = command.make_context(name, list(rest), parent=context)
    return verb, context.params


def texts_of(value: Any) -> set[str]:
    """Returns the texts from which a value may have been read."""
    if isinstance(value, list | tuple):
        return set().union(*map(texts_of, value))
    return {str(value), f"{value:g}"} if isinstance(value, int | float) else {str(value)}


def test_the_pages_show_commands() -> None:
    assert len(commands()) > 40


@pytest.mark.parametrize("command", commands())
def test_a_command_of_the_pages_is_understood(command: str) -> None:
    words = [word for word in commands()[command] if word != "..."]
    if words != commands()[command]:
        words += ["--out", "somewhere"]  # "..." stands for the options of the command above it
    verb, values = parsed(words)
    given = {word for word in words[len(verb) :] if not word.startswith("-")}
    assert given <= texts_of([*values.values()])
