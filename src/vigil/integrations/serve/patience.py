"""Limits on connections: a client that sends or reads too slowly loses its connection, but not its session."""

import asyncio
from typing import Any

import uvicorn
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from uvicorn.protocols.http.h11_impl import H11Protocol

from vigil.integrations.serve.messages import MAX_MESSAGE_BYTES

SPARE_CONNECTIONS = 32
"""Number of connections that are accepted in addition to four connections for each session."""
SHUTDOWN_SECONDS = 5
REQUEST_SECONDS = 20.0
"""Time limit in seconds for the head of a request to arrive, for each part of its body to arrive, and for the client to
read each part of the answer."""


class PatientProtocol(H11Protocol):
    """An HTTP connection that closes if the head of a request does not arrive in time."""

    request_seconds = REQUEST_SECONDS
    _waits: asyncio.TimerHandle | None = None
    _is_upgraded = False

    def connection_made(self, transport: Any) -> None:
        """Start the time limit of the first request."""
        super().connection_made(transport)
        self._watch()

    def data_received(self, data: bytes) -> None:
        """Read a part of a request, and stop the time limit when the head is complete."""
        super().data_received(data)
        self._watch()

    def handle_websocket_upgrade(self, event: Any) -> None:
        """Pass the connection to the WebSocket protocol, which has its own limits."""
        self._is_upgraded = True
        super().handle_websocket_upgrade(event)

    def connection_lost(self, exc: Exception | None) -> None:
        """Stop the time limit of a closed connection."""
        self._is_upgraded = True
        self._watch()
        super().connection_lost(exc)

    def _watch(self) -> None:
        is_answering = self.cycle is not None and not self.cycle.response_complete
        if is_answering or self._is_upgraded:
            if self._waits is not None:
                self._waits.cancel()
            self._waits = None
        elif self._waits is None:
            self._waits = self.loop.call_later(self.request_seconds, self.transport.close)


class Patience:
    """Application that ends a request if the client sends its body, or reads the answer, too slowly."""

    def __init__(self, app: ASGIApp, seconds: float = REQUEST_SECONDS) -> None:
        self._app, self._seconds = app, seconds

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one connection."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        is_body_left = scope["type"] == "http"

        async def patient_receive() -> Message:
            nonlocal is_body_left
            async with asyncio.timeout(self._seconds if is_body_left else None):
                message = await receive()
            is_body_left = is_body_left and message.get("more_body", False)
            return message

        async def patient_send(message: Message) -> None:
            async with asyncio.timeout(self._seconds):
                await send(message)

        await self._app(scope, patient_receive, patient_send)


def server_config(app: ASGIApp, max_sessions: int) -> uvicorn.Config:
    """Return the configuration of the web server, with limits on the number, size and time of requests."""
    return uvicorn.Config(
        app,
        http=PatientProtocol,
        ws="websockets-sansio",
        ws_max_size=MAX_MESSAGE_BYTES,
        limit_concurrency=4 * max_sessions + SPARE_CONNECTIONS,
        timeout_graceful_shutdown=SHUTDOWN_SECONDS,
        log_level="warning",
        access_log=False,
        server_header=False,
    )
