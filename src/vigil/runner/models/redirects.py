"""Redirects are not followed: a client would carry the key, and the request, to a host that the user did not name.

HTTP libraries drop the header `Authorization` on the way to another host, but no provider's header of its own
(`x-api-key`), and nothing of a request's body.
"""

from collections.abc import Iterator
from typing import Any

from inspect_ai.model import ModelAPI


def stay(api: ModelAPI) -> None:
    """Makes a provider's client take a redirect as an answer, now and whenever it is made anew."""
    make_anew = api.initialize

    def initialize() -> None:
        make_anew()
        _stay(api)

    api.initialize = initialize  # type: ignore[method-assign]
    _stay(api)


def _stay(api: ModelAPI) -> None:
    for client in _clients(api):
        client.follow_redirects = False


def _clients(api: ModelAPI) -> Iterator[Any]:
    """Yields the HTTP clients of a provider, as far as it keeps them."""
    own = getattr(api, "client", None)
    for holder in (getattr(api, "http_client", None), getattr(own, "_client", None), own):
        if isinstance(getattr(holder, "follow_redirects", None), bool):
            yield holder
