"""Even draw: episodes in an order of which any first part has as many of each family, or of each kind of a suite."""

import hashlib
from collections import deque
from collections.abc import Iterable, Iterator, Mapping

from pydantic import BaseModel, ConfigDict

from vigil.protocol.episode import FAMILIES, Episode


class SuiteEntry(BaseModel):
    """Where an episode stands in its suite: all that drawing and ordering need of its answer."""

    model_config = ConfigDict(extra="ignore", frozen=True)

    episode_id: str
    kind: str
    pair: str | None = None
    """The same for both twins; None for an episode on its own."""


def draw_evenly(episodes: Iterable[Episode]) -> list[Episode]:
    """Return episodes so that any first part of them holds every family as often as can be: see `balanced_units`."""
    return [episode for unit in balanced_units(episodes, {}) for episode in unit]


def balanced_units(episodes: Iterable[Episode], entries: Mapping[str, SuiteEntry]) -> Iterator[list[Episode]]:
    """Yield episodes, twins together as one unit, each time of the family or kind that has given the fewest so far.

    Families come in the order of the table; within each the order is that of the SHA-256 of the ids, as good as a
    random one, and the same wherever the pack is. A longer first part holds all of a shorter one.
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
