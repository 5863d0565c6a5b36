"""Builder: puts an Asset together from meshes, joints, surfaces and solids.

Makers use the frame of `vigil.assets.kernel.asset`, but with y = 0 at the bottom of the box (x is in -width/2..width/2,
y in 0..height, z in -depth/2..depth/2). `build` moves the origin to the middle, and stretches the asset so that it
exactly fills the box that was asked for.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import shapely

from vigil.assets.kernel.asset import Asset, Glow, Joint, Mesh, Part, Solid, Surface
from vigil.assets.kernel.meshes import Point3, bounds, merge, scale, translate
from vigil.assets.kernel.shapes import span
from vigil.base.geometry import Vec3

Range = tuple[float, float]
UNBOUNDED_M = 10.0
"""Clearance (m) of a surface with nothing above it."""


@dataclass(frozen=True, slots=True)
class PartStyle:
    """Properties that all meshes of a part share; meshes with equal properties become one part.

    A part on a joint shows whether the asset is open. A part shows whether the asset is on if it has a material `lit`,
    or if it is drawn only in one of the two states (`shown`).
    """

    material: str
    joint: str | None = None
    lit: str | None = None
    """Name of the material while the asset is on; None if the material does not change."""
    shown: Literal["always", "on", "off"] = "always"
    opens: bool = False
    """Whether seeing this part shows that the asset is open. Parts on a joint always do."""
    toggles: bool = False
    """Whether the part counts as showing that the asset is on, although the part always looks the same."""


class Builder:
    """Collects the parts of one asset."""

    def __init__(self, category: str, size: Vec3) -> None:
        self.category = category
        self.width, self.height, self.depth = size
        self.across: Range = (-size.x / 2, size.x / 2)
        self.through: Range = (-size.z / 2, size.z / 2)
        self._size = size
        self._meshes: dict[PartStyle, list[Mesh]] = {}
        self._joints: list[Joint] = []
        self._surfaces: list[Surface] = []
        self._solids: list[Solid] = []
        self.glow: Glow | None = None

    def add(self, look: PartStyle | str, *meshes: Mesh) -> None:
        """Add meshes with the same look. If `look` is a string, it names a material, and the meshes are on the body."""
        key = PartStyle(look) if isinstance(look, str) else look
        self._meshes.setdefault(key, []).extend(meshes)

    def block(self, look: PartStyle | str, x: Range, y: Range, z: Range, bevel: float = 0.0) -> None:
        """Add a box, given by its range along each axis."""
        self.add(look, span((x[0], y[0], z[0]), (x[1], y[1], z[1]), bevel))

    def hinge(self, name: str, axis: Point3, origin: Point3, degrees: float) -> str:
        """Add a hinge (see `Joint.axis` for the direction) and return its name."""
        self._joints.append(Joint(name, "hinge", _vec(axis), _vec(origin), degrees))
        return name

    def slide(self, name: str, axis: Point3, metres: float) -> str:
        """Add a slide along a unit axis and return its name."""
        self._joints.append(Joint(name, "slide", _vec(axis), Vec3(0.0, 0.0, 0.0), metres))
        return name

    def surface(
        self,
        name: str,
        center: Point3,
        size: tuple[float, float],
        clearance: float = UNBOUNDED_M,
        *,
        is_inside: bool = False,
        needs_opening: bool = False,
        joint: str | None = None,
    ) -> None:
        """Add a surface on which things can be put; `size` is along x and z. `needs_opening` implies `is_inside`."""
        inside = is_inside or needs_opening
        self._surfaces.append(Surface(name, _vec(center), *size, clearance, inside, needs_opening, joint))

    def solid(self, low: Point3, high: Point3, joint: str | None = None) -> None:
        """Add the box between two corners as an obstacle."""
        self._solids.append(box_solid(low, high, joint))

    def prism(self, polygon: Iterable[Sequence[float]], bottom: float, top: float, joint: str | None = None) -> None:
        """Add an upright prism as an obstacle; its base is a convex polygon of (x, z)."""
        corners = tuple((float(x), float(z)) for x, z in polygon)
        self._solids.append(Solid(corners, float(bottom), float(top), joint))

    def walls(self, width: float, depth: float, floor: float, z: float = 0.0) -> None:
        """Add the obstacles of an open vessel at (0, z): its bottom up to the height `floor`, and four walls."""
        left, right, back, front = -width / 2, width / 2, z - depth / 2, z + depth / 2
        wall = 0.08 * min(width, depth)
        self.solid((left, 0, back), (right, floor, front))
        self.solid((left, floor, back), (left + wall, self.height, front))
        self.solid((right - wall, floor, back), (right, self.height, front))
        self.solid((left, floor, back), (right, self.height, back + wall))
        self.solid((left, floor, front - wall), (right, self.height, front))

    def octagon(self, width: float, depth: float, low: float, high: float) -> None:
        """Add an octagonal prism around the asset's middle as the obstacle of a round thing."""
        angles = np.arange(8) * np.pi / 4 + np.pi / 8
        self.prism(np.c_[width / 2 * np.cos(angles), depth / 2 * np.sin(angles)], low, high)

    def column(self, radius: float, bottom: float, top: float, center: tuple[float, float] = (0.0, 0.0)) -> None:
        """Add an upright octagonal prism as the obstacle of a round column."""
        angles = np.arange(8) * np.pi / 4
        self.prism(np.c_[center[0] + radius * np.cos(angles), center[1] + radius * np.sin(angles)], bottom, top)

    def build(self, tags: Iterable[str] = (), *, takes_room: bool = True) -> Asset:
        """Return the asset, stretched to its size. With `takes_room`, a body without solids gets its box as a solid."""
        merged = {look: merge(parts) for look, parts in self._meshes.items()}
        low, high = bounds(whole for look, whole in merged.items() if look.shown != "on")
        fit = _BoxFit(low, high, np.asarray(self._size, np.float64))
        parts = tuple(
            _part(f"{look.joint or 'body'}_{n}", look, fit.mesh(merged[look])) for n, look in enumerate(merged)
        )
        still = [part.mesh for part in parts if part.joint is None and part.shown != "on"]
        box = bounds(still or [part.mesh for part in parts])
        solids = tuple(clipped for solid in self._solids if (clipped := fit.solid(solid)) is not None)
        if takes_room and all(solid.joint is not None for solid in solids):
            solids = (box_solid(*box), *solids)
        half = np.asarray(self._size) / 2
        whole = bool(np.allclose(box[0], -half, atol=1e-4) and np.allclose(box[1], half, atol=1e-4))
        return Asset(
            category=self.category,
            size=Vec3(*map(float, self._size)),
            parts=parts,
            solids=solids,
            joints=tuple(fit.joint(joint) for joint in self._joints),
            surfaces=tuple(fit.surface(surface) for surface in self._surfaces),
            body=None if whole else (_vec(box[0]), _vec(box[1])),
            glow=None if self.glow is None else replace(self.glow, position=fit.point(self.glow.position)),
            tags=frozenset(tags),
        )


