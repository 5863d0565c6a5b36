"""Loose objects: small objects that the document does not list as children of the furniture that carries them.

Holodeck's houses have loose objects. Each loose object becomes a child of the furniture below or around it. The
furniture's asset then gets a shelf at the object's height, and the scene knows what the object lies on or in.
"""

import numpy as np

from vigil.assets.catalog import CATALOG, CEILING, WALL
from vigil.assets.database import AssetDatabase, AssetEntry
from vigil.base.geometry import rotate_floor
from vigil.protocol.house import HouseObject

ON_FLOOR_M = 0.07
"""An object stands on the floor if the height (m) of its bottom is at most this."""
OVER_M = 0.25
"""Greatest height (m) of an object's bottom above the top of its carrier."""


def with_implied_parents(nodes: list[HouseObject], assets: AssetDatabase) -> tuple[list[HouseObject], list[str]]:
    """Return the objects of a house, in which each loose object is now a child of its carrier, and a note on each."""
    entries = {node.id: assets.look_up(node.asset_id, node.name_in_house) for node in nodes}
    kinds = {node.id: CATALOG[entries[node.id].category] for node in nodes}
    furniture = [node for node in nodes if kinds[node.id].is_receptacle and not kinds[node.id].is_pickupable]
    carried: dict[str, list[HouseObject]] = {}
    for node in nodes:
        carrier = _carrier_of(node, furniture, entries) if _is_loose(node, entries[node.id]) else None
        if carrier is not None:
            carried.setdefault(carrier.id, []).append(node)
    moved = {node.id: carrier for carrier, inner in carried.items() for node in inner}
    roots = [
        node.model_copy(update={"children": [*node.children, *carried[node.id]]}) if node.id in carried else node
        for node in nodes
        if node.id not in moved
    ]
    return roots, [f"{node}: judging by its place, it rests on {carrier!r}" for node, carrier in moved.items()]


def _is_loose(node: HouseObject, entry: AssetEntry) -> bool:
    kind = CATALOG[entry.category]
    is_hung = WALL in kind.rests_on or CEILING in kind.rests_on
    return kind.is_pickupable and not is_hung and node.position.y - entry.size.y / 2 > ON_FLOOR_M


def _carrier_of(node: HouseObject, furniture: list[HouseObject], entries: dict[str, AssetEntry]) -> HouseObject | None:
    """Return the furniture that an object lies in or on, judging by the boxes of both; None if there is none.

    Of several pieces of furniture, return the one whose top is nearest to the object's bottom.
    """
    bottom = node.position.y - entries[node.id].size.y / 2
    gaps: list[float] = []
    for each in furniture:
        size = entries[each.id].size
        x, z = rotate_floor(node.position.x - each.position.x, node.position.z - each.position.z, -each.rotation.y)
        above = bottom - each.position.y - size.y / 2
        is_over = abs(x) <= size.x / 2 and abs(z) <= size.z / 2 and -size.y < above <= OVER_M
        gaps.append(abs(above) if is_over else np.inf)
    nearest = int(np.argmin(gaps)) if gaps else -1
    return furniture[nearest] if gaps and gaps[nearest] < np.inf else None
