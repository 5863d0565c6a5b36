"""Objects in view by their names, for a profile in which an agent names what it interacts with.

`pixel_of_named` returns None if no object has the name, if none in view has it, and if several in view have it. The
agent does not learn which of these is the case. Source: `protocol.md` section 11.
"""

import numpy as np

from vigil.assets.catalog import CATALOG
from vigil.base.geometry import Pose
from vigil.scene.things import Scene, Thing
from vigil.sim.core.sight import Sight

IN_VIEW_PX, IN_VIEW_M = 40, 6.0
"""Least number of pixels and greatest distance (m) of a thing in view, as for an observable object."""
ARTICLES = ("the ", "a ", "an ")


def pixel_of_named(scene: Scene, sight: Sight, agent: Pose, name: str) -> tuple[int, int] | None:
    """Return the pixel (x, y), near the middle of its pixels, of the only thing in view called `name`.

    None if no such thing is in view and can be clicked, or if several are in view.
    """
    wanted = _plain(name)
    named = [thing for thing in scene.things.values() if thing.is_present and _plain(_name(thing)) == wanted]
    seen = sight.see(agent, [thing for thing in named if not thing.is_held])
    in_view = [
        thing
        for thing in named
        if thing.id in seen
        and seen[thing.id].visible_px >= IN_VIEW_PX
        and (seen[thing.id].nearest_m or 0.0) <= IN_VIEW_M
    ]
    if len(in_view) != 1:
        return None
    pixels = sight.click_pixel(agent, in_view[0])
    if not len(pixels):
        return None
    away = np.square(pixels - pixels.mean(axis=0)).sum(axis=1)
    x, y = pixels[int(away.argmin())]
    return int(x), int(y)


def _name(thing: Thing) -> str:
    return "drawer" if thing.is_drawer else CATALOG[thing.category].display_name


def _plain(name: str) -> str:
    """Return a name in lower case, without spaces and without its article."""
    words = " ".join(name.casefold().split())
    return next((words.removeprefix(word) for word in ARTICLES if words.startswith(word)), words).replace(" ", "")
