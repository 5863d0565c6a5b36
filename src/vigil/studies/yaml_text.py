"""YAML files that people write: reads plain values and the line of every key; errors name the file, line and key."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from vigil.errors import SettingError

MAX_BYTES = 1_000_000
MAX_DEPTH = 50
"""Maximum number of lists and mappings around a value."""
Place = tuple[str | int, ...]
"""Keys and indices that lead from the top of the document to a value."""
_GUESSED = frozenset({"tag:yaml.org,2002:bool", "tag:yaml.org,2002:timestamp"})
"""Types that YAML 1.1 gives to unquoted texts such as `on` and `2026-01-01`."""


class _Loader(yaml.SafeLoader):
    """Loader that reads dates and the words `on`, `off`, `yes` and `no` as texts."""


_Loader.yaml_implicit_resolvers = {
    first: [(tag, pattern) for tag, pattern in found if tag not in _GUESSED]
    for first, found in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
_Loader.add_implicit_resolver("tag:yaml.org,2002:bool", re.compile("(?:true|false)$"), list("tf"))


class _TextLoader(yaml.BaseLoader):
    """Loader that reads every value as text, except that an empty value and `null` are None."""


_TextLoader.add_implicit_resolver("tag:yaml.org,2002:null", re.compile("(?:null|~|)$"), ["n", "~", ""])
_TextLoader.add_constructor("tag:yaml.org,2002:null", lambda loader, node: None)


@dataclass(frozen=True)
class YamlText:
    """The values in a YAML file, with the line of every key and item."""

    path: Path
    value: Any
    lines: dict[Place, int]
    """Place of each key and list item -> its line number, from 1."""

    def error(self, place: Place, message: str) -> SettingError:
        """Return an error about the value at `place`, with the line of the innermost part of `place` that is in the
        file."""
        known = next((place[:end] for end in range(len(place), -1, -1) if place[:end] in self.lines), ())
        key = f", {place_text(place)}" if place else ""
        return SettingError(f"{str(self.path)!r}, line {self.lines[known]}{key}: {message}")


def place_text(place: Place) -> str:
    """Return a place as readable text, such as `models[2].settings.limit`. List items are counted from 1."""
    parts = [f"[{part + 1}]" if isinstance(part, int) else f".{part}" for part in place]
    return "".join(parts).removeprefix(".")


def read_yaml(path: Path, *, is_text: bool = False) -> YamlText:
    """Return the values in a YAML file; with `is_text`, numbers stay texts, so that an id of digits is not changed.

    Raises SettingError if the file cannot be read, or has duplicate keys or aliases.
    """
    loader = _TextLoader if is_text else _Loader
    try:
        raw = path.read_bytes()
    except OSError as error:
        raise SettingError(
            f"{str(path)!r} cannot be read: {error.strerror}. Give a YAML file that can be read."
        ) from None
    if len(raw) > MAX_BYTES:
        raise SettingError(f"{str(path)!r} has {len(raw):,} bytes, but may have at most {MAX_BYTES:,}.")
    try:
        text = raw.decode()
        _check_structure(path, text)
        root = yaml.compose(text, loader)
        value = yaml.load(text, loader)
    except UnicodeDecodeError as error:
        raise SettingError(
            f"{str(path)!r} is not UTF-8 text: byte {error.start} is invalid. Save it as UTF-8."
        ) from None
    except yaml.YAMLError as error:
        raise SettingError(_syntax_error(path, error)) from None
    if root is None:
        raise SettingError(f"{str(path)!r} is empty. Write the keys of the file into it; the docs show an example.")
    found = YamlText(path, value, {(): root.start_mark.line + 1})
    for place, line in _lines(root):
        if place in found.lines:
            raise found.error(place, f"the key is a duplicate of line {line}. Remove one of them.")
        found.lines[place] = line
    return found


def _check_structure(path: Path, text: str) -> None:
    """Raise SettingError at an alias or at deep nesting, which take long to read or exceed the recursion limit."""
    depth = 0
    for event in yaml.parse(text, _Loader):
        if isinstance(event, yaml.AliasEvent):
            fault = "aliases (*name) are not allowed. Write the value itself."
        elif depth > MAX_DEPTH:
            fault = f"values are nested more than {MAX_DEPTH} levels deep. Use fewer levels."
        else:
            depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
            continue
        raise SettingError(f"{str(path)!r}, line {event.start_mark.line + 1}: {fault}")


def _lines(node: yaml.Node, place: Place = ()) -> Iterator[tuple[Place, int]]:
    """Yield the place and the line of every key and item below a node."""
    if isinstance(node, yaml.MappingNode):
        for key, below in node.value:
            here = (*place, str(key.value))
            yield here, key.start_mark.line + 1
            yield from _lines(below, here)
    elif isinstance(node, yaml.SequenceNode):
        for index, below in enumerate(node.value):
            yield (*place, index), below.start_mark.line + 1
            yield from _lines(below, (*place, index))


def _syntax_error(path: Path, error: yaml.YAMLError) -> str:
    mark, problem = getattr(error, "problem_mark", None), getattr(error, "problem", None) or str(error)
    where = "" if mark is None else f", line {mark.line + 1}, column {mark.column + 1}"
    return f"{str(path)!r}{where}: this is not YAML: {problem}."
