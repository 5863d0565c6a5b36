"""Diagnosis: why episodes of a run were not verified successes, with advice for each cause.

Verdicts and the reasons of invalid replies are counted. The advice says where to look, not what the agent meant.
"""

import json
import tomllib
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from vigil.analysis.measures.rows import values
from vigil.base.glossary import TERMS
from vigil.scoring.closure import ClosureOutcome

MIN_REASON_SHARE = 0.05
"""A reason gets its own advice if it makes at least this share of the replies invalid. The other reasons are counted
together."""
FORM_ONLY_SHARE = 0.95
"""A run with at least this share of invalid replies measures little except whether replies have the right form."""
_TEXTS = tomllib.loads((Path(__file__).parent / "advice.toml").read_text(encoding="utf-8"))
REPLY_ADVICE: Mapping[str, str] = {
    reason: advice.format(**_TEXTS["shared"]) for reason, advice in _TEXTS["replies"].items()
}
"""Reason of an invalid reply -> advice; any other reason means that the reply has the wrong form."""
ENDING_ADVICE: Mapping[str, str] = _TEXTS["endings"]
"""Ending of an episode -> advice on where to look."""


@dataclass(frozen=True, slots=True)
class FailureCauses:
    """Counts that may explain the rates of one run: how its episodes ended, and why its replies were invalid."""

    episodes: int
    replies: int
    endings: Mapping[str, int]
    """Number of episodes without verified success, by the subtype of the report or, without a subtype, by label."""
    reasons: Mapping[str, int]
    """Number of invalid replies by reason."""

    @property
    def sentences(self) -> tuple[str, ...]:
        """Sentences on what prevented verified successes, first those about invalid replies; may be empty."""
        return (*_reply_sentences(self), *_ending_sentences(self))


def causes_of_rows(rows: pd.DataFrame) -> FailureCauses:
    """Return the possible causes of the rates of a run of the eight families."""
    endings = Counter(
        subtype or label
        for subtype, label in zip(values(rows, "subtype", object), values(rows, "label", object), strict=True)
        if label not in ("B", None)
    )
    reasons = _sum_counts(json.loads(text) for text in rows["invalid_reasons"])
    return FailureCauses(len(rows), int(values(rows, "steps", int).sum()), endings, reasons)


def causes_of_closure(outcomes: Iterable[ClosureOutcome]) -> FailureCauses:
    """Return what may explain the failures of C (correct closure) in a run of the closure-stress suite."""
    found = list(outcomes)
    endings = Counter(each.label for each in found if each.label != "closed")
    reasons = _sum_counts(each.outcome.invalid_reasons for each in found)
    return FailureCauses(len(found), sum(each.outcome.steps for each in found), endings, reasons)


def _sum_counts(counts: Iterable[Mapping[str, int]]) -> Counter[str]:
    return sum(map(Counter, counts), Counter())


def _reply_sentences(causes: FailureCauses) -> list[str]:
    invalid = sum(causes.reasons.values())
    if not invalid or invalid < MIN_REASON_SHARE * causes.replies:
        return []
    share = invalid / causes.replies
    alone = " The run measures that more than anything else." if share >= FORM_ONLY_SHARE else ""
    by_advice: dict[str, list[str]] = {}
    for reason, count in sorted(causes.reasons.items(), key=lambda each: (-each[1], each[0])):
        advice = (
            REPLY_ADVICE.get(reason, _TEXTS["shared"]["form"]) if count >= MIN_REASON_SHARE * causes.replies else ""
        )
        by_advice.setdefault(advice, []).append(f"{count} `{reason}`")
    first = f"{share:.0%} of the replies ({invalid:,} of {causes.replies:,}) are not actions.{alone}"
    return [first, *(f"{', '.join(counted)}. {advice}".rstrip() for advice, counted in by_advice.items())]


def _ending_sentences(causes: FailureCauses) -> list[str]:
    ranked = sorted(causes.endings.items(), key=lambda each: (-each[1], each[0]))
    found = []
    for name, count in ranked:
        explained = f", {TERMS[name].short}" if name in TERMS else ""
        found.append(f"{count:,} of {causes.episodes:,} episodes: `{name}`{explained}. {ENDING_ADVICE[name]}")
    return found
