"""Names of single drawers, by their row from above and their column from the left, as seen from the front.

Examples are "the top drawer of the side table", "the second drawer from above of the dresser" and "the upper left
drawer of the TV stand". The name includes the furniture, since "the top drawer" could be one of another piece.
"""

from collections.abc import Callable

import numpy as np

from vigil.assets.catalog import CATALOG
from vigil.base.geometry import rotate_floor
from vigil.scene.supports import drawers_of
from vigil.scene.things import Scene, Thing

OF = " of the "
"""Text between a drawer and its furniture in a name."""
DRAWER = "drawer"
SAME_ROW_M = 0.05
"""Greatest distance (m) between the middles of drawers in one row, or in one column."""
MAX_COLUMNS = 3
"""Number of columns that words can tell apart: left, middle and right."""
ORDINALS = ("first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth")


def drawer_name(scene: Scene, drawer: Thing) -> str:
    """Return a drawer's name with its furniture.

    It does not say which drawer it is if the drawers do not form a full grid, or one that words cannot describe.
    """
    chest = scene.things[drawer.parent or ""]
    display_name = CATALOG[chest.category].display_name
    places = {part.id: _place(chest, part) for part in drawers_of(scene, chest)}
    rows = _steps([-height for _, height in places.values()])
    columns = _steps([along for along, _ in places.values()])
    along, height = places[drawer.id]
    if len(rows) * len(columns) != len(places) or len(rows) > len(ORDINALS) or len(columns) > MAX_COLUMNS:
        return f"{DRAWER}{OF}{display_name}"
    return (
        f"{_drawer_in_grid(_index(rows, -height), len(rows), _index(columns, along), len(columns))}{OF}{display_name}"
    )


def is_drawer(name: str) -> bool:
    """Return whether a name is that of a drawer, or the bare word."""
    return OF in name or name == DRAWER


def without_position(name: str) -> str:
    """Return "drawer" for the name of a drawer, and any other name as it is."""
    return DRAWER if OF in name else name


def furniture_of(name: str) -> str | None:
    """Return the name of the furniture in a drawer's name; None for any other name."""
    return name.partition(OF)[2] or None


def fits(said: str, name: str, furniture_fits: Callable[[str, str], bool]) -> bool:
    """Return whether a listener could understand `said` as the thing named `name`, if both are drawers.

    `furniture_fits` says the same of two names of furniture: for a listener who calls a TV stand a dresser, the top
    drawer of the dresser is that of the TV stand.
    """
    which, _, whole = said.partition(OF)
    drawer, _, of = name.partition(OF)
    if not is_drawer(name) or not is_drawer(said):
        return False
    return said == DRAWER or (which == drawer and furniture_fits(whole, of))


def _place(chest: Thing, part: Thing) -> tuple[float, float]:
    """Return a drawer's offset (m) to the right as seen from the front, and its height (m)."""
    x, _ = rotate_floor(part.position.x - chest.position.x, part.position.z - chest.position.z, -chest.rotation.y)
    return -x, part.position.y


def _steps(values: list[float]) -> list[float]:
    """Return the values in order, without those at most `SAME_ROW_M` above the last returned one."""
    found: list[float] = []
    for value in sorted(values):
        if not found or value > found[-1] + SAME_ROW_M:
            found.append(value)
    return found


def _index(steps: list[float], value: float) -> int:
    return int(np.abs(np.array(steps) - value).argmin())


def _drawer_in_grid(row: int, rows: int, column: int, columns: int) -> str:
    """Return the words for a drawer's position in a grid; row 0 is the top one, column 0 the left one."""
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
