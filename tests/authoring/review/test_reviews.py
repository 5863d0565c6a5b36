"""The review file: append-only, whole after a crash, bound to the very episode; and what follows from it."""

from collections import Counter
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
from pydantic import ValidationError

from tests.support.tiny_pack import tiny_episode
from vigil.authoring.review.reviews import (
    Decision,
    Review,
    agreement,
    append_review,
    apply_reviews,
    decisions,
    episode_sha256,
    queue,
    read_reviews,
)
from vigil.errors import RecordError
from vigil.protocol.episode import Episode

EPISODES = [tiny_episode(number, family) for number, family in enumerate(("DA", "PG", "SV", "AI") * 3)]


def said(episode: Episode, verdict: str, reviewer: str = "ada", **more: Any) -> Review:
    fields = {"at": datetime(2026, 1, 1, tzinfo=UTC), "reviewer": reviewer, "episode_id": episode.id}
    return Review.model_validate({**fields, "episode_sha256": episode_sha256(episode), "verdict": verdict, **more})


def test_lines_are_added_and_read_back(tmp_path: Path) -> None:
    path = tmp_path / "reviews.jsonl"
    assert read_reviews(path) == []
    given = [said(EPISODES[0], "approve"), said(EPISODES[1], "note", text="dark")]
    for review in given:
        append_review(path, review)
    assert read_reviews(path) == given


def test_what_a_crash_left_is_put_aside_and_nothing_is_lost(tmp_path: Path) -> None:
    path = tmp_path / "reviews.jsonl"
    append_review(path, said(EPISODES[0], "approve"))
    with path.open("ab") as file:
        file.write(b'{"at": "2026')
    assert len(read_reviews(path)) == 1
    append_review(path, said(EPISODES[1], "reject"))
    assert [review.verdict for review in read_reviews(path)] == ["approve", "reject"]
    (side,) = tmp_path.glob("*.partial-*")
    assert side.read_bytes() == b'{"at": "2026'


def test_of_two_crashes_that_left_as_much_neither_remainder_is_lost(tmp_path: Path) -> None:
    path = tmp_path / "reviews.jsonl"
    append_review(path, said(EPISODES[0], "approve"))
    good = path.read_bytes()
    for torn in (b"first", b"other"):
        path.write_bytes(good + torn)
        append_review(path, said(EPISODES[1], "reject"))
    assert sorted(side.read_bytes() for side in tmp_path.glob("*.partial-*")) == [b"first", b"other"]


def test_a_broken_line_is_named(tmp_path: Path) -> None:
    path = tmp_path / "reviews.jsonl"
    append_review(path, said(EPISODES[0], "approve"))
    path.write_bytes(path.read_bytes() + b'{"verdict": "maybe"}\n')
    with pytest.raises(RecordError, match="line 2"):
        read_reviews(path)


@pytest.mark.parametrize(
    "fields",
    [
        {"verdict": "edit"},
        {"verdict": "approve", "instruction": "Go."},
        {"verdict": "target_size"},
        {"verdict": "note", "text": "  "},
        {"verdict": "approve", "reviewer": "../ada"},
        {"verdict": "approve", "reviewer": "gpt", "reviewer_kind": "model"},
        {"verdict": "approve", "reviewer": "model: gpt"},
    ],
)
def test_a_verdict_carries_what_it_says(fields: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        said(EPISODES[0], **fields)


def test_later_lines_overrule_and_other_versions_do_not_count() -> None:
    episode = EPISODES[0]
    changed = episode.model_copy(update={"instruction": "Another one."})
    reviews = [
        said(episode, "reject", text="too dark"),
        said(episode, "approve"),
        said(episode, "target_size", target_size="small"),
        said(changed, "reject"),
        said(episode, "reject", reviewer="bob"),
    ]
    assert decisions(episode, reviews) == {
        "ada": Decision("approve", None, "small", ("too dark",)),
        "bob": Decision("reject"),
    }
    assert decisions(changed, reviews) == {"ada": Decision("reject")}


def test_reviews_are_applied() -> None:
    episode = EPISODES[0]
    reviews = [said(episode, "approve"), said(episode, "edit", instruction="Walk to the table.")]
    applied = apply_reviews(episode, reviews)
    assert (applied.provenance.reviewed, applied.instruction) == ("approved", "Walk to the table.")
    rejected = apply_reviews(episode, [*reviews, said(episode, "reject", reviewer="bob")])
    assert rejected.provenance.reviewed == "rejected"
    assert apply_reviews(EPISODES[1], reviews) == EPISODES[1]
    marked = episode.model_copy(update={"provenance": applied.provenance})
    assert episode_sha256(marked) == episode_sha256(episode)


def test_the_queue_takes_the_families_in_turn() -> None:
    ordered = queue(EPISODES, seed=3)
    assert {episode.id for episode in ordered} == {episode.id for episode in EPISODES}
    for start in range(0, len(ordered), 4):
        assert Counter(episode.family for episode in ordered[start : start + 4]).most_common(1)[0][1] == 1
    assert queue(EPISODES[::-1], seed=3) == ordered
    assert queue(EPISODES, seed=4) != ordered


def test_two_reviewers_are_compared() -> None:
    verdicts = [("approve", "approve"), ("approve", "reject"), ("reject", "reject"), ("reject", "reject")]
    reviews = [
        said(episode, verdict, reviewer=name)
        for episode, pair in zip(EPISODES, verdicts, strict=False)
        for name, verdict in zip(("ada", "bob"), pair, strict=True)
    ]
    found = agreement(EPISODES, [*reviews, said(EPISODES[8], "approve")], "ada", "bob")
    assert (found.both, found.agree, found.disputed) == (4, 3, (EPISODES[1].id,))
    assert found.kappa == pytest.approx(0.5)
    assert agreement(EPISODES, [], "ada", "bob").kappa is None
