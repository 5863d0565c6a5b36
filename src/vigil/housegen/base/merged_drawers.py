"""Merged drawers: converts a house to a form without drawers, in which their contents lie directly in the furniture.

AI2-THOR has no assets of drawers, and real houses do not name drawers. So houses are exported and compared in this
form.
"""

from typing import Any

from vigil.assets.drawers import split_drawer_id
from vigil.protocol.house import House


def with_merged_drawers(house: House) -> House:
    """Return a house in which each piece of furniture and its drawers are one object.

    If the house does not name drawers, return the house itself.
    """
    if all(split_drawer_id(node.asset_id) is None for node, _ in house.objects()):
        return house
    return House(house.name, {**house.data, "objects": [_merge_drawers(node) for node in house.data["objects"]]})


def _merge_drawers(node: dict[str, Any]) -> dict[str, Any]:
    """Return an object of a document without its drawers.

    The object gets the contents of its drawers, and the openness of the drawer that is open the farthest.
    """
    if not node.get("children"):
        return node
    drawers = [
        child for child in node["children"] if (split_drawer_id(child["assetId"]) or ("",))[0] == node["assetId"]
    ]
    children = [child for child in node["children"] if child not in drawers]
    children += [each for drawer in drawers for each in drawer.get("children") or []]
    whole = {**node, "children": [_merge_drawers(child) for child in children]}
    return {**whole, "openness": max(drawer.get("openness") or 0.0 for drawer in drawers)} if drawers else whole
