"""Families of one's own in a stream: only with what drafts them, and only in the process that knows it."""

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from vigil.authoring.drafting.house_context import HouseContext
from vigil.authoring.drafting.proposals import Drafts
from vigil.authoring.families.pg.drafts import pointing
from vigil.authoring.streaming.stream import Stream
from vigil.errors import SettingError
from vigil.protocol.families import FAMILIES, register_family
from vigil.protocol.family import DraftKind, FamilySpec, StreamGrading

BATHROOM = 15
PACKAGED = tuple(FAMILIES)


@pytest.fixture
def own() -> Iterator[str]:
    """A family without drafts."""
    register_family(replace(FAMILIES["PG"], code="ZZ", name="Pointing Again", kinds={}, stratum="template", rules=()))
    yield "ZZ"
    for name in ("ZZ", "SA"):
        FAMILIES.pop(name, None)


def add_drafts(family: str) -> None:
    kinds = {"again": DraftKind(drafts)}
    FAMILIES[family] = replace(FAMILIES[family], kinds=kinds, grading=StreamGrading("actions", easy=1, medium=2))


def drafts(context: HouseContext) -> Drafts:
    """Yield the episodes of PG under the name of another family."""
    for episode in pointing(context, "large"):
        yield episode.model_copy(update={"family": "ZZ", "target_size": None})


def read(**asked: Any) -> list[Any]:
    return list(Stream(7, first=BATHROOM, last=BATHROOM + 1, workers=0, **asked))


def test_a_stream_holds_a_registered_family(own: str) -> None:
    plain = read(families=("PG",))
    add_drafts(own)
    found = read(families=(own,), difficulties=("medium",))
    assert found
    assert {(item.episode.family, item.difficulty, item.draft.kind) for item in found} == {("ZZ", "medium", "again")}
    assert len({item.episode.id for item in found}) == len(found)
    assert [item.episode for item in read(families=("PG", own)) if item.episode.family == "PG"] == [
        item.episode for item in plain
    ]
    assert Stream(7, workers=0).settings.families == (*PACKAGED, own)
    for asked in ((own,), ()):
        with pytest.raises(SettingError, match=r"Family ZZ is registered only in this process.* \(workers 0\)"):
            Stream(7, families=asked, workers=1)
    assert Stream(7, families=PACKAGED, workers=1).settings.families == PACKAGED


def test_a_family_that_nothing_drafts_is_named(own: str) -> None:
    with pytest.raises(SettingError, match=r"cannot draft family 'ZZ': register it with `kinds`"):
        Stream(7, families=(own,), workers=0)
    assert Stream(7, workers=1).settings.families == PACKAGED


def test_the_page_s_example_runs(own: str) -> None:
    page = (Path(__file__).parents[3] / "docs" / "extending.md").read_text(encoding="utf-8")
    (code,) = [each for each in re.findall(r"```python\n(.*?)```", page, re.DOTALL) if "DraftKind" in each]
    names: dict[str, Any] = {"FamilySpec": FamilySpec, "DraftKind": DraftKind, "StreamGrading": StreamGrading}
    names |= {"register_family": register_family, "drafts": drafts, "Stream": Stream}
    exec(code, names)
    assert names["items"].settings.families == ("SA",)
