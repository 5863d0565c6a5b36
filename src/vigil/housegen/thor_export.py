"""Export of a house: replaces the project's own assets and material names by those of AI2-THOR.

Each object gets THOR's asset of the same category that is nearest in size; objects that already have an asset of THOR
do not change. Positions change as little as the new sizes allow: backs remain at their wall, and objects on their
carriers. Objects for whose category THOR has no asset are left out and listed. The result has the format that AI2-THOR
reads (ProcTHOR's, schema 1.0.0), but it has not been tried in AI2-THOR.
"""

import copy
import math
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from vigil.assets.database import AssetDatabase
from vigil.base.files import read_file
from vigil.base.geometry import Box, Vec3, heading, rotate_floor
from vigil.base.json_files import read_json
from vigil.errors import SettingError
from vigil.housegen.checking.check import check_house
from vigil.housegen.document import with_merged_drawers
from vigil.protocol.house import Door, House, HouseObject, Window
from vigil.scene.outlines import floor_of, footprint

OVERSIZE = 1.6
"""Weight of sides that are too large, when sizes are compared; sides that are too small have weight 1. Objects that are
too large may hit their neighbours."""
AT_WALL_M = 0.35
"""An object whose back is at most this far (m) from a wall stands at the wall and stays there."""
SLIDES = tuple(sign * step / 20 for step in range(16) for sign in (1, -1))
"""Distances (m) along the wall that an object is moved, in this order, to bring all of it into the room."""
ON_TOP_M = 0.03
"""A child lies on its carrier's top if their heights differ by at most this (m)."""
GAP_M = 0.01
"""Least gap (m) between an object and the ceiling or its carrier's top. A hole whose bottom is at most this high (m)
begins at the floor."""

_COUNTER_SHAPE = re.compile(r"[Cc]ountertop_(?:\d+_)?([A-Z][a-z]*)_\d+x\d+")


@dataclass(slots=True)
class ThorExport:
    """The document for THOR, and the ids of objects that are not in it."""

    data: dict[str, Any]
    left_out: list[str] = field(default_factory=list)
    """Ids of objects for which THOR has no asset, of objects that lie on them, and of openings that no asset fits."""
    removed_collisions: list[str] = field(default_factory=list)
    """Ids of small objects that were removed because other objects, with their new sizes, leave too little room."""


def export_thor(house: House, thor: AssetDatabase, materials: dict[str, list[str]]) -> ThorExport:
    """Return the house with assets from the database `thor`.

    `materials` are THOR's material names by kind; if it is empty, material names do not change. Raises SettingError if
    `thor` has none of the house's categories, or has no asset that fits a door between two rooms.
    """
    house = with_merged_drawers(house)
    export = ThorExport(copy.deepcopy(house.data))
    exporter = _Exporter(house, thor, export)
    nodes = zip(house.document.objects, export.data["objects"], strict=True)
    export.data["objects"] = [data for node, data in nodes if exporter.replace(node, data, None)]
    if house.document.objects and not export.data["objects"]:
        raise SettingError(
            f"House {house.name!r}: the asset database does not have an asset for any of its objects. "
            "Give AI2-THOR's whole asset-database.json."
        )
    for key, openings in (("doors", house.document.doors), ("windows", house.document.windows)):
        pairs = zip(openings, export.data[key], strict=True)
        export.data[key] = [data for opening, data in pairs if exporter.replace_opening(opening, data)]
    if materials:
        _rename_materials(export.data, materials)
    _drop_colliding(export, House(house.name, export.data), thor, exporter.changed)
    return export


def _drop_colliding(export: ThorExport, exported: House, thor: AssetDatabase, changed: set[str]) -> None:
    """Remove carried objects that reach out of the room or overlap another object; of two that overlap, remove the
    smaller.

    Overlaps between objects that did not change are in the original house, too, and remain.
    """
    inner = (node for node, up in exported.objects() if up is not None)
    carried = {node.id: thor.look_up(node.asset_id, node.name_in_house).size for node in inner}
    for fault in check_house(exported, thor):
        if fault.rule not in ("overlap", "outside-room") or not {fault.subject, fault.other} & changed:
            continue
        concerned = [name for name in (fault.subject, fault.other) if name in carried]
        if concerned and not {fault.subject, fault.other} & set(export.removed_collisions):
            export.removed_collisions.append(min(concerned, key=lambda name: math.prod(carried[name])))
    _remove(export.data["objects"], set(export.removed_collisions))


def _remove(nodes: list[dict[str, Any]], unwanted: set[str]) -> None:
    nodes[:] = [node for node in nodes if node["id"] not in unwanted]
    for node in nodes:
        _remove(node.get("children") or [], unwanted)


