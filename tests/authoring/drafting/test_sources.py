"""Where houses come from: files with a house a line are read within limits, compressed or not."""

import gzip
from pathlib import Path

import pytest

from vigil.authoring.drafting import sources
from vigil.authoring.drafting.sources import houses_from, houses_from_seeds, lines_of
from vigil.errors import HouseError, SettingError
from vigil.protocol.house import MAX_HOUSE_BYTES


def write(path: Path, data: bytes) -> Path:
    path.write_bytes(gzip.compress(data, 1) if path.suffix == ".gz" else data)
    return path


@pytest.fixture(params=["houses.jsonl", "houses.jsonl.gz"])
def path(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    return tmp_path / request.param


def test_lines_are_those_of_the_file(path: Path):
    assert list(lines_of(write(path, b"{}\n{}\n[]"))) == [b"{}\n", b"{}\n", b"[]"]
    assert [house.line for house in houses_from([str(path)])] == [1, 2, 3]


def test_a_line_that_no_house_fills_is_refused_before_it_is_read_whole(path: Path):
    """Compressed it has some 150 kB."""
    write(path, bytes(MAX_HOUSE_BYTES + 2))
    with pytest.raises(HouseError, match=r"houses\.jsonl(\.gz)?': line 1 is over 32 MiB, the limit for a file"):
        next(lines_of(path))


@pytest.mark.parametrize(
    ("limit", "said"),
    [({"MAX_LINES": 2}, "it has more than 2 lines"), ({"MAX_LINES_BYTES": 7}, "it is over 0 GiB")],
)
def test_endless_files_of_houses_are_refused(
    path: Path, monkeypatch: pytest.MonkeyPatch, limit: dict[str, int], said: str
):
    for name, value in limit.items():
        monkeypatch.setattr(sources, name, value)
    write(path, b"{}\n{}\n{}\n")
    with pytest.raises(HouseError, match=said):
        list(lines_of(path))


@pytest.mark.parametrize("seeds", ["0:99999999999", "9:9", "a:b", "²:³", f"0:{'9' * 5000}"])
def test_seeds_of_no_or_too_many_houses_are_refused(seeds: str):
    with pytest.raises(SettingError, match=r"^Seeds "):
        houses_from_seeds(seeds, ["2"])
