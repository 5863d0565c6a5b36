"""A cache whose results are forgotten together with the objects for which they were computed."""

import functools
from collections.abc import Callable
from typing import Any, Concatenate, ParamSpec, TypeVar
from weakref import WeakKeyDictionary

T = TypeVar("T")
P = ParamSpec("P")
R = TypeVar("R")


def cached_while_alive(function: Callable[Concatenate[T, P], R]) -> Callable[Concatenate[T, P], R]:
    """Cache a function's results for as long as its first argument lives. The results must not refer to it.

    All arguments are positional. First arguments are compared as keys of a dict: by `is` if their class does not define
    equality.
    """
    results: WeakKeyDictionary[T, dict[tuple[Any, ...], R]] = WeakKeyDictionary()

    @functools.wraps(function)
    def find(first: T, *others: P.args, **_: P.kwargs) -> R:
        own = results.get(first)
        if own is None:
            own = results.setdefault(first, {})
        if others not in own:
            own.setdefault(others, function(first, *others))  # pyright: ignore[reportCallIssue] - no names are given
        return own[others]

    return find
