"""House: a ProcTHOR house document (JSON, schema 1.0.0), loaded, saved and hashed.

Unknown keys are kept, so that a house that was loaded and saved again is the same document. This
module knows the document, not what the things in it look like or do (`vigil.scene.build`).
"""

import hashlib
import json
from functools import cached_property
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError
from pydantic.alias_generators import to_camel

from vigil.errors import HouseError, first_fault
from vigil.pose import Pose, Vec3
from vigil.strict_json import read_json

MAX_HOUSE_BYTES = 32 * 1024 * 1024
MAX_OBJECTS = 5000
MAX_OPENINGS = 300
"""Doors and windows, which are compared with each other and hit by rays; far more than a house of ten rooms has."""
FARTHEST = 10_000.0
"""No coordinate (m) or angle (degrees) of a house is beyond this: a larger one is a typo or hostile input."""
MAX_NESTING = 16
"""How deep things may lie in things; in ProcTHOR's houses it is three."""


class _Node(BaseModel):
    model_config = ConfigDict(
        extra="allow", frozen=True, allow_inf_nan=False, alias_generator=to_camel, populate_by_name=True
    )


class Point(_Node):
    """x, y, z in metres (THOR's frame), or degrees for a rotation."""

    x: float = Field(allow_inf_nan=False, ge=-FARTHEST, le=FARTHEST)
    y: float = Field(allow_inf_nan=False, ge=-FARTHEST, le=FARTHEST)
    z: float = Field(allow_inf_nan=False, ge=-FARTHEST, le=FARTHEST)

    @property
    def vec(self) -> Vec3:
        """The same as a tuple."""
        return Vec3(self.x, self.y, self.z)


class Color(_Node):
    """Red, green and blue in 0..1."""

    r: float
    g: float
    b: float


class MaterialRef(_Node):
    """A material by name, maybe tinted."""

    name: str
    color: Color | None = None


class Room(_Node):
    """A room: its floor polygon and material."""

    id: str
    room_type: str
    floor_polygon: list[Point] = Field(min_length=3)
    floor_material: MaterialRef


class Wall(_Node):
    """A wall panel: a vertical quad seen from one side."""

    id: str
    room_id: str
    polygon: list[Point] = Field(min_length=4, max_length=4)
    material: MaterialRef


class Opening(_Node):
    """A hole in a pair of wall panels, with what fills it. Coordinates run along `wall0`."""

    id: str
    asset_id: str
    room0: str
    room1: str
    wall0: str
    wall1: str | None = None
    hole_polygon: list[Point] = Field(min_length=2)
    asset_position: Point | None = None


class Door(Opening):
    """A door, doorway or open frame."""

    openable: bool | None = None
    openness: float | None = None


class Window(Opening):
    """A window."""


class HouseObject(_Node):
    """A thing; `position` is the centre of its bounding box."""

    id: str
    asset_id: str
    position: Point
    rotation: Point
    kinematic: bool = True
    children: list["HouseObject"] = Field(default_factory=list)
    openness: float | None = None
    is_on: bool | None = None
    is_dirty: bool | None = None


class Light(_Node):
    """A light: `directional`, or a room's `point` light."""

    id: str
    type: str
    position: Point
    intensity: float = 1.0
    rgb: Color = Color(r=1.0, g=1.0, b=1.0)


class ProceduralParameters(_Node):
    """Lights, ceiling and sky."""

    lights: list[Light] = Field(default_factory=list)
    ceiling_material: MaterialRef | None = None
    skybox_id: str | None = None


class HouseDocument(_Node):
    """The whole document as ProcTHOR writes it."""

    rooms: list[Room] = Field(min_length=1)
    walls: list[Wall]
    doors: list[Door]
    windows: list[Window]
    objects: list[HouseObject]
    procedural_parameters: ProceduralParameters
    metadata: dict[str, Any] = Field(default_factory=dict)


