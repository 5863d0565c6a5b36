"""Code blocks, links and headings of pages in Markdown: what the site and the tests of the docs read."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from textwrap import dedent

_FENCE = re.compile(
    r"^(?P<indent> *)(?P<ticks>`{3,})(?P<language>[\w-]*)[^\n]*\n(?P<text>.*?)^(?P=indent)(?P=ticks) *$",
    re.DOTALL | re.MULTILINE,
)
_SPAN = re.compile(r"(?<!`)(`+)(?!`)(?:(?!\n\n).)+?(?<!`)\1(?!`)", re.DOTALL)
_COMMENT = re.compile(r"<!--(.*?)-->", re.DOTALL)
_COMMENTS_ABOVE = re.compile(r"(?:<!--(?:(?!-->).)*-->\s*)+\Z", re.DOTALL)
_LINK = re.compile(r"""(?<=\]\()[^()\s]+(?=\)|\s+"[^"]*"\))|(?<=\bsrc=")[^"]+(?=")|(?<=\bhref=")[^"]+(?=")""")
_HEADING = re.compile(r"^#{1,6} +(.+?) *#*$", re.MULTILINE)
_ANCHOR = re.compile(r"""<a (?:id|name)="([^"]+)">""")
_LINKED_WORDS = re.compile(r"!?\[([^\]]*)\]\([^)]*\)")
_OUTSIDE = re.compile(r"[a-z][a-z0-9+.-]*:|//", re.IGNORECASE)


@dataclass(frozen=True)
class Block:
    """A fenced block of code."""

    language: str
    text: str
    line: int
    """Line of the page on which the code begins."""
    comments: tuple[str, ...]
    """The texts of the HTML comments that stand directly above it."""


@dataclass(frozen=True)
class Link:
    """Where a link or picture of a page leads."""

    target: str
    start: int
    """Where the target begins in the page's text."""

    @property
    def is_outside(self) -> bool:
        """Whether it leads to another site."""
        return _OUTSIDE.match(self.target) is not None

    @property
    def path(self) -> str:
        """The file, relative to the page; empty for a place on the same page."""
        return self.target.partition("#")[0]

    @property
    def anchor(self) -> str:
        """The place on the page; empty for its top."""
        return self.target.partition("#")[2]


def blocks(page: str) -> Iterator[Block]:
    """Yield the code blocks of a page's text."""
    for found in _FENCE.finditer(page):
        above = _COMMENTS_ABOVE.search(page, 0, found.start())
        comments = _COMMENT.findall(above[0]) if above else []
        line = page.count("\n", 0, found.start("text")) + 1
        yield Block(found["language"], dedent(found["text"]), line, tuple(text.strip() for text in comments))


def links(page: str) -> Iterator[Link]:
    """Yield the links and pictures of a page's text; those in code are none."""
    for found in _LINK.finditer(without_code(page)):
        yield Link(found[0], found.start())


def anchors(page: str) -> set[str]:
    """Return the names of the places that a link to the page may end with, formed as GitHub does."""
    found = set(_ANCHOR.findall(without_code(page)))
    without_blocks = _FENCE.sub("", page)
    for title in _HEADING.findall(without_blocks):
        slug = base = anchor_of(title)
        number = 0
        while slug in found:
            number += 1
            slug = f"{base}-{number}"
        found.add(slug)
    return found


def anchor_of(title: str) -> str:
    """Return the name of a heading in links."""
    words = _LINKED_WORDS.sub(r"\1", title).lower().strip()
    return re.sub(r"[^\w\- ]", "", words.replace("`", "").replace("*", "")).replace(" ", "-")


def title_of(page: str) -> str:
    """Return the first heading of a page's text."""
    found = _HEADING.search(_FENCE.sub("", page))
    return found[1] if found else ""


def without_code(page: str) -> str:
    """Return a page's text with spaces for its code and comments; every other character stays in its place."""
    for pattern in (_FENCE, _SPAN, _COMMENT):
        page = pattern.sub(lambda found: re.sub(r"[^\n]", " ", found[0]), page)
    return page


def read(path: Path) -> str:
    """Return the text of a page."""
    return path.read_text(encoding="utf-8")
