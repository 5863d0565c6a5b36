"""Names of packaged packs: NAME_vN_M, where NAME alone means the newest version that is packaged."""

import re
from collections.abc import Iterable

STREAM = "stream:"
"""How the address of a stream of episodes begins, which is no pack's name."""
_VERSIONED = re.compile(r"(?P<stem>.+?)_v(?P<version>\d+(?:_\d+)*)")


def newest_version(name: str, known: Iterable[str]) -> str | None:
    """Return the known name of the highest version of `name`, which itself names no version; None when none is."""
    versions = {version_of(each): each for each in known if stem_of(each) == name}
    return versions[max(versions)] if name and versions else None


def newer_version(name: str, known: Iterable[str]) -> str | None:
    """Return the newest known version of the pack that `name` names another version of; None when there is none."""
    stem = stem_of(name)
    return newest_version(stem, known) if stem is not None else None


def stem_of(name: str) -> str | None:
    """Return a name without its version; None when it has none."""
    match = _VERSIONED.fullmatch(name)
    return match["stem"] if match else None


def other_names(name: str, aliases: Iterable[str]) -> list[str]:
    """Return what a pack may be called besides, each once."""
    return [other for other in dict.fromkeys((stem_of(name), *aliases)) if other and other != name]


def version_words(name: str, version: str) -> str:
    """Return a pack's version as its name says it, else as its manifest does."""
    return ".".join(map(str, version_of(name))) or version


def version_of(name: str) -> tuple[int, ...]:
    """Return a name's version, e.g. (1, 1) of `mini_v1_1`; () when it has none."""
    match = _VERSIONED.fullmatch(name)
    return tuple(map(int, match["version"].split("_"))) if match else ()
