"""The address of a stream, `stream:SEED` or `stream:SEED@VERSION`, and the version that a stream depends on."""

import re

from vigil.authoring.drafting.drafts import DRAFTS_VERSION
from vigil.base.versions import RULES_VERSION, SHAPES_VERSION
from vigil.errors import SettingError
from vigil.housegen.generate import GENERATOR_VERSION
from vigil.packs.names import STREAM
from vigil.packs.private import secret_name

_ADDRESS = re.compile(rf"{STREAM}(?P<seed>\d{{1,40}})(?:@(?P<version>[\d.]+))?", re.ASCII)


def stream_version() -> str:
    """Return the versions of houses, shapes, rules and drafts, e.g. `7.5.3.8`. A stream's bytes depend on all four."""
    return f"{GENERATOR_VERSION}.{SHAPES_VERSION}.{RULES_VERSION}.{DRAFTS_VERSION}"


def is_stream(address: object) -> bool:
    """Return whether a value is the address of a stream, rather than the name or folder of a pack."""
    return isinstance(address, str) and address.startswith(STREAM)


def seed_in(address: str) -> int:
    """Return the seed in the address of a stream.

    Raises SettingError if the address is malformed, or if its version is not the version of this package.
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
    """Return the address of the stream with this seed and this package's version."""
    return f"{STREAM}{seed}@{stream_version()}"


def hidden_address_of(seed: int) -> str:
    """Return a text that stands for the address of a stream with a secret seed; the same for equal streams."""
    return f"{STREAM}{secret_name(seed, 'secret', b'')}@{stream_version()}"
