"""Draw docstrings, messages, help lines and paragraphs at random, for a reader who judges whether they are clear.

    python -m tools.text_sample 83 --out words.jsonl

Each row shows a text as a reader meets it: a docstring with its file and signature, a help line with its command, a
paragraph with its page and heading. The reader adds `is_clear`, and `why` if it is False.
"""

import ast
import json
import random
import re
from collections.abc import Callable, Iterator, Mapping
from itertools import pairwise
from pathlib import Path
from typing import Annotated

import typer

from vigil.cli.verbs import VERBS, Group, Verb, load

ROOT = Path(__file__).parents[1]
NUMBERS = {"docstring": 60, "message": 25, "help": 15, "paragraph": 30}
MIN_PARAGRAPH_CHARS = 80
"""Minimum length of a paragraph; shorter ones are headings of lists."""
_NOT_PROSE = ("|", "<", "!", "- [", "#")
Text = dict[str, str]


def docstrings() -> Iterator[Text]:
    """Yield the docstrings of the package, attributes included."""
    for path in sorted((ROOT / "src").rglob("*.py")):
        source = path.read_text()
        where = str(path.relative_to(ROOT / "src"))
        tree = ast.parse(source)
        if text := ast.get_docstring(tree):
            yield {"where": f"module {where}", "text": text}
        yield from _inside(tree, source.splitlines(), where)


def _inside(parent: ast.Module | ast.ClassDef, lines: list[str], where: str) -> Iterator[Text]:
    for node, after in pairwise([*parent.body, ast.Pass()]):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            if text := ast.get_docstring(node):
                yield {
                    "where": where,
                    "code": "\n".join(lines[node.lineno - 1 : node.body[0].lineno - 1]),
                    "text": text,
                }
            if isinstance(node, ast.ClassDef):
                yield from _inside(node, lines, f"{where}, class {node.name}")
        elif isinstance(node, ast.Assign | ast.AnnAssign) and (text := _string(after)):
            yield {"where": where, "code": "\n".join(lines[node.lineno - 1 : node.end_lineno]), "text": text}


def _string(node: ast.stmt) -> str | None:
    """Return the text of a statement that is only a string."""
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
        return node.value.value
    return None


def messages() -> Iterator[Text]:
    """Yield the messages of errors that are written where they are raised."""
    for path in sorted((ROOT / "src").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            arguments = node.exc.args if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call) else []
            if arguments and isinstance(arguments[-1], ast.JoinedStr | ast.Constant):
                yield {"where": str(path.relative_to(ROOT / "src")), "text": ", ".join(map(ast.unparse, arguments))}


def helps(verbs: Mapping[str, Verb | Group] = VERBS, called: str = "vigil") -> Iterator[Text]:
    """Yield the help of every command and option of the command line."""
    for name, verb in verbs.items():
        yield {"where": f"{called} {name}", "text": verb.help}
        if isinstance(verb, Group):
            yield from helps(verb.verbs, f"{called} {name}")
        else:
            for option in load(verb).params:
                yield {"where": f"{called} {name} {option.opts[0]}", "text": option.help}


def paragraphs() -> Iterator[Text]:
    """Yield the paragraphs of the pages, without decisions, tables and code."""
    for path in sorted([*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md")]):
        heading = ""
        for block in re.split(r"\n\s*\n", re.sub(r"^```.*?^```", "", path.read_text(), flags=re.S | re.M)):
            first, _, rest = block.partition("\n")
            if first.startswith("#"):
                heading, block = first, rest
            if len(block) >= MIN_PARAGRAPH_CHARS and not block.startswith(_NOT_PROSE):
                yield {"where": f"{path.name}: {heading}", "text": block}


KINDS: dict[str, Callable[[], Iterator[Text]]] = {
    "docstring": docstrings,
    "message": messages,
    "help": helps,
    "paragraph": paragraphs,
}


def main(seed: int, out: Annotated[Path, typer.Option(help="File for the sample, JSON Lines.")]) -> None:
    """Draw 130 texts with a seed."""
    rng = random.Random(seed)
    with out.open("w") as file:
        for kind, found in KINDS.items():
            for text in rng.sample(list(found()), NUMBERS[kind]):
                file.write(json.dumps({"kind": kind, **text}, ensure_ascii=False) + "\n")


if __name__ == "__main__":
    typer.run(main)
