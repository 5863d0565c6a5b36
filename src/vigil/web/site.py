"""Shared parts of all sites: templates, static files, and rules against requests from other users and other sites."""

import hmac
import re
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import HTMLResponse, JSONResponse, PlainTextResponse, RedirectResponse, Response
from fastapi.staticfiles import StaticFiles
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from starlette.requests import HTTPConnection

from vigil.analysis.tables.page import prose
from vigil.base.glossary import TERMS
from vigil.base.markup import finalize
from vigil.errors import InfrastructureError, InputError, SettingError, VigilError

HERE = Path(__file__).parent
STATIC = HERE / "static"
COOKIE = "vigil_token"
LOOPBACK = frozenset({"127.0.0.1", "localhost", "::1"})
MAX_BODY_BYTES = 256 * 1024
_LOOPBACK_HEADER = re.compile(r"(127\.0\.0\.1|localhost|\[::1\])(:[0-9]{1,5})?", re.ASCII | re.IGNORECASE)
_LENGTH = re.compile(r"[0-9]{1,9}")
_MAX_FAULT_CHARS = 300
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; "
    "base-uri 'none'; form-action 'self'; frame-ancestors 'none'"
)
HEADERS = {
    "Content-Security-Policy": POLICY,
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "X-Frame-Options": "DENY",
}


@dataclass(frozen=True, slots=True)
class Address:
    """Address at which a site is served. An address other than loopback needs a token."""

    host: str = "127.0.0.1"
    port: int = 8377
    token: str = ""

    def check(self) -> None:
        """Raise SettingError if the address needs a token and does not have one."""
        if self.host not in LOOPBACK and len(self.token) < 8:
            raise SettingError(
                f"--host {self.host!r} is not loopback, so other machines could see the pages. Give --token with 8 "
                "characters or more."
            )


def percent(rate: float | None) -> str:
    """Return a rate as a percentage; a dash for None."""
    return "–" if rate is None else f"{100 * rate:.1f}"


def template_environment() -> Environment:
    """Return the template environment, which escapes all values."""
    templates = Environment(
        loader=FileSystemLoader(HERE / "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        finalize=finalize,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    templates.filters |= {"percent": percent, "prose": prose}
    templates.globals["terms"] = TERMS
    templates.globals["query"] = lambda **values: urlencode({k: v for k, v in values.items() if v not in (None, "")})
    return templates


TEMPLATES = template_environment()


def page(name: str, *, status: int = 200, headers: dict[str, str] | None = None, **values: Any) -> HTMLResponse:
    """Return the page that the template called `name` renders with `values`."""
    return HTMLResponse(TEMPLATES.get_template(name).render(**values), status, headers)


def picture(name: str, **values: Any) -> Response:
    """Return a rendered SVG that contains the pages' style, because an SVG picture cannot load files."""
    style = (STATIC / "vigil.css").read_text(encoding="utf-8")
    drawn = TEMPLATES.get_template(name).render(style=style, **values)
    headers = {"Content-Security-Policy": "default-src 'none'; style-src 'unsafe-inline'"}
    return Response(drawn, media_type="image/svg+xml", headers=headers)


def png(data: bytes) -> Response:
    """Return a picture that browsers may cache for ten minutes."""
    return Response(data, media_type="image/png", headers={"Cache-Control": "private, max-age=600"})


def make_site(address: Address) -> FastAPI:
    """Return an application without pages that refuses requests from other users and sites. Raises SettingError."""
    address.check()
    site = FastAPI(title="VIGIL", docs_url=None, redoc_url=None, openapi_url=None)
    site.mount("/static", StaticFiles(directory=STATIC), name="static")

    @site.middleware("http")
    async def guard(request: Request, call_next: Callable[[Request], Awaitable[Response]]) -> Response:
        response = refusal(request, address) or await call_next(request)
        for name, value in HEADERS.items():
            response.headers.setdefault(name, value)
        if not request.scope["path"].startswith("/static/"):
            response.headers.setdefault("Cache-Control", "no-store")
        return response

    @site.exception_handler(VigilError)
    async def on_vigil_error(request: Request, error: VigilError) -> Response:
        status = 503 if isinstance(error, InfrastructureError) else 400 if isinstance(error, InputError) else 500
        return fault(request, status, str(error))

    @site.exception_handler(RequestValidationError)
    async def on_invalid_request(request: Request, error: RequestValidationError) -> Response:
        found = error.errors()[0]
        place = ".".join(str(part) for part in found["loc"])
        return fault(request, 422, f"{place}: {found['msg']}"[:_MAX_FAULT_CHARS])

    @site.exception_handler(KeyError)
    @site.exception_handler(404)
    async def on_nothing_found(request: Request, error: Exception) -> Response:
        return fault(request, 404, "There is nothing at this address.")

    return site


def fault(request: Request, status: int, message: str) -> Response:
    """Return an error page; for scripts, JSON.

    The message may quote the request, including characters that UTF-8 cannot encode.
    """
    message = message.encode("utf-8", "replace").decode()
    if request.method != "GET" or "application/json" in request.headers.get("accept", ""):
        return JSONResponse({"error": message}, status)
    if request.scope["path"].rpartition(".")[2] in ("png", "gif", "json"):
        return PlainTextResponse(message, status)
    return page("fault.html", status=status, title="Not shown", message=message)


def refusal(request: HTTPConnection, address: Address, max_bytes: int = MAX_BODY_BYTES) -> Response | None:
    """Return the response that refuses a request; None if the request is allowed."""
    if not address.token and not _LOOPBACK_HEADER.fullmatch(request.headers.get("host", "")):
        return PlainTextResponse("This server answers only to 127.0.0.1 and localhost.", 421)
    origin = request.headers.get("origin")
    is_foreign = origin not in (None, "null") and origin.partition("://")[2] != request.headers.get("host", "")
    if is_foreign or _is_asked_by_another_site(request):
        return PlainTextResponse("Requests from other sites are refused.", 403)
    if request.scope.get("method", "GET") not in ("GET", "HEAD"):
        length = request.headers.get("content-length", "")
        is_json = request.headers.get("content-type", "").startswith("application/json")
        is_reasonable = _LENGTH.fullmatch(length) is not None and int(length) <= max_bytes
        if not is_json or not is_reasonable or origin == "null":
            return PlainTextResponse("Only JSON of a reasonable length is accepted.", 415)
    return _token_refusal(request, address) if address.token else None


def _is_asked_by_another_site(request: HTTPConnection) -> bool:
    """Return whether, according to the browser, a page of another site made the request. A link that a user followed
    does not count."""
    is_link = request.scope.get("method") == "GET" and request.headers.get("sec-fetch-mode") == "navigate"
    return request.headers.get("sec-fetch-site") in ("cross-site", "same-site") and not is_link


def _token_refusal(request: HTTPConnection, address: Address) -> Response | None:
    given = request.query_params.get("token")
    if given is not None and _is_token(given, address.token):
        rest = urlencode([(name, value) for name, value in request.query_params.multi_items() if name != "token"])
        path = re.sub(r"^/+", "/", request.url.path)
        response = RedirectResponse(path + (f"?{rest}" if rest else ""), 303)
        response.set_cookie(COOKIE, address.token, httponly=True, samesite="strict")
        return response
    bearer = request.headers.get("authorization", "").removeprefix("Bearer ")
    if _is_token(request.cookies.get(COOKIE, ""), address.token) or _is_token(bearer, address.token):
        return None
    return PlainTextResponse("This server needs its token: open the address with ?token=...", 401)


def _is_token(given: str, token: str) -> bool:
    return hmac.compare_digest(given.encode(), token.encode())
