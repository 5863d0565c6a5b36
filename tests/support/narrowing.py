"""Values as the type that a test expects; it fails if they are something else."""

from typing import TypeVar

from vigil.protocol.actions import InvalidAction, ParsedReply

T = TypeVar("T")


def present(value: T | None) -> T:
    """Return a value that must not be None."""
    assert value is not None
    return value


def accepted(parsed: ParsedReply | InvalidAction) -> ParsedReply:
    """Return the action of a reply that must be valid."""
    assert isinstance(parsed, ParsedReply), parsed
    return parsed


def rejected(parsed: ParsedReply | InvalidAction) -> InvalidAction:
    """Return the fault of a reply that must be invalid."""
    assert isinstance(parsed, InvalidAction), parsed
    return parsed
