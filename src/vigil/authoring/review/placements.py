"""Wrong placements of a thing: on top of a receptacle instead of inside, inside instead of on top, or next to it."""

from collections.abc import Iterator

import numpy as np

from vigil.assets.catalog import CATALOG
from vigil.base.geometry import Vec3
from vigil.protocol.world import Placement
from vigil.scene.geometry import body_box, box_distances
from vigil.scene.supports import ancestors, contents, ends_lying_on, level_surfaces
from vigil.scene.things import Scene, Thing
from vigil.sim.core.placing import open_surfaces

GRID = 15
"""Number of points along each side of a surface that are tried as places for a thing."""
MAX_NEIGHBOURS = 2


def placements_on(receptacle: Thing, thing: Thing, *, inside: bool) -> Iterator[Placement]:
    """Yield placements in the middle of each level surface: those inside a receptacle if `inside`, else those on it."""
    for surface, frame in level_surfaces(receptacle):
        if surface.is_inside == inside:
            yield _placement(frame.shift, thing, receptacle)


def placements_in_openings(scene: Scene, receptacle: Thing, thing: Thing) -> Iterator[Placement]:
    """Yield placements inside a receptacle, or inside something in it, that do not count as on the receptacle.

    There is at most one placement for each category of container, e.g. one in a drawer and one in a microwave.
    """
    found: dict[str, Placement] = {}
    for bearer in (receptacle, *contents(scene, receptacle.id)):
        for surface, frame in level_surfaces(bearer):
            if ends_lying_on(bearer, surface, receptacle):
                found.setdefault(bearer.category, _placement(frame.shift, thing, bearer))
    yield from found.values()


def placements_on_neighbours(scene: Scene, receptacle: Thing, thing: Thing) -> Iterator[Placement]:
    """Yield placements of a thing on other receptacles, the nearest first, each as near to `receptacle` as possible."""
    found = [
        (away, other.id, place)
        for other in scene.things.values()
        if _takes(other, thing) and receptacle.id not in {each.id for each in (other, *ancestors(scene, other))}
        for away, place in _placements_near(other, receptacle, thing)
    ]
    nearest: dict[str, Placement] = {}
    for _, other, place in sorted(found, key=lambda each: each[:2]):
        nearest.setdefault(other, place)
    yield from list(nearest.values())[:MAX_NEIGHBOURS]


def _takes(other: Thing, thing: Thing) -> bool:
    takes = CATALOG[other.category].can_hold(CATALOG[thing.category])
    return takes and other.is_receptacle and other.is_present and not other.is_held and other.id != thing.id


def _placements_near(other: Thing, receptacle: Thing, thing: Thing) -> Iterator[tuple[float, Placement]]:
    """Yield, for each open surface of `other`, the placement nearest to a receptacle, with its distance (m)."""
    box = body_box(receptacle)
    for surface, frame in open_surfaces(other):
        along = np.linspace(-0.5, 0.5, GRID)
        x, z = (axis.ravel() for axis in np.meshgrid(along * surface.size_x, along * surface.size_z))
        spots = frame(np.column_stack([x, np.zeros(len(x)), z]))
        away = box_distances(box, spots[:, [0, 2]])
        away[away == 0.0] = np.inf
        nearest = int(away.argmin())
        if np.isfinite(away[nearest]):
            yield round(float(away[nearest]), 6), _placement(spots[nearest], thing, other)


def _placement(point: np.ndarray, thing: Thing, parent: Thing) -> Placement:
    x, y, z = (float(value) for value in point)
    position = Vec3(x, y + thing.asset.size.y / 2, z)
    return Placement(position=position, rotation=Vec3(0.0, thing.rotation.y, 0.0), parent=parent.id)
