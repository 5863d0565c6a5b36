"""The file of decisions: ids and words are read as they are written."""

from pathlib import Path

import pytest

from vigil.errors import SettingError
from vigil.web.leaderboard.build import read_decisions


def decisions(folder: Path, run: str, more: str = "") -> Path:
    path = folder / "decisions.yaml"
    path.write_text(f"decisions:\n- {{run: {run}, status: accepted, why: it holds, by: us, date: 2026-01-01{more}}}\n")
    return path


@pytest.mark.parametrize("run", ["123456789012", "012345670123", "'123456789012'"])
def test_an_id_of_digits_is_read_as_it_is_written(tmp_path: Path, run: str) -> None:
    assert list(read_decisions(decisions(tmp_path, run))) == [run.strip("'")]


def test_a_value_that_is_left_out_is_none(tmp_path: Path) -> None:
    for more in (", tier: null", ", tier: ", ", tier: ~", ""):
        (found,) = read_decisions(decisions(tmp_path, "123456789012", more)).values()
        assert found.tier is None


def test_an_invalid_id_is_refused_with_its_line(tmp_path: Path) -> None:
    with pytest.raises(SettingError, match=r"line 2, decisions\[1\]\.run"):
        read_decisions(decisions(tmp_path, "12"))
