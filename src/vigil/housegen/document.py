"""Writes the house document: rooms, walls, openings and objects as JSON in ProcTHOR's format (schema 1.0.0)."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Literal

from vigil.assets.catalog import CATALOG
from vigil.assets.drawers import drawer_asset_id, drawer_names, drawer_of, split_drawer_id
from vigil.base.geometry import Pose
from vigil.housegen.base.models import PlacedObject
from vigil.housegen.base.randomness import GENERATOR_VERSION
from vigil.housegen.layout.appearance import RoomFinish, layer_of, material_reference
from vigil.housegen.layout.floorplan import RoomLayout, RoomPlan
from vigil.housegen.layout.openings import PlannedOpening
from vigil.housegen.layout.walls import wall_pieces
from vigil.protocol.house import SCHEMA, House, drawer_id

AGENT_Y = 0.95
"""Height (m) of the agent's position in ProcTHOR's documents; there, the position is the middle of the body."""


@dataclass(slots=True)
class HouseParts:
    """The parts of a house from which its document is written."""

    plan: RoomLayout
    openings: list[PlannedOpening]
    pieces: list[PlacedObject]
    """Furniture and hanging objects; their children are the objects on and in them."""
    finishes: dict[int, RoomFinish]
    """Number of a room -> the materials of its surfaces."""
    lights: list[dict[str, Any]]
    facade: str
    """Material of the outside walls."""
    ceiling: tuple[float, float, float]
    """Colour of the ceilings."""
    sky: str
    """Name of THOR's sky box."""
    start: Pose
    spec_name: str
    seed: int


def write_document(parts: HouseParts) -> dict[str, Any]:
    """Return the house's document as JSON data."""
    return {
        "rooms": [_room(room, parts) for room in parts.plan.rooms],
        "walls": _walls(parts),
        "doors": [_opening(opening) for opening in parts.openings if opening.is_door],
        "windows": [_opening(opening) for opening in parts.openings if not opening.is_door],
        "objects": _objects(parts),
        "proceduralParameters": {
            "ceilingMaterial": material_reference("PureWhite", parts.ceiling),
            "floorColliderThickness": 1.0,
            "lights": parts.lights,
            "receptacleHeight": 0.7,
            "reflections": [],
            "skyboxId": parts.sky,
        },
        "metadata": {
            "schema": SCHEMA,
            "roomSpecId": parts.spec_name,
            "generator": {"name": "vigil", "version": GENERATOR_VERSION, "seed": parts.seed, "spec": parts.spec_name},
            "warnings": {},
            "agent": {
                "position": {"x": parts.start.position.x, "y": AGENT_Y, "z": parts.start.position.z},
                "rotation": {"x": 0, "y": parts.start.rotation, "z": 0},
                "horizon": parts.start.horizon,
                "standing": True,
            },
        },
    }


def generators_of(houses: Iterable[House]) -> str:
    """Return a text with the sorted versions of this generator that made the houses; empty if it made none of them."""
    makers = map(_generator, houses)
    return ", ".join(sorted({str(maker.get("version")) for maker in makers if maker.get("name") == "vigil"}))


def seed_of(house: House) -> int | None:
    """Return the seed of a generated house; None if the document does not state one."""
    seed = _generator(house).get("seed")
    return seed if isinstance(seed, int) else None


def with_seed_removed(house: House, name: str) -> House:
    """Return a house with a new name and without the seed in its document."""
    seedless = {key: value for key, value in _generator(house).items() if key != "seed"}
    return House(name, {**house.data, "metadata": {**house.data["metadata"], "generator": seedless}})


def with_merged_drawers(house: House) -> House:
    """Return a house in which each piece of furniture and its drawers are one object, for exports and comparisons.

    AI2-THOR has no assets of drawers, and real houses do not name drawers. If the house does not name drawers, return
    the house itself.
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


def generator_name(house: House) -> Literal["vigil", "procthor", "house"]:
    """Return the name of the generator that made a house, for episode ids; "house" if it is unknown.

    ProcTHOR's documents do not name a generator, but always have `roomSpecId`.
    """
    metadata = house.document.metadata
    if _generator(house).get("name") == "vigil":
        return "vigil"
    return "procthor" if metadata.get("generator") is None and "roomSpecId" in metadata else "house"


def _generator(house: House) -> dict[str, Any]:
    """Return the document's entry about its generator; an empty dict if there is no valid entry."""
    generator = house.document.metadata.get("generator")
    return generator if isinstance(generator, dict) else {}


