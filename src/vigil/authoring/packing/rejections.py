"""Counts of the proposals and candidates of a pack that broke each rule, for its manifest and card."""

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from typing import Any

from vigil.authoring.drafting.drafts import DraftsContent
from vigil.authoring.review.validate import Finding
from vigil.protocol.families import Family


def rejected_by_rule(
    read: Sequence[DraftsContent], families: Collection[Family], bad: Mapping[str, Sequence[Finding]], tried: int
) -> dict[str, Any]:
    """Return the numbers of proposals and candidates that were tried and rejected, and the rejections by rule.

    `bad` are the findings of rejected candidates by id, `tried` is the number of candidates that were checked. A
    proposal counts only under the first rule that it breaks, a candidate under each.
    """
    rejections = [each for proposed in read for each in proposed.rejections if each.family in families]
    held = sum(draft.episode.family in families for proposed in read for draft in proposed.drafts)
    candidates = Counter(rule for findings in bad.values() for rule in {finding.rule for finding in findings})
    return {
        "proposals": {
            "tried": held + len(rejections),
            "rejected": len(rejections),
            "by_rule": _counted(Counter(each.rule for each in rejections)),
        },
        "candidates": {"tried": tried, "rejected": len(bad), "by_rule": _counted(candidates)},
    }


def rejection_lines(found: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """Return the lines of a card about the counts of `rejected_by_rule`."""
    lines: list[str] = []
    for what, counts in found.items():
        listed = ", ".join(f"`{rule}` {count}" for rule, count in counts["by_rule"].items())
        lines.append(
            f"- Of {counts['tried']} {what} {counts['rejected']} were rejected{': ' if listed else ''}{listed}."
        )
    return lines


def _counted(counts: Counter[str]) -> dict[str, int]:
    return dict(sorted(counts.items()))
