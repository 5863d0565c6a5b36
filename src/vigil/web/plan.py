"""Floor plans as shapes for SVG, in metres: x points to the right, y points down, and north (+z) is up, so y = -z."""

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

from vigil.assets.database import AssetDatabase
from vigil.errors import VigilError
from vigil.protocol.episode import Episode
from vigil.protocol.house import House
from vigil.scene.build import build_scene
from vigil.scene.plan import FloorPlan, PlanLabel, PlanRoom, floor_plan
from vigil.scene.things import Thing
from vigil.web.films.plan import FilmPlan
from vigil.web.library import LibraryPack

TEXT_SHARE = 0.026
"""Height of the letters as a share of the plan's width; at this height, they are legible on the pages."""
PAGE_ASPECT = 1.2
"""Width divided by height of the area that pages give to a plan."""


class SvgShape(NamedTuple):
    """A shape of the plan. A line has two points, a dot has one."""

    kind: str
    id: str
    points: str


@dataclass(frozen=True, slots=True)
class PlanDrawing:
    """The plan of a house, seen from above, as shapes and labels for SVG."""

    view_box: str
    text_m: float
    """Height (m) of the letters."""
    shapes: tuple[SvgShape, ...]
    labels: tuple[PlanLabel, ...]
    rooms: tuple[PlanRoom, ...]
    things: tuple[Thing, ...]


def plan_of(house: House, assets: AssetDatabase) -> PlanDrawing:
    """Return the drawing of a house's plan."""
    things = _built(house, assets)
    plan = floor_plan(house, things)
    low, high = plan.bounds
    width, height = (float(value) for value in high - low)
    text_m = TEXT_SHARE * max(width, height * PAGE_ASPECT)
    return PlanDrawing(
        view_box=f"{low[0]:.3f} {-high[1]:.3f} {width:.3f} {height:.3f}",
        text_m=text_m,
        shapes=tuple(
            SvgShape(shape.kind, shape.id, " ".join(f"{x:.3f},{-z:.3f}" for x, z in shape.points.tolist()))
            for shape in plan.shapes
        ),
        labels=tuple(plan.labels(text_m)),
        rooms=plan.rooms,
        things=tuple(things),
    )


def floor_plan_of(house: House, assets: AssetDatabase) -> FloorPlan:
    """Return the floor plan of a house; it has no furniture if the objects of the house cannot be built."""
    return floor_plan(house, _built(house, assets))


def _built(house: House, assets: AssetDatabase) -> list[Thing]:
    try:
        return list(build_scene(house, assets).things.values())
    except VigilError:
        return []


_cached_plan = lru_cache(maxsize=32)(plan_of)


def try_plan(pack: LibraryPack, episode: Episode) -> PlanDrawing | None:
    """Return the floor plan of an episode's house; None if the house cannot be read."""
    try:
        return _cached_plan(pack.house(episode.house.name), pack.assets)
    except VigilError:
        return None


def try_film_plan(pack: LibraryPack, episode: Episode) -> FilmPlan | None:
    """Return the floor plan of an episode's house for a film; None if the house cannot be read."""
    try:
        return FilmPlan(floor_plan_of(pack.house(episode.house.name), pack.assets))
    except VigilError:
        return None
