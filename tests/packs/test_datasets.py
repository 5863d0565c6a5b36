"""Packaged packs as data sets: the card names every table, and every column of a table has one type.

HF `datasets` reads the very files; its own test runs where it is installed, without a network.
"""

import json
import math
import re
from collections import defaultdict
from pathlib import Path
from typing import Any

import pytest

from vigil.packs.pack import Pack, packaged_names

PACKS = tuple(packaged_names())
TABLES = ("episodes", "solutions", "facts", "levels", "closure", "chores")


def _configs(pack: Pack) -> dict[str, str]:
    """Return {config name: data file}, as the card's front matter says."""
    card = (pack.folder / "README.md").read_text(encoding="utf-8")
    return dict(re.findall(r"^- config_name: (\S+)\n  data_files: (\S+)$", card, re.MULTILINE))


def _rows(path: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


def _types(value: Any, place: str, found: dict[str, set[str]]) -> None:
    """Adds the type at each place of a row; null fits every type."""
    if value is not None:
        found[place].add(type(value).__name__)
    if isinstance(value, dict):
        for key, item in value.items():
            _types(item, f"{place}.{key}", found)
    if isinstance(value, list):
        for item in value:
            _types(item, f"{place}[]", found)


def _mixed(rows: list[dict[str, Any]]) -> dict[str, set[str]]:
    found: dict[str, set[str]] = defaultdict(set)
    for row in rows:
        _types(row, "", found)
    return {place: types for place, types in found.items() if len(types) > 1}


def _same(told: Any, meant: Any) -> bool:
    """Whether a value is what the file says: absent keys may be null, floats may differ from the tenth place on."""
    if isinstance(meant, dict):
        extra = {key: told[key] for key in told.keys() - meant.keys()}
        return not any(extra.values()) and all(_same(told[key], item) for key, item in meant.items())
    if isinstance(meant, list):
        return len(told) == len(meant) and all(map(_same, told, meant))
    if isinstance(meant, float):
        return math.isclose(told, meant, rel_tol=1e-9, abs_tol=1e-9)
    return told == meant and type(told) is type(meant)


@pytest.mark.parametrize("name", PACKS)
def test_the_card_names_every_table(name: str) -> None:
    pack = Pack.load(name)
    tables = {table: f"{table}.jsonl" for table in TABLES if f"{table}.jsonl" in pack.manifest.files}
    assert _configs(pack) == tables


@pytest.mark.parametrize("name", PACKS)
def test_a_column_has_one_type(name: str) -> None:
    folder = Pack.load(name).folder
    for path in sorted(folder.glob("*.jsonl")):
        rows = _rows(path)
        assert _mixed(rows) == {}, path
        assert {frozenset(row) for row in rows} == {frozenset(rows[0])}, f"{path}: rows have differing columns"


def test_a_mixed_column_is_found() -> None:
    assert _mixed([{"a": [1, None]}, {"a": ["x"]}]) == {".a[]": {"int", "str"}}
    assert _mixed([{"a": {"b": 1}}, {"a": {"b": 1.5}}]) == {".a.b": {"int", "float"}}


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", PACKS)
def test_hf_datasets_reads_every_table(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HF_HUB_OFFLINE", "1")
    monkeypatch.setenv("HF_HOME", str(tmp_path / "home"))
    datasets = pytest.importorskip("datasets")
    pack = Pack.load(name)
    for config, file in _configs(pack).items():
        loaded = datasets.load_dataset(str(pack.folder), config, split="train", cache_dir=str(tmp_path / "cache"))
        rows = _rows(pack.folder / file)
        assert loaded.num_rows == len(rows)
        assert set(loaded.column_names) == set(rows[0])
        wrong = [row for told, row in zip(loaded, rows, strict=True) if not _same(told, row)]
        assert wrong == []
