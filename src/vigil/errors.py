"""The error tree.

VigilError
├── InputError               bad input from the user: stop at once, say what, where and what to do
│   ├── HouseError           a house that is malformed, too large or refers to missing objects
│   ├── EpisodeError         an episode that contradicts its house or the protocol
│   ├── PackMismatch         a pack whose files or hashes differ from its manifest
│   ├── RecordError          a run folder or record that cannot be read or continued
│   └── SettingError         a command-line or run setting that makes no sense
└── InfrastructureError      retried, then the episode ends as `error` and is never scored
    ├── SimulatorError       a simulator that crashed, hung or broke its own contract
    └── ModelAPIError        transport, rate limits and outages of a model's provider

What an agent does wrong is never an exception: it is data (`vigil.protocol.actions.InvalidAction`).
"""

from collections.abc import Collection, Iterable
from difflib import get_close_matches
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # `vigil --help` needs the errors, but need not wait until pydantic is loaded
    from pydantic import ValidationError

MAX_FAULT_CHARS = 300
"""Maximum length of a field path or message that quotes a file or a model."""
MAX_PART_CHARS = 80
"""Maximum length of one name in a field path."""


class VigilError(Exception):
    """Base class of all errors that VIGIL raises on purpose."""


class InputError(VigilError):
    """Bad input from the user. The message says what is wrong, where, and what to do."""


class HouseError(InputError):
    """A house document that cannot be loaded."""


class EpisodeError(InputError):
    """An episode that contradicts its house or the protocol."""


class PackMismatch(InputError):
    """A pack whose files differ from what its manifest says."""


class RecordError(InputError):
    """A run folder or record that cannot be read or continued."""


class SettingError(InputError):
    """A setting or option with an invalid value."""


class InfrastructureError(VigilError):
    """A failure that the agent did not cause. It is retried; if it persists, the episode ends with `end="error"`."""


class SimulatorError(InfrastructureError):
    """A simulator that crashed, hung or broke its own contract."""


class ModelAPIError(InfrastructureError):
    """A failure of a model's provider: transport, rate limit, outage, or no image support."""


def first_error(error: "ValidationError", root: str = "the document") -> str:
    """Return "place: message" for the first validation error, both cut to a readable length.

    `root` is the place if the error is about the whole document. Place and message are cut because they may quote long
    input.
    """
    fault = error.errors(include_url=False, include_context=False, include_input=False)[0]
    place = ".".join(shorten(str(part), MAX_PART_CHARS) for part in fault["loc"])
    return f"{shorten(place, MAX_FAULT_CHARS) or root}: {shorten(fault['msg'], MAX_FAULT_CHARS)}"


def shorten(text: str, max_chars: int) -> str:
    """Return `text`, cut to `max_chars` characters with "..." at the end if it is longer."""
    return text if len(text) <= max_chars else f"{text[: max_chars - 3]}..."


def check_known(what: str, name: str, known: Collection[str], advice: str = "Known:", end: str = ".") -> None:
    """Raise SettingError unless `name` is known. The message lists the known names between `advice` and `end`."""
    if name not in known:
        hint = did_you_mean(name, known)
        raise SettingError(f"{what} {name!r} does not exist.{hint} {advice} {', '.join(known)}{end}")


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """Return " Did you mean 'x'?" with the known word most similar to `word`; empty when no known word is similar."""
    close = get_close_matches(word, sorted(known), n=1)
    return f" Did you mean {close[0]!r}?" if close else ""
