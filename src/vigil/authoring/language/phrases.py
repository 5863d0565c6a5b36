"""What to call the things of a scene as they are now, each found when it is asked for and kept for the moment."""

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
    """What to call things that somebody sees together."""

    def __init__(self, items: dict[str, DescribedThing]) -> None:
        self._items = items
        self._found: dict[str, Phrase | None] = {}

    def of(self, thing_id: str) -> Phrase | None:
        """Return the shortest phrase that fits a thing alone; None when there is none."""
        if thing_id not in self._found:
            self._found[thing_id] = phrase_for(self._items[thing_id], self._items.values())
        return self._found[thing_id]


@cached(LRUCache(DESCRIPTION_CACHE_SIZE), key=description_key, lock=threading.Lock())
def phrases_of(scene: Scene) -> Phrases:
    """Return what who sees the things of a scene would call them as they are now."""
    return Phrases(items_as_seen(scene))
