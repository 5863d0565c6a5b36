"""Objects that the modules of a package export under one name: registries whose entries are files."""

import importlib
import pkgutil
from collections.abc import Callable, Sequence
from typing import Any


def exported_by_modules(package: str, name: str, required: Sequence[str]) -> list[Any]:
    """Import each module of a package, and return what the modules export as `name`, by its attribute `position`.

    Raises AttributeError for a module that exports nothing under the name, TypeError for an object of which one of
    the `required` attributes is empty.
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
    """Return a function that is given as it is, or by its name "package.module:function"."""
    return pkgutil.resolve_name(function) if isinstance(function, str) else function