def load_materials(path: Path) -> dict[str, list[str]]:
    """Return THOR's material names by kind, from its `material-database.json`. Raises SettingError."""
    wanted = "Expected AI2-THOR's form: {kind: [material name, ...], ...}."
    try:
        data = read_json(read_file(path, f"Material database {str(path)!r}", SettingError))
    except ValueError as error:
        raise SettingError(f"Material database {str(path)!r} is not JSON: {error}. {wanted}") from None
    is_table = isinstance(data, dict) and all(
        isinstance(names, list) and all(isinstance(name, str) for name in names) for names in data.values()
    )
    if not is_table or not any(data.values()):
        raise SettingError(f"Material database {str(path)!r} does not map kinds of materials to names. {wanted}")
    return data


class _Exporter:
    """Replaces the assets of one house."""

    def __init__(self, house: House, thor: AssetDatabase, export: ThorExport) -> None:
        self.house = house
        self.thor = thor
        self.export = export
        self.changed: set[str] = set()
        """Ids of the objects whose asset or position has changed."""
        rooms = [floor_of(room) for room in house.document.rooms]
        self.floors = [floor for floor in rooms if floor.is_valid]
        self.ceiling = max((point.y for wall in house.document.walls for point in wall.polygon), default=math.inf)

    def replace(self, node: HouseObject, data: dict[str, Any], above: tuple[Box, Box] | None) -> bool:
        """Give an object and its children THOR's assets; return whether there is an asset for its category.

        If there is none, list the ids of the object and its children as left out. `above` is the box of the object's
        carrier before and after its own replacement; None if there is no carrier.
        """
        entry = self.thor.look_up(node.asset_id, node.name_in_house)
        before = after = Box(center=node.position.vec, size=entry.size, yaw=node.rotation.y)
        if node.asset_id not in self.thor or (above is not None and above[0] != above[1]):
            asset = self._nearest(entry.category, entry.size, node.asset_id)
            if asset is None:
                self._leave_out(node)
                return False
            after = (
                self._resized_in_place(before, asset[1])
                if above is None
                else _moved_with_support(before, asset[1], *above)
            )
            data["assetId"] = asset[0]
            data["position"] = {axis: round(value, 4) + 0.0 for axis, value in zip("xyz", after.center, strict=True)}
            self.changed.add(node.id)
        children = zip(node.children, data.get("children", []), strict=True)
        kept = [below for child, below in children if self.replace(child, below, (before, after))]
        if "children" in data:
            data["children"] = kept
        return True

    def _leave_out(self, node: HouseObject) -> None:
        self.export.left_out.append(node.id)
        for child in node.children:
            self._leave_out(child)

    def _nearest(self, category: str, size: Vec3, asset_id: str) -> tuple[str, Vec3] | None:
        """Return (asset id, size) of THOR's asset for an object; None if THOR has none for its category.

        This is the object's own asset if THOR has it, else the asset of the category that is nearest in size. A
        countertop gets a countertop of the same shape, if there is one.
        """
        if asset_id in self.thor:
            return asset_id, size
        choices = self.thor.of_category(category)
        if category == "CounterTop":
            same_shape = [choice for choice in choices if _counter_shape(choice[0]) == _counter_shape(asset_id)]
            choices = same_shape or choices
        return min(choices, key=lambda choice: (_size_difference(size, choice[1]), choice[0]), default=None)

    def _resized_in_place(self, before: Box, size: Vec3) -> Box:
        """Return the new box, with size `size`, of an object on the floor or a wall; in the room, if possible."""
        (dx, dz), (x, y, z) = heading(before.yaw), before.center
        back = shapely.Point(x - dx * before.size.z / 2, z - dz * before.size.z / 2)
        if any(floor.exterior.distance(back) < AT_WALL_M for floor in self.floors):
            ahead = (size.z - before.size.z) / 2
            x, z = x + dx * ahead, z + dz * ahead
        on_floor = before.bottom < AT_WALL_M
        height = before.bottom + size.y / 2 if on_floor else min(y, self.ceiling - GAP_M - size.y / 2)
        box = Box(center=Vec3(x, height, z), size=size, yaw=before.yaw)
        inside = [floor for floor in self.floors if shapely.contains_xy(floor, before.center.x, before.center.z)]
        for floor in inside[:1]:
            for slide in SLIDES:
                moved = Box(center=Vec3(x + dz * slide, height, z - dx * slide), size=size, yaw=before.yaw)
                if floor.contains(footprint(moved)):
                    return moved
        return box

    def replace_opening(self, opening: Door | Window, data: dict[str, Any]) -> bool:
        """Give a door or window one of THOR's assets, and its hole the asset's size; return whether an asset fits.

        If none fits, list the opening's id as left out. If none fits a door between two rooms, raise SettingError
        instead, because the rooms would not be connected.
        """
        if opening.asset_id in self.thor:
            return True
        xs, ys = [point.x for point in opening.hole_polygon], [point.y for point in opening.hole_polygon]
        size = Vec3(max(xs) - min(xs), max(ys) - min(ys), 0.1)
        wall = next(wall for wall in self.house.document.walls if wall.id == opening.wall0)
        length, heights = math.dist(*wall.ends), [point.y for point in wall.polygon]
        height = max(heights) - min(heights)
        category = self.thor.look_up(opening.asset_id, opening.asset_id).category
        fitting = [
            choice for choice in self.thor.of_category(category) if choice[1].x <= length and choice[1].y <= height
        ]
        if not fitting and isinstance(opening, Door) and opening.joins_rooms:
            raise SettingError(
                f"House {self.house.name!r}: the asset database does not have a {category} that fits {opening.id!r} in "
                f"its wall of {length:.2f} x {height:.2f} m. Give AI2-THOR's whole asset-database.json."
            )
        if not fitting:
            self.export.left_out.append(opening.id)
            return False
        asset_id, new = min(fitting, key=lambda choice: (_size_difference(size, choice[1]), choice[0]))
        left = float(np.clip((min(xs) + max(xs) - new.x) / 2, 0.0, length - new.x))
        low = 0.0 if min(ys) <= GAP_M else float(np.clip(max(ys) - new.y, 0.0, height - new.y))
        data["assetId"] = asset_id
        data["holePolygon"] = [_point(left, low), _point(left + new.x, low + new.y)]
        data["assetPosition"] = _point(left + new.x / 2, low + new.y / 2)
        return True


