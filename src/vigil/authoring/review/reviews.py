"""Reviews: an append-only file of reviewers' verdicts on episodes, and the decisions that follow from the verdicts.

Each line is one verdict. Lines are never changed or removed; a later line by the same reviewer overrides an earlier
line. Each line identifies an episode by hash, so that verdicts on another version of the episode do not count.
"""

import hashlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

from vigil.base.json_lines import append_line, dump_line, parse_line, read_lines
from vigil.base.versions import schema_validator
from vigil.protocol.episode import MAX_INSTRUCTION_CHARS, Episode
from vigil.protocol.families import FAMILIES
from vigil.protocol.family import TargetSize
from vigil.protocol.house import canonical_json

REVIEW_SCHEMA = 2
Verdict = Literal["approve", "reject", "edit", "target_size", "note"]
Judgement = Literal["approve", "reject"]


class Review(BaseModel):
    """One line of the review file."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    schema_version: Annotated[int, schema_validator(REVIEW_SCHEMA)] = REVIEW_SCHEMA
    at: datetime
    reviewer: str = Field(pattern=r"^(model: )?[A-Za-z0-9][A-Za-z0-9_.-]{0,39}$")
    """Name of the reviewer. The name of a model begins with `model: `, so that readers recognize it everywhere."""
    reviewer_kind: Literal["person", "model"] = "person"
    episode_id: str = Field(min_length=1, max_length=200)
    episode_sha256: str = Field(pattern=r"^[0-9a-f]{64}$")
    verdict: Verdict
    instruction: str | None = Field(default=None, min_length=1, max_length=MAX_INSTRUCTION_CHARS)
    """New wording of the instruction; only for the verdict `edit`."""
    target_size: TargetSize | None = None
    """New target size of the episode; only for the verdict `target_size`."""
    text: str = Field(default="", max_length=4000)
    """Reason for the verdict, or text of the note."""

    @model_validator(mode="after")
    def _carries_what_it_says(self) -> "Review":
        if (self.reviewer_kind == "model") != self.reviewer.startswith("model: "):
            raise ValueError("the `reviewer` must begin with `model: ` if, and only if, `reviewer_kind` is `model`")
        if (self.verdict == "edit") != (self.instruction is not None):
            raise ValueError("`instruction` must be given for the verdict `edit`, and for no other verdict")
        if (self.verdict == "target_size") != (self.target_size is not None):
            raise ValueError("`target_size` must be given for the verdict `target_size`, and for no other verdict")
        if self.verdict == "note" and not self.text.strip():
            raise ValueError("a note needs a text")
        return self


@dataclass(frozen=True, slots=True)
class Decision:
    """The outcome of all verdicts of one reviewer on one episode."""

    judgement: Judgement | None = None
    instruction: str | None = None
    target_size: TargetSize | None = None
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Agreement:
    """Agreement of two reviewers on the episodes that both approved or rejected."""

    both: int
    """Number of episodes that both reviewers approved or rejected."""
    agree: int
    """Number of episodes on which both reviewers gave the same verdict."""
    kappa: float | None
    """Cohen's kappa; None if `both` is 0, or if chance alone would give full agreement."""
    disputed: tuple[str, ...]
    """Ids of the episodes that one reviewer approved and the other rejected."""


def episode_sha256(episode: Episode) -> str:
    """Return the hash that identifies a version of an episode in reviews. It leaves out the field `reviewed`."""
    fields = episode.model_dump(mode="json")
    fields["provenance"].pop("reviewed", None)
    return hashlib.sha256(canonical_json(fields)).hexdigest()


def append_review(path: Path, review: Review) -> None:
    """Append a review to a file; several writers may append. On return, the review is on disk. Raises RecordError."""
    append_line(path, dump_line(review, exclude_defaults=True))


