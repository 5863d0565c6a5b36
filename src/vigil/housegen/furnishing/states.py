"""States of objects at the start: open, on or dirty. No object is half open."""

import numpy as np

from vigil.assets.catalog import CATALOG
from vigil.housegen.base.models import PlacedObject
from vigil.housegen.base.randomness import chance
from vigil.housegen.base.tables import TABLES

OPEN_CHANCE: dict[str, float] = TABLES["open_chance"]
"""Category -> probability that an object of this category is open; 0 by default.

Furniture is always shut if something lies in or on its moving parts.
"""

ON_CHANCE: dict[str, float] = TABLES["on_chance"]
"""Category -> probability that an object of this category is on; 0 by default."""

DIRTY_CHANCE = {"Bed": 0.55} | dict.fromkeys(("Mirror", "Plate", "Bowl", "Mug", "Cup", "Pan", "Pot", "Cloth"), 0.35)
"""Category -> probability that an object of this category is dirty; a dirty bed is unmade."""


def set_states(pieces: list[PlacedObject], rng: np.random.Generator) -> None:
    """Set the state that every object, including children, has at the start."""
    for top in pieces:
        for piece in top.with_contents():
            _set_state(piece, rng)


def _set_state(piece: PlacedObject, rng: np.random.Generator) -> None:
    kind = CATALOG[piece.category]
    if kind.is_openable and piece.model.asset.can_open:
        piece.openness = _openness(piece, rng)
    if kind.is_toggleable:
        is_shut_off = kind.runs_only_when_closed and (piece.openness or 0.0) > 0.0
        is_dark = piece.category == "Laptop" and not piece.openness
        piece.is_on = chance(rng, ON_CHANCE.get(piece.category, 0.0)) and not is_shut_off and not is_dark
    if piece.category in DIRTY_CHANCE:
        piece.is_dirty = chance(rng, DIRTY_CHANCE[piece.category])


def _openness(piece: PlacedObject, rng: np.random.Generator) -> float:
    moves_along = any(each.surface is not None and each.surface.joint is not None for each in [piece, *piece.children])
    if moves_along or not chance(rng, OPEN_CHANCE.get(piece.category, 0.0)):
        return 0.0
    return 1.0 if chance(rng, 0.5) else round(float(rng.uniform(0.85, 1.0)), 3)
