"""Redaction: keys, tokens and passwords are removed from all that a run writes.

Two methods are used together. The first looks for names and forms of secrets. It depends only on the text, so a run's
name in its header stays the same when a key is replaced. The second looks for values: everything recognised as a
secret, and every secret of the environment, is removed from free text (messages, tracebacks, the standard error of
programs). Replies of an agent are evidence and are never changed.
"""

import base64
import json
import os
import re
import shlex
from collections.abc import Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, TypeGuard
from urllib.parse import quote, unquote, urlsplit, urlunsplit

from vigil.errors import VigilError

REDACTED = "(not recorded)"
MIN_SECRET_CHARS = 6
"""Minimum length of a secret. Shorter values are not removed, because they also occur within ordinary words."""
MIN_ENVIRONMENT_CHARS = 8
"""Minimum length of a secret from the environment."""
_SECRET_WORDS = {
    *("secret", "secrets", "password", "passwords", "passwd", "passphrase", "pwd", "apikey", "apikeys"),
    *("authorization", "credential", "credentials", "cookie", "cookies", "bearer"),
}
"""Words that show, anywhere in a name, that its value is a secret."""
_SECRET_LAST_WORDS = frozenset({"key", "keys", "token", "auth"})
"""Words that, at the end of a name, show that its value is a secret; `max_tokens` and `token_budget` are harmless."""
_HARMLESS_LAST_WORDS = frozenset(
    ["file", "path", "dir", "env", "name", "var", "variable", "type", "count", "limit", "length"]
)
"""Words that show, at the end of a name, that its value is a place or a number and not a secret."""
_HARMLESS_WORDS = frozenset(
    ["max", "min", "num", "stop", "eos", "bos", "pad", "unk", "top", "sort", "group", "primary"]
)
_HARMLESS_HEADERS = frozenset(
    ["accept", "accept-language", "content-type", "user-agent", "anthropic-beta", "anthropic-version", "openai-beta"]
)
_WORD = r"""(?:\\.|[^\s'"\\]|"(?:\\.|[^"\\])*"|'[^']*')+"""
"""Pattern of a word of a shell command, including its quotes."""
_NAME = r"(?P<name>[A-Za-z][\w.-]*)"
_NAMED = re.compile(
    rf"(?P<head>(?:(?<![\w-])--?{_NAME}['\"]?(?:\s+|=)|{_NAME.replace('name', 'other')}['\"]?(?:=|\s*:\s*))"
    rf"(?:(?:Bearer|Basic|Token)\s+)?)(?P<value>{_WORD})"
)
"""Pattern of `--name value`, `--name=value`, `NAME=value` and `Name: value`."""
_USER = re.compile(rf"(?P<head>(?<!\S)(?:-u|--user|--proxy-user)(?:\s+|=))(?P<value>{_WORD})")
_KEY_PATTERNS = (
    re.compile(r"(?P<head>\b[A-Za-z][A-Za-z0-9+.-]*://)(?P<value>[^\s/?#'\"]*)(?=@)"),
    re.compile(r"(?P<head>\b(?:Bearer|Basic) +)(?P<value>[A-Za-z0-9._~+/=-]{6,})"),
    re.compile(
        r"(?P<head>)(?P<value>\b(?:(?:sk|pk|rk|xai|pplx|nvapi|glpat)-[\w-]{16,}|(?:gsk|hf|r8|gh[pousr])_\w{16,}"
        r"|github_pat_\w{20,}|AIza[\w-]{20,}|AKIA[A-Z0-9]{16}|xox[abp]-[\w-]{10,}|eyJ[\w-]+\.[\w-]+\.[\w-]+))"
    ),
)
"""Patterns of logins in addresses, of keys in authorization headers, and of keys with a known form."""


def is_secret_name(name: str) -> bool:
    """Return whether the value of a setting, header, variable or option of that name is a secret."""
    spaced = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name)
    words = [word for word in re.split(r"[^a-z0-9]+", spaced.casefold()) if word]
    if not words or words[-1] in _HARMLESS_LAST_WORDS:
        return False
    if _SECRET_WORDS & set(words):
        return True
    last = words[-2] if words[-1] == "id" and len(words) > 1 else words[-1]
    return last in _SECRET_LAST_WORDS and not _HARMLESS_WORDS & set(words)


def without_login(url: str) -> str:
    """Return an address without user name, password and query, for a run header."""
    parts = urlsplit(url)
    return urlunsplit((parts.scheme, parts.netloc.rpartition("@")[2], parts.path, "", ""))


