"""Makers as rows of data: each row describes an asset by shapes, numbers and colours.

`docs/assets.md` describes the rows. A number is a share of the box: of its width along x, of its height along y, of its
depth along z; a radius is a share of the width. A string in place of a number is a formula; lengths that it computes
are in metres. When a category is made for the first time, its row is turned into Python expressions
(`vigil.assets.kernel.formulas`).
"""

import tomllib
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from inspect import Parameter, signature
from pathlib import Path
from typing import Any

import numpy as np

from vigil.assets.kernel.arrange import Maker, along_longest, lengthwise
from vigil.assets.kernel.asset import Asset
from vigil.assets.kernel.builder import Builder, PartStyle
from vigil.assets.kernel.formulas import GLOBALS, Known, Names, compiled, formula, text
from vigil.assets.kernel.row_words import ADDITIONS, CHANGES, DRAWS, SHAPES, WORDS
from vigil.base.geometry import Vec3
from vigil.errors import did_you_mean

Row = Mapping[str, Any]
Reader = Callable[[Any, Known, str], str]
"""Function that turns a value in a row into a Python expression, given the value, the names known there and an axis."""
Step = Callable[[Builder, Names], None]
"""Function that adds to an asset what one entry of a row describes."""
ARRANGED = {"lengthwise": lengthwise, "along_longest": along_longest}
ALONG = {"x": "_x", "y": "_y", "z": "_z"}
"""Axis -> name of a length (the box's, or 1 m if the row's `unit` is true). Numbers are shares of this length."""
SIDES = ("_x", "_y", "_z")
ACROSS = {"x": ("_z", "_y"), "y": ("_x", "_z"), "z": ("_x", "_y")}
"""Axis -> names of the box's sides along the other two axes, for shapes that are flat across the axis."""
_STYLE = {"look": "material", "lit": "lit", "joint": "joint", "shown": "shown", "opens": "opens", "toggles": "toggles"}
"""Key of a row -> field of `PartStyle` that it sets."""
_REPEATS = ("each", "let", "when")
_KEYS = frozenset({"about", "lies", "parts", "room", "unit", "values", "words"})


def _number(raw: Any, known: Known, side: str | None = None) -> str:
    """Return the expression of a formula or a number; if a `side` is given, a number is a share of this side."""
    if isinstance(raw, str):
        return formula(raw, known)
    if isinstance(raw, bool) or not isinstance(raw, int | float):
        raise ValueError(f"{raw!r} is neither a number nor a formula")
    return repr(raw) if side is None else f"{raw!r} * {side}"


def _numbers(raw: Any, known: Known, sides: Sequence[str | None]) -> str:
    """Return the expression of a list with one number for each side, or of a formula for the whole list."""
    if isinstance(raw, str):
        return formula(raw, known)
    if not isinstance(raw, list) or len(raw) != len(sides):
        raise ValueError(f"{raw!r} is not a list of {len(sides)} numbers")
    return f"({', '.join(_number(one, known, side) for one, side in zip(raw, sides, strict=True))})"


def _list(raw: Any, known: Known, read: Callable[[Any, Known], str]) -> str:
    """Return the expression of a list: one formula, or entries. An entry may stand for several values.

    An entry for several values is a formula that gives a list, or a table with `of` (the value) and `each` (the names
    and values with which it is repeated).
    """
    if isinstance(raw, str):
        return formula(raw, known)
    if not isinstance(raw, list):
        raise ValueError(f"{raw!r} is not a list")
    return f"[{', '.join(_entry(one, known, read) for one in raw)}]"


def _entry(raw: Any, known: Known, read: Callable[[Any, Known], str]) -> str:
    if isinstance(raw, str):
        return f"*{formula(raw, known)}"
    if not isinstance(raw, dict):
        return read(raw, known)
    rounds, names = _rounds(raw, known)
    return f"*[{read(raw['of'], known | set(names))} {rounds}]"


def _points(raw: Any, known: Known, sides: Sequence[str | None]) -> str:
    """Return the expression of a list of lists with one number for each side."""
    return _list(raw, known, lambda one, inner: _numbers(one, inner, sides))


def _radius(raw: Any, known: Known, axis: str) -> str:
    if isinstance(raw, list):
        return f"[{', '.join(_number(one, known, '_x') for one in raw)}]"
    return _number(raw, known, "_x")


def _turns(raw: Any, known: Known, axis: str) -> str:
    """Return the expression of rotations; each is an axis (vector or name), degrees, and maybe a point on the axis."""
    is_one = isinstance(raw, list) and len(raw) > 1 and not isinstance(raw[1], list)
    return _list([raw] if is_one else raw, known, _turn)


