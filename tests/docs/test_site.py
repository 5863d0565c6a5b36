"""What the documentation site is made of: its menu, the pages that the source says, and the check of what was built."""

import json
import pkgutil
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

from scripts import build_docs
from scripts.docs_reference import EXTENDED, command_line, decisions, public_names, reference_pages
from scripts.markdown_pages import read
from tests.support.doc_commands import ROOT
from vigil import api
from vigil.cli.verbs import VERBS, Group, Verb

MENU = tomllib.loads(read(ROOT / "zensical.toml"))["project"]["nav"]


def listed(menu: object) -> Iterator[str]:
    """Yield the pages of a menu."""
    if isinstance(menu, str):
        yield menu
    else:
        for each in menu.values() if isinstance(menu, dict) else menu:  # type: ignore[attr-defined]
            yield from listed(each)


def test_every_page_is_in_the_menu_once() -> None:
    pages = {path.name for path in (ROOT / "docs").glob("*.md")} | {path for path, _ in reference_pages()}
    assert sorted(listed(MENU)) == sorted(pages)


def test_the_python_pages_name_modules_that_are_there() -> None:
    modules = [module for _, modules in EXTENDED.values() for module in modules]
    assert len(modules) == len(set(modules))
    places = {module: ROOT / "src/vigil" / module.replace(".", "/") for module in modules}
    assert [name for name, place in places.items() if not (place.is_dir() or place.with_suffix(".py").is_file())] == []


def test_what_decides_is_where_the_architecture_page_says() -> None:
    page = read(ROOT / "docs/architecture.md")
    table = page[page.index("## Where it is decided") : page.index("## Tests")]
    names = re.findall(r"`(vigil\.[\w.]+)`", table)
    assert len(names) > 20
    for name in names:
        assert pkgutil.resolve_name(name) is not None


def test_the_page_of_import_vigil_has_every_name() -> None:
    page = public_names()
    for name in api.__all__:
        assert f"heading: vigil.{name}\n" in page


def test_the_command_line_page_has_every_verb_and_option() -> None:
    page = command_line()
    verbs = [name for name, verb in VERBS.items() if isinstance(verb, Verb)]
    verbs_of = {name: each.verbs for name, each in VERBS.items() if isinstance(each, Group)}
    groups = [
        f"{group} {name}"
        for group in ("houses", "pack")
        for name, each in verbs_of[group].items()
        if not each.is_hidden
    ]
    for name in (*verbs, *groups):
        assert f"\n## vigil {name}\n" in page
    assert (
        "| `--dry-run` | Do not play; print how many calls and tokens the run could need at least and at most. |"
        in page
    )
    assert "```sh\nvigil score runs/solver runs/premature\n```" in page


def test_every_decision_is_listed() -> None:
    found = [line for line in decisions().splitlines() if line.startswith("- ")]
    assert len(found) == len(list((ROOT / "docs/decisions").glob("*.md")))
    assert found[0] == "- [1. The embedded simulator is engine-neutral](0001-engine-neutral-simulator.md)"


@pytest.fixture
def tree(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A small repository: pages that link out of docs/, to a program and to a page that links back."""
    (tmp_path / "docs/more").mkdir(parents=True)
    (tmp_path / "docs/page.md").write_text("[a](../run.py) [b](../README.md#top) [c](more/) [d](more/x.md#y) `[e](f)`")
    (tmp_path / "docs/more/x.md").write_text("[up](../page.md) ![p](../../p.png)")
    (tmp_path / "README.md").write_text("[page](docs/page.md) [run](run.py)")
    (tmp_path / "run.py").write_text("print('```')\n")
    (tmp_path / "p.png").write_bytes(b"p")
    monkeypatch.setattr(build_docs, "ROOT", tmp_path)
    monkeypatch.setattr(build_docs, "DOCS", tmp_path / "docs")
    monkeypatch.setattr(build_docs, "reference_pages", lambda: [("more/index.md", "# More")])
    return tmp_path


def test_links_out_of_the_docs_lead_to_copies(tree: Path) -> None:
    out = tree / "out"
    build_docs.write_pages(out)
    assert read(out / "page.md") == (
        "[a](files/run.py.md) [b](files/README.md#top) [c](more/index.md) [d](more/x.md#y) `[e](f)`"
    )
    assert read(out / "more/x.md") == "[up](../page.md) [![p](../files/p.png)](../files/p.png)"
    assert read(out / "files/README.md") == "[page](../page.md) [run](run.py.md)"
    assert "````python\nprint('```')\n````" in read(out / "files/run.py.md")
    assert (out / "files/p.png").read_bytes() == b"p"
    assert read(out / "more/index.md") == "# More\n"


def test_what_is_wrong_with_a_built_site_is_named(tmp_path: Path) -> None:
    assert build_docs.faults(tmp_path) == ["there is no page"]
    (tmp_path / "a.html").write_text(
        '<link rel="canonical" href="https://x.y/a"><link rel="stylesheet" href="https://x.y/a.css">'
        '<script src="//x.y/a.js"></script><img src="b.png"><p id="p"></p>'
        '<a href="#p">1</a><a href="#q">2</a><a href="b.html">3</a><a href="https://x.y">4</a><a href="sub/">5</a>'
    )
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub/index.html").write_text('<a href="../a.html#p">1</a><a href="../a.html#r">2</a>')
    (tmp_path / "a.css").write_text("@import 'https://x.y/f.css'; a { b: url(c.svg) } d { e: url(//x.y/g.woff) }")
    assert build_docs.faults(tmp_path) == [
        "a.html loads //x.y/a.js",
        "a.html loads https://x.y/a.css",
        "a.html links to #q",
        "a.html links to b.html",
        "sub/index.html links to ../a.html#r",
        "a.css loads https://x.y/f.css",
        "a.css loads //x.y/g.woff",
    ]


def test_versions_stand_beside_each_other(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "site").mkdir()
    (tmp_path / "site/index.html").write_text("new")
    monkeypatch.setattr(build_docs, "SITE", tmp_path / "site")
    for version in ("0.9.0", "0.10.0", "0.2.0"):
        build_docs.publish_version(tmp_path / "pages", version)
    listed = json.loads(read(tmp_path / "pages/versions.json"))
    assert [one["version"] for one in listed] == ["0.10.0", "0.9.0", "0.2.0"]
    assert [one["aliases"] for one in listed] == [["latest"], [], []]
    assert "url=0.10.0/index.html" in read(tmp_path / "pages/index.html")
    assert read(tmp_path / "pages/0.9.0/index.html") == "new"


def test_the_search_knows_what_is_python_by_its_full_name(tmp_path: Path) -> None:
    items = [
        {"location": "howto_report.html", "title": "Read a report"},
        {"location": "reference/agents.html#vigil.protocol.actions.Report", "title": "Report"},
        {"location": "reference/command_line.html#vigil-report", "title": "vigil report"},
    ]
    (tmp_path / "search.json").write_text(json.dumps({"config": {}, "items": items}), encoding="utf-8")
    build_docs.rank_pages_first(tmp_path)
    index = (tmp_path / "search.json").read_text(encoding="utf-8")
    titles = [item["title"] for item in json.loads(index)["items"]]
    assert titles == ["Read a report", "<code>vigil.protocol.actions.Report</code>", "vigil report"]
    assert (tmp_path / "search.js").read_text(encoding="utf-8") == f"var __index = {index}"