class House:
    """A house document with its name and hash."""

    def __init__(self, name: str, data: dict[str, Any]) -> None:
        """`data` is the JSON document. Raises HouseError."""
        self.name = name
        self.data = data
        try:
            self.document = HouseDocument.model_validate(data)
        except ValidationError as error:
            raise HouseError(_first_fault(name, error)) from None
        _check_references(name, self.document)

    @cached_property
    def sha256(self) -> str:
        """SHA-256 of the canonical JSON (sorted keys, no white space). Raises HouseError when it has none."""
        return hashlib.sha256(self._canonical()).hexdigest()

    @property
    def start(self) -> Pose | None:
        """The start pose that the document proposes (`metadata.agent`), on the floor; None without one.

        Raises HouseError when what is there is no pose.
        """
        agent = self.document.metadata.get("agent")
        if not isinstance(agent, dict):
            return None
        try:
            position, rotation = agent["position"], agent["rotation"]
            yaw = rotation["y"] if isinstance(rotation, dict) else rotation
            place = Vec3(position["x"], 0.0, position["z"])
            return Pose(position=place, rotation=yaw, horizon=agent.get("horizon", 30))
        except (KeyError, TypeError, ValueError):
            raise HouseError(
                f"House {self.name!r}: metadata.agent is no start pose; it needs position (x, z) and rotation (y)."
            ) from None

    def objects(self) -> list[tuple[HouseObject, str | None]]:
        """Returns every object with its parent's id, parents before children, in document order."""
        found: list[tuple[HouseObject, str | None]] = []

        def visit(nodes: list[HouseObject], parent: str | None) -> None:
            for node in nodes:
                found.append((node, parent))
                visit(node.children, node.id)

        visit(self.document.objects, None)
        return found

    def save(self, path: Path) -> None:
        """Writes the document as canonical JSON. Raises HouseError when it has none."""
        path.write_bytes(self._canonical() + b"\n")

    def _canonical(self) -> bytes:
        try:
            return canonical_json(self.data)
        except UnicodeEncodeError as error:
            raise HouseError(
                f"House {self.name!r}: {error.object[error.start : error.end]!r} is half a character (a lone "
                "surrogate), which UTF-8 cannot hold. Mend the string that has it."
            ) from None
        except ValueError:
            raise HouseError(
                f"House {self.name!r}: a number in it is NaN or infinite, which JSON does not have. Mend that number."
            ) from None

    @classmethod
    def load(cls, path: Path) -> "House":
        """Returns the house in a JSON file; its name is the file's stem. Raises HouseError."""
        if not path.is_file():
            what = "is no file" if path.exists() else "does not exist"
            raise HouseError(f"House file {str(path)!r} {what}. Give the path of a ProcTHOR house JSON file.")
        if path.stat().st_size > MAX_HOUSE_BYTES:
            raise HouseError(f"House file {str(path)!r} is over {MAX_HOUSE_BYTES // 2**20} MiB; is it one house?")
        try:
            data = read_json(path.read_bytes())
        except ValueError as error:
            raise HouseError(f"House file {str(path)!r} is not JSON: {error}.") from None
        if not isinstance(data, dict):
            raise HouseError(f"House file {str(path)!r} holds a {type(data).__name__}; a house is one JSON object.")
        return cls(path.stem, data)


def canonical_json(data: Any) -> bytes:
    """Returns the one byte form of a JSON value: sorted keys, no white space, UTF-8."""
    return json.dumps(data, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False).encode()


def _first_fault(name: str, error: ValidationError) -> str:
    more = f" ({error.error_count() - 1} more)" if error.error_count() > 1 else ""
    return f"House {name!r}: {first_fault(error)}{more}. A house is a ProcTHOR document of schema 1.0.0."


def _check_references(name: str, document: HouseDocument) -> None:
    rooms, walls = {room.id for room in document.rooms}, {wall.id for wall in document.walls}
    openings = [*document.doors, *document.windows]
    if len(openings) > MAX_OPENINGS:
        raise HouseError(f"House {name!r}: {len(openings)} doors and windows, more than the limit of {MAX_OPENINGS}.")
    for opening in openings:
        for room in (opening.room0, opening.room1):
            if room not in rooms:
                raise HouseError(f"House {name!r}: opening {opening.id!r} names room {room!r}, absent from `rooms`.")
        if opening.wall0 not in walls:
            raise HouseError(f"House {name!r}: {opening.id!r} has wall0 {opening.wall0!r}, absent from `walls`.")
    seen: set[str] = set()
    stack = [(node, 1) for node in document.objects]
    while stack:
        node, depth = stack.pop()
        if depth > MAX_NESTING:
            raise HouseError(
                f"House {name!r}: object {node.id!r} lies {depth} deep in other things, more than the limit of "
                f"{MAX_NESTING}. Is a thing its own child?"
            )
        if node.id in seen:
            raise HouseError(f"House {name!r}: two objects have the id {node.id!r}; ids must be unique.")
        seen.add(node.id)
        stack.extend((child, depth + 1) for child in node.children)
    if len(seen) > MAX_OBJECTS:
        raise HouseError(f"House {name!r}: {len(seen)} objects, more than the limit of {MAX_OBJECTS}.")
