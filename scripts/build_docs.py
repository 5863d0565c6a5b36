"""Builds the documentation site into site/: `make docs`.

The pages are those of docs/, with what the source says (`scripts.docs_reference`). A link that leads out of docs/ works
on the repository's host as it is; in the site it leads to a copy of the file, so that the site is whole without a
network and says what was so in its version. With `--publish FOLDER` the site is put into FOLDER/VERSION, beside those
of other versions, and each has a menu of all.
"""

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote

from scripts.docs_reference import reference_pages
from scripts.markdown_pages import links, read, without_code
from vigil import __version__

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = ROOT / "build/docs"
SITE = ROOT / "site"
COPIES = "files"
"""Folder of the site for files out of docs/ that pages link to."""
IMAGE_SUFFIXES = (".jpg", ".jpeg", ".png", ".gif", ".webp", ".svg")
LANGUAGES = {".py": "python", ".toml": "toml", ".json": "json", ".cff": "yaml", ".yml": "yaml", ".sh": "sh"}
_LOADED = {"script": "src", "img": "src", "iframe": "src", "source": "src", "video": "src", "link": "href"}
"""What a browser loads with a page, by the element; of links only style sheets, icons and what is fetched early."""
_PICTURE = re.compile(r"(?<!\[)!\[[^\]]*\]\(([^()\s]+)\)")
"""A picture in Markdown that is not a link yet."""
_IN_STYLE = re.compile(r"""(?:url\(|@import)\s*["']?((?:https?:)?//[^"')\s]+)""")


def write_pages(folder: Path = PAGES) -> None:
    """Write the site's pages in Markdown, and what belongs to them, into a new folder."""
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(DOCS, folder)
    wanted: dict[Path, Path] = {}
    for path in sorted(folder.rglob("*.md")):
        path.write_text(_mapped(read(path), DOCS / path.relative_to(folder), path, folder, wanted), encoding="utf-8")
    written: set[Path] = set()
    while left := sorted(set(wanted) - written):
        for source in left:
            written.add(source)
            _copy(source, wanted[source], folder, wanted)
    for name, text in reference_pages():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text + "\n", encoding="utf-8")


def _mapped(text: str, source: Path, page: Path, folder: Path, wanted: dict[Path, Path]) -> str:
    """Return the text of a page for the site; what it needs from outside of docs/ is put into `wanted`."""
    parts, end = [], 0
    for link in links(text):
        if link.is_outside or not link.path:
            continue
        target = Path(os.path.normpath(source.parent / link.path))
        if target.is_dir():
            target /= "index.md"
        if target.is_relative_to(DOCS):
            there = folder / target.relative_to(DOCS)
        else:
            there = wanted[target] = folder / COPIES / _name_of_copy(target)
        anchor = f"#{link.anchor}" if link.anchor else ""
        parts += [text[end : link.start], os.path.relpath(there, page.parent).replace(os.sep, "/"), anchor]
        end = link.start + len(link.target)
    return _opened_by_click("".join([*parts, text[end:]]))


def _opened_by_click(text: str) -> str:
    """Return the text of a page with each picture as a link to itself: pages show it smaller than it is."""
    parts, end = [], 0
    for picture in _PICTURE.finditer(without_code(text)):
        parts += [text[end : picture.start()], f"[{picture[0]}]({picture[1]})"]
        end = picture.end()
    return "".join([*parts, text[end:]])


def _name_of_copy(target: Path) -> Path:
    name = target.relative_to(ROOT)
    return name if name.suffix in (".md", *IMAGE_SUFFIXES) else name.with_name(f"{name.name}.md")


def _copy(source: Path, page: Path, folder: Path, wanted: dict[Path, Path]) -> None:
    page.parent.mkdir(parents=True, exist_ok=True)
    if source.suffix in IMAGE_SUFFIXES:
        shutil.copy(source, page)
    elif source.suffix == ".md":
        page.write_text(_mapped(read(source), source, page, folder, wanted), encoding="utf-8")
    else:
        code = f"````{LANGUAGES.get(source.suffix, 'text')}\n{read(source)}````"
        page.write_text(f"# {source.relative_to(ROOT).as_posix()}\n\n{code}\n", encoding="utf-8")


