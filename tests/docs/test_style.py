"""The documentation, docstrings, messages and help avoid the wordings that `style.toml` lists."""

import ast
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest

ROOT = Path(__file__).parents[2]
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])
SOURCES = sorted((ROOT / "src").rglob("*.py"))
TEXTS = sorted((ROOT / "src" / "vigil" / "analysis").rglob("*.toml"))
FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)
TEXT_OF_HELP = ("help", "short_help", "epilog")
FENCE = re.compile(r"^\s*(```|~~~)")
BEFORE_AFTER = "| before | after |"
"""The head of a table that shows rejected wordings."""
INLINE_CODE = re.compile(r"`+[^`]*`+|<!--.*?-->|\]\([^)]*\)")


KINDS = ("page", "docstring", "docstring of a function", "message")


class Rejected(NamedTuple):
    """A wording that is not used, with what to write instead."""

    pattern: str
    write: str
    before: str
    after: str
    only: tuple[str, ...] = KINDS

    def is_in(self, text: str) -> re.Match[str] | None:
        """Return where the text has the wording."""
        return re.search(self.pattern, text, re.IGNORECASE)


class Text(NamedTuple):
    """A piece of prose, one of the KINDS, and the line at which it begins."""

    path: Path
    line: int
    kind: str
    text: str


REJECTED = [
    Rejected(**{**one, "only": tuple(one.get("only", KINDS))})
    for one in tomllib.loads((Path(__file__).parent / "style.toml").read_text(encoding="utf-8"))["rejected"]
]


def prose_of_page(path: Path) -> Iterator[Text]:
    """Yield the lines of a page outside of its code and its tables of wordings before and after."""
    is_code = is_example = False
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        is_example = line == BEFORE_AFTER or (is_example and line.startswith("|"))
        if FENCE.match(line):
            is_code = not is_code
        elif not is_code and not is_example:
            yield Text(path, number, "page", INLINE_CODE.sub("x", line))


def prose_of_module(path: Path) -> Iterator[Text]:
    """Yield a module's docstrings, the texts of its exceptions and the help of its options."""
    nodes = list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
    functions = {id(node.body[0]) for node in nodes if isinstance(node, FUNCTIONS) and not _is_property(node)}
    for node in nodes:
        match node:
            case ast.Expr(value=ast.Constant(value=str(text))):
                kind = "docstring of a function" if id(node) in functions else "docstring"
                yield Text(path, node.lineno, kind, _without_code(text))
            case ast.Raise(exc=ast.Call(args=args)):
                yield from (Text(path, node.lineno, "message", text) for arg in args for text in _texts(arg))
            case ast.keyword(arg=name, value=value) if name in TEXT_OF_HELP:
                yield from (Text(path, value.lineno, "message", text) for text in _texts(value))
            case ast.Call(func=ast.Name(id="Setting"), args=[value, *_]):
                yield from (Text(path, value.lineno, "message", text) for text in _texts(value))


def prose_of_texts(path: Path) -> Iterator[Text]:
    """Yield the texts of a TOML file."""
    values: list[Any] = [tomllib.loads(path.read_text(encoding="utf-8"))]
    for value in values:
        if isinstance(value, str):
            yield Text(path, 1, "message", _without_code(value))
        elif isinstance(value, dict | list):
            values += value.values() if isinstance(value, dict) else value


def _is_property(node: ast.FunctionDef | ast.AsyncFunctionDef) -> bool:
    return any("property" in ast.unparse(decorator) for decorator in node.decorator_list)


def _texts(node: ast.expr) -> list[str]:
    """Return the texts within an expression; what an f-string fills in is "x"."""
    match node:
        case ast.Constant(value=str(text)):
            return [_without_code(text)]
        case ast.JoinedStr(values=parts):
            return ["".join(str(part.value) if isinstance(part, ast.Constant) else "x" for part in parts)]
        case ast.BinOp(left=left, right=right):
            return _texts(left) + _texts(right)
        case ast.IfExp(body=body, orelse=other):
            return _texts(body) + _texts(other)
    return []


def _without_code(text: str) -> str:
    return " ".join(INLINE_CODE.sub("x", text).split())


def hits(texts: list[Text]) -> list[str]:
    """Return a line for each rejected wording in the texts: where it is, and what to write."""
    return [
        f"{text.path.relative_to(ROOT)}:{text.line}: {found.group()!r} in {_around(text.text, found)!r}: "
        f"write {one.write} (pattern {one.pattern})"
        for text in texts
        for one in REJECTED
        if text.kind in one.only and (found := one.is_in(text.text))
    ]


def _around(text: str, found: re.Match[str]) -> str:
    return text[max(0, found.start() - 30) : found.end() + 30]


@pytest.mark.parametrize("one", REJECTED, ids=lambda one: one.before)
def test_a_pattern_finds_its_example_alone(one: Rejected) -> None:
    assert one.is_in(one.before)
    assert not one.is_in(one.after)


def test_the_pages_are_in_plain_words() -> None:
    found = hits([text for path in PAGES for text in prose_of_page(path)])
    assert not found, "\n".join(found)


def test_the_texts_of_reports_are_in_plain_words() -> None:
    texts = [text for path in TEXTS for text in prose_of_texts(path)]
    assert texts
    found = hits(texts)
    assert not found, "\n".join(found)


def test_docstrings_messages_and_help_are_in_plain_words() -> None:
    found = hits([text for path in SOURCES for text in prose_of_module(path)])
    assert not found, "\n".join(found)
