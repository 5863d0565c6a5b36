"""Names of packaged packs, e.g. `mini_v1_1`: a stem and a version. The stem alone means the newest packaged version."""

import re
from collections.abc import Iterable

STREAM = "stream:"
"""Prefix of the address of a stream of episodes. A text with this prefix is not the name of a pack."""
_VERSIONED = re.compile(r"(?P<stem>.+?)_v(?P<version>\d+(?:_\d+)*)")


def newest_version(name: str, known: Iterable[str]) -> str | None:
    """Return the newest of the known names whose stem (name without version) is `name`; None if there is none."""
    versions = {version_of(each): each for each in known if stem_of(each) == name}
    return versions[max(versions)] if name and versions else None


def newer_version(name: str, known: Iterable[str]) -> str | None:
    """Return the newest known version of a pack, given its name with any version; None if no version is known."""
    stem = stem_of(name)
    return newest_version(stem, known) if stem is not None else None


def stem_of(name: str) -> str | None:
    """Return the stem of a name: the name without its version. None if the name does not have a version."""
    match = _VERSIONED.fullmatch(name)
    return match["stem"] if match else None


def other_names(name: str, aliases: Iterable[str]) -> list[str]:
    """Return the other names of a pack, without duplicates: its stem and its aliases."""
    return [other for other in dict.fromkeys((stem_of(name), *aliases)) if other and other != name]


def version_words(name: str, version: str) -> str:
    """Return the version in a pack's name as text, e.g. "1.1" for `mini_v1_1`.

    If the name does not have a version, return `version`, which comes from the manifest.
    """
    return ".".join(map(str, version_of(name))) or version


def version_of(name: str) -> tuple[int, ...]:
    """Return the version in a name, e.g. (1, 1) for `mini_v1_1`; () if the name does not have a version."""
    match = _VERSIONED.fullmatch(name)
    return tuple(map(int, match["version"].split("_"))) if match else ()
