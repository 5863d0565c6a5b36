"""Every link between files of the repository's pages leads to a file, and to a place in it that is there."""

from pathlib import Path

import pytest

from scripts.markdown_pages import anchor_of, anchors, blocks, links, read
from tests.support.doc_commands import ROOT, name_of

PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), *(ROOT / "src/vigil/data/packs").rglob("*.md")])


def wrong_links(page: Path) -> list[str]:
    """Return the broken links of a page, and what is wrong with each."""
    found = []
    for link in links(read(page)):
        target = (page.parent / link.path).resolve() if link.path else page
        if link.is_outside:
            continue
        if not target.exists():
            found.append(f"{link.target}: there is no such file")
        elif target.is_dir() and not target.is_relative_to(ROOT / "docs"):
            found.append(f"{link.target}: link to a file of the folder")
        elif link.anchor and target.suffix == ".md" and link.anchor not in anchors(read(target)):
            found.append(f"{link.target}: the page has {sorted(anchors(read(target)))}")
    return found


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_the_links_of_a_page_lead_somewhere(page: Path) -> None:
    assert wrong_links(page) == []


def test_the_pages_have_links() -> None:
    assert sum(len(list(links(read(page)))) for page in PAGES) > 150


def test_what_leads_nowhere_is_found(tmp_path: Path) -> None:
    (tmp_path / "other.md").write_text("# One `word`\n## Again\n## Again\n```\n# no heading\n```\n")
    good = (
        "[a](other.md) [b](other.md#one-word) ![c](other.md#again-1) `[d](none.md)` [e](https://x.y/z) <!-- [f](g) -->"
    )
    bad = '[a](none.md) [b](other.md#none) [c](#none) <img src="none.png"> [d](other.md#no-heading)'
    (tmp_path / "page.md").write_text(f"# Page\n{good}\n```sh\n[a](none.md)\n```\n{bad}\n")
    wrong = [text.partition(":")[0] for text in wrong_links(tmp_path / "page.md")]
    assert wrong == ["none.md", "other.md#none", "#none", "none.png", "other.md#no-heading"]


@pytest.mark.parametrize(
    ("title", "anchor"),
    [
        ("W on SV, `W_strict`", "w-on-sv-w_strict"),
        ("What's *this*?", "whats-this"),
        ("From A — to B", "from-a--to-b"),
        ("[Agents](agents.md) & co", "agents--co"),
    ],
)
def test_a_place_is_named_as_on_the_repositorys_host(title: str, anchor: str) -> None:
    assert anchor_of(title) == anchor


def test_a_block_knows_its_comments_and_its_line() -> None:
    page = "# P\n<!-- far -->\ntext\n\n<!-- one -->\n<!-- two\nlines -->\n```sh\nvigil\n```\n  ```\n  x\n  ```\n"
    first, second = blocks(page)
    assert (first.language, first.text, first.line) == ("sh", "vigil\n", 9)
    assert first.comments == ("one", "two\nlines")
    assert (second.text, second.comments) == ("x\n", ())