def _point(x: float, y: float, z: float) -> dict[str, float]:
    return {"x": round(x, 4) + 0.0, "y": round(y, 4) + 0.0, "z": round(z, 4) + 0.0}


def _room(room: RoomPlan, parts: HouseParts) -> dict[str, Any]:
    return {
        "id": room.id,
        "roomType": room.kind,
        "floorPolygon": [_point(x, 0.0, z) for x, z in room.corners],
        "floorMaterial": material_reference(parts.finishes[room.number].floor),
        "ceilings": [],
        "children": [],
        "layer": layer_of(room.number),
    }


def _walls(parts: HouseParts) -> list[dict[str, Any]]:
    """Return the panels of all walls as seen from the rooms, and then those of the outside walls seen from outside."""
    inner: list[dict[str, Any]] = []
    outer: list[dict[str, Any]] = []
    for piece in wall_pieces(parts.plan):
        finish = parts.finishes[piece.room]
        polygon = [_point(x, y, z) for y in (0, parts.plan.height_m) for x, z in (piece.start, piece.end)]
        panel = {
            "id": piece.id,
            "roomId": f"room|{piece.room}",
            "polygon": polygon,
            "material": material_reference(finish.wall, finish.paint),
            "layer": layer_of(piece.room),
        }
        inner.append(panel)
        if piece.behind is None:
            behind = [{**point} for point in reversed(polygon)]
            facade = material_reference(parts.facade)
            outer.append({**panel, "id": piece.exterior_id, "polygon": behind, "material": facade})
    return [*inner, *outer]


def _opening(opening: PlannedOpening) -> dict[str, Any]:
    other = opening.other
    node: dict[str, Any] = {
        "id": opening.id,
        "assetId": opening.asset_id,
        "room0": f"room|{opening.wall.room}",
        "room1": f"room|{opening.wall.room if other is None else other.room}",
        "wall0": opening.wall.id,
        "wall1": opening.wall.exterior_id if other is None else other.id,
        "holePolygon": [_point(opening.left, opening.bottom, 0), _point(opening.right, opening.top, 0)],
        "assetPosition": _point(opening.middle, (opening.bottom + opening.top) / 2, 0),
    }
    if opening.openable is not None:
        node["openable"] = opening.openable
        node["openness"] = opening.openness
    return node


def _number(pieces: list[PlacedObject]) -> None:
    """Give every object an id that consists of its category, its room, and its number in that room."""
    counts: dict[int, int] = {}
    for top in pieces:
        for piece in top.with_contents():
            number = counts.get(piece.room, 0)
            counts[piece.room] = number + 1
            piece.id = f"{piece.category}|{piece.room}|{number}"


def _drawer_of(piece: PlacedObject) -> str | None:
    """Return the name of the drawer in which an object lies; None if it is not in a drawer."""
    return None if piece.surface is None else piece.surface.joint


def _node(piece: PlacedObject, node_id: str, asset_id: str, place: Iterable[float]) -> dict[str, Any]:
    """Return the entry of an object, or of one of its drawers, at a place; without its state and its children."""
    return {
        "id": node_id,
        "assetId": asset_id,
        "position": _point(*place),
        "rotation": {"x": 0, "y": round(piece.yaw, 2) % 360.0, "z": 0},
        "kinematic": node_id != piece.id or not CATALOG[piece.category].is_pickupable,
        "layer": layer_of(piece.room),
    }


def _objects(parts: HouseParts) -> list[dict[str, Any]]:
    _number(parts.pieces)

    def node_of(piece: PlacedObject) -> dict[str, Any]:
        drawers = drawer_names(piece.model.asset)
        openness = None if drawers else piece.openness
        states = {"openness": openness, "isOn": piece.is_on, "isDirty": piece.is_dirty}
        node = _node(piece, piece.id, piece.model.asset_id, piece.position)
        node.update({key: value for key, value in states.items() if value is not None})
        children = [drawer_node(piece, name) for name in drawers]
        children += [node_of(child) for child in piece.children if _drawer_of(child) not in drawers]
        return {**node, "children": children} if children else node

    def drawer_node(chest: PlacedObject, name: str) -> dict[str, Any]:
        _, middle = drawer_of(chest.model.asset, name)
        x, z = chest.to_floor_point(middle.x, middle.z)
        place, asset_id = (x, chest.position.y + middle.y, z), drawer_asset_id(chest.model.asset_id, name)
        node = {**_node(chest, drawer_id(chest.id, name), asset_id, place), "openness": chest.openness}
        children = [node_of(child) for child in chest.children if _drawer_of(child) == name]
        return {**node, "children": children} if children else node

    return [node_of(piece) for piece in parts.pieces]
