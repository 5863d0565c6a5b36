"""The messages that the FAQ quotes are those that the source prints today."""

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

import vigil

FAQ = Path(__file__).parents[1] / "docs" / "faq.md"
LEAST_FIXED = 18
"""Letters that a message must have in common with the source: fewer say nothing."""
MESSAGES = re.findall(r"^```text\n(.*?)\n```", FAQ.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)


def texts(tree: ast.AST) -> Iterator[tuple[str, int]]:
    """Yield the texts of a module as patterns in which a value may be any text, with their number of fixed letters."""
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            fixed = [part.value if isinstance(part, ast.Constant) else None for part in node.values]
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            fixed = [node.value]
        else:
            continue
        pattern = "".join(".*?" if part is None else re.escape(str(part)) for part in fixed)
        yield pattern, sum(len(str(part)) for part in fixed if part is not None)


@cache
def patterns() -> list[re.Pattern[str]]:
    modules = Path(vigil.__file__).parent.rglob("*.py")
    found = [text for module in modules for text in texts(ast.parse(module.read_text(encoding="utf-8")))]
    return [re.compile(pattern, re.DOTALL) for pattern, fixed in found if fixed >= LEAST_FIXED]


def test_the_page_quotes_messages() -> None:
    assert len(MESSAGES) > 20


@pytest.mark.parametrize("message", MESSAGES)
def test_a_message_is_printed_by_the_source(message: str) -> None:
    assert any(pattern.fullmatch(message) for pattern in patterns())


def test_no_other_message_passes() -> None:
    assert not any(pattern.fullmatch("Port 8377 is taken. Give another, e.g. --port 8387.") for pattern in patterns())