def _point(x: float, y: float) -> dict[str, float]:
    return {"x": round(x, 4), "y": round(y, 4), "z": 0.0}


def _counter_shape(asset_id: str) -> str:
    """Return the shape that a countertop's asset id names, e.g. "I", "L", "C" or "Island"; "I" if it names none."""
    found = _COUNTER_SHAPE.search(asset_id)
    return found[1] if found else "I"


def _size_difference(size: Vec3, other: Vec3) -> float:
    """Return a measure of how much two sizes differ; it is 0 when they are equal."""
    logs = [math.log(b / a) for a, b in zip(size, other, strict=True)]
    return sum(log * OVERSIZE if log > 0 else -log for log in logs)


def _moved_with_support(before: Box, size: Vec3, below: Box, holder: Box) -> Box:
    """Return the new box, with size `size`, of an object that is on or in a carrier.

    The carrier has been replaced: `below` was the carrier's box before, and `holder` is its box now.
    """
    x, z = rotate_floor(before.center.x - below.center.x, before.center.z - below.center.z, -below.yaw)
    dx, dz = rotate_floor(x * holder.size.x / below.size.x, z * holder.size.z / below.size.z, holder.yaw)
    if before.bottom >= below.top - ON_TOP_M:
        bottom = holder.top + before.bottom - below.top
    elif before.top > below.top:
        bottom = holder.top - (below.top - before.bottom) * size.y / before.size.y
    else:
        share = (before.bottom - below.bottom) / below.size.y
        bottom = min(holder.bottom + share * holder.size.y, max(holder.bottom, holder.top - size.y - GAP_M))
    center = Vec3(holder.center.x + dx, bottom + size.y / 2, holder.center.z + dz)
    return Box(center=center, size=size, yaw=before.yaw)


def _rename_materials(data: dict[str, Any], materials: dict[str, list[str]]) -> None:
    """Give floors, walls and the ceiling THOR's material names; a name that THOR lacks becomes a similar name."""
    names = sorted({name for kind in materials.values() for name in kind})
    ceiling = data["proceduralParameters"].get("ceilingMaterial")
    references = [(room["floorMaterial"], "wood floor") for room in data["rooms"]]
    references += [(wall["material"], "drywall") for wall in data["walls"]]
    for reference, usual in [*references, *([] if ceiling is None else [(ceiling, "drywall")])]:
        if reference["name"] not in names:
            words = _words(reference["name"]) or _words(usual)
            reference["name"] = max(names, key=lambda name: _name_similarity(words, name, usual))


def _name_similarity(words: set[str], name: str, usual: str) -> tuple[int, int, int, str]:
    found = _words(name)
    return len(words & found), len(_words(usual) & found), -len(found), name


def _words(text: str) -> set[str]:
    parts = re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+", text)
    return {part.lower().removesuffix("s") for part in parts}