def _turn(raw: Any, known: Known) -> str:
    if not isinstance(raw, list) or len(raw) not in (2, 3):
        raise ValueError(f"{raw!r} is not [axis, degrees] or [axis, degrees, point]")
    about = repr(raw[0]) if isinstance(raw[0], str) else _numbers(raw[0], known, (None,) * 3)
    return f"({', '.join([about, _number(raw[1], known), *(_numbers(one, known, SIDES) for one in raw[2:])])})"


def _path(raw: Any, known: Known) -> str:
    """Return the expression of a list of points, or of three formulas, one for each coordinate of all points."""
    if isinstance(raw, list) and len(raw) == 3 and not any(isinstance(one, list | dict) for one in raw):
        return f"points{_numbers(raw, known, SIDES)}"
    return _points(raw, known, SIDES)


def _tier(raw: Any, known: Known) -> str:
    """Return the expression of an outline and its height."""
    outline, height = raw
    return f"({formula(outline, known)}, {_number(height, known, '_y')})"


_BY_READER: tuple[tuple[Reader, str], ...] = (
    (lambda raw, known, axis: _numbers(raw, known, SIDES), "size at move stretch"),
    (lambda raw, known, axis: _path(raw, known), "path ends"),
    (lambda raw, known, axis: _list(raw, known, _path), "rings"),
    (lambda raw, known, axis: _list(raw, known, _tier), "tiers"),
    (lambda raw, known, axis: _number(raw, known, ALONG[axis]), "length"),
    (lambda raw, known, axis: _numbers(raw, known, (ALONG[axis],) * 2), "between"),
    (lambda raw, known, axis: _numbers(raw, known, ACROSS[axis]), "area around"),
    (lambda raw, known, axis: _number(raw, known, "_y"), "tall floor clearance"),
    (lambda raw, known, axis: _number(raw, known, "_z"), "deep"),
    (lambda raw, known, axis: _numbers(raw, known, (None,) * 3), "rgb about"),
    (lambda raw, known, axis: f"lambda z: {formula(raw, known | {'z'})}", "bend"),
    (lambda raw, known, axis: text(raw, known), "look lit joint shown style name"),
    (lambda raw, known, axis: _points(raw, known, ACROSS[axis]), "outline hole"),
    (lambda raw, known, axis: _points(raw, known, (None, None)), "profile sides"),
    (_radius, "radius top wide"),
    (_turns, "turn"),
    (lambda raw, known, axis: repr(raw), "axis crease facing fit inside open opening opens outward toggles"),
)
READERS: dict[str, Reader] = {word: reader for reader, words in _BY_READER for word in words.split()}
"""Argument of a shape, change or addition -> its reader; other arguments are plain numbers or formulas."""


def _read(key: str, raw: Any, known: Known, axis: str = "y") -> str:
    return READERS[key](raw, known, axis) if key in READERS else _number(raw, known)


def _arguments(call: Callable[..., Any], word: str, entry: Row, known: Known, skipped: int = 0) -> str:
    """Return the expression of a function's arguments. The first argument is the entry's value for `word`."""
    parameters = dict(list(signature(call).parameters.items())[skipped:])
    whole = {key: 1 for key in ("wide", "deep", "tall") if key in parameters}
    given = whole | {next(iter(parameters)): entry[word]} | {key: entry[key] for key in entry if key != word}
    for key in given:
        if key not in parameters:
            raise ValueError(f"{word!r} cannot have the key {key!r}.{did_you_mean(key, parameters)}")
    missing = [key for key, each in parameters.items() if each.default is Parameter.empty and key not in given]
    if missing:
        raise ValueError(f"{word!r} needs {missing[0]!r}")
    named = entry.get("facing", entry.get("axis", "z" if word == "panel" else "y"))
    axis = named[-1:]
    if axis not in ALONG:
        raise ValueError(f"{named!r} is not an axis; the axes are x, y and z")
    return _dict({key: _read(key, raw, known, axis) for key, raw in given.items()})


def _dict(expressions: Mapping[str, str]) -> str:
    return f"{{{', '.join(f'{key!r}: {value}' for key, value in expressions.items())}}}"


def _shape(word: str, entry: Row, known: Known) -> Step:
    """Return the step that makes one shape, applies the entry's changes in their order, and adds the shape."""
    if "look" not in entry:
        raise ValueError(f"{word!r} needs 'look'")
    shaped = {key: raw for key, raw in entry.items() if key not in (*_STYLE, *CHANGES)}
    looks = _dict({own: _read(key, entry[key], known) for key, own in _STYLE.items() if key in entry})
    changes = [key for key in entry if key in CHANGES]
    changed = "".join(f"{_read(key, entry[key], known)}, " for key in changes)
    read = compiled(f"({_arguments(SHAPES[word], word, shaped, known)}, {looks}, ({changed}))")
    make, steps = SHAPES[word], [CHANGES[key] for key in changes]

    def add(builder: Builder, names: Names) -> None:
        arguments, look, values = read(names)
        part = make(**arguments)
        for change, value in zip(steps, values, strict=True):
            part = change(part, value)
        builder.add(PartStyle(**look), part)

    return add


