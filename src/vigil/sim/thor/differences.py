"""In what the back end over AI2-THOR differs from the embedded simulator, and why: the docs' list, and nothing besides.

`vigil compare-backends` takes a difference of one of these kinds for explained, and no other.
"""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Difference:
    """One of them."""

    what: str
    why: str
    kinds: tuple[str, ...] = ()
    """Of what a comparison finds: what this explains."""
    checks: tuple[str, ...] = ()
    """Conformance checks that cannot hold for it."""


DIFFERENCES: tuple[Difference, ...] = (
    Difference(
        "Visible pixels are those of the instance segmentation; of a state, those of the whole object.",
        "THOR has no rays that pass glass, and no parts of objects. The embedded simulator counts rays, on a lattice "
        "over large things, and the parts that tell a state.",
        ("pixels", "verdict by sight"),
    ),
    Difference(
        "Panes hide what is behind them from the count of pixels, and from rays.",
        "The segmentation shows panes, and THOR's rays stop at them.",
        ("pixels", "nearest", "verdict by sight"),
        ("sees_through_glass_but_clicks_it",),
    ),
    Difference(
        "What is in the hand hides what is behind it from the count of pixels; clicks pass it where THOR's rays do.",
        "The hand is in THOR's picture.",
        ("pixels", "nearest", "near", "verdict by sight"),
    ),
    Difference(
        "The nearest visible point is that of the depth picture.",
        "Drawn pixel by pixel, where the embedded simulator has a lattice of rays.",
        ("nearest", "verdict by sight"),
    ),
    Difference(
        "`visible` is THOR's own word: a visibility point within 6 m in view.",
        "The protocol asks for the simulator's own.",
        ("visible", "verdict by sight"),
    ),
    Difference(
        "Boxes, and distances to them, are those of metadata, of the whole object as it is when shut.",
        "THOR tells no box without leaves and handles.",
        ("box",),
    ),
    Difference(
        "What a click hits and is near to, at an object's very edge.",
        "Pixels of a drawn mask, where the embedded simulator has rays through the pixels' middles.",
        ("near",),
    ),
)

EXPLAINED: frozenset[str] = frozenset(kind for each in DIFFERENCES for kind in each.kinds)
EXPECTED_FAILURES: dict[str, str] = {check: each.what for each in DIFFERENCES for check in each.checks}
"""Conformance check -> why it cannot hold."""
