"""The address of a stream, `stream:SEED` or `stream:SEED@VERSION`, and the version of the code that makes streams."""

import re

from vigil.authoring.drafting.drafts import DRAFTS_VERSION
from vigil.base.versions import RULES_VERSION, SHAPES_VERSION
from vigil.errors import SettingError
from vigil.housegen.generate import GENERATOR_VERSION
from vigil.packs.names import STREAM
from vigil.packs.private import secret_name

_ADDRESS = re.compile(rf"{STREAM}(?P<seed>\d{{1,40}})(?:@(?P<version>[\d.]+))?", re.ASCII)


def stream_version() -> str:
    """Return the versions of houses, shapes, rules and drafts, on which a stream's bytes depend, e.g. `6.5.3.5`."""
    return f"{GENERATOR_VERSION}.{SHAPES_VERSION}.{RULES_VERSION}.{DRAFTS_VERSION}"


def is_stream(address: object) -> bool:
    """Return whether a value is the address of a stream, not a pack's name or folder."""
    return isinstance(address, str) and address.startswith(STREAM)


def seed_in(address: str) -> int:
    """Return the seed of the stream at an address.

    Raises SettingError if the address is malformed or its version is not that of this package.
    """
    match = _ADDRESS.fullmatch(address)
    if match is None:
        raise SettingError(f"Stream {address!r}: expected {STREAM}SEED with a seed of 0 or more, e.g. {STREAM}7.")
    asked, here = match["version"], stream_version()
    if asked is not None and asked != here:
        raise SettingError(
            f"Stream {address!r} asks for version {asked}, but this package makes version {here} (of houses, "
            f"shapes, rules and drafts), which has other episodes. Install the package that makes version {asked}, "
            "or leave out the version."
        )
    return int(match["seed"])


def address_of(seed: int) -> str:
    """Return the address of a stream with this package's version."""
    return f"{STREAM}{seed}@{stream_version()}"


def hidden_address_of(seed: int) -> str:
    """Return a text in place of the address of a stream with a secret seed; equal streams have equal texts."""
    return f"{STREAM}{secret_name(seed, 'secret', b'')}@{stream_version()}"
