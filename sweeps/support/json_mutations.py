"""Mutations of JSON documents: a few of a document's values replaced, removed, doubled or swapped."""

import copy
import random
from collections.abc import Callable
from typing import Any

KeyPath = tuple[str | int, ...]

ODD_VALUES: tuple[Any, ...] = (
    None, True, False, 0, -1, 1, 0.0, -0.0, 1e-300, 1e9, -1e9, 1e308, -1e308, 10**30, 10**400, float("nan"),
    float("inf"), float("-inf"), "", "x", "NaN", "../../etc/passwd", "/etc/passwd", "a\x00b", "\ud800", "é" * 300,
    "x" * 100_000, [], {}, [None], [[]], {"": ""}, {"x": 1, "y": 2, "z": 3}, {"x": float("nan"), "y": 0, "z": 0},
    {"x": 1e308, "y": 1e308, "z": 1e308},
)  # fmt: skip


def mutated(rng: random.Random, document: Any) -> Any:
    """Return a copy with one to four of its values changed."""
    changed = copy.deepcopy(document)
    for _ in range(rng.choice([1, 1, 1, 2, 4])):
        path = rng.choice(_deep_paths(rng, changed))
        if path:
            rng.choices(_KINDS, _WEIGHTS)[0](rng, changed, path)
        else:
            changed = rng.choice(ODD_VALUES)
    return changed


def nested(levels: int) -> bytes:
    """Return JSON text of lists in lists."""
    return b"[" * levels + b"]" * levels


def _deep_paths(rng: random.Random, document: Any) -> list[KeyPath]:
    """Return some paths, one for each of several walks from the root to a leaf, so that long lists do not dominate."""
    found: list[KeyPath] = []
    for _ in range(8):
        path: KeyPath = ()
        node = document
        while isinstance(node, dict | list) and node and (not path or rng.random() < 0.85):
            step = rng.choice(list(node)) if isinstance(node, dict) else rng.randrange(len(node))
            path, node = (*path, step), node[step]
        found.append(path)
    return found


def _parent(document: Any, path: KeyPath) -> Any:
    node = document
    for step in path[:-1]:
        node = node[step]
    return node


def _replace(rng: random.Random, document: Any, path: KeyPath) -> None:
    _parent(document, path)[path[-1]] = rng.choice(ODD_VALUES)


def _rescale(rng: random.Random, document: Any, path: KeyPath) -> None:
    parent = _parent(document, path)
    value = parent[path[-1]]
    if isinstance(value, int | float) and not isinstance(value, bool):
        parent[path[-1]] = value * rng.choice([-1, 0, 1e-9, 1e-3, 0.99, 1.01, 2, 10, 1e3, 1e6]) + rng.choice(
            [0, 0.01, 5]
        )
    else:
        _replace(rng, document, path)


def _remove(rng: random.Random, document: Any, path: KeyPath) -> None:
    del _parent(document, path)[path[-1]]


def _double(rng: random.Random, document: Any, path: KeyPath) -> None:
    parent = _parent(document, path)
    if isinstance(parent, list):
        place = rng.randrange(len(parent))
        parent[place:place] = [copy.deepcopy(_parent(document, path)[path[-1]])] * rng.choice([1, 1, 2, 50])
    else:
        parent[f"{path[-1]}{rng.choice(['', '2', ' ', chr(0)])}"] = copy.deepcopy(parent[path[-1]])


def _swap(rng: random.Random, document: Any, path: KeyPath) -> None:
    parent = _parent(document, path)
    other = rng.choice(list(parent)) if isinstance(parent, dict) else rng.randrange(len(parent))
    parent[path[-1]], parent[other] = parent[other], parent[path[-1]]


def _transplant(rng: random.Random, document: Any, path: KeyPath) -> None:
    """Put a copy of another part of the document there."""
    source = rng.choice(_deep_paths(rng, document))
    if source:
        _parent(document, path)[path[-1]] = copy.deepcopy(_parent(document, source)[source[-1]])


_TABLE: tuple[tuple[Callable[[random.Random, Any, KeyPath], None], int], ...] = (
    (_replace, 25), (_rescale, 60), (_remove, 15), (_double, 10), (_swap, 10), (_transplant, 10),
)  # fmt: skip
_KINDS, _WEIGHTS = [kind for kind, _ in _TABLE], [weight for _, weight in _TABLE]
