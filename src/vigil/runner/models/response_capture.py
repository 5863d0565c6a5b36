"""Listening to the HTTP client of a model: the server's own bytes, before any library has read them.

Inspect keeps a provider's raw answer only now and then, and its own rendering differs from it. So the clients that it
makes for OpenAI, Anthropic, Google and all that speak their formats get hooks, which note each request and its answer
in the call that is being made. Calls run at once in one event loop: a context variable, which tasks inherit, tells them
apart.
"""

import contextlib
import time
from collections.abc import AsyncGenerator, Callable, Iterator
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import Any

import httpx2
from inspect_ai._util.http_defaults_httpx2 import default_client_kwargs

from vigil.runner.models.answers import Wire
from vigil.runner.models.redaction import without_login


@dataclass(slots=True)
class Exchange:
    """One HTTP request, with what has come of its answer so far."""

    wire: Wire
    address: str = ""
    """Where the request went, without login and query."""
    status: int | None = None
    """None until the answer begins."""
    body: bytearray = field(default_factory=bytearray)
    """Decompressed."""
    started: float = field(default_factory=time.monotonic)


_exchanges: ContextVar[list[Exchange] | None] = ContextVar("vigil_exchanges", default=None)
_KEY = "vigil_exchange"


@contextlib.contextmanager
def capture_exchanges(api: Any) -> Iterator[list[Exchange]]:
    """Yield a list that takes in the exchanges of one call of Inspect's model `api`, in order.

    It stays empty when the provider uses no client that can be listened to, or speaks none of the four formats.
    Requests that ask for no message (Anthropic's count of tokens) are left out.
    """
    _hook_client(getattr(getattr(api, "client", None), "_client", None))
    if type(api).__name__ == "GoogleGenAIAPI" and "model_client" not in vars(api):
        clients = _GoogleClients(api)
        api.model_client, api.aclose = clients.model_client, clients.aclose
    exchanges: list[Exchange] = []
    token = _exchanges.set(exchanges)
    try:
        yield exchanges
    finally:
        _exchanges.reset(token)


def _hook_client(client: Any) -> None:
    hooks = getattr(client, "event_hooks", None)
    if isinstance(hooks, dict) and _note_request not in hooks["request"]:
        hooks["request"].append(_note_request)
        hooks["response"].insert(0, _note_answer)


class _GoogleClients:
    """Makes Google's clients for Inspect, one a call as it does, over an HTTP client that has the hooks.

    Left alone, Google's library takes another HTTP library, to which nobody can listen. The connections are shared.
    """

    def __init__(self, api: Any) -> None:
        self._make, self._close = api.model_client, api.aclose
        self._settings = default_client_kwargs()

    def model_client(self, http_options: Any = None) -> Any:
        """Return a client, as Inspect's function of that name does."""
        if http_options is not None and http_options.httpx_async_client is None:
            http_options.httpx_async_client = httpx2.AsyncClient(**self._settings)
            _hook_client(http_options.httpx_async_client)
        return self._make(http_options)

    async def aclose(self) -> None:
        """Close the shared connections, and what Inspect closes."""
        await httpx2.AsyncClient(**self._settings).aclose()
        await self._close()


def wire_of(path: str) -> Wire | None:
    """Return the format of the answers at an address; None for one that is not known here."""
    path = path.rstrip("/")
    if path.endswith("/chat/completions"):
        return "chat"
    if path.endswith("/responses") or path.rpartition("/")[0].endswith("/responses"):
        return "responses"
    if path.endswith(("/messages", "/invoke", ":rawPredict", ":streamRawPredict")):
        return "anthropic"
    return "google" if path.endswith((":generateContent", ":streamGenerateContent")) else None


async def _note_request(request: Any) -> None:
    exchanges, wire = _exchanges.get(), wire_of(request.url.path)
    if exchanges is not None and wire is not None:
        exchange = Exchange(wire, without_login(str(request.url)))
        exchanges.append(exchange)
        request.extensions[_KEY] = exchange


async def _note_answer(response: Any) -> None:
    exchange = response.request.extensions.get(_KEY)
    if isinstance(exchange, Exchange):
        exchange.status = response.status_code
        response.aiter_bytes = _copying(response.aiter_bytes, exchange)


_Read = Callable[[int | None], AsyncGenerator[bytes]]


def _copying(read: _Read, exchange: Exchange) -> Callable[..., AsyncGenerator[bytes]]:
    """Return `read`, a response's reader of decompressed bytes, copying what passes the first time."""
    is_read = False

    async def aiter_bytes(chunk_size: int | None = None) -> AsyncGenerator[bytes]:
        nonlocal is_read
        is_first, is_read = not is_read, True
        async with contextlib.aclosing(read(chunk_size)) as chunks:
            async for chunk in chunks:
                if is_first:
                    exchange.body += chunk
                yield chunk

    return aiter_bytes
