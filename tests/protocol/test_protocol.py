"""The normative text, docs/protocol.md: every section that the code cites is there."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
HEADING = re.compile(r"^#{2,3} (?P<number>\d+(?:\.\d+)?)\.? (?P<title>.+)$", re.MULTILINE)
CITATION = re.compile(r"protocol\.md`? sections? (?P<numbers>\d[\d., and to]*)")
SOURCES = sorted(
    path for folder in ("src", "tests", "benchmarks", "scripts", "sweeps") for path in (ROOT / folder).rglob("*.py")
)


def citations() -> list[tuple[str, str]]:
    """Return (file, numbers) for every citation in the sources, without line breaks and comment marks."""
    found: list[tuple[str, str]] = []
    for path in SOURCES:
        text = re.sub(r"\s*\n\s*#?\s*", " ", path.read_text(encoding="utf-8"))
        name = str(path.relative_to(ROOT))
        found += [(name, match["numbers"]) for match in CITATION.finditer(text)]
    return found


@pytest.fixture(scope="module")
def sections() -> dict[str, str]:
    text = (ROOT / "docs" / "protocol.md").read_text(encoding="utf-8")
    return {match["number"]: match["title"] for match in HEADING.finditer(text)}


def test_sections_are_numbered_without_a_gap(sections: dict[str, str]) -> None:
    tops = [number for number in sections if "." not in number]
    assert tops == [str(number) for number in range(1, 12)]
    for top in tops:
        below = [number for number in sections if number.startswith(f"{top}.")]
        assert below == [f"{top}.{index}" for index in range(1, len(below) + 1)]


def test_every_cited_section_is_there(sections: dict[str, str]) -> None:
    cited = citations()
    assert len(cited) > 20
    numbered = [(name, number) for name, numbers in cited for number in re.findall(r"\d+(?:\.\d+)?", numbers)]
    assert not [(name, number) for name, number in numbered if number not in sections]
