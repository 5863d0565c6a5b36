"""Models compiled lately: to load the same scene again costs a copy.

A scene is known by all that it consists of, not by a name, so a model is only handed out for the scene that it was made
of. What is handed out is a copy: live scenes never share what changes in them.
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
"""Models kept at most for each engine of the process; that of a house of four rooms takes 16 MB."""

_lock = threading.Lock()
_engines: WeakSet[Any] = WeakSet()


class _Models(LRUCache[Hashable, CompiledModel]):
    """As many as all engines together may keep; each may find there what another one has built."""

    def __setitem__(self, key: Hashable, value: CompiledModel) -> None:
        super().__setitem__(key, value)
        while len(self) > MAX_CACHED_PER_ENGINE * max(1, len(_engines)):
            self.popitem()


def register_engine(engine: object) -> None:
    """Has more models kept as long as an engine lives."""
    _engines.add(engine)


def _identity(scene: Scene) -> Hashable:
    """Return all that a scene consists of; its assets stand for themselves, since equal ones are made once."""
    return tuple(_values(part) for parts in (scene.rooms, scene.panels, scene.things.values()) for part in parts)


def _values(part: object) -> Hashable:
    return tuple(_plain(getattr(part, each.name)) for each in fields(part))  # type: ignore[arg-type]


def _plain(value: object) -> Hashable:
    if isinstance(value, np.ndarray):
        return value.shape, value.tobytes()
    return value  # type: ignore[return-value]


@cached(_Models(math.inf), key=_identity, lock=_lock)
def _cached_model(scene: Scene) -> CompiledModel:
    return build(scene)


def model_of(scene: Scene) -> CompiledModel:
    """Return a model of the scene as it is now, the caller's own."""
    model = _cached_model(scene)
    with _lock:
        return model.copy()


def prepare(scene: Scene) -> None:
    """Compiles a model of the scene, unless it is kept."""
    _cached_model(scene)


def clear() -> None:
    """Drops all models kept."""
    _cached_model.cache_clear()
