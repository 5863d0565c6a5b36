"""Names of single drawers: by row, counted from above, and by column, counted from the left as seen from the front.

Examples are "the top drawer of the side table", "the second drawer from above of the dresser" and "the upper left
drawer of the TV stand". The name includes the furniture, because "the top drawer" could be a drawer of other furniture.
"""

from collections.abc import Callable

import numpy as np

from vigil.assets.catalog import CATALOG
from vigil.base.geometry import rotate_floor
from vigil.scene.supports import drawers_of
from vigil.scene.things import Scene, Thing

OF = " of the "
"""Text between the drawer and its furniture in a name."""
DRAWER = "drawer"
SAME_ROW_M = 0.05
"""Maximum distance (m) between the middles of drawers in the same row or in the same column."""
MAX_COLUMNS = 3
"""Maximum number of columns that words can distinguish: left, middle and right."""
SIDES = {1: ("",), 2: ("left ", "right "), 3: ("left ", "middle ", "right ")}
"""Number of columns -> the word for each column, from the left."""
ORDINALS = ("first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth")


def drawer_name(scene: Scene, drawer: Thing) -> str:
    """Return a drawer's name, which includes its furniture.

    If the drawers do not form a full grid, or words cannot describe the grid, the name does not say which drawer it is.
    """
    display_name = CATALOG[scene.things[drawer.parent or ""].category].display_name
    place = _place_in_grid(scene, drawer)
    return f"{DRAWER if place is None else _drawer_in_grid(*place)}{OF}{display_name}"


def true_positions(scene: Scene, drawer: Thing) -> set[str]:
    """Return all words, such as "bottom drawer" or "second drawer from above", that are true of a drawer's position.

    "The bottom drawer" of a dresser with three rows is its third drawer from above, too.
    """
    place = _place_in_grid(scene, drawer)
    if place is None:
        return {DRAWER}
    row, rows, column, columns = place
    found = {DRAWER}
    for side in {"", SIDES[columns][column]}:
        found |= {f"{side}{DRAWER}", f"{ORDINALS[row]} {side}{DRAWER} from above"}
        found.add(f"{side}{DRAWER} in the {ORDINALS[row]} row from above")
        ends = (("top", "upper"), row == 0), (("bottom", "lower"), row == rows - 1)
        found |= {f"{word} {side}{DRAWER}" for words, is_end in ends if is_end for word in words}
    return found


def _place_in_grid(scene: Scene, drawer: Thing) -> tuple[int, int, int, int] | None:
    """Return a drawer's row, the number of rows, its column, and the number of columns.

    None if the drawers do not form a full grid, or if words cannot describe the grid.
    """
    chest = scene.things[drawer.parent or ""]
    places = {part.id: _place(chest, part) for part in drawers_of(scene, chest)}
    rows = _steps([-height for _, height in places.values()])
    columns = _steps([along for along, _ in places.values()])
    along, height = places[drawer.id]
    if len(rows) * len(columns) != len(places) or len(rows) > len(ORDINALS) or len(columns) > MAX_COLUMNS:
        return None
    return _index(rows, -height), len(rows), _index(columns, along), len(columns)


def is_drawer(name: str) -> bool:
    """Return whether a name is the name of a drawer, or the word "drawer" alone."""
    return OF in name or name == DRAWER


def without_position(name: str) -> str:
    """Return "drawer" if the name is that of a drawer; otherwise the name itself."""
    return DRAWER if OF in name else name


def furniture_name(name: str) -> str | None:
    """Return the name of the furniture in a drawer's name; None for any other name."""
    return name.partition(OF)[2] or None


def could_mean_drawer(said: str, name: str, furniture_fits: Callable[[str, str], bool]) -> bool:
    """Return whether `said` and `name` are drawers, and a listener could understand `said` as the drawer called `name`.

    `furniture_fits` decides the same for two names of furniture. If a TV stand may be called a dresser, "the top drawer
    of the dresser" may mean the drawer of the TV stand.
    """
    which, _, whole = said.partition(OF)
    drawer, _, of = name.partition(OF)
    if not is_drawer(name) or not is_drawer(said):
        return False
    return said == DRAWER or (which == drawer and furniture_fits(whole, of))


def _place(chest: Thing, part: Thing) -> tuple[float, float]:
    """Return a drawer's offset (m) to the right, seen from the front of the furniture, and the drawer's height (m)."""
    x, _ = rotate_floor(part.position.x - chest.position.x, part.position.z - chest.position.z, -chest.rotation.y)
    return -x, part.position.y


def _steps(values: list[float]) -> list[float]:
    """Return the values in ascending order; of values within `SAME_ROW_M` of each other, only the lowest is kept."""
    found: list[float] = []
    for value in sorted(values):
        if not found or value > found[-1] + SAME_ROW_M:
            found.append(value)
    return found


def _index(steps: list[float], value: float) -> int:
    return int(np.abs(np.array(steps) - value).argmin())


def _drawer_in_grid(row: int, rows: int, column: int, columns: int) -> str:
    """Return the words for a drawer's position in a grid. Row 0 is the top row, column 0 the left column."""
    side = SIDES[columns][column]
    if rows == 1:
        return f"{side}{DRAWER}"
    if columns == 1:
        ends = {0: f"top {DRAWER}", rows - 1: f"bottom {DRAWER}"}
        return ends.get(row, f"{ORDINALS[row]} {DRAWER} from above")
    if rows == 2:
        return f"{('upper', 'lower')[row]} {side}{DRAWER}"
    ends = {0: f"top {side}{DRAWER}", rows - 1: f"bottom {side}{DRAWER}"}
    return ends.get(row, f"{side}{DRAWER} in the {ORDINALS[row]} row from above")
