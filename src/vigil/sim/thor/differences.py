"""Known differences between the AI2-THOR backend and the embedded simulator, with their reasons.

The docs show this list. `vigil compare-backends` counts a difference as explained only if this list has its kind.
"""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Difference:
    """A known way in which the AI2-THOR backend differs from the embedded simulator."""

    what: str
    """How the AI2-THOR backend behaves."""
    why: str
    kinds: tuple[str, ...] = ()
    """Kinds of differences, in a comparison of backends, that this entry explains."""
    checks: tuple[str, ...] = ()
    """Names of the conformance checks that fail because of this difference."""


DIFFERENCES: tuple[Difference, ...] = (
    Difference(
        "Visible pixels are those of the instance segmentation. A state's pixels are those of the whole object.",
        "THOR has neither rays that pass through glass nor parts of objects. The embedded simulator counts rays, on a "
        "lattice for large objects, and only the parts that show a state.",
        ("pixels", "verdict by sight"),
    ),
    Difference(
        "What is behind a pane is neither counted in visible pixels nor met by rays.",
        "The segmentation shows panes, and THOR's rays stop at them.",
        ("pixels", "nearest", "verdict by sight"),
        ("sees_through_glass_but_clicks_it",),
    ),
    Difference(
        "What is behind the held object is not counted in visible pixels. Clicks pass through the held object where "
        "THOR's rays do.",
        "THOR's frame shows the held object.",
        ("pixels", "nearest", "near", "verdict by sight"),
    ),
    Difference(
        "The nearest visible point comes from the depth frame.",
        "The depth frame has every pixel, while the embedded simulator casts a lattice of rays.",
        ("nearest", "verdict by sight"),
    ),
    Difference(
        "`visible` is THOR's own answer: a visibility point of the object is in view within 6 m.",
        "The protocol asks for the simulator's own answer.",
        ("visible", "verdict by sight"),
    ),
    Difference(
        "Boxes, and distances to them, come from the metadata and are those of the whole object when shut.",
        "THOR does not give boxes without leaves and handles.",
        ("box",),
    ),
    Difference(
        "At an object's very edge, a click may hit, or be near, another object.",
        "THOR draws a mask of pixels, while the embedded simulator casts rays through the pixels' middles.",
        ("near",),
    ),
)

EXPLAINED: frozenset[str] = frozenset(kind for each in DIFFERENCES for kind in each.kinds)
"""Kinds of differences that this list explains."""
EXPECTED_FAILURES: dict[str, str] = {check: each.what for each in DIFFERENCES for check in each.checks}
"""Name of a conformance check -> the known difference that makes it fail."""
