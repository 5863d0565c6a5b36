"""The error tree.

VigilError
├── InputError               bad input of the user's: stop at once, say what, where and what to do
│   ├── HouseError           a house that is malformed, too large or refers to what is not there
│   ├── EpisodeError         an episode that its house or the protocol contradicts
│   ├── PackMismatch         a pack whose files or hashes differ from its manifest
│   ├── RecordError          a run folder or record that cannot be read or continued
│   └── SettingError         a command-line or run setting that makes no sense
└── InfrastructureError      retried, then the episode ends as `error` and is never scored
    ├── SimulatorError       a simulator that crashed, hung or broke its own contract
    └── ModelAPIError        transport, rate limits and outages of a model's provider

What an agent does wrong is never an exception: it is data (`vigil.protocol.actions.InvalidAction`).
"""

from collections.abc import Iterable
from difflib import get_close_matches
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # `vigil --help` needs the errors, and not the time that pydantic takes to load
    from pydantic import ValidationError

MAX_FAULT_CHARS = 300
"""Of a place, and of a message, that a file or a model wrote."""
MAX_PART_CHARS = 80
"""Of one name in a place."""


class VigilError(Exception):
    """Any error that VIGIL raises on purpose."""


class InputError(VigilError):
    """Bad input: the message names what, where and what to do."""


class HouseError(InputError):
    """A house document that cannot be loaded."""


class EpisodeError(InputError):
    """An episode that contradicts its house or the protocol."""


class PackMismatch(InputError):
    """A pack whose files differ from what its manifest says."""


class RecordError(InputError):
    """A run folder or record that cannot be read or continued."""


class SettingError(InputError):
    """A setting that makes no sense."""


class InfrastructureError(VigilError):
    """A failure that is not the agent's: retried, then `end="error"`."""


class SimulatorError(InfrastructureError):
    """A simulator that crashed, hung or broke its own contract."""


class ModelAPIError(InfrastructureError):
    """A model's provider failed: transport, rate limit, outage, or no image support."""


def first_error(error: "ValidationError", root: str = "the document") -> str:
    """Return "place: message" of the first thing that pydantic found wrong, both cut to a readable length.

    `root` names the place when it is all that was read. A message may quote what was read, which has any length.
    """
    fault = error.errors(include_url=False, include_context=False, include_input=False)[0]
    place = ".".join(shorten(str(part), MAX_PART_CHARS) for part in fault["loc"])
    return f"{shorten(place, MAX_FAULT_CHARS) or root}: {shorten(fault['msg'], MAX_FAULT_CHARS)}"


def shorten(text: str, max_chars: int) -> str:
    """Return a text with at most `max_chars` characters, its end replaced by "..." when it is longer."""
    return text if len(text) <= max_chars else f"{text[: max_chars - 3]}..."


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """Return " Did you mean 'x'?" for the known word nearest to `word`; empty when none is near."""
    close = get_close_matches(word, sorted(known), n=1)
    return f" Did you mean {close[0]!r}?" if close else ""