def _step(entry: Any, known: Known) -> Step:
    """Return the step of one entry (a shape, an addition or a group), with its repetitions and its condition."""
    if not isinstance(entry, dict):
        raise ValueError(f"{entry!r} is not a table")
    rest = {key: raw for key, raw in entry.items() if key not in _REPEATS}
    rounds, own = _rounds(entry, known)
    words = [key for key in rest if key in SHAPES or key in ADDITIONS or key == "parts"]
    if len(words) != 1:
        held = ", ".join(words) or next((key for key in rest if key not in (*_STYLE, *READERS)), "none")
        near = "" if words else did_you_mean(held, {*SHAPES, *ADDITIONS})
        raise ValueError(
            f"an entry must have exactly one shape, one addition (e.g. 'hinge') or 'parts', not {held!r}.{near}"
        )
    do = _done(words[0], rest, known | set(own))
    if not rounds:
        return do
    found = compiled(f"[{_dict({name: name for name in own})} {rounds}]")

    def run(builder: Builder, names: Names) -> None:
        for values in found(names):
            do(builder, names | values)

    return run


def _done(word: str, entry: Row, known: Known) -> Step:
    if word == "parts":
        inherited = {key: raw for key, raw in entry.items() if key != "parts"}
        return _steps([inherited | each for each in entry["parts"]], known)
    if word in SHAPES:
        return _shape(word, entry, known)
    add = ADDITIONS[word]
    own = {key: raw for key, raw in entry.items() if key not in _STYLE or key in signature(add).parameters}
    arguments = compiled(_arguments(add, word, own, known, skipped=1))
    return lambda builder, names: add(builder, **arguments(names))


def _steps(entries: Sequence[Any], known: Known) -> Step:
    steps = []
    for place, entry in enumerate(entries, 1):
        try:
            steps.append(_step(entry, known))
        except ValueError as error:
            raise ValueError(f"part {place}: {error}") from None

    def run(builder: Builder, names: Names) -> None:
        for step in steps:
            step(builder, names)

    return run


def _rounds(entry: Row, known: Known) -> tuple[str, tuple[str, ...]]:
    """Return the loops of an entry, as the end of a comprehension, and the names to which they give values.

    The loops go over all combinations of the values in `each`. For each combination, they compute `let`, and skip the
    combination if `when` is false. The loops are empty if the entry has none of these keys.
    """
    loops, names = [], []
    for key, raw in entry.get("each", {}).items():
        loops.append(f"for {key} in {_options(_names(key), raw, known)}")
        names += _names(key)
    for key, raw in entry.get("let", {}).items():
        loops.append(f"for {key} in ({_number(raw, known | set(names))},)")
        names += _names(key)
    if "when" in entry:
        loops.append(f"{'' if loops else 'for _ in (0,) '}if {formula(entry['when'], known | set(names))}")
    return " ".join(loops), tuple(names)


def _names(key: str) -> list[str]:
    """Return the names in a key such as "x, z". Raises ValueError if a name is invalid or is the name of a function."""
    names = key.split(", ")
    for name in names:
        if not name.isidentifier() or name.startswith("_") or name in GLOBALS:
            raise ValueError(f"{name!r} cannot be the name of a value")
    return names


def _options(keys: list[str], raw: Any, known: Known) -> str:
    """Return the expression of a list of values for one or more names: a list, a number to count to, or a formula."""
    if isinstance(raw, str):
        return formula(raw, known)
    options = list(range(raw)) if isinstance(raw, int) else raw
    return f"[{', '.join(_option(keys, option, known) for option in options)}]"


def _option(keys: list[str], option: Any, known: Known) -> str:
    """Return the expression of one value, or of a tuple with one value for each of several names; strings are texts."""
    if len(keys) == 1:
        return text(option, known) if isinstance(option, str) else repr(option)
    if not isinstance(option, list) or len(option) != len(keys):
        raise ValueError(f"option {option!r} does not give one value for each of {', '.join(keys)}")
    return f"({', '.join(_option(keys[:1], one, known) for one in option)})"


Draw = Callable[[np.random.Generator, Names], Any]
"""Function that draws or computes a value from a random stream and the values known so far."""


