"""The glossary: the terms of reports, pages and documentation, each defined once, in `glossary.toml`.

Reports show the glossary at their foot; `vigil view` and exported sites show it as a page. `scripts/docs_tables.py`
writes it to `docs/glossary.md`. Nothing is computed here: the formulas are in `vigil.scoring.outcomes` and
`vigil.scoring.rates`.
"""

import re
import tomllib
from pathlib import Path
from typing import NamedTuple


class Term(NamedTuple):
    """A term of the glossary: a short definition, which can be part of a sentence, and sentences that explain more."""

    name: str
    short: str
    more: str = ""
    aliases: tuple[str, ...] = ()
    """Other spellings of the term in table headings, without units."""

    @property
    def anchor(self) -> str:
        """Part of the URL after `#` that links to the term."""
        return re.sub(r"[^a-z0-9_]+", "-", self.name.replace("Δ", "delta").lower()).strip("-")

    @property
    def text(self) -> str:
        """The whole definition, in sentences; back-ticks mark code."""
        return f"{self.short[0].upper()}{self.short[1:]}.{' ' if self.more else ''}{self.more}"


_ROWS = tomllib.loads(Path(__file__).with_name("glossary.toml").read_text(encoding="utf-8"))
SECTIONS: dict[str, tuple[Term, ...]] = {
    heading: tuple(
        Term(name, row["short"], row.get("more", ""), tuple(row.get("aliases", ()))) for name, row in rows.items()
    )
    for heading, rows in _ROWS.items()
}
"""Heading -> the terms under this heading."""
RESULTS = {heading: terms for heading, terms in SECTIONS.items() if heading != "Words of the project and its code"}
"""The sections for reports and pages."""
TERMS: dict[str, Term] = {term.name: term for terms in SECTIONS.values() for term in terms}
_UNITS = re.compile(r"( \[95\u00a0%\]| %| \(pp\)| \(steps\))+$")
_BY_HEADING = {name: term for terms in RESULTS.values() for term in terms for name in (term.name, *term.aliases)}


def term_of(heading: str) -> Term | None:
    """Return the term whose name or alias is a column heading, ignoring units; None if there is no such term."""
    return _BY_HEADING.get(_UNITS.sub("", heading))
