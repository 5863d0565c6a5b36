"""The server's HTTP and WebSocket pages, in the form of OpenEnv's protocol.

`POST /reset` begins a session and `POST /step` carries out a reply; the WebSocket `/ws` takes the same requests as
messages. An answer is made by `vigil.integrations.serve.messages`, or is a fixed sentence that says what is wrong with
the request.
"""

import asyncio
import json
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from typing import Annotated, Any

from fastapi import FastAPI, Header, Request, WebSocket, WebSocketDisconnect
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse, Response
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from vigil import __version__
from vigil.integrations.serve.host import Host
from vigil.integrations.serve.messages import (
    MAX_MESSAGE_BYTES,
    NOTHING_LEFT,
    SESSION_HEADER,
    SessionError,
    client_reply,
)
from vigil.integrations.serve.patience import Patience
from vigil.web.site import Address, refusal

IDLE_SECONDS = 60
"""Time (s) after which a WebSocket without a session is closed."""
MAX_INVALID = 100
"""Number of invalid messages in a row after which a WebSocket is closed."""
DESCRIPTION = (
    "Household episodes from egocentric RGB: the agent acts, and closes each episode with a report of its own."
)
_INVALID = SessionError(422, "VALIDATION_ERROR", "The request is not valid: see /schema.")
_NO_SESSION = SessionError(400, "SESSION_ERROR", f"Begin a session (reset) and give its token ({SESSION_HEADER}).")
_Token = Annotated[str, Header(alias=SESSION_HEADER, max_length=200)]


class ResetRequest(BaseModel):
    """Request for a session. The server chooses the episode; a seed or an episode's id in the request is ignored."""

    model_config = ConfigDict(extra="ignore")

    session: str | None = Field(default=None, max_length=200)
    """Token of a session that the client continues; None to begin a new session."""
    index: int | None = None
    """Number of the wanted episode, if the server is for training; None for the next episode."""


class StepRequest(BaseModel):
    """Request to carry out a reply, given as its `text` or as the action itself."""

    model_config = ConfigDict(extra="ignore")

    action: dict[str, Any]
    moment: int | None = None
    """Number of the view (`View.moment`) that the reply answers; None for the current view."""


async def reset(host: Host, request: ResetRequest) -> tuple[str | None, dict[str, Any]]:
    """Begin a session, or continue the one that the request names; return its token and the answer to the client."""
    if request.session is not None:
        return request.session, (await host.view(request.session)).message(request.session)
    opened = await host.open(request.index)
    if opened is None:
        return None, NOTHING_LEFT
    token, view = opened
    return token, view.message(token)


async def step(host: Host, token: str, request: StepRequest) -> dict[str, Any]:
    """Carry out a reply and return the answer to the client."""
    try:
        given = client_reply(request.action)
    except ValidationError:
        raise _INVALID from None
    return (await host.step(token, given, request.moment)).message()


def make_app(host: Host, address: Address) -> FastAPI:
    """Return the web application. Raises SettingError if clients need a token at this address, but none is set."""
    address.check()

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        await host.restore()
        yield
        await host.close()

    app = FastAPI(title="VIGIL", version="1.0.0", docs_url=None, redoc_url=None, lifespan=lifespan)

    @app.middleware("http")
    async def guard(request: Request, call_next: Callable[[Request], Awaitable[Response]]) -> Response:
        if request.scope["path"] != "/health" and (refused := refusal(request, address, MAX_MESSAGE_BYTES)) is not None:
            return refused
        response = await call_next(request)
        response.headers["Cache-Control"] = "no-store"
        return response

    @app.exception_handler(SessionError)
    async def on_session_error(_: Request, error: SessionError) -> Response:
        return JSONResponse({"error": error.message, "code": error.code}, error.status)

    @app.exception_handler(RequestValidationError)
    async def on_invalid_request(request: Request, _: RequestValidationError) -> Response:
        return await on_session_error(request, _INVALID)

    _add_facts(app, host)

    @app.post("/reset")
    async def reset_page(request: ResetRequest) -> dict[str, Any]:
        return (await reset(host, request))[1]

    @app.post("/step")
    async def step_page(request: StepRequest, token: _Token = "") -> dict[str, Any]:
        return await step(host, token, request)

    @app.get("/state")
    async def state_page(token: _Token = "") -> dict[str, Any]:
        return {"episode_id": None, "step_count": (await host.view(token)).moment}

    @app.websocket("/ws")
    async def socket(websocket: WebSocket) -> None:
        if refusal(websocket, address) is not None or "origin" in websocket.headers:
            await websocket.close(1008)
            return
        await websocket.accept()
        await _Socket(host, websocket).serve()

    app.add_middleware(Patience)
    return app


