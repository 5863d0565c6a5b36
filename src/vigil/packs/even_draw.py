"""Even draw: orders episodes so that any first N are spread evenly over families or, in a suite, over kinds of task."""

import hashlib
from collections import deque
from collections.abc import Iterable, Iterator, Mapping

from pydantic import BaseModel, ConfigDict

from vigil.protocol.episode import Episode
from vigil.protocol.families import FAMILIES


class SuiteEntry(BaseModel):
    """The kind of task of a suite's episode, and the name of its pair. Episodes are drawn and ordered by both."""

    model_config = ConfigDict(extra="ignore", frozen=True)

    episode_id: str
    kind: str
    pair: str | None = None
    """Name of the pair, the same for both twins; None for an episode without a twin."""


def draw_evenly(episodes: Iterable[Episode]) -> list[Episode]:
    """Return the episodes in an order in which any first N are spread evenly over families (`balanced_units`)."""
    return [episode for unit in balanced_units(episodes, {}) for episode in unit]


def balanced_units(episodes: Iterable[Episode], entries: Mapping[str, SuiteEntry]) -> Iterator[list[Episode]]:
    """Yield the episodes in units: one episode or two twins. The next unit always comes from the family (in a suite,
    from the kind of task) that has the fewest episodes so far.

    If several families have equally few episodes, the first of them in the table of families is taken. Within a family,
    units are sorted by the SHA-256 of their ids: a pseudo-random order that is the same on every machine. So the first
    N + 1 units always contain the first N.
    """
    units: dict[str, list[Episode]] = {}
    waiting: dict[str, deque[list[Episode]]] = {}
    for episode in sorted(episodes, key=lambda episode: hashlib.sha256(episode.id.encode()).digest()):
        place = entries.get(episode.id)
        part, name = (episode.family, episode.id) if place is None else (place.kind, place.pair or episode.id)
        unit = units.setdefault(name, [])
        if not unit:
            waiting.setdefault(part, deque()).append(unit)
        unit.append(episode)
    given, table = dict.fromkeys(waiting, 0), list(FAMILIES)
    order = {part: (table.index(part) if part in table else len(table), part) for part in waiting}
    while waiting:
        part = min(waiting, key=lambda part: (given[part], len(waiting[part][0]), order[part]))
        unit = waiting[part].popleft()
        given[part] += len(unit)
        if not waiting[part]:
            del waiting[part]
        yield unit
