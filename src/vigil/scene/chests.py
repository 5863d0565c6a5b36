"""Furniture whose drawers open separately: each drawer becomes a thing of the scene.

A house names a drawer by a child object of the furniture; the child's asset is a drawer of the furniture's asset
(`vigil.assets.drawers`). Drawers that the house does not name exist too, with the openness of the furniture. A drawer's
position is computed from the position of the furniture, never read from the document.
"""

import numpy as np

from vigil.assets.catalog import CATALOG
from vigil.assets.drawers import DRAWER, drawer_names, drawer_of, split_drawer_id
from vigil.assets.kernel.asset import Asset
from vigil.base.geometry import Vec3
from vigil.errors import HouseError
from vigil.protocol.house import HouseObject, drawer_id
from vigil.scene.geometry import place_of
from vigil.scene.things import Thing


def named_drawers(node: HouseObject) -> dict[str, HouseObject]:
    """Return drawer name -> child, for the children of an object that are drawers of it.

    Raises HouseError when two children are the same drawer.
    """
    found: dict[str, HouseObject] = {}
    for child in node.children:
        parts = split_drawer_id(child.asset_id)
        if parts is None or parts[0] != node.asset_id:
            continue
        name = parts[1]
        if name in found:
            raise HouseError(
                f"{found[name].id!r} and {child.id!r} both name {name!r} of {node.id!r}. Name each drawer once."
            )
        found[name] = child
    return found


def drawers_in(node: HouseObject, chest: Thing, full_asset: Asset) -> dict[str, Thing]:
    """Return the drawers of a piece of furniture: drawer name -> thing.

    `full_asset` is the asset of the furniture with all drawers in it; `chest.asset` is its body without drawers.

    Raises HouseError when the house names a drawer that the asset does not have.
    """
    named, names = named_drawers(node), drawer_names(full_asset)
    for name, child in named.items():
        if name not in names:
            has = f"has {', '.join(names)}" if names else "has no drawers"
            raise HouseError(
                f"{child.id!r} names {name!r} of {node.id!r}, which {has}. Name only drawers that the furniture has."
            )
    return {name: _drawer(named.get(name), chest, full_asset, name, node.openness or 0.0) for name in names}


def _drawer(node: HouseObject | None, chest: Thing, full_asset: Asset, name: str, default_openness: float) -> Thing:
    asset, middle = drawer_of(full_asset, name)
    place = place_of(chest)(np.array(middle)[None])[0]
    openness = default_openness if node is None or node.openness is None else node.openness
    return Thing(
        id=drawer_id(chest.id, name) if node is None else node.id,
        category=DRAWER,
        asset=asset,
        position=Vec3(*place.tolist()),
        rotation=chest.rotation,
        parent=chest.id,
        is_openable=CATALOG[DRAWER].is_openable,
        is_receptacle=CATALOG[DRAWER].is_receptacle,
        openness=min(1.0, max(0.0, openness)),
        is_drawer=True,
    )