def without_secrets(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return `settings` with secrets replaced, at any depth, for a run header."""
    found: list[str] = []
    return {name: _redact_value(name, value, found) for name, value in sorted(settings.items())}


def without_key_patterns(text: str, found: list[str] | None = None) -> str:
    """Return a text without the parts that look like a key or a login; these parts are added to `found`."""
    for form in _KEY_PATTERNS:
        text = form.sub(lambda match: _redact_match(match, found), text)
    return text


def without_option_secrets(command: str, found: list[str] | None = None) -> str:
    """Return a command line without the values of options, variables and headers whose names say that they are secret.

    These values are added to `found`.
    """
    command = without_key_patterns(command, found)
    text, start = "", 0
    while match := _NAMED.search(command, start):
        which = "name" if match["name"] else "other"
        is_secret = is_secret_name(match[which])
        end = match.end() if is_secret else match.end(which)
        text += command[start : match.start()]
        text += _redact_match(match, found) if is_secret else command[match.start() : end]
        start = end
    return _USER.sub(lambda match: _redact_match(match, found), text + command[start:])


class Secrets:
    """The known secrets, which must not be written to files or messages."""

    def __init__(self, values: Iterable[str]) -> None:
        forms = {form for value in values if len(value) >= MIN_SECRET_CHARS for form in _encodings_of(value)}
        longest_first = sorted(forms, key=lambda form: (-len(form), form))
        self._pattern = re.compile("|".join(map(re.escape, longest_first))) if forms else None

    @classmethod
    def of(
        cls, *, command: str = "", url: str | None = None, settings: Iterable[Mapping[str, Any]] = (), key: str = ""
    ) -> "Secrets":
        """Return `key` and the secrets in a command line, an address, settings and the environment."""
        found = [*environment_secrets(os.environ).values(), key]
        without_option_secrets(command, found)
        for mapping in settings:
            for name, value in mapping.items():
                _redact_value(name, value, found)
        found += _secrets_in_url(url or "")
        return cls(found)

    def redact(self, text: str) -> str:
        """Return `text` without secrets."""
        known = text if self._pattern is None else self._pattern.sub(REDACTED, text)
        return without_key_patterns(known)


@contextmanager
def redacted_errors(secrets: Secrets) -> Generator[None, None, None]:
    """Remove the secrets from the messages of errors that are raised inside the context."""
    try:
        yield
    except VigilError as error:
        said = str(error)
        if secrets.redact(said) == said:
            raise
        raise type(error)(secrets.redact(said)) from None


def environment_secrets(environment: Mapping[str, str]) -> dict[str, str]:
    """Return {name: value} of variables with a secret's name, and of logins in variables with an address."""
    found = {
        name: value
        for name, value in environment.items()
        if is_secret_name(name) and len(value) >= MIN_ENVIRONMENT_CHARS and not value.startswith("/")
    }
    for name, value in environment.items():
        if "://" in value and name not in found:
            logins = _secrets_in_login(value)
            found |= {f"{name} {index}": part for index, part in enumerate(logins)}
    return found


def _secrets_in_url(url: str) -> list[str]:
    """Return the secrets in an address: user name, password, query, and the login in the form that a header has."""
    try:
        query = urlsplit(url).query
    except ValueError:
        return []
    values = [query, *(piece.partition("=")[2] or piece for piece in query.split("&"))]
    return [*_secrets_in_login(url), *(form for value in values if value for form in (value, unquote(value)))]


def _secrets_in_login(url: str) -> list[str]:
    try:
        login = urlsplit(url).netloc.rpartition("@")[0]
    except ValueError:
        return []
    if not login:
        return []
    user, _, password = login.partition(":")
    basic = base64.b64encode(unquote(login).encode()).decode()
    return [basic, *(form for part in (login, user, password) if part for form in (part, unquote(part)))]


def _redact_value(name: str, value: Any, found: list[str], *, is_hidden: bool = False) -> Any:
    """Return `value` with secrets replaced; the secrets are added to `found`."""
    is_hidden = is_hidden or is_secret_name(name)
    if _is_mapping(value):
        return _redact_mapping(name, value, found, is_hidden)
    if _is_sequence(value):
        is_pair = len(value) == 2 and isinstance(value[0], str) and is_secret_name(value[0])
        if is_pair and not is_hidden:
            return [value[0], _redact_value(value[0], value[1], found)]
        return [_redact_value("", item, found, is_hidden=is_hidden) for item in value]
    if is_hidden and not isinstance(value, bool | None):
        if isinstance(value, int | float) and not _can_number_be_secret(name):
            return value
        found += [str(value), str(value).rpartition(" ")[2]]  # of `Bearer KEY`, the key alone is a secret, too
        return REDACTED
    return without_option_secrets(value, found) if isinstance(value, str) else value


def _is_mapping(value: object) -> TypeGuard[Mapping[Any, Any]]:
    return isinstance(value, Mapping)


def _is_sequence(value: object) -> TypeGuard[Sequence[Any]]:
    return isinstance(value, list | tuple)


def _redact_mapping(name: str, value: Mapping[Any, Any], found: list[str], is_hidden: bool) -> dict[str, Any]:
    is_header = name.casefold().endswith(("headers", "header"))
    labels = {value.get(label) for label in ("name", "key", "header") if isinstance(value.get(label), str)}
    is_labelled = any(is_secret_name(str(label)) for label in labels)
    cleaned: dict[str, Any] = {}
    for key, item in value.items():
        is_secret = is_hidden or (is_header and str(key).casefold() not in _HARMLESS_HEADERS)
        is_secret = is_secret or (is_labelled and item not in labels)
        cleaned[str(key)] = (
            item if is_labelled and item in labels else _redact_value(str(key), item, found, is_hidden=is_secret)
        )
    return cleaned


def _can_number_be_secret(name: str) -> bool:
    return not name or bool(_SECRET_WORDS & set(re.split(r"[^a-z0-9]+", name.casefold())))


def _redact_match(match: re.Match[str], found: list[str] | None) -> str:
    value = match["value"]
    if REDACTED in value or value == REDACTED.split()[0]:
        return match[0]
    if found is not None:
        found += [value, _unquoted(value), *re.split(r"['\"]", value)]
        found.extend(_secrets_in_url(f"x://{value}@x") if match["head"].endswith("://") else ())
    return match["head"] + REDACTED


def _unquoted(word: str) -> str:
    try:
        return "".join(shlex.split(word))
    except ValueError:
        return word


def _encodings_of(value: str) -> Iterator[str]:
    """Yield the forms in which a text may contain a value: unchanged, or encoded for an address, JSON or Python."""
    yield value
    yield quote(value, safe="")
    yield quote(value)
    yield json.dumps(value)[1:-1]
    yield json.dumps(value, ensure_ascii=False)[1:-1]
    yield repr(value)[1:-1]