def _part(name: str, look: PartStyle, whole: Mesh) -> Part:
    return Part(
        name=name,
        mesh=whole,
        material=look.material,
        material_on=look.lit,
        joint=look.joint,
        bears_open=look.opens or look.joint is not None,
        bears_toggle=look.toggles or look.lit is not None or look.shown != "always",
        is_glass=look.material.partition("/")[0] in ("glass", "smoked_glass"),
        shown=look.shown,
    )


class _BoxFit:
    """The stretch and shift that turn one box into a box of a wanted size around the origin."""

    def __init__(self, low: np.ndarray, high: np.ndarray, size: np.ndarray) -> None:
        extent = high - low
        self.factor = np.where(extent > 1e-9, size / np.maximum(extent, 1e-9), 1.0)
        self.factor = np.where(np.abs(self.factor - 1) < 1e-6, 1.0, self.factor)
        self.middle = (low + high) / 2
        self.size = size

    def point(self, point: Point3) -> Vec3:
        return _vec((np.asarray(point, np.float64) - self.middle) * self.factor)

    def mesh(self, part: Mesh) -> Mesh:
        moved = translate(part, -self.middle)
        return moved if (self.factor == 1.0).all() else scale(moved, self.factor)

    def joint(self, joint: Joint) -> Joint:
        along = float(np.abs(np.asarray(joint.axis)) @ self.factor)
        travel = joint.travel * along if joint.kind == "slide" else joint.travel
        return replace(joint, origin=self.point(joint.origin), travel=travel)

    def surface(self, surface: Surface) -> Surface:
        clear = surface.clearance
        return replace(
            surface,
            center=self.point(surface.center),
            size_x=surface.size_x * float(self.factor[0]),
            size_z=surface.size_z * float(self.factor[2]),
            clearance=clear if clear >= UNBOUNDED_M else clear * float(self.factor[1]),
        )

    def solid(self, solid: Solid) -> Solid | None:
        """Return the part of a solid that is inside the box; None when no part is inside."""
        corners = (np.array(solid.polygon) - self.middle[[0, 2]]) * self.factor[[0, 2]]
        half_x, half_y, half_z = (float(length) / 2 for length in self.size)
        if (np.abs(corners) > [half_x, half_z]).any():
            inside = shapely.Polygon(corners).intersection(shapely.box(-half_x, -half_z, half_x, half_z))
            if not isinstance(inside, shapely.Polygon) or inside.is_empty:
                return None
            corners = np.array(inside.exterior.coords)[:-1]
        bottom, top = ((y - self.middle[1]) * self.factor[1] for y in (solid.bottom, solid.top))
        bottom, top = max(float(bottom), -half_y), min(float(top), half_y)
        if bottom >= top:
            return None
        return replace(solid, polygon=tuple((x, z) for x, z in corners.tolist()), bottom=bottom, top=top)


def box_solid(low: Point3, high: Point3, joint: str | None = None) -> Solid:
    """Return the solid between two corners."""
    (x0, y0, z0), (x1, y1, z1) = _vec(low), _vec(high)
    return Solid(((x0, z0), (x1, z0), (x1, z1), (x0, z1)), y0, y1, joint)


def _vec(point: Point3) -> Vec3:
    x, y, z = (float(value) for value in point)
    return Vec3(x, y, z)
