"""The address of a stream, `stream:SEED` or `stream:SEED@VERSION`, and the version of what streams are made by."""

import re

from vigil.authoring.drafting.drafts import DRAFTS_VERSION
from vigil.base.versions import RULES_VERSION, SHAPES_VERSION
from vigil.errors import SettingError
from vigil.housegen.generate import GENERATOR_VERSION
from vigil.packs.names import STREAM
from vigil.packs.private import secret_name

_ADDRESS = re.compile(rf"{STREAM}(?P<seed>\d{{1,40}})(?:@(?P<version>[\d.]+))?", re.ASCII)


def stream_version() -> str:
    """Return the versions that a stream's bytes depend on: of houses, shapes, rules and drafts, e.g. `5.4.3.4`."""
    return f"{GENERATOR_VERSION}.{SHAPES_VERSION}.{RULES_VERSION}.{DRAFTS_VERSION}"


def is_stream(address: object) -> bool:
    """Whether something is meant as the address of a stream, and not as a pack's name or folder."""
    return isinstance(address, str) and address.startswith(STREAM)


def seed_in(address: str) -> int:
    """Return the seed of the stream at an address.

    Raises SettingError on one that is malformed, or names another version than this package's.
    """
    match = _ADDRESS.fullmatch(address)
    if match is None:
        raise SettingError(f"Stream {address!r}: expected {STREAM}SEED, e.g. {STREAM}7, the seed a number from 0 on.")
    asked, here = match["version"], stream_version()
    if asked is not None and asked != here:
        raise SettingError(
            f"Stream {address!r} asks for version {asked}; this package makes version {here} (of houses, shapes, rules "
            "and drafts), whose episodes differ. Install the package that made it, or leave out the version."
        )
    return int(match["seed"])


def address_of(seed: int) -> str:
    """Return the address of a stream as this package makes it, with its version."""
    return f"{STREAM}{seed}@{stream_version()}"


def hidden_address_of(seed: int) -> str:
    """Return what stands for the address of a stream whose seed is secret: the same for the same stream."""
    return f"{STREAM}{secret_name(seed, 'secret', b'')}@{stream_version()}"
