"""Templates limit their own family, in drafts and in packs; other families have all their kinds."""

from pathlib import Path

import pytest

from vigil.authoring.drafting.drafts import DraftsFile
from vigil.authoring.drafting.generation import FAMILY_GRAMMAR, DraftWorker, GenerationSettings
from vigil.authoring.packing.requests import PackRequest
from vigil.errors import SettingError
from vigil.protocol.families import FAMILIES, parse_kinds, wanted_kinds

PAPER = ("open_pick_place", "put_into", "rearrange", "reveal_pick")


def test_templates_are_read_from_several_options() -> None:
    assert parse_kinds(["rearrange,put_into", "reveal_pick"]) == ("put_into", "rearrange", "reveal_pick")
    with pytest.raises(SettingError, match=r"Template 'put_in' does not exist. Did you mean 'put_into'"):
        parse_kinds(["put_in"])


def test_only_the_families_of_named_templates_are_limited() -> None:
    assert set(wanted_kinds("SM", PAPER)) == set(PAPER)
    assert wanted_kinds("CR", PAPER) == tuple(FAMILIES["CR"].kinds)
    request = PackRequest("p", templates=PAPER)
    assert request.admits("SM", "rearrange")
    assert not request.admits("SM", "swap")
    assert request.admits("CR", "swing_implicit")
    assert PackRequest("p").admits("SM", "swap")


def test_a_houses_limits_are_shared_by_the_wanted_kinds() -> None:
    settings = GenerationSettings(("SM",), per_house=8, templates=PAPER)
    assert settings.limit(8, "SM") == 2
    assert GenerationSettings(("SM",)).limit(8, "SM") == 1


def test_kinds_that_are_not_wanted_are_not_drafted() -> None:
    begun: list[object] = []

    class Context:
        begin = begun.append

    worker = object.__new__(DraftWorker)  # without a simulator
    worker._settings = GenerationSettings(("SM",), templates=PAPER)
    worker._propose = lambda _context, family: ((kind, iter(())) for kind in FAMILIES[family].kinds)
    assert list(worker._lines_of_family(Context(), "SM")) == []  # pyright: ignore[reportArgumentType]
    assert len(begun) == len(PAPER)


def test_a_drafts_file_is_continued_only_with_the_same_templates(tmp_path: Path) -> None:
    file = DraftsFile(tmp_path / "drafts.jsonl")
    plain, limited = GenerationSettings(("SM",)), GenerationSettings(("SM",), templates=PAPER, grammar=FAMILY_GRAMMAR)
    with file.writing(limited.header()):
        pass
    assert "rearrange" in file.path.read_text()
    with pytest.raises(SettingError), file.writing(plain.header()):
        pass