def _add_facts(app: FastAPI, host: Host) -> None:
    """Add the pages that describe what is served. They are the same for every client."""

    @app.get("/health")
    async def health() -> dict[str, str]:
        return {"status": "healthy"}

    @app.get("/metadata")
    async def metadata() -> dict[str, str]:
        return {"name": "vigil", "description": DESCRIPTION, "version": __version__}

    @app.get("/contract")
    async def contract() -> dict[str, Any]:
        settings = host.settings
        return {
            "profile": host.profile.model_dump(mode="json"),
            "reply_seconds": settings.reply_seconds,
            "episode_seconds": settings.episode_seconds,
            "max_sessions": settings.max_sessions,
            **({"episodes": host.episodes} if settings.training else {}),
        }

    @app.get("/schema")
    async def schema() -> dict[str, Any]:
        words = {"type": "string"}
        frame = {"type": "object", "required": ["media_type", "width", "height", "data"]}
        action = {"type": "object", "properties": {"text": words}, "required": ["text"]}
        names = {"instruction": words, "prompt": words, "session": words, "request": words}
        seen = {**names, "moment": {"type": "integer"}, "frame": frame, "feedback": {"type": "object"}}
        state = {"type": "object", "properties": {"step_count": {"type": "integer"}}}
        return {"action": action, "observation": {"type": "object", "properties": seen}, "state": state}

    @app.post("/mcp")
    async def mcp() -> dict[str, Any]:
        fault = {"code": -32601, "message": "This environment has no tools."}
        return {"jsonrpc": "2.0", "id": None, "error": fault}


class _Socket:
    """One WebSocket. It has at most one session at a time, which ends soon after the connection ends."""

    def __init__(self, host: Host, websocket: WebSocket) -> None:
        self._host, self._websocket = host, websocket
        self._token: str | None = None
        self._invalid = 0
        """Number of invalid messages since the last valid one."""

    async def serve(self) -> None:
        is_closed = False
        try:
            while not is_closed:
                async with asyncio.timeout(IDLE_SECONDS if self._token is None else None):
                    text = await self._websocket.receive_text()
                answer = await self._answer(text)
                is_closed = answer is None
                if answer is not None:
                    await self._websocket.send_text(json.dumps(answer))
                if self._invalid >= MAX_INVALID:
                    await self._websocket.close(1008)
                    return
                await asyncio.sleep(0)  # other connections get their turn, however many messages wait here
            await self._websocket.close()
        except TimeoutError:
            await self._websocket.close(1001)
        except (WebSocketDisconnect, KeyError):  # the connection broke, or the message is not a text
            pass
        finally:
            if self._token is not None:
                self._host.detach(self._token, at_once=is_closed)

    async def _answer(self, text: str) -> dict[str, Any] | None:
        """Return the answer to a message; None if the client closes the session."""
        invalid, self._invalid = self._invalid, 0
        try:
            message = _Incoming.model_validate_json(text)
            if message.type == "close":
                return None
            if message.type == "state":
                moment = 0 if self._token is None else (await self._host.view(self._token)).moment
                return {"type": "state", "data": {"episode_id": None, "step_count": moment}}
            return {"type": "observation", "data": await self._act(message)}
        except ValidationError:
            error = _INVALID
        except SessionError as found:
            error = found
        if error.status == _INVALID.status:
            self._invalid = invalid + 1
        return {"type": "error", "data": {"message": error.message, "code": error.code}}

    async def _act(self, message: "_Incoming") -> dict[str, Any]:
        if message.type == "reset":
            request = ResetRequest.model_validate(message.data)
            if self._token is not None and request.session != self._token:
                self._host.detach(self._token, at_once=True)
            self._token, answer = await reset(self._host, request)
            return answer
        if message.type != "step":
            raise SessionError(
                422, "UNKNOWN_TYPE", "The message has an unknown type. Known types: reset, step, state, close."
            )
        if self._token is None:
            raise _NO_SESSION
        answer = await step(self._host, self._token, StepRequest(action=message.data, moment=message.moment))
        if answer["done"]:
            self._token = None
        return answer


class _Incoming(BaseModel):
    """One message from a client."""

    model_config = ConfigDict(extra="ignore")

    type: str = Field(max_length=20)
    data: dict[str, Any] = Field(default_factory=dict)
    moment: int | None = None
