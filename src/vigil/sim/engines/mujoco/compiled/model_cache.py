"""A cache of compiled models, so that loading an equal scene again only makes a copy.

Scenes are compared by their whole contents, not by a name. Each caller gets a copy, so that changes in one live scene
do not affect another.
"""

import threading
from collections.abc import Hashable
from dataclasses import fields
from typing import Any
from weakref import WeakSet

import numpy as np
from cachetools import LRUCache

from vigil.base.free_memory import return_free_memory
from vigil.scene.things import Scene
from vigil.sim.engines.mujoco.compiled.model import CompiledModel, build

MAX_CACHED = 4
"""Number of models that are kept, if they are small enough for `MAX_CACHED_BYTES`."""
MAX_CACHED_BYTES = 64 * 2**20
"""Greatest size in bytes of all kept models together, without their light, which takes about as much. The model of a
house of four rooms has 12 MB, that of a house of ten rooms 25 MB."""


def _size(model: CompiledModel) -> int:
    """Return the size in bytes that a model counts as in the cache."""
    return min(max(model.native.nbuffer, MAX_CACHED_BYTES // MAX_CACHED), MAX_CACHED_BYTES)


_lock = threading.Lock()
_engines: WeakSet[Any] = WeakSet()
_cached: LRUCache[Hashable, CompiledModel] = LRUCache(MAX_CACHED_BYTES, getsizeof=_size)
_prepared: dict[Hashable, CompiledModel] = {}
"""Models that were compiled in advance and not yet used: at most one for each live engine."""


def register_engine(engine: object) -> None:
    """Let one more model wait for its first use for as long as `engine` lives."""
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


def _take(scene: Scene) -> tuple[Hashable, CompiledModel]:
    """Return the key and the model of a scene; a model that was prepared does not wait any longer."""
    key = _identity(scene)
    with _lock:
        model = _prepared.pop(key, None) or _cached.get(key)
    if model is None:
        model = build(scene)
        return_free_memory()  # the compiler has used three times as much as the model takes
    return key, model


def model_of(scene: Scene) -> CompiledModel:
    """Return a new copy of the model of a scene in its present state."""
    key, model = _take(scene)
    with _lock:
        _cached[key] = model
        return model.copy()


def prepare(scene: Scene) -> None:
    """Compile the model of a scene, unless it is there already, and keep it until it is used."""
    key, model = _take(scene)
    with _lock:
        _prepared[key] = model
        while len(_prepared) > max(1, len(_engines)):
            del _prepared[next(iter(_prepared))]


def clear() -> None:
    """Empty the cache."""
    with _lock:
        _cached.clear()
        _prepared.clear()
