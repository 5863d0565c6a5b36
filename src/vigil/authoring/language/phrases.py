"""Phrases for the things of a scene in its current state, computed on demand and cached per state."""

import threading
from collections.abc import Callable
from functools import cache

from cachetools import LRUCache, cached

from vigil.authoring.language.referring import (
    DESCRIPTION_CACHE_SIZE,
    Phrase,
    description_key,
    items_as_seen,
    phrase_for,
)
from vigil.scene.things import Scene


@cached(LRUCache(DESCRIPTION_CACHE_SIZE), key=description_key, lock=threading.Lock())
def phrase_finder(scene: Scene) -> Callable[[str], Phrase | None]:
    """Return the function from a thing's id to the shortest phrase that means the thing only; None if there is none.

    The phrase is that of a person who sees the things in the current state of the scene.
    """
    items = items_as_seen(scene)
    return cache(lambda thing_id: phrase_for(items[thing_id], items.values()))
