"""Code blocks of README.md and the docs: commands, programs and files, with marks that say how they are tested.

A mark is an HTML comment directly above a block of code; docs/writing.md describes them.
"""

import re
import shlex
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from typer.main import get_command

from scripts.markdown_pages import Block, blocks, read
from vigil.cli import app

ROOT = Path(__file__).parents[2]
PAGES = [
    ROOT / "README.md",
    *(path for path in sorted((ROOT / "docs").rglob("*.md")) if path.parent.name != "decisions"),
]
SHELL = ("sh", "bash", "console")
_MARK = re.compile(
    r"(?P<kind>parsed only|run by|saved as|exits with \d)(?:, (?P<start>[^:]+))?: (?P<text>.+)", re.DOTALL
)
_VARIABLE = re.compile(r"\$\{?\w+\}?")
_SETTING = re.compile(r"[A-Z_]+=")


@dataclass(frozen=True)
class Mark:
    """Mark that says how a block, or its commands that begin with `start`, are tested."""

    kind: str
    start: str
    text: str
    """The reason; for "run by" the test's file; for "saved as" the file's name."""


@dataclass(frozen=True)
class Command:
    """A shell command on a page."""

    place: str
    text: str
    marks: tuple[Mark, ...]

    @property
    def words(self) -> list[str]:
        """The words of the command without comments; every variable is replaced by 1."""
        return shlex.split(_without_variables(self.text), comments=True)

    def mark(self, kind: str) -> Mark | None:
        """Return the command's mark of a kind, if it has one."""
        return next((mark for mark in self.marks if mark.kind.startswith(kind)), None)

    @property
    def is_run(self) -> bool:
        """Whether the tests of the pages run the command."""
        return self.mark("parsed only") is None and self.mark("run by") is None


def name_of(page: Path) -> str:
    """Return a page's path in the repository."""
    return page.relative_to(ROOT).as_posix()


@cache
def blocks_of(page: Path) -> tuple[Block, ...]:
    """Return the code blocks of a page."""
    return tuple(blocks(read(page)))


def marks_of(block: Block) -> list[Mark]:
    """Return the marks above a block, ignoring other comments."""
    found = [_MARK.fullmatch(" ".join(text.split())) for text in block.comments]
    return [Mark(one["kind"], one["start"] or "", one["text"]) for one in found if one]


def is_script(block: Block) -> bool:
    """Whether a block is a complete shell script rather than commands to type."""
    return block.language in SHELL and block.text.startswith("#!")


def commands_of(page: Path, block: Block) -> Iterator[Command]:
    """Yield the commands of a shell block; in a console block, the text after each prompt but not the output."""
    marks = marks_of(block)
    start, lines = block.line, []
    for number, line in enumerate(block.text.splitlines(), block.line):
        start = start if lines else number
        lines.append(line.removesuffix("\\"))
        if line.endswith("\\"):
            continue
        text, lines = " ".join(map(str.strip, lines)), []
        if block.language == "console":
            if not text.startswith("$ "):
                continue
            text = text[2:]
        if text and not text.startswith("#"):
            mine = tuple(mark for mark in marks if text.startswith(mark.start))
            yield Command(f"{name_of(page)}:{start}", text, mine)


def all_commands() -> Iterator[Command]:
    """Yield every command of every page, including the lines of scripts."""
    for page in PAGES:
        for block in blocks_of(page):
            if block.language in SHELL:
                yield from commands_of(page, block)


def vigil_calls(text: str) -> list[list[str]]:
    """Return the words after `vigil` for every call of it in a shell command."""
    found = []
    for part in re.split(r"\s(?:&&|\|\|?|;)\s", _without_variables(text)):
        words = shlex.split(part, comments=True)
        while words and _SETTING.match(words[0]):
            words.pop(0)
        if words and words[0].rpartition("/")[2] == "vigil":
            found.append(words[1:])
    return found


def _without_variables(text: str) -> str:
    return _VARIABLE.sub("1", text.replace('"$@"', ""))


def parsed(words: list[str]) -> tuple[list[str], dict[str, Any]]:
    """Return the subcommand of a call and the parsed values of its options and arguments, without running it."""
    command: Any = get_command(app)
    context = command.make_context("vigil", list(words))
    verb = []
    while hasattr(command, "resolve_command"):
        name, command, rest = command.resolve_command(context, [*context._protected_args, *context.args])
        verb.append(name)
        context = command.make_context(name, list(rest), parent=context)
    return verb, context.params


def texts_of(value: Any) -> set[str]:
    """Return the texts that may have been parsed to a value."""
    if isinstance(value, list | tuple):
        return set().union(*map(texts_of, value))
    return {str(value), f"{value:g}"} if isinstance(value, int | float) else {str(value)}


def wrong_with(words: list[str]) -> str:
    """Return the faults of a command of another program of the project; empty if it has none."""
    program, *rest = words
    if program == "make":
        makefile = read(ROOT / "Makefile")
        names = [word.partition("=")[0] for word in rest]
        known = {name: re.search(rf"^{re.escape(name)}(:| \?=)", makefile, re.MULTILINE) for name in names}
        return f"the Makefile has no {[name for name in names if not known[name]]}" if not all(known.values()) else ""
    if program == "pip":
        extras = tomllib.loads(read(ROOT / "pyproject.toml"))["project"]["optional-dependencies"]
        asked = [extra for word in rest for extra in re.findall(r"\w+", word.partition("[")[2])]
        return f"no extra {set(asked) - set(extras)}" if set(asked) - set(extras) else ""
    if program.rpartition("/")[2] == "python" and rest:
        return _wrong_with_python(rest)
    return ""


def _wrong_with_python(words: list[str]) -> str:
    """Return the faults of a call of one of the project's Python programs."""
    path = ROOT / (f"{words[1].replace('.', '/')}.py" if words[0] == "-m" else words[0])
    if not path.is_file():
        return f"there is no {path.relative_to(ROOT)}"
    package = path.parent.glob("*.py") if words[0] == "-m" else [path]
    source = "".join(map(read, package))
    asked = [word for word in words if word.startswith("--")]
    known = {word for word in asked if re.search(rf"\b{word[2:].replace('-', '[-_]')}\b", source)}
    return " ".join(f"{word} is no option" for word in asked if word not in known)
