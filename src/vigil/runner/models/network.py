"""Checks proxies and certificates of the environment before a client reads them, and disables redirects.

Libraries read proxies and certificates from environment variables, and their errors do not name the variable. Redirects
are not followed, because a client would send the key and the request to a host that the user did not name. On a
redirect to another host, HTTP libraries drop the header `Authorization`, but they still send the body and a provider's
special header (`x-api-key`).
"""

import os
import ssl
from collections.abc import Generator
from contextlib import contextmanager
from importlib.util import find_spec
from ipaddress import ip_address
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit
from urllib.request import getproxies, proxy_bypass

from vigil.errors import SettingError
from vigil.runner.models.redaction import without_login

_SCHEMES = ("http", "https", "socks5", "socks5h")
_PROXIES = {"http": "HTTP_PROXY", "https": "HTTPS_PROXY", "all": "ALL_PROXY"}
_ADVICE = "Unset it, or correct it, and give the same command again."


def check_network(address: str) -> None:
    """Raise SettingError, naming the variable, if the environment would make a client for this address fail."""
    _check_certificates()
    if is_loopback(address):
        return
    for kind, url in getproxies().items():
        if kind in _PROXIES:
            _check_proxy(_variable(_PROXIES[kind]), url)


@contextmanager
def without_proxies(address: str) -> Generator[None, None, None]:
    """Remove the proxies from the environment inside the context if the address is on this machine."""
    names = [case for name in _PROXIES.values() for case in (name, name.lower())] if is_loopback(address) else []
    kept = {name: os.environ.pop(name) for name in names if name in os.environ}
    try:
        yield
    finally:
        os.environ.update(kept)


def proxy_note(address: str) -> str:
    """Return a text that names the proxy for requests to an address; empty when no proxy is used."""
    parts = urlsplit(address)
    proxies = getproxies()
    kind = parts.scheme if parts.scheme in proxies else "all"
    if kind not in proxies or is_loopback(address) or proxy_bypass(parts.hostname or ""):
        return ""
    return f"it went through the proxy of {_variable(_PROXIES[kind])} ({without_login(proxies[kind])})"


def is_loopback(address: str) -> bool:
    """Return whether an address is on this machine."""
    host = urlsplit(address).hostname or ""
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return host == "localhost" or host.endswith(".localhost")


def _check_proxy(variable: str, url: str) -> None:
    shown, scheme = without_login(url), urlsplit(url).scheme if "://" in url else "http"
    if scheme not in _SCHEMES:
        raise SettingError(
            f"{variable} is {shown!r}, a proxy of an unknown kind. Write http://, https://, socks5:// or socks5h:// "
            f"in front of its host. {_ADVICE}"
        )
    if scheme.startswith("socks") and find_spec("socksio") is None:
        raise SettingError(
            f"{variable} is {shown!r}, but SOCKS needs a package that is not installed: pip install socksio. "
            f"Or unset {variable}."
        )


def _check_certificates() -> None:
    log = os.environ.get("SSLKEYLOGFILE")
    if log and not os.access(log if os.path.exists(log) else os.path.dirname(log) or ".", os.W_OK):
        raise SettingError(f"SSLKEYLOGFILE is {log!r}, which cannot be written. {_ADVICE}")
    file = os.environ.get("SSL_CERT_FILE")
    if file:
        try:
            ssl.create_default_context(cafile=file)
        except (OSError, ssl.SSLError) as error:
            what = "does not exist" if not Path(file).exists() else f"does not have certificates ({error})"
            raise SettingError(f"SSL_CERT_FILE is {file!r}, which {what}. {_ADVICE}") from None


def _variable(name: str) -> str:
    """Return the spelling of the variable that libraries use: its lower-case name if that is set, else `name`."""
    return name.lower() if os.environ.get(name.lower()) else name


def disable_redirects(api: Any) -> None:
    """Make a provider's client return a redirect as an answer, now and whenever the client is made again."""
    original_initialize = api.initialize

    def initialize() -> None:
        original_initialize()
        _set_no_redirects(api)

    api.initialize = initialize  # type: ignore[method-assign] - replaced on this object only
    _set_no_redirects(api)


def _set_no_redirects(api: Any) -> None:
    own: Any = getattr(api, "client", None)
    clients: list[Any] = [getattr(api, "http_client", None), getattr(own, "_client", None), own]
    for client in clients:
        if isinstance(getattr(client, "follow_redirects", None), bool):
            client.follow_redirects = False
