"""House: a ProcTHOR house document (JSON, schema 1.0.0), loaded, saved and hashed.

Unknown keys are preserved, so that a house that is loaded and saved again is the same document. Keys that have a
default in AI2-THOR may be missing or null. This module handles only the document: `vigil.scene.build` defines what the
objects look like and do, and `vigil.scene.keys` lists what happens to the keys that this module does not read.
"""

import hashlib
import json
import re
from functools import cached_property
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator
from pydantic.alias_generators import to_camel

from vigil.base.files import MIB, read_file
from vigil.base.geometry import Pose, Vec3
from vigil.base.json_files import is_object, read_json
from vigil.errors import HouseError, first_error
from vigil.protocol.house_conversion import euler_from_axis_angle, find_outdated_part

MAX_HOUSE_BYTES = 32 * MIB
MAX_OBJECTS = 5000
MAX_OPENINGS = 300
"""Maximum number of doors and windows; far more than a house of ten rooms has."""
MAX_MAGNITUDE = 10_000.0
"""Maximum coordinate (m) or angle (degrees) in a house. A larger value is a typo or hostile input."""
MAX_NESTING = 16
"""Maximum nesting depth of objects; ProcTHOR's houses nest three deep."""
LEVEL_TOLERANCE_M = 1e-4
"""Height difference (m) up to which corners of a wall count as equally low."""
EXTERIOR = "exterior"
"""Room name that means the outside of the house. A room that is null or "" also means the outside."""
ROOM_KINDS = {kind.lower(): kind for kind in ("Kitchen", "LivingRoom", "Bedroom", "Bathroom")}
SCHEMA = "1.0.0"


class _Values(BaseModel):
    model_config = ConfigDict(
        extra="allow", frozen=True, allow_inf_nan=False, alias_generator=to_camel, populate_by_name=True
    )


class _Node(_Values):
    @model_validator(mode="before")
    @classmethod
    def _leave_out_null(cls, data: Any) -> Any:
        return {key: value for key, value in data.items() if value is not None} if is_object(data) else data


class Point(_Values):
    """Point x, y, z in metres (THOR's frame). For points of a floor, y may be missing and is then 0."""

    x: float = Field(allow_inf_nan=False, ge=-MAX_MAGNITUDE, le=MAX_MAGNITUDE)
    y: float = Field(default=0.0, allow_inf_nan=False, ge=-MAX_MAGNITUDE, le=MAX_MAGNITUDE)
    z: float = Field(allow_inf_nan=False, ge=-MAX_MAGNITUDE, le=MAX_MAGNITUDE)

    @property
    def vec(self) -> Vec3:
        """The point as a tuple (x, y, z)."""
        return Vec3(self.x, self.y, self.z)


class HolePoint(Point):
    """Corner of a hole in a wall: x along the wall and y up, in metres; z is not used."""

    z: float = Field(default=0.0, allow_inf_nan=False, ge=-MAX_MAGNITUDE, le=MAX_MAGNITUDE)


class Rotation(HolePoint):
    """Euler angles in degrees. A rotation by `degrees` about an `axis` is converted to Euler angles."""

    x: float = Field(default=0.0, allow_inf_nan=False, ge=-MAX_MAGNITUDE, le=MAX_MAGNITUDE)

    @model_validator(mode="before")
    @classmethod
    def _as_angles(cls, data: Any) -> Any:
        if not is_object(data) or data.get("axis") is None or any(data.get(side) is not None for side in "xyz"):
            return data
        about = _AxisAngle.model_validate(data)
        return dict(zip("xyz", euler_from_axis_angle(about.axis.vec, about.degrees), strict=True))


class _AxisAngle(_Values):
    axis: Point
    degrees: float = Field(ge=-MAX_MAGNITUDE, le=MAX_MAGNITUDE)


class Color(_Values):
    """Red, green and blue in 0..1."""

    r: float
    g: float
    b: float


class MaterialRef(_Node):
    """A material by name, with an optional tint."""

    name: str = ""
    color: Color | None = None


class Ceiling(_Node):
    """The ceiling of one room."""

    material: MaterialRef | None = None


class Room(_Node):
    """A room: its type, floor polygon, floor material and ceilings."""

    id: str
    room_type: str = ""
    floor_polygon: list[Point] = Field(min_length=3)
    floor_material: MaterialRef = MaterialRef()
    ceilings: list[Ceiling] = Field(default_factory=list[Ceiling])

    @property
    def kind(self) -> str:
        """Room type in ProcTHOR's spelling (a "living room" is a LivingRoom); other types are unchanged."""
        return ROOM_KINDS.get(re.sub(r"[^a-z]", "", self.room_type.lower()), self.room_type)