def build(*, has_versions: bool) -> None:
    """Have Zensical build the pages; a warning is an error. `has_versions`: with the menu of versions."""
    zensical = Path(sys.executable).with_name("zensical")
    config = ROOT / ".zensical.toml"
    menu = '[project.extra.version]\nprovider = "mike"\n' if has_versions else ""
    config.write_text(f"{read(ROOT / 'zensical.toml')}\n{menu}", encoding="utf-8")
    try:
        subprocess.run([zensical, "build", "--strict", "--clean", "--config-file", config], cwd=ROOT, check=True)
    finally:
        config.unlink()


def rank_pages_first(site: Path = SITE) -> None:
    """Name what is Python by its full name in the index of the search.

    The search ranks a title that is the word itself first: `Report`, an attribute, stood before the page on reports.
    """
    index = json.loads(read(site / "search.json"))
    for item in index["items"]:
        _, _, anchor = item["location"].partition("#")
        if anchor.startswith("vigil."):
            item["title"] = f"<code>{anchor}</code>"
    text = json.dumps(index, ensure_ascii=False)
    (site / "search.json").write_text(text, encoding="utf-8")
    (site / "search.js").write_text(f"var __index = {text}", encoding="utf-8")


class _Page(HTMLParser):
    """What an HTML page loads, where its links lead, and the places on it."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.loaded: set[str] = set()
        self.links: set[str] = set()
        self.places: set[str] = {""}
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Take up one element."""
        values = {name: value or "" for name, value in attrs}
        self.places |= {values.get("id", ""), values.get("name", "") if tag == "a" else ""}
        if tag == "a" and "href" in values:
            self.links.add(values["href"])
        elif _LOADED.get(tag) in values and values.get("rel") not in ("canonical", "next", "prev", "edit"):
            self.loaded.add(values[_LOADED[tag]])


def faults(site: Path = SITE) -> list[str]:
    """Return what is wrong with a built site: what it loads from elsewhere, and links that lead nowhere."""
    pages = {path: _Page(read(path)) for path in sorted(site.rglob("*.html"))}
    found = [] if pages else ["there is no page"]
    for path, page in pages.items():
        name = path.relative_to(site).as_posix()
        found += [f"{name} loads {url}" for url in sorted(page.loaded) if re.match(r"(https?:)?//", url)]
        if name != "404.html":  # its addresses begin at the root of a host
            found += [f"{name} links to {url}" for url in sorted(page.links) if not _resolves(url, path, pages)]
    for path in sorted(site.rglob("*.css")):
        found += [f"{path.relative_to(site)} loads {url}" for url in _IN_STYLE.findall(read(path))]
    return found


def _resolves(url: str, path: Path, pages: dict[Path, _Page]) -> bool:
    if re.match(r"[a-z][a-z0-9+.-]*:|//", url):
        return True
    name, _, place = unquote(url).partition("#")
    target = Path(os.path.normpath(path.parent / name)) if name else path
    if target.is_dir():
        target /= "index.html"
    return place in pages[target].places if target in pages else target.is_file()


def publish_version(folder: Path, version: str = __version__) -> None:
    """Put the built site beside those of other versions; the root of `folder` leads to the newest."""
    shutil.rmtree(folder / version, ignore_errors=True)
    shutil.copytree(SITE, folder / version)
    versions = sorted((path.parent.name for path in folder.glob("*/index.html")), key=_order, reverse=True)
    listed = [
        {"version": name, "title": name, "aliases": ["latest"] if name == versions[0] else []} for name in versions
    ]
    (folder / "versions.json").write_text(json.dumps(listed, indent=1) + "\n", encoding="utf-8")
    leads = (
        f'<!doctype html><meta charset="utf-8"><meta http-equiv="refresh" content="0; url={versions[0]}/index.html">'
    )
    (folder / "index.html").write_text(
        f'{leads}<a href="{versions[0]}/index.html">VIGIL {versions[0]}</a>\n', encoding="utf-8"
    )


def _order(version: str) -> tuple[int, ...]:
    return tuple(map(int, re.findall(r"\d+", version)))


def main() -> None:
    """Build the site, and exit with 1 when it has a fault."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--publish", type=Path, metavar="FOLDER", help="put the site into FOLDER/VERSION as well")
    arguments = parser.parse_args()
    write_pages()
    build(has_versions=arguments.publish is not None)
    rank_pages_first()
    found = faults()
    for fault in found:
        print(fault, file=sys.stderr)
    if found:
        sys.exit(f"{len(found)} faults in {SITE.relative_to(ROOT)}/: mend the pages that it names.")
    if arguments.publish:
        publish_version(arguments.publish)


if __name__ == "__main__":
    main()
