"""Rejections: how many proposals and candidates broke which rule on the way to a pack, for its manifest and card."""

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from typing import Any

from vigil.authoring.drafting.drafts import DraftsContent
from vigil.authoring.review.validate import Finding
from vigil.protocol.families import Family


def rejected_by_rule(
    read: Sequence[DraftsContent], families: Collection[Family], bad: Mapping[str, Sequence[Finding]], tried: int
) -> dict[str, Any]:
    """Return, by rule, how many proposals broke it and how many of the candidates tried for selection did.

    A proposal counts only under the first rule that it breaks, a candidate under each.
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
    """Return a card's text about `rejected_by_rule`."""
    return [
        f"- Of {counts['tried']} {what} {counts['rejected']} were rejected"
        f"{': ' if counts['by_rule'] else ''}{_listed(counts['by_rule'])}."
        for what, counts in found.items()
    ]


def _listed(by_rule: Mapping[str, int]) -> str:
    return ", ".join(f"`{rule}` {count}" for rule, count in by_rule.items())


def _counted(counts: Counter[str]) -> dict[str, int]:
    return dict(sorted(counts.items()))
