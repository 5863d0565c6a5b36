"""Families of one's own in a stream: only with what drafts them, and only in the process that knows it."""

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from vigil.authoring.drafting import proposals
from vigil.authoring.drafting.grammar import GRAMMAR
from vigil.authoring.drafting.house_context import HouseContext
from vigil.authoring.drafting.proposals import Drafts
from vigil.authoring.streaming import families
from vigil.authoring.streaming.difficulty import MAX_ACTIONS
from vigil.authoring.streaming.families import register_drafts
from vigil.authoring.streaming.stream import Stream
from vigil.errors import SettingError
from vigil.protocol.episode import FAMILIES, register_family

BATHROOM = 15
PACKAGED = tuple(FAMILIES)


@pytest.fixture
def own() -> Iterator[str]:
    """A family without drafts."""
    register_family("ZZ", replace(FAMILIES["PG"], name="Pointing Anew"))
    yield "ZZ"
    for name in ("ZZ", "SA"):
        families._own.discard(name)
        for table in (FAMILIES, GRAMMAR, MAX_ACTIONS):
            table.pop(name, None)


def drafts(context: HouseContext) -> Drafts:
    """Yields pointing under another name."""
    for episode in proposals.pointing(context, "large"):
        yield episode.model_copy(update={"family": "ZZ", "target_size": None})


def read(**asked: Any) -> list[Any]:
    return list(Stream(7, first=BATHROOM, last=BATHROOM + 1, workers=0, **asked))


def test_a_stream_holds_a_registered_family(own: str) -> None:
    plain = read(families=("PG",))
    register_drafts(own, {"anew": drafts}, most_actions=(1, 2))
    found = read(families=(own,), difficulties=("medium",))
    assert found
    assert {(item.episode.family, item.difficulty, item.draft.kind) for item in found} == {("ZZ", "medium", "anew")}
    assert len({item.episode.id for item in found}) == len(found)
    assert [item.episode for item in read(families=("PG", own)) if item.episode.family == "PG"] == [
        item.episode for item in plain
    ]
    assert Stream(7, workers=0).settings.families == (*PACKAGED, own)
    for asked in ((own,), ()):
        with pytest.raises(SettingError, match=r"Family ZZ is registered in this process alone.* \(workers 0\)"):
            Stream(7, families=asked, workers=1)
    assert Stream(7, families=PACKAGED, workers=1).settings.families == PACKAGED


def test_a_family_that_nothing_drafts_is_named(own: str) -> None:
    with pytest.raises(SettingError, match=r"nothing that drafts episodes of family 'ZZ'.*register_drafts"):
        Stream(7, families=(own,), workers=0)
    assert Stream(7, workers=1).settings.families == PACKAGED


@pytest.mark.parametrize(
    ("family", "kinds", "most_actions", "message"),
    [
        ("PG", {"anew": drafts}, (1, 2), "'PG': it is the package's own"),
        ("XX", {"anew": drafts}, (1, 2), "'XX': it is the package's own, or unknown"),
        ("ZZ", {}, (1, 2), "got kinds none"),
        ("ZZ", {"anew": drafts}, (3, 2), r"EASY <= MEDIUM actions; got kinds anew and \(3, 2\)"),
    ],
)
def test_drafts_that_make_no_sense_are_named(
    own: str, family: str, kinds: dict[str, Any], most_actions: tuple[int, int], message: str
) -> None:
    with pytest.raises(SettingError, match=message):
        register_drafts(family, kinds, most_actions=most_actions)
    assert own not in GRAMMAR


def test_the_page_s_example_runs(own: str) -> None:
    page = (Path(__file__).parents[3] / "docs" / "extending.md").read_text(encoding="utf-8")
    (code,) = [each for each in re.findall(r"```python\n(.*?)```", page, re.DOTALL) if "register_drafts" in each]
    register_family("SA", replace(FAMILIES[own], name="Search and Approach"))
    names: dict[str, Any] = {"register_drafts": register_drafts, "drafts": drafts, "Stream": Stream}
    exec(code, names)
    assert names["items"].settings.families == ("SA",)
