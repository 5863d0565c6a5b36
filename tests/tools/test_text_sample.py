"""A sample of texts has each kind in its number, and the published verdicts are of such samples."""

import json
from collections import Counter
from pathlib import Path

from tools.text_sample import NUMBERS, docstrings, main

PUBLISHED = sorted((Path(__file__).parents[2] / "docs" / "blind").glob("words_*.jsonl"))


def test_a_sample_holds_each_kind_with_its_place(tmp_path: Path) -> None:
    main(7, tmp_path / "words.jsonl")
    rows = [json.loads(line) for line in (tmp_path / "words.jsonl").read_text().splitlines()]
    assert Counter(row["kind"] for row in rows) == NUMBERS
    assert all(row["where"] and row["text"] for row in rows)


def test_a_docstring_stands_with_its_place_and_signature() -> None:
    by_place = {(text["where"], text.get("code", "")): text["text"] for text in docstrings()}
    eye = by_place["vigil/base/geometry.py, class Pose", "    def eye(self) -> Vec3:"]
    assert eye == "Position of the agent's camera."


def test_published_verdicts_are_of_whole_samples() -> None:
    for path in PUBLISHED:
        rows = [json.loads(line) for line in path.read_text().splitlines()]
        assert Counter(row["kind"] for row in rows) == NUMBERS
        assert all(row["is_clear"] or row["why"] for row in rows)
