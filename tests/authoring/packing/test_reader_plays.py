"""What readers came to who played a pack: kept beside it, told in its card."""

from pathlib import Path
from typing import Any

import pytest
from pydantic import ValidationError

from tests.support.tiny_pack import tiny_pack
from vigil.authoring.packing.dataset_card import card_of
from vigil.authoring.packing.reader_plays import PLAYS, ReaderPlay, ReaderPlays, plays_table, read_plays
from vigil.errors import PackMismatch
from vigil.packs.pack import Pack


def play(number: int, **facts: Any) -> ReaderPlay:
    given = {"group": "hard", "steps": 9, "status": "success", "W": True, "B": True, "label": "B", **facts}
    return ReaderPlay(episode_id=f"e{number}", reader="ada", **given)


@pytest.fixture
def pack(tmp_path: Path) -> Pack:
    return tiny_pack(tmp_path / "pack", 8)


@pytest.fixture
def found(pack: Pack) -> ReaderPlays:
    failed = play(1, W=False, B=False, label="FR", cause="picture", reason="A white cup on white.")
    unsaid = play(2, group="easy", B=False, label="NR", status=None, cause="agent")
    return ReaderPlays(pack=pack.name, pack_sha256=pack.sha256, drawn="By lot.", plays=(play(0), failed, unsaid))


def test_shares_stand_by_level_with_causes_of_failures(found: ReaderPlays) -> None:
    assert plays_table(found)[2:] == [
        "| all | 3 | 66.7 [21, 94] | 33.3 [6, 79] | 1 | 1 | 0 | 0 |",
        "| easy | 1 | 100.0 [21, 100] | 0.0 [0, 79] | 1 | 0 | 0 | 0 |",
        "| hard | 2 | 50.0 [9, 91] | 50.0 [9, 91] | 0 | 1 | 0 | 0 |",
    ]


def test_a_suite_is_told_by_its_own_measure() -> None:
    plays = (play(0, group="all_of", C=True, B=False), play(1, group="already", C=False, cause="world"))
    lines = plays_table(ReaderPlays(pack="p", pack_sha256="0", drawn="By lot.", plays=plays))
    assert lines[0] == "|  | plays | C [95 %] | agent | picture | wording | world |"
    assert lines[2] == "| all | 2 | 50.0 [9, 91] | 0 | 0 | 0 | 1 |"


@pytest.mark.parametrize("facts", [{"cause": "agent"}, {"B": False}, {"C": False}])
def test_failures_have_causes_and_nothing_else_has(facts: dict[str, Any]) -> None:
    with pytest.raises(ValidationError, match="a play that failed needs a cause"):
        play(0, **facts)


def test_the_card_tells_plays_of_this_very_pack_alone(pack: Pack, found: ReaderPlays) -> None:
    assert "Played by readers" not in card_of(pack)
    file = pack.folder / PLAYS
    file.write_text(found.model_dump_json())
    assert read_plays(pack) == found
    assert "By lot. Each was played once" in card_of(pack)
    assert Pack.load(pack.folder).sha256 == pack.sha256
    file.write_text(found.model_copy(update={"pack_sha256": "0" * 64}).model_dump_json())
    assert read_plays(pack) is None
    file.write_text("{}")
    with pytest.raises(PackMismatch, match="Write it again, or remove it"):
        read_plays(pack)