class Wall(_Node):
    """A wall panel: a vertical quad, visible from one side. If `empty`, it is an open boundary of two rooms."""

    id: str
    room_id: str = ""
    polygon: list[Point] = Field(min_length=4)
    material: MaterialRef = MaterialRef()
    empty: bool = False

    @property
    def ends(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """First two bottom corners (x, z) of the wall. If the wall has only one bottom corner, both are this corner."""
        bottom = min(corner.y for corner in self.polygon)
        low = [(corner.x, corner.z) for corner in self.polygon if corner.y <= bottom + LEVEL_TOLERANCE_M]
        return low[0], low[min(1, len(low) - 1)]

    @property
    def is_exterior(self) -> bool:
        """Whether the panel faces outside the house."""
        return EXTERIOR in self.room_id or EXTERIOR in self.id.split("|")


class Opening(_Node):
    """A hole in a pair of wall panels, with the door or window in the hole. Coordinates are along `wall0`."""

    id: str
    asset_id: str
    room0: str = ""
    room1: str = ""
    wall0: str
    wall1: str = ""
    hole_polygon: list[HolePoint] = Field(min_length=2)

    @property
    def joins_rooms(self) -> bool:
        """Whether the opening is between two rooms; otherwise it leads outside."""
        return self.room0 != self.room1 and not (is_outside(self.room0) or is_outside(self.room1))


class Door(Opening):
    """A door, doorway or open frame."""

    openable: bool | None = None
    openness: float | None = None


class Window(Opening):
    """A window in a wall."""


class HouseObject(_Node):
    """An object; `position` is the centre of its bounding box."""

    id: str
    asset_id: str
    object_name: str | None = Field(default=None, alias="object_name")
    position: Point
    rotation: Rotation
    children: list["HouseObject"] = Field(default_factory=list["HouseObject"])
    openness: float | None = None
    is_on: bool | None = None
    is_dirty: bool | None = None

    @property
    def name_in_house(self) -> str:
        """Name of the object in the house. It is `object_name` in Holodeck's houses, which have this separate key."""
        return self.object_name or self.id


class Light(_Node):
    """A light: `directional`, or a room's `point` light."""

    id: str
    type: str
    position: Point
    intensity: float = 1.0
    rgb: Color = Color(r=1.0, g=1.0, b=1.0)


class ProceduralParameters(_Node):
    """The lights and the ceiling material of a house document."""

    lights: list[Light] = Field(default_factory=list[Light])
    ceiling_material: MaterialRef | None = None


class HouseDocument(_Node):
    """A house document, as ProcTHOR writes it."""

    rooms: list[Room] = Field(default_factory=list[Room])
    walls: list[Wall] = Field(default_factory=list[Wall])
    doors: list[Door] = Field(default_factory=list[Door])
    windows: list[Window] = Field(default_factory=list[Window])
    objects: list[HouseObject] = Field(default_factory=list[HouseObject])
    procedural_parameters: ProceduralParameters = ProceduralParameters()
    metadata: dict[str, Any] = Field(default_factory=dict)


class House:
    """A house document with its name and hash. Unknown keys are preserved."""

    def __init__(self, name: str, data: dict[str, Any]) -> None:
        """`data` is the house document, as parsed from JSON. Raises HouseError if the document is not valid."""
        self.name = name
        self.data = data
        older = find_outdated_part(data)
        if older is not None:
            raise HouseError(
                f"House {name!r} is of an older schema than {SCHEMA}: {older}. Convert the house to {SCHEMA} with "
                "ProcTHOR's `scripts/upgrade_house.py`."
            )
        try:
            self.document = HouseDocument.model_validate(data)
        except ValidationError as error:
            more = f" ({error.error_count() - 1} more)" if error.error_count() > 1 else ""
            raise HouseError(
                f"House {name!r}: {first_error(error)}{more}. A house is a ProcTHOR document of schema 1.0.0."
            ) from None
        _check_references(name, self.document)

    @cached_property
    def sha256(self) -> str:
        """SHA-256 of the canonical JSON (sorted keys, no white space). Raises HouseError if the data is not JSON."""
        return hashlib.sha256(self._canonical()).hexdigest()

    @property
    def start(self) -> Pose | None:
        """The start pose that the document proposes, on the floor; None if the document does not propose a pose.

        The pose is `metadata.agent`, or else the default of `metadata.agentPoses`. Raises HouseError if the value in
        the document is not a pose.
        """
        agent, poses = (self.document.metadata.get(key) for key in ("agent", "agentPoses"))
        if agent is None and is_object(poses):
            agent = poses.get("default")
        if not is_object(agent):
            return None
        try:
            position, rotation = agent["position"], agent["rotation"]
            yaw = rotation["y"] if is_object(rotation) else rotation
            place = Vec3(position["x"], 0.0, position["z"])
            return Pose(position=place, rotation=yaw, horizon=agent.get("horizon", 30))
        except (KeyError, TypeError, ValueError):
            raise HouseError(
                f"House {self.name!r}: metadata.agent is not a start pose; it needs position (x, z) and rotation (y)."
            ) from None

    def may_contain(self, object_id: str) -> bool:
        """Return whether the document has an object or opening with that id, or furniture that may have a drawer with
        that id.

        The document does not list the drawers of furniture: the furniture's shape decides which drawers it has.
        """
        return object_id in self.ids or any(
            object_id.startswith(start) and object_id.removeprefix(start).isdecimal() for start in self._drawer_starts
        )

    @cached_property
    def ids(self) -> frozenset[str]:
        """Ids of all objects, doors and windows in the document."""
        openings = [*self.document.doors, *self.document.windows]
        return frozenset(each.id for each in [*openings, *(node for node, _ in self.objects())])

    @cached_property
    def _drawer_starts(self) -> frozenset[str]:
        return frozenset(drawer_id(node.id, "") for node, _ in self.objects())

    def objects(self) -> list[tuple[HouseObject, str | None]]:
        """Return every object with its parent's id, parents before children, in document order."""
        found: list[tuple[HouseObject, str | None]] = []

        def visit(nodes: list[HouseObject], parent: str | None) -> None:
            for node in nodes:
                found.append((node, parent))
                visit(node.children, node.id)

        visit(self.document.objects, None)
        return found

    def save(self, path: Path) -> None:
        """Write the document as canonical JSON. Raises HouseError if the document is not valid JSON."""
        path.write_bytes(self._canonical() + b"\n")

    def _canonical(self) -> bytes:
        try:
            return canonical_json(self.data)
        except UnicodeEncodeError as error:
            raise HouseError(
                f"House {self.name!r}: {error.object[error.start : error.end]!r} is an unpaired surrogate, "
                "which UTF-8 cannot encode. Fix the string that contains it."
            ) from None
        except ValueError:
            raise HouseError(
                f"House {self.name!r}: a number in it is NaN or infinite, which JSON does not have. Fix that number."
            ) from None

    @classmethod
    def load(cls, path: Path, sha256: str | None = None) -> "House":
        """Return the house in a JSON file; its name is the file's stem.

        Raises HouseError if the file is not a valid house, or if `sha256` is given and the house has another hash.
        """
        what = f"House file {str(path)!r}"
        if not path.exists():
            raise HouseError(f"{what} does not exist. Give the path of a ProcTHOR house JSON file.")
        house = cls.from_json(path.stem, read_file(path, what, HouseError, MAX_HOUSE_BYTES), what)
        if sha256 not in (None, house.sha256):
            raise HouseError(
                f"{what} has SHA-256 {house.sha256[:12]}..., expected {str(sha256)[:12]}.... It has been "
                "changed: restore it from a copy."
            )
        return house

    @classmethod
    def from_json(cls, name: str, data: bytes, what: str) -> "House":
        """Return the house in `data`, the bytes of a JSON file that messages call `what`. Raises HouseError."""
        try:
            found = read_json(data)
        except ValueError as error:
            raise HouseError(f"{what} is not JSON: {error}.") from None
        if not is_object(found):
            raise HouseError(f"{what} holds a {type(found).__name__}; a house is one JSON object.")
        return cls(name, found)


def canonical_json(data: Any) -> bytes:
    """Return the canonical bytes of a JSON value: sorted keys, without white space, UTF-8."""
    return json.dumps(data, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False).encode()


def drawer_id(chest_id: str, name: str) -> str:
    """Return the object id of a drawer: "Drawer|2|5|Dresser0" is drawer 0 of "Dresser|2|5"."""
    kind, _, rest = chest_id.partition("|")
    number = name.removeprefix("drawer")
    return f"Drawer|{rest}|{kind}{number}" if rest else f"Drawer|{chest_id}|{number}"


def is_outside(room: str) -> bool:
    """Return whether a room name in a door, window or wall means the outside of the house."""
    return not room or EXTERIOR in room


def _check_references(name: str, document: HouseDocument) -> None:
    rooms, walls = {room.id for room in document.rooms}, {wall.id for wall in document.walls}
    openings = [*document.doors, *document.windows]
    if not rooms:
        raise HouseError(f"House {name!r} has no rooms. A house has at least one, with its `floorPolygon`.")
    if len(openings) > MAX_OPENINGS:
        raise HouseError(f"House {name!r}: {len(openings)} doors and windows, more than the limit of {MAX_OPENINGS}.")
    for opening in openings:
        for room in (opening.room0, opening.room1):
            if room not in rooms and not is_outside(room):
                raise HouseError(f"House {name!r}: opening {opening.id!r} names room {room!r}, absent from `rooms`.")
        if opening.wall0 not in walls:
            raise HouseError(f"House {name!r}: {opening.id!r} has wall0 {opening.wall0!r}, absent from `walls`.")
    seen: set[str] = set()
    stack = [(node, 1) for node in document.objects]
    while stack:
        node, depth = stack.pop()
        if depth > MAX_NESTING:
            raise HouseError(
                f"House {name!r}: object {node.id!r} is inside or on a chain of {depth} objects, more than the limit "
                f"of {MAX_NESTING}. Is an object its own child?"
            )
        if node.id in seen:
            raise HouseError(f"House {name!r}: two objects have the id {node.id!r}; ids must be unique.")
        seen.add(node.id)
        stack.extend((child, depth + 1) for child in node.children)
    if len(seen) > MAX_OBJECTS:
        raise HouseError(f"House {name!r}: {len(seen)} objects, more than the limit of {MAX_OBJECTS}.")
