"""Phrases for the things of a scene in its current state. They are computed on demand and cached for each state."""

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
    """Return a function that takes a thing's id and returns the shortest phrase that means only this thing, or None.

    The phrase is what a person would say who sees the things in the current state of the scene.
    """
    items = items_as_seen(scene)
    return cache(lambda thing_id: phrase_for(items[thing_id], items.values()))
