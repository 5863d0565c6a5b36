"""Ways to corrupt the files of a run's folder, each drawn from a seed and described in a few words."""

import json
import os
import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

from vigil.records.record import EPISODES_FILE, HEADER_FILE

ODD_VALUES = (
    None,
    True,
    -1,
    10**400,
    1.5,
    "",
    "x" * 100_000,
    [],
    {},
    [[]],
    float("nan"),
    float("inf"),
    "\ud800",
    "\x00",
    -(2**70),
)
Corruption = Callable[[random.Random, Path], str]


def _cut(rng: random.Random, path: Path) -> str:
    data = path.read_bytes()
    size = rng.randrange(len(data))
    path.write_bytes(data[:size])
    return f"cut to {size} of {len(data)} bytes"


def _flip(rng: random.Random, path: Path) -> str:
    data = bytearray(path.read_bytes())
    places = [rng.randrange(len(data)) for _ in range(rng.choice((1, 1, 2, 20)))]
    for place in places:
        data[place] ^= 1 << rng.randrange(8)
    path.write_bytes(bytes(data))
    return f"bits flipped at {places[:3]}"


def _overwrite(rng: random.Random, path: Path) -> str:
    data = bytearray(path.read_bytes())
    start, size = rng.randrange(len(data)), rng.randint(1, 2000)
    data[start : start + size] = rng.choice((b"\x00" * size, b"\xff" * size, rng.randbytes(size), b"\n" * size))
    path.write_bytes(bytes(data))
    return f"{size} bytes overwritten at {start}"


def _lines(change: Callable[[random.Random, list[bytes]], str]) -> Corruption:
    def corrupt(rng: random.Random, path: Path) -> str:
        lines = path.read_bytes().splitlines(keepends=True)
        description = change(rng, lines)
        path.write_bytes(b"".join(lines))
        return description

    return corrupt


def _duplicate(rng: random.Random, lines: list[bytes]) -> str:
    lines.insert(rng.randint(0, len(lines)), rng.choice(lines))
    return "a line twice"


def _shuffle(rng: random.Random, lines: list[bytes]) -> str:
    rng.shuffle(lines)
    return "lines in another order"


def _remove(rng: random.Random, lines: list[bytes]) -> str:
    lines.pop(rng.randrange(len(lines)))
    return "a line removed"


ALIEN_LINES = (
    b"\n",
    b"  \n",
    b"null\n",
    b"[]\n",
    b"{}\n",
    b"7\n",
    b"NaN\n",
    b'"text"\n',
    b"[" * 100_000 + b"\n",
    b'{"a":' * 100_000 + b"\n",
    b"[" * 900 + b"]" * 900 + b"\n",
    b"\x00" * 4096 + b"\n",
    b"\xff\xfe\n",
    b"\r\n",
    b"9" * 5000 + b"\n",
    b'{"schema_version": 99}\n',
    b'{"a": "' + b"x" * 5_000_000 + b'"}\n',
    b'"\\ud800"\n',
    b"\xe2\x80\xa8\n",
    b"// note\n",
    b"<<<<<<< HEAD\n",
    b"\x0b\n",
    b"\x85\n",
)


def _insert(rng: random.Random, lines: list[bytes]) -> str:
    line = rng.choice(ALIEN_LINES)
    lines.insert(rng.randint(0, len(lines)), line)
    return f"line {line[:20]!r} inserted"


def _value(rng: random.Random, lines: list[bytes]) -> str:
    number = rng.randrange(len(lines))
    document = json.loads(lines[number])
    description = change_value(rng, document)
    lines[number] = json.dumps(document).encode() + b"\n"
    return f"line {number + 1}: {description}"


def change_value(rng: random.Random, document: Any) -> str:
    """Replace, removes or adds one value somewhere in a JSON document."""
    place, holder = [], document
    while True:
        keys = list(holder) if isinstance(holder, dict) else list(range(len(holder)))
        key = rng.choice(keys)
        place.append(str(key))
        if not isinstance(holder[key], (dict, list)) or not holder[key] or rng.random() < 0.2:
            break
        holder = holder[key]
    share = rng.random()
    if share < 0.2:
        del holder[key]
        return f"{'.'.join(place)} removed"
    if share < 0.3 and isinstance(holder, dict):
        holder["unknown"] = rng.choice(ODD_VALUES)
        return f"something beside {'.'.join(place)}"
    holder[key] = rng.choice(ODD_VALUES)
    return f"{'.'.join(place)} = {str(holder[key])[:20]!r}"


def _header_value(rng: random.Random, path: Path) -> str:
    document = json.loads(path.read_bytes())
    description = change_value(rng, document)
    path.write_text(json.dumps(document))
    return description


def _prefixed(prefix: bytes) -> Corruption:
    def corrupt(rng: random.Random, path: Path) -> str:
        path.write_bytes(prefix + path.read_bytes())
        return f"begins with {prefix!r}"

    return corrupt


def _crlf(rng: random.Random, path: Path) -> str:
    path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
    return "CRLF"


def _utf16(rng: random.Random, path: Path) -> str:
    path.write_bytes(path.read_text().encode("utf-16"))
    return "UTF-16"


def _filled(data: bytes, name: str) -> Corruption:
    def corrupt(rng: random.Random, path: Path) -> str:
        path.write_bytes(data)
        return name

    return corrupt


def _replaced(put: Callable[[Path], object], name: str) -> Corruption:
    def corrupt(rng: random.Random, path: Path) -> str:
        path.unlink()
        put(path)
        return name

    return corrupt


def _unreadable(rng: random.Random, path: Path) -> str:
    path.chmod(0)
    return "no permission"


FILE_CORRUPTIONS: tuple[Corruption, ...] = (
    _cut,
    _cut,
    _cut,
    _flip,
    _flip,
    _flip,
    _overwrite,
    _crlf,
    _utf16,
    _unreadable,
    _prefixed(b"\xef\xbb\xbf"),
    _prefixed(b"\x00"),
    _prefixed(b"\n\n"),
    _filled(b"", "empty"),
    _filled(b"\x00" * 10_000, "NUL bytes alone"),
    _filled(b"\n" * 9, "line breaks alone"),
    _filled(b"[" * 200_000, "a nesting bomb"),
    _replaced(lambda path: None, "missing"),
    _replaced(Path.mkdir, "a folder"),
    _replaced(lambda path: path.symlink_to(path), "a link to itself"),
    _replaced(os.mkfifo, "a pipe"),
    _replaced(lambda path: path.symlink_to("/dev/zero"), "a link to /dev/zero"),
)
ROW_CORRUPTIONS: tuple[Corruption, ...] = tuple(
    map(_lines, (_duplicate, _shuffle, _remove, _insert, _insert, _value, _value, _value, _value))
)
HEADER_CORRUPTIONS: tuple[Corruption, ...] = (_header_value,) * 6


def corrupt(rng: random.Random, folder: Path) -> str:
    """Corrupt one file of a run's folder and return what was done."""
    frames = sorted((folder / "frames").rglob("*.png"))
    choices = [
        (EPISODES_FILE, (*FILE_CORRUPTIONS, *ROW_CORRUPTIONS, *ROW_CORRUPTIONS)),
        (HEADER_FILE, (*FILE_CORRUPTIONS, *HEADER_CORRUPTIONS)),
    ]
    name, corruptions = rng.choice(
        [*choices, *choices, (str(rng.choice(frames).relative_to(folder)), FILE_CORRUPTIONS[:7])]
    )
    corruption = rng.choice([each for each in corruptions if not (each is _utf16 and name.endswith(".png"))])
    return f"{name}: {corruption(rng, folder / name)}"