def _value(keys: list[str], raw: Any, known: Known, shared: Row) -> Draw:
    """Return the function that draws, looks up or computes the value of a name, or of several names at once."""
    if not isinstance(raw, list | dict):
        value = compiled(_number(raw, known))
        return lambda _, names: value(names)
    table = {"of": raw} if isinstance(raw, list) else raw
    if "by" in table:
        return _table(table, known)
    kinds = [kind for kind in table if kind in DRAWS]
    if len(kinds) != 1 or set(table) - {"when", "without", *DRAWS}:
        raise ValueError(
            f"the value needs exactly one of {', '.join(DRAWS)} (a random draw), or 'by' (a table of values by "
            "another value)"
        )
    return _drawn(keys, kinds[0], table, known, shared)


def _drawn(keys: list[str], kind: str, table: Row, known: Known, shared: Row) -> Draw:
    draw, setting = DRAWS[kind], table[kind]
    if isinstance(setting, str) and setting in shared:
        setting = shared[setting]
    for word in [setting] if isinstance(setting, str) else setting if kind in WORDS else ():
        if kind in WORDS and word not in WORDS[kind]:
            raise ValueError(f"{word!r} is not among {kind}.{did_you_mean(word, WORDS[kind])}")
    found = compiled(_options(keys, setting, known) if kind == "of" else repr(setting))
    condition = compiled(formula(table["when"], known)) if "when" in table else None
    is_code = kind == "colours" and len(keys) == 1

    def drawn(rng: np.random.Generator, names: Names) -> Any:
        if condition is not None and not condition(names):
            return (False,) * len(keys) if len(keys) > 1 else False
        options, used = found(names), names.get(table.get("without", ""))
        value = draw(rng, [option for option in options if option != used] if used else options)
        return value[1] if is_code else value

    return drawn


def _table(table: Row, known: Known) -> Draw:
    """Return the function that looks up a value in a table: the entry for the value of `by`, else the entry "other"."""
    by = table["by"]
    if by not in known:
        raise ValueError(f"the table needs the value {by!r}, which does not exist here.{did_you_mean(by, known)}")
    found = compiled(_dict({key: _option([key], option, known) for key, option in table.items() if key != "by"}))

    def looked_up(_: np.random.Generator, names: Names) -> Any:
        options = found(names)
        return options.get(str(names[by]), options.get("other"))

    return looked_up


def maker_of(category: str, row: Row, shared: Row) -> Maker:
    """Return the maker that a row describes. Raises ValueError, which says where the row is wrong and why."""
    for key in row:
        if key not in _KEYS:
            raise ValueError(f"a row cannot have the key {key!r}.{did_you_mean(key, _KEYS)}")
    if "about" not in row:
        raise ValueError("a row needs 'about', which says what the thing is")
    known: Known = frozenset(("category", "width", "height", "depth", "levels"))
    values = []
    for key, raw in row.get("values", {}).items():
        try:
            names = _names(key)
            values.append((names, _value(names, raw, known, shared)))
        except ValueError as error:
            raise ValueError(f"value {key!r}: {error}") from None
        known |= set(names)
    steps = _steps(row.get("parts", []), known)
    words = compiled(f"[{', '.join(text(word, known) for word in row.get('words', []))}]")

    def make(size: Vec3, rng: np.random.Generator, levels: Sequence[float]) -> Asset:
        builder = Builder(category, size)
        found = GLOBALS | {"category": category, "width": size.x, "height": size.y, "depth": size.z, "levels": levels}
        found |= zip(SIDES, (1.0, 1.0, 1.0) if row.get("unit") else size, strict=True)
        for names, draw in values:
            value = draw(rng, found)
            found |= zip(names, value, strict=True) if len(names) > 1 else {names[0]: value}
        steps(builder, found)
        return builder.build(filter(None, words(found)), takes_room=row.get("room", True))

    return ARRANGED[row["lies"]](make) if "lies" in row else make


def makers_in(path: Path) -> dict[str, Maker]:
    """Return the makers in a file of rows, by category. A row is read when its category is made for the first time.

    A maker whose row is wrong raises ValueError, which names the file, the row and the part.
    """
    rows = tomllib.loads(path.read_text(encoding="utf-8"))
    shared = rows.pop("shared", {})
    return {category: _read_later(path.name, category, row, rows, shared) for category, row in rows.items()}


def _read_later(file: str, category: str, row: Row, rows: Row, shared: Row) -> Maker:
    @cache
    def maker() -> Maker:
        try:
            return maker_of(category, rows[row["like"]] if "like" in row else row, shared)
        except (KeyError, ValueError) as error:
            raise ValueError(f"{file}: {category}: {error}") from None

    return lambda size, rng, levels: maker()(size, rng, levels)
