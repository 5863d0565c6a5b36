"""Registries whose entries are modules: each module of a package exports one object under the same name."""

import importlib
import pkgutil
from collections.abc import Callable, Sequence
from typing import Any


def exported_by_modules(package: str, name: str, required: Sequence[str]) -> list[Any]:
    """Import each module of a package, and return the objects that they export as `name`, sorted by `position`.

    Raises AttributeError for a module without this name, TypeError for an object whose attributes in `required` are
    empty.
    """
    found: list[Any] = []
    for module in pkgutil.iter_modules(importlib.import_module(package).__path__):
        exported = getattr(importlib.import_module(f"{package}.{module.name}"), name)
        missing = [attribute for attribute in required if not getattr(exported, attribute)]
        if missing:
            raise TypeError(f"{name} of {package}.{module.name} lacks {', '.join(missing)}.")
        found.append(exported)
    return sorted(found, key=lambda exported: exported.position)


def loaded(function: str | Callable[..., Any]) -> Callable[..., Any]:
    """Return a function that is given either as itself or by its name "package.module:function"."""
    return pkgutil.resolve_name(function) if isinstance(function, str) else function
