"""Phrases for the things of a scene in its current state, computed on demand and cached per state."""

import threading

from cachetools import LRUCache, cached

from vigil.authoring.language.referring import (
    DESCRIPTION_CACHE_SIZE,
    DescribedThing,
    Phrase,
    description_key,
    items_as_seen,
    phrase_for,
)
from vigil.scene.things import Scene


class Phrases:
    """Phrases for the things of one scene in one state."""

    def __init__(self, items: dict[str, DescribedThing]) -> None:
        self._items = items
        self._found: dict[str, Phrase | None] = {}

    def of(self, thing_id: str) -> Phrase | None:
        """Return the shortest phrase that means a thing only; None if there is none."""
        if thing_id not in self._found:
            self._found[thing_id] = phrase_for(self._items[thing_id], self._items.values())
        return self._found[thing_id]


@cached(LRUCache(DESCRIPTION_CACHE_SIZE), key=description_key, lock=threading.Lock())
def phrases_of(scene: Scene) -> Phrases:
    """Return the phrases that a person who sees a scene's things in their current state would use."""
    return Phrases(items_as_seen(scene))
