"""Strata: the rules that classify a target by size and distance. Packs are balanced over these classes, and results are
split by them."""

from collections.abc import Mapping

from vigil.protocol.family import TargetSize

SIZE_OF_CATEGORY: dict[str, TargetSize] = {
    **dict.fromkeys(("Fridge", "Television"), "large"),
    **dict.fromkeys(("Microwave", "Cabinet"), "medium"),
    **dict.fromkeys(("Egg", "Pen", "Watch"), "small"),
}
"""Category -> size class, for the categories that the paper names as examples. For these, dimensions do not matter."""
LARGE_M, SMALL_M = 0.7, 0.22
"""Limits on the longest side (m) in all other categories: a target is large from LARGE_M, and small up to SMALL_M."""
DISTANCE_BANDS_M = (3.0, 4.0)
"""Limits (m) of the distance from start to target: the near band ends at the first, the middle band at the second."""
_SIZE_ORDER = {"under": 0, "small": 0, "over": 2, "large": 2}


def size_of(category: str, longest_side_m: float) -> TargetSize:
    """Return the size class of a target (large, medium or small), from its category and its longest side (m)."""
    by_side: TargetSize = "large" if longest_side_m >= LARGE_M else "small" if longest_side_m <= SMALL_M else "medium"
    return SIZE_OF_CATEGORY.get(category, by_side)


def distance_band(distance_m: float) -> str:
    """Return the name of the distance band for a distance (m) from the start to the target."""
    near, middle = DISTANCE_BANDS_M
    if distance_m < near:
        return f"under {near:g} m"
    return f"{near:g} to {middle:g} m" if distance_m < middle else f"over {middle:g} m"


def sort_by_size(named: Mapping[str, int]) -> dict[str, int]:
    """Return counts sorted by the size or number at the beginning of each name (the smallest first), then by name.

    Counts from a manifest need this, because a manifest sorts them only by name.
    """
    return dict(sorted(named.items(), key=lambda each: _sort_key(each[0])))


def _sort_key(name: str) -> tuple[int, int, str]:
    first = name.partition(" ")[0]
    return _SIZE_ORDER.get(first, 1), int(first) if first.isdecimal() else 0, name
