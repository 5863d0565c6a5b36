"""Tables of the docs that stand in the source too are as the source has them."""

import re
from pathlib import Path

import pytest

from scripts.docs_tables import DOCS, PAGES, TABLES, with_tables


@pytest.mark.parametrize("name", PAGES)
def test_a_page_has_the_tables_of_the_source(name: str) -> None:
    page = (DOCS / name).read_text(encoding="utf-8")
    assert page == with_tables(page), "give: python scripts/docs_tables.py"


def test_every_table_stands_in_a_page() -> None:
    pages = "".join((DOCS / name).read_text(encoding="utf-8") for name in PAGES)
    assert sorted(re.findall(r"<!-- table: (\w+) -->", pages)) == sorted(TABLES)


def test_no_other_page_has_one() -> None:
    others = [path for path in Path(DOCS).rglob("*.md") if path.name not in PAGES]
    assert not [path for path in others if "<!-- table:" in path.read_text(encoding="utf-8")]
