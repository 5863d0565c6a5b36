"""What to call one drawer of several: by its row from above and its column from the left, as seen from the front.

"The top drawer of the side table", "the second drawer from above of the dresser", "the upper left drawer of the TV
stand". The furniture is always said: alone, "the top drawer" could be another's.
"""

from collections.abc import Callable

import numpy as np

from vigil.assets.catalog import CATALOG
from vigil.base.geometry import rotate_floor
from vigil.scene.supports import drawers_of
from vigil.scene.things import Scene, Thing

OF = " of the "
"""Between a drawer and its furniture in a name."""
DRAWER = "drawer"
SAME_ROW_M = 0.05
"""Drawers whose middles differ by less are in one row, or in one column."""
ORDINALS = ("first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth")


def drawer_name(scene: Scene, drawer: Thing) -> str:
    """Return what a drawer is called in its furniture; a bare "drawer" where its drawers stand in no full grid."""
    chest = scene.things[drawer.parent or ""]
    display_name = CATALOG[chest.category].display_name
    places = {part.id: _place(chest, part) for part in drawers_of(scene, chest)}
    rows = _steps([-height for _, height in places.values()])
    columns = _steps([along for along, _ in places.values()])
    along, height = places[drawer.id]
    if len(rows) * len(columns) != len(places) or len(rows) > len(ORDINALS) or len(columns) > 3:
        return f"{DRAWER}{OF}{display_name}"
    return (
        f"{_drawer_in_grid(_index(rows, -height), len(rows), _index(columns, along), len(columns))}{OF}{display_name}"
    )


def is_drawer(name: str) -> bool:
    """Whether a name is a drawer's, or the bare word."""
    return OF in name or name == DRAWER


def without_position(name: str) -> str:
    """Return a name without which of several drawers it is."""
    return DRAWER if OF in name else name


def furniture_of(name: str) -> str | None:
    """Return the furniture that a drawer's name speaks of; None for any other name."""
    return name.partition(OF)[2] or None


def fits(said: str, name: str, furniture_fits: Callable[[str, str], bool]) -> bool:
    """Whether a listener could take what is named `name` for what is `said`, where one of them is a drawer.

    `furniture_fits` says so of the furniture: who takes a TV stand for a dresser looks for its top drawer.
    """
    which, _, whole = said.partition(OF)
    drawer, _, of = name.partition(OF)
    if not is_drawer(name) or not is_drawer(said):
        return False
    return said == DRAWER or (which == drawer and furniture_fits(whole, of))


def _place(chest: Thing, part: Thing) -> tuple[float, float]:
    """Return how far (m) a drawer is to the right, for who looks at the front, and how high."""
    x, _ = rotate_floor(part.position.x - chest.position.x, part.position.z - chest.position.z, -chest.rotation.y)
    return -x, part.position.y


def _steps(values: list[float]) -> list[float]:
    """Return the values that are apart, in order."""
    found: list[float] = []
    for value in sorted(values):
        if not found or value > found[-1] + SAME_ROW_M:
            found.append(value)
    return found


def _index(steps: list[float], value: float) -> int:
    return int(np.abs(np.array(steps) - value).argmin())


def _drawer_in_grid(row: int, rows: int, column: int, columns: int) -> str:
    """Return which drawer of a grid it is, in words; row 0 is the top one, column 0 the left one."""
    side = {1: ("",), 2: ("left ", "right "), 3: ("left ", "middle ", "right ")}[columns][column]
    if rows == 1:
        return f"{side}{DRAWER}"
    if columns == 1:
        ends = {0: f"top {DRAWER}", rows - 1: f"bottom {DRAWER}"}
        return ends.get(row, f"{ORDINALS[row]} {DRAWER} from above")
    if rows == 2:
        return f"{('upper', 'lower')[row]} {side}{DRAWER}"
    ends = {0: f"top {side}{DRAWER}", rows - 1: f"bottom {side}{DRAWER}"}
    return ends.get(row, f"{side}{DRAWER} in the {ORDINALS[row]} row from above")
