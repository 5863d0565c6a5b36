"""A cache of compiled models, so that loading an equal scene again only makes a copy.

Scenes are compared by their whole contents, not by a name. Each caller gets a copy, so that changes in one live scene
do not affect another.
"""

import math
import threading
from collections.abc import Hashable
from dataclasses import fields
from typing import Any
from weakref import WeakSet

import numpy as np
from cachetools import LRUCache, cached

from vigil.scene.things import Scene
from vigil.sim.engines.mujoco.compiled.model import CompiledModel, build

MAX_CACHED_PER_ENGINE = 4
"""Greatest number of cached models for each live engine. The model of a house of four rooms takes 16 MB."""

_lock = threading.Lock()
_engines: WeakSet[Any] = WeakSet()


class _Models(LRUCache[Hashable, CompiledModel]):
    """The cache of models that all engines share; its size depends on the number of engines."""

    def __setitem__(self, key: Hashable, value: CompiledModel) -> None:
        super().__setitem__(key, value)
        while len(self) > MAX_CACHED_PER_ENGINE * max(1, len(_engines)):
            self.popitem()


def register_engine(engine: object) -> None:
    """Make the cache larger for as long as `engine` lives."""
    _engines.add(engine)


def _identity(scene: Scene) -> Hashable:
    """Return a key that contains everything of which a scene consists.

    Assets are compared by `is`, because equal assets are made only once.
    """
    parts: list[Any] = [*scene.rooms, *scene.panels, *scene.things.values()]
    values = (tuple(getattr(part, each.name) for each in fields(part)) for part in parts)
    return tuple(
        tuple((each.shape, each.tobytes()) if isinstance(each, np.ndarray) else each for each in own) for own in values
    )


@cached(_Models(math.inf), key=_identity, lock=_lock)
def _cached_model(scene: Scene) -> CompiledModel:
    return build(scene)


def model_of(scene: Scene) -> CompiledModel:
    """Return a new copy of the model of a scene in its present state."""
    model = _cached_model(scene)
    with _lock:
        return model.copy()


def prepare(scene: Scene) -> None:
    """Compile the model of a scene into the cache, unless it is there already."""
    _cached_model(scene)


def clear() -> None:
    """Empty the cache."""
    _cached_model.cache_clear()