def read_reviews(path: Path) -> list[Review]:
    """Return all reviews in the order of the file; an empty list if the file does not exist.

    A partial last line is ignored. Raises RecordError if another line is invalid.
    """
    return [parse_line(line, Review, repr(str(path)), "Restore the file.") for line in read_lines(path)]


def decisions(episode: Episode, reviews: Iterable[Review]) -> dict[str, Decision]:
    """Return reviewer -> decision on this version of an episode, sorted by the reviewer's name."""
    sha256 = episode_sha256(episode)
    found: dict[str, Decision] = {}
    for review in reviews:
        if (review.episode_id, review.episode_sha256) == (episode.id, sha256):
            found[review.reviewer] = _with_review(found.get(review.reviewer, Decision()), review)
    return dict(sorted(found.items()))


def apply_reviews(episode: Episode, reviews: Sequence[Review]) -> Episode:
    """Return the episode, marked as rejected if any reviewer rejected it, or else as approved if any approved it.

    The episode gets the last new wording and the last new target size.
    """
    sha256 = episode_sha256(episode)
    mine = [review for review in reviews if (review.episode_id, review.episode_sha256) == (episode.id, sha256)]
    judgements = {decision.judgement for decision in decisions(episode, mine).values()}
    reviewed = "rejected" if "reject" in judgements else "approved" if "approve" in judgements else None
    edits = [review.instruction for review in mine if review.instruction is not None]
    sizes = [review.target_size for review in mine if review.target_size is not None]
    changes = {
        "instruction": edits[-1] if edits else episode.instruction,
        "target_size": sizes[-1] if sizes else episode.target_size,
        "provenance": episode.provenance.model_copy(update={"reviewed": reviewed}),
    }
    return Episode.model_validate({**dict(episode), **changes})


def queue(episodes: Iterable[Episode], seed: int = 0) -> list[Episode]:
    """Return episodes in the order of review: one of each family in turn. Within a family, `seed` draws the order."""
    rng = np.random.default_rng(seed)
    ordered = sorted(episodes, key=lambda episode: episode.id)
    groups = [[episode for episode in ordered if episode.family == family] for family in FAMILIES]
    shuffled = [[group[index] for index in rng.permutation(len(group))] for group in groups]
    longest = max((len(group) for group in shuffled), default=0)
    return [group[turn] for turn in range(longest) for group in shuffled if turn < len(group)]


def agreement(episodes: Iterable[Episode], reviews: Sequence[Review], a: str, b: str) -> Agreement:
    """Return the agreement of reviewers `a` and `b` on the episodes that both approved or rejected."""
    pairs: list[tuple[str, Judgement, Judgement]] = []
    for episode in episodes:
        found = decisions(episode, (review for review in reviews if review.episode_id == episode.id))
        first, second = found.get(a, Decision()).judgement, found.get(b, Decision()).judgement
        if first is not None and second is not None:
            pairs.append((episode.id, first, second))
    agree = sum(first == second for _, first, second in pairs)
    disputed = tuple(name for name, first, second in pairs if first != second)
    return Agreement(len(pairs), agree, _kappa(pairs), disputed)


def _with_review(before: Decision, review: Review) -> Decision:
    notes = (*before.notes, review.text) if review.text.strip() else before.notes
    judgement: Judgement | None = review.verdict if review.verdict in ("approve", "reject") else before.judgement
    return Decision(
        judgement, review.instruction or before.instruction, review.target_size or before.target_size, notes
    )


def _kappa(pairs: Sequence[tuple[str, Judgement, Judgement]]) -> float | None:
    n = len(pairs)
    if n == 0:
        return None
    observed = sum(first == second for _, first, second in pairs) / n
    approve_a = sum(first == "approve" for _, first, _ in pairs) / n
    approve_b = sum(second == "approve" for _, _, second in pairs) / n
    chance = approve_a * approve_b + (1 - approve_a) * (1 - approve_b)
    return None if chance == 1.0 else (observed - chance) / (1 - chance)
