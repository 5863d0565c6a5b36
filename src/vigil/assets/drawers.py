"""Divides furniture with drawers into a body that does not open, and one asset for each drawer.

Makers build one asset whose drawers would all open together. While the drawers are shut, the body and the drawers look
the same and take up the same space as this asset.
"""

import re
from dataclasses import replace

import numpy as np

from vigil.assets.kernel.asset import Asset, Solid
from vigil.base.caches import cached_while_alive
from vigil.base.geometry import Vec3

DRAWER = "Drawer"
"""Category of a drawer."""
_DRAWER_ID = re.compile(r"(.+)_(drawer\d+)")


def drawer_asset_id(chest_asset_id: str, name: str) -> str:
    """Return the asset id of the drawer `name` of a piece of furniture."""
    return f"{chest_asset_id}_{name}"


def split_drawer_id(asset_id: str) -> tuple[str, str] | None:
    """Return the furniture's asset id and the drawer's name in a drawer's asset id; None for any other id."""
    found = _DRAWER_ID.fullmatch(asset_id)
    return (found[1], found[2]) if found else None


def drawer_names(asset: Asset) -> tuple[str, ...]:
    """Return the names of the drawers into which an asset is divided, the lowest row first.

    The result is empty if other parts of the asset also move, or if the asset is itself a single drawer.
    """
    if asset.category == DRAWER:
        return ()
    names = tuple(joint.name for joint in asset.joints)
    carrying = {surface.joint for surface in asset.surfaces}
    is_chest = all(joint.kind == "slide" and joint.name in carrying for joint in asset.joints)
    return names if is_chest and all(name.startswith("drawer") for name in names) else ()


@cached_while_alive
def body_of(asset: Asset) -> Asset:
    """Return the asset without its drawers.

    The result has the bounding box of the whole asset, so that its place in a house does not change.
    """
    return replace(
        asset,
        parts=tuple(part for part in asset.parts if part.joint is None),
        solids=tuple(solid for solid in asset.solids if solid.joint is None),
        joints=(),
        surfaces=tuple(surface for surface in asset.surfaces if surface.joint is None),
    )


@cached_while_alive
def drawer_of(asset: Asset, name: str) -> tuple[Asset, Vec3]:
    """Return one drawer of an asset, shut, as a separate asset, and the place of its middle in the whole asset (m).

    All drawers of a piece of furniture open equally far. (In the whole asset, where all drawers open together, lower
    drawers open farther than upper drawers.)
    """
    parts = [part for part in asset.parts if part.joint == name]
    points = np.concatenate([part.mesh.vertices for part in parts]).astype(np.float64)
    low, high = points.min(axis=0), points.max(axis=0)
    middle = (low + high) / 2
    reach = max(abs(joint.travel) for joint in asset.joints)
    x, y, z = middle.tolist()

    def moved(point: Vec3) -> Vec3:
        return Vec3(*(np.array(point) - middle).tolist())

    def moved_solid(solid: Solid) -> Solid:
        polygon = tuple((corner_x - x, corner_z - z) for corner_x, corner_z in solid.polygon)
        return replace(solid, polygon=polygon, bottom=solid.bottom - y, top=solid.top - y)

    drawer = Asset(
        category=DRAWER,
        size=Vec3(*(high - low).tolist()),
        parts=tuple(
            replace(part, mesh=replace(part.mesh, vertices=(part.mesh.vertices - middle).astype(np.float32)))
            for part in parts
        ),
        solids=tuple(moved_solid(solid) for solid in asset.solids if solid.joint == name),
        joints=tuple(
            replace(joint, origin=moved(joint.origin), travel=float(np.copysign(reach, joint.travel)))
            for joint in asset.joints
            if joint.name == name
        ),
        surfaces=tuple(replace(each, center=moved(each.center)) for each in asset.surfaces if each.joint == name),
    )
    return drawer, Vec3(x, y, z)
