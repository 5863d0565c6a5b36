"""Assets with which a house can be furnished (`AssetModel`), and objects placed in a house (`PlacedObject`)."""

from dataclasses import dataclass, field
from functools import cached_property, lru_cache

import numpy as np

from vigil.assets.database import AssetDatabase, own_asset_id
from vigil.assets.kernel.asset import Asset, Surface
from vigil.base.geometry import Vec3, rotate_floor
from vigil.scene.geometry import joint_motion, solid_corners

OPENNESS_SAMPLES = tuple(step / 20 for step in range(1, 21))
"""Values of openness at which moving parts are examined."""
VARIANTS = 24
"""Number of variants in each category of the project's own assets; the generator draws one of them."""

Rect = tuple[float, float, float, float]
"""Rectangle x0, z0, x1, z1 (m) on the floor, with sides along the axes."""
Block = tuple[Rect, float, float]
"""Box with sides along the axes: its rectangle on the floor, and the heights (m) of its bottom and top."""


@dataclass(frozen=True, eq=False)
class AssetModel:
    """An asset, given by its id. Its shape is made on first use."""

    asset_id: str
    category: str
    size: Vec3
    variant: int

    @property
    def rect(self) -> Rect:
        """Rectangle that the asset's bounding box covers in the plan, in the asset's frame."""
        return -self.size.x / 2, -self.size.z / 2, self.size.x / 2, self.size.z / 2

    @cached_property
    def asset(self) -> Asset:
        """Shape of the asset."""
        from vigil.assets.making import make  # noqa: PLC0415 - reads the descriptions of all shapes

        return make(self.category, self.size, self.variant)


@lru_cache(maxsize=4096)
def asset_model(asset_id: str, category: str) -> AssetModel:
    """Return the asset with this id."""
    entry = AssetDatabase.default().look_up(asset_id, f"{category}|0|0")
    return AssetModel(asset_id, entry.category, entry.size, entry.variant)


def draw_model(category: str, rng: np.random.Generator, variants: int = VARIANTS) -> AssetModel:
    """Return a random asset of this category from the project's own assets."""
    return asset_model(own_asset_id(category, int(rng.integers(variants))), category)


def most_similar(model: AssetModel, choices: list[AssetModel]) -> AssetModel:
    """Return the asset in `choices` that has the most materials in common with `model`."""
    materials = {part.material for part in model.asset.parts}
    return max(choices, key=lambda choice: len(materials & {part.material for part in choice.asset.parts}))


@dataclass(slots=True, eq=False)
class PlacedObject:
    """An object at its place in the house; its children rest on or in it."""

    model: AssetModel
    position: Vec3
    """Centre of the bounding box."""
    yaw: float
    """Yaw (deg) of the object."""
    room: int
    """Number of the object's room."""
    children: list["PlacedObject"] = field(default_factory=list)
    surface: Surface | None = None
    """Surface of the parent on which the object rests; None for furniture and hanging objects."""
    openness: float | None = None
    is_on: bool | None = None
    is_dirty: bool | None = None
    is_on_wall: bool = False
    """Whether the object hangs on a wall or from the ceiling."""
    id: str = ""
    """Id of the object in the house document; it is assigned when the document is written."""

    @property
    def category(self) -> str:
        """Category in the catalogue."""
        return self.model.category

    @property
    def bottom(self) -> float:
        """Height (m) of the lowest face."""
        return self.position.y - self.model.size.y / 2

    @property
    def top(self) -> float:
        """Height (m) of the highest face."""
        return self.position.y + self.model.size.y / 2

    def to_floor_point(self, x: float, z: float) -> tuple[float, float]:
        """Return the floor point (m, house's frame) where the point (x, z) of the asset's frame lies."""
        dx, dz = rotate_floor(x, z, self.yaw)
        return self.position.x + dx, self.position.z + dz

    def footprint(self) -> Rect:
        """Return the rectangle, with sides along the axes, that contains the object's box."""
        return turned_rect(self.model.rect, self.position.x, self.position.z, self.yaw)

    def block(self) -> Block:
        """Return the block, with sides along the axes, that contains the object's box."""
        return self.footprint(), self.bottom, self.top

    def swing(self) -> Block | None:
        """Return the block through which the object's doors, drawers and lids move; None if it has none of these."""
        block = swing_of(self.model)
        if block is None:
            return None
        rect, bottom, top = block
        x, y, z = self.position
        return turned_rect(rect, x, z, self.yaw), y + bottom, y + top

    def with_contents(self) -> list["PlacedObject"]:
        """Return the object and everything on and in it."""
        return [self, *(piece for child in self.children for piece in child.with_contents())]


def turned_rect(rect: Rect, x: float, z: float, yaw: float) -> Rect:
    """Turn `rect` by `yaw` (deg), move it by (x, z), and return the rectangle with sides along the axes around it."""
    corners = [rotate_floor(rect[i], rect[j], yaw) for i in (0, 2) for j in (1, 3)]
    xs, zs = [corner[0] for corner in corners], [corner[1] for corner in corners]
    return x + min(xs), z + min(zs), x + max(xs), z + max(zs)


@lru_cache(maxsize=4096)
def swing_of(model: AssetModel) -> Block | None:
    """Return the block (asset's frame) through which the asset's moving parts move; None if nothing opens.

    Moving parts without a solid, which cannot hit anything, count only if no moving part has a solid.
    """
    joints = {joint.name: joint for joint in model.asset.joints}
    moving = [(joints[solid.joint], solid_corners(solid)) for solid in model.asset.solids if solid.joint in joints]
    drawn = [(joints[part.joint], part.mesh.vertices) for part in model.asset.parts if part.joint in joints]
    places = [
        joint_motion(joint, openness)(points) for joint, points in moving or drawn for openness in OPENNESS_SAMPLES
    ]
    if not places:
        return None
    corners = np.concatenate(places)
    (x0, y0, z0), (x1, y1, z1) = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
    return (x0, z0, x1, z1), y0, y1


def swept_rect(model: AssetModel) -> Rect | None:
    """Return the rectangle (asset's frame) over which the asset's moving parts move; None if nothing opens."""
    block = swing_of(model)
    return None if block is None else block[0]


@lru_cache(maxsize=4096)
def leaf_reach(model: AssetModel) -> float:
    """Return how far (m) the asset's doors and drawers reach in front of its box when they open."""
    rect = swept_rect(model)
    return 0.0 if rect is None else max(0.0, rect[3] - model.size.z / 2)
