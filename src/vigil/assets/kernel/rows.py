"""Makers as rows of data: things that are turned, boxed, bent or stacked from numbers and colours.

`docs/extending.md` describes the rows. A number is a share of the box: of its width along x, of its height along y, of
its depth along z; a radius is a share of the width. A string in place of a number is a formula, in metres where it is a
length.
"""

import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import reduce
from inspect import Parameter, signature
from itertools import product
from pathlib import Path
from string import Formatter
from typing import Any

import numpy as np

from vigil.assets.kernel import shapes
from vigil.assets.kernel.arrange import Maker, along_longest, bend, creased, drape, lathed_oval, lengthwise, strip
from vigil.assets.kernel.asset import Asset, Glow
from vigil.assets.kernel.builder import UNBOUNDED_M, Builder, PartStyle
from vigil.assets.kernel.formulas import Names, Value, formula
from vigil.assets.kernel.furniture_parts import add_case, add_legs, cloth, lining, wood
from vigil.assets.kernel.palette import COLOURS, one_of
from vigil.base.geometry import Vec3
from vigil.errors import did_you_mean

Row = Mapping[str, Any]
Step = Callable[[Builder, Names], None]
"""Function that adds one entry of a row's parts to an asset."""
Known = frozenset[str]
"""Names that formulas and texts at one place of a row may use."""
SIDES = ("x side", "y side", "z side")
"""Names of the lengths of which numbers are shares: the box's, or 1 m in a row whose `unit` is true."""
ALONG = dict(zip("xyz", SIDES, strict=True))
ACROSS = {"x": SIDES[:0:-1], "y": SIDES[::2], "z": SIDES[:2]}
"""Sides of the box along the two axes of what is flat across an axis."""


def _oval(profile: list, wide: float, deep: float, tall: float, at: Any = None, segments: int = 18) -> shapes.Mesh:
    return _at(lathed_oval([(radius, y * tall) for radius, y in profile], wide, deep, segments), at)


def _at(part: shapes.Mesh, at: Any) -> shapes.Mesh:
    return part if at is None else shapes.translate(part, at)


SHAPES: dict[str, Callable[..., shapes.Mesh]] = {
    "ball": lambda size, at=shapes.ORIGIN, segments=16, bands=8: shapes.ellipsoid(size, at, segments, bands),
    "box": lambda size, at=shapes.ORIGIN, bevel=0.0: shapes.box(size, at, bevel),
    "cushion": lambda size, at=shapes.ORIGIN: shapes.cushion(size, at),
    "cylinder": lambda radius, length, at=shapes.ORIGIN, axis="y", segments=16, top=None: shapes.cylinder(
        radius, length, at, axis, segments, top
    ),
    "disc": lambda radius, at=shapes.ORIGIN, axis="y", segments=18: shapes.disc(radius, at, axis, segments),
    "drape": lambda area, waves, thick, thickness, at=None: _at(drape(*area, waves, thick, thickness=thickness), at),
    "extrude": lambda outline, between, axis="y", at=None: _at(shapes.extrude(outline, *between, axis), at),
    "lining": lambda ends: lining(*ends),
    "loft": lambda rings: shapes.loft(np.array(rings)),
    "lathe": lambda points, at=shapes.ORIGIN, segments=18: shapes.lathe(points, at, segments),
    "panel": lambda area, at=shapes.ORIGIN, facing="+z", fit=True: shapes.panel(*area, at, facing, fit),
    "rounded": lambda size, at=shapes.ORIGIN, bevel=0.02, puff=0.0: shapes.rounded_box(size, at, bevel, puff),
    "slab": lambda size, at=shapes.ORIGIN, bevel=0.05: shapes.slab(size, at, bevel),
    "span": lambda ends, bevel=0.0: shapes.span(*ends, bevel),
    "strip": lambda sides, thick, level=0.0, at=None: _at(strip(sides, thick, level), at),
    "tube": lambda path, radius, segments=8: shapes.tube(path, radius, segments),
    "turned": _oval,
}
"""Shapes of parts by their names in rows; the first argument is the value of the name."""


def _surface(
    builder: Builder, name: str, at: Any, area: Any, clearance: float = UNBOUNDED_M,
    inside: bool = False, opening: bool = False, joint: str | None = None,
) -> None:  # fmt: skip
    builder.surface(name, at, area, clearance, is_inside=inside, needs_opening=opening, joint=joint)


def _glow(builder: Builder, rgb: Any, at: Any, strength: float) -> None:
    builder.glow = Glow(Vec3(*map(float, at)), tuple(rgb), strength)


ADDITIONS: dict[str, Callable[..., Any]] = {
    "case": lambda builder, ends, look, wall, open="+z": add_case(builder, look, *ends, wall, missing=open),
    "legs": lambda builder, area, look, length, thick, style, x=0.0, z=0.0: add_legs(
        builder, look, area, length, thick, style, (x, z)
    ),
    "column": lambda builder, radius, between: builder.column(radius, *between),
    "glow": _glow,
    "hinge": lambda builder, name, turns, at, degrees: builder.hinge(name, turns, at, degrees),
    "octagon": lambda builder, area, between: builder.octagon(*area, *between),
    "solid": lambda builder, ends, joint=None: builder.solid(*ends, joint),
    "surface": _surface,
    "walls": lambda builder, area, floor, x=0.0, z=0.0: builder.walls(*area, floor, x, z),
}
"""What a row adds besides parts; the first argument is the value of the name."""
_STYLE = ("look", "lit", "joint", "shown", "toggles")
CHANGES: dict[str, Callable[[shapes.Mesh, Any], shapes.Mesh]] = {
    "bend": bend,
    "crease": lambda part, is_sharp: creased(part) if is_sharp else part,
    "move": shapes.translate,
    "stretch": shapes.scale,
    "turn": lambda part, turns: reduce(lambda turned, turn: shapes.rotate(turned, *turn), turns, part),
}
"""What is done to a part after it is made."""


def _text(raw: Any, known: Known, axis: str) -> Value:
    """Return the value of a text with names in braces; a text that is one name only keeps the value's type."""
    if not isinstance(raw, str):
        raise ValueError(f"{raw!r} is not a text")
    fields = [field for _, field, _, _ in Formatter().parse(raw) if field is not None]
    for field in fields:
        if field not in known:
            raise ValueError(f"{raw!r} names {field!r}, which has no value here.{did_you_mean(field, known)}")
    if fields and raw == f"{{{fields[0]}}}":
        return lambda names: names[fields[0]]
    return raw.format_map if fields else lambda _: raw


def _number(side: str | None) -> Callable[[Any, Known, str], Value]:
    """Return the reader of a formula, or of a number, which is a share of a side if one is given."""

    def read(raw: Any, known: Known, axis: str) -> Value:
        if isinstance(raw, str):
            return formula(raw, known)
        if isinstance(raw, bool) or not isinstance(raw, int | float):
            raise ValueError(f"{raw!r} is neither a number nor a formula")
        return (lambda _: raw) if side is None else (lambda names: raw * names[side])

    return read


def _numbers(raw: Any, known: Known, sides: Iterable[str | None]) -> Value:
    """Return the value of a list of numbers, one for each side, or of a name that stands for the list."""
    wanted = tuple(sides)
    if isinstance(raw, str):
        return formula(raw, known)
    if not isinstance(raw, list) or len(raw) != len(wanted):
        raise ValueError(f"{raw!r} is not a list of {len(wanted)} numbers")
    parts = [_number(side)(entry, known, "y") for entry, side in zip(raw, wanted, strict=True)]
    return lambda names: tuple([part(names) for part in parts])


def _list(raw: Any, known: Known, read: Callable[[Any, Known], Value]) -> Value:
    """Return the value of a list: a formula, or a list of entries, some of which may stand for several.

    Such an entry is a formula of a list, or a table whose `of` is made for each value of its `each`.
    """
    if isinstance(raw, str):
        return formula(raw, known)
    if not isinstance(raw, list):
        raise ValueError(f"{raw!r} is not a list")
    parts = [_several(one, known, read) if isinstance(one, str | dict) else read(one, known) for one in raw]
    many = [isinstance(one, str | dict) for one in raw]
    if not any(many):
        return lambda names: [part(names) for part in parts]
    pairs = list(zip(parts, many, strict=True))
    return lambda names: [each for part, is_many in pairs for each in (part(names) if is_many else (part(names),))]


def _several(raw: str | Row, known: Known, read: Callable[[Any, Known], Value]) -> Value:
    if isinstance(raw, str):
        return formula(raw, known)
    rounds, inner = _rounds(raw, known)
    value = read(raw["of"], inner)
    return lambda names: [value(found) for found in rounds(names)]


def _radius(raw: Any, known: Known, axis: str) -> Value:
    read = _number(SIDES[0])
    if not isinstance(raw, list):
        return read(raw, known, axis)
    parts = [read(one, known, axis) for one in raw]
    return lambda names: [part(names) for part in parts]


def _constant(raw: Any, known: Known, axis: str) -> Value:
    return lambda _: raw


READERS: dict[str, Callable[[Any, Known, str], Value]] = {
    **dict.fromkeys(("size", "at", "move", "stretch"), lambda raw, known, axis: _numbers(raw, known, SIDES)),
    **dict.fromkeys(
        ("path", "ends"), lambda raw, known, axis: _list(raw, known, lambda one, known: _numbers(one, known, SIDES))
    ),
    **dict.fromkeys(("radius", "top", "wide"), _radius),
    "deep": _number(SIDES[2]),
    **dict.fromkeys(("tall", "floor", "clearance"), _number(SIDES[1])),
    "rings": lambda raw, known, axis: _list(raw, known, lambda ring, known: READERS["path"](ring, known, axis)),
    "length": lambda raw, known, axis: _number(ALONG[axis])(raw, known, axis),
    "area": lambda raw, known, axis: _numbers(raw, known, ACROSS[axis]),
    "between": lambda raw, known, axis: _numbers(raw, known, (ALONG[axis],) * 2),
    "outline": lambda raw, known, axis: _list(raw, known, lambda one, known: _numbers(one, known, ACROSS[axis])),
    **dict.fromkeys(
        ("profile", "points", "sides"),
        lambda raw, known, axis: _list(raw, known, lambda one, known: _numbers(one, known, (None, None))),
    ),
    **dict.fromkeys(("axis", "facing", "fit", "inside", "open", "opening"), _constant),
    **dict.fromkeys(("name", "joint", "look", "lit", "shown", "style"), _text),
    "turns": lambda raw, known, axis: _numbers(raw, known, (None,) * 3),
    "rgb": lambda raw, known, axis: _numbers(raw, known, (None,) * 3),
    "turn": lambda raw, known, axis: _turns(raw, known),
    "bend": lambda raw, known, axis: _lift(raw, known),
    "crease": _constant,
}
"""Argument of a shape or an addition -> what reads it; the others are plain numbers or formulas."""


def _lift(raw: Any, known: Known) -> Value:
    """Return the function from z to a height that a formula of `z` describes."""
    height = formula(raw, known | {"z"})
    return lambda names: lambda z: height({**names, "z": z})


def _turns(raw: Any, known: Known) -> Value:
    """Return the arguments of rotations, each given as an axis, degrees and perhaps a point on the axis."""
    turns = (
        raw
        if isinstance(raw, list)
        and raw
        and isinstance(raw[0], list)
        and len(raw[0]) in (2, 3)
        and isinstance(raw[0][0], str)
        else [raw]
    )
    return _list(turns, known, _turn)


def _turn(raw: Any, known: Known) -> Value:
    if not isinstance(raw, list) or len(raw) not in (2, 3):
        raise ValueError(f"{raw!r} is not [axis, degrees] or [axis, degrees, point]")
    about = _constant(raw[0], known, "y") if isinstance(raw[0], str) else _numbers(raw[0], known, (None,) * 3)
    parts = [about, _number(None)(raw[1], known, "y"), *(_numbers(point, known, SIDES) for point in raw[2:])]
    return lambda names: [part(names) for part in parts]


def _arguments(call: Callable[..., Any], verb: str, entry: Row, known: Known, skipped: int = 0) -> Value:
    """Return the arguments that an entry gives to a function, whose first one is the value of the entry's verb."""
    parameters = dict(list(signature(call).parameters.items())[skipped:])
    whole = {key: 1 for key in ("wide", "deep", "tall") if key in parameters}
    given = whole | {next(iter(parameters)): entry[verb]} | {key: entry[key] for key in entry if key != verb}
    for key in given:
        if key not in parameters:
            raise ValueError(f"{verb!r} takes no {key!r}.{did_you_mean(key, parameters)}")
    missing = [key for key, each in parameters.items() if each.default is Parameter.empty and key not in given]
    if missing:
        raise ValueError(f"{verb!r} needs {missing[0]!r}")
    axis = entry.get("facing", entry.get("axis", "z" if verb == "panel" else "y"))[-1]
    if axis not in ALONG:
        raise ValueError(f"{axis!r} is not an axis: x, y or z")
    values = {key: READERS.get(key, _number(None))(raw, known, axis) for key, raw in given.items()}
    return lambda names: {key: value(names) for key, value in values.items()}


def _part(verb: str, entry: Row, known: Known) -> Step:
    """Return the step that adds one mesh: made, then changed in the order in which the entry says how."""
    if "look" not in entry:
        raise ValueError(f"{verb!r} needs 'look'")
    own = {key: raw for key, raw in entry.items() if key not in (*_STYLE, *CHANGES)}
    make, arguments = SHAPES[verb], _arguments(SHAPES[verb], verb, own, known)
    style = {key: _text(entry[key], known, "y") for key in _STYLE if key in entry}
    changes = [(CHANGES[key], READERS[key](entry[key], known, "y")) for key in entry if key in CHANGES]

    def add(builder: Builder, names: Names) -> None:
        part = make(**arguments(names))
        for change, value in changes:
            part = change(part, value(names))
        builder.add(_style(**{key: value(names) for key, value in style.items()}), part)

    return add


def _style(
    look: str, lit: str | None = None, joint: str | None = None, shown: Any = "always", toggles: str = ""
) -> PartStyle:
    """Return the style of a part: what hangs on a joint shows openness, what is lit or shown at times the state."""
    is_toggled = bool(lit is not None or shown != "always" or toggles)
    is_glass = look.partition("/")[0] == "glass"
    return PartStyle(look, joint, lit, joint is not None, is_toggled, is_glass, shown)


def _step(entry: Any, known: Known) -> Step:
    """Return the step of one entry: a part, an addition or a group, under its condition and for each of its values."""
    if not isinstance(entry, dict):
        raise ValueError(f"{entry!r} is not a table")
    rest = {key: raw for key, raw in entry.items() if key not in ("when", "each", "let")}
    rounds, inner = _rounds(entry, known)
    condition = formula(entry["when"], inner) if "when" in entry else None
    verbs = [key for key in rest if key in SHAPES or key in ADDITIONS or key == "parts"]
    if len(verbs) != 1:
        unknown = next((key for key in rest if key not in (*_STYLE, *READERS)), "")
        raise ValueError(f"an entry is one shape, addition or 'parts'.{did_you_mean(unknown, {*SHAPES, *ADDITIONS})}")
    do = _verb(verbs[0], rest, inner)

    def run(builder: Builder, names: Names) -> None:
        for found in rounds(names):
            if condition is None or condition(found):
                do(builder, found)

    return run


def _verb(verb: str, entry: Row, known: Known) -> Step:
    if verb == "parts":
        inherited = {key: raw for key, raw in entry.items() if key != "parts"}
        return _steps([inherited | each for each in entry["parts"]], known)
    if verb in SHAPES:
        return _part(verb, entry, known)
    add, arguments = ADDITIONS[verb], _arguments(ADDITIONS[verb], verb, entry, known, skipped=1)
    return lambda builder, names: add(builder, **arguments(names))


def _steps(raw: Any, known: Known) -> Step:
    steps = []
    for place, entry in enumerate(raw if isinstance(raw, list) else [raw], 1):
        try:
            steps.append(_step(entry, known))
        except ValueError as error:
            raise ValueError(f"part {place}: {error}") from None

    def run(builder: Builder, names: Names) -> None:
        for step in steps:
            step(builder, names)

    return run


def _rounds(entry: Row, known: Known) -> tuple[Callable[[Names], Iterable[Names]], Known]:
    """Return what gives an entry's names, for all combinations of its `each` and with its `let`, and their names."""
    lists = [_options(key.split(", "), raw, known) for key, raw in entry.get("each", {}).items()]
    known |= {name for key in entry.get("each", {}) for name in key.split(", ")}
    lets = []
    for name, raw in entry.get("let", {}).items():
        lets.append((name, _number(None)(raw, known, "y")))
        known |= {name}
    if not lists and not lets:
        return lambda names: (names,), known

    def rounds(names: Names) -> Iterable[Names]:
        for chosen in product(*(options(names) for options in lists)):
            found = dict(names)
            for values in chosen:
                found |= values
            for name, value in lets:
                found[name] = value(found)
            yield found

    return rounds, known


def _options(keys: list[str], raw: Any, known: Known) -> Callable[[Names], list[Names]]:
    """Return what gives the values of one list: written out, counted from 0, or that of a name."""
    if isinstance(raw, str):
        value = formula(raw, known)
        return lambda names: [dict(zip(keys, one if len(keys) > 1 else [one], strict=True)) for one in value(names)]
    options = [_unpacked(keys, option, known) for option in (range(raw) if isinstance(raw, int) else raw)]
    return lambda names: [{key: value(names) for key, value in option.items()} for option in options]


def _unpacked(names: list[str], option: Any, known: Known) -> dict[str, Value]:
    """Return the values that one option gives to its names; strings are texts."""
    options = [option] if len(names) == 1 else option
    if not isinstance(options, list) or len(options) != len(names):
        raise ValueError(f"{option!r} does not give {', '.join(names)}")
    return {
        name: _text(one, known, "y") if isinstance(one, str) else _constant(one, known, "y")
        for name, one in zip(names, options, strict=True)
    }


Draw = Callable[[np.random.Generator, Names], Any]
DRAWS: dict[str, Callable[[np.random.Generator, Any], Any]] = {
    "chance": lambda rng, share: bool(rng.random() < share),
    "choice": lambda rng, options: float(rng.choice(options)),
    "finish": lambda rng, kind: (finish := {"cloth": cloth, "wood": wood}[kind](rng), (finish.word, finish.material))[
        1
    ],
    "of": one_of,
    "colours": lambda rng, words: (word := one_of(rng, words), COLOURS[word]),
    "integers": lambda rng, ends: int(rng.integers(*ends)),
    "uniform": lambda rng, ends: float(rng.uniform(*ends)),
}
"""Random values of a row."""


def _value(key: str, raw: Any, known: Known, shared: Row) -> Callable[[np.random.Generator, Names], Names]:
    """Return what gives a row's value or values, drawn at random, looked up or computed."""
    names = key.split(", ")
    if isinstance(raw, list):
        raw = {"of": raw}
    if not isinstance(raw, dict):
        value = _number(None)(raw, known, "y")
        return lambda _, old: {names[0]: value(old)}
    raw = {kind: shared[each] if kind in DRAWS and isinstance(each, str) else each for kind, each in raw.items()}
    if "points" in raw:
        listed = READERS["points"](raw["points"], known, "y")
        return lambda _, old: {names[0]: listed(old)}
    if "by" in raw:
        return _table(names[0], raw, known)
    condition = formula(raw["when"], known) if "when" in raw else None
    kinds = [kind for kind in raw if kind in DRAWS]
    if len(kinds) != 1 or set(raw) - {"when", "without", *DRAWS}:
        raise ValueError(f"{key!r} is drawn as one of {', '.join(DRAWS)}, or looked up 'by' a value")
    draw, setting = DRAWS[kinds[0]], raw[kinds[0]]
    if kinds[0] == "of":
        setting = [_unpacked(names, option, known) for option in setting]

    def drawn(rng: np.random.Generator, old: Names) -> Names:
        if condition is not None and not condition(old):
            return dict.fromkeys(names, False)
        if kinds[0] == "of":
            return {name: value(old) for name, value in one_of(rng, setting).items()}
        left = old.get(raw.get("without"))
        found = draw(rng, [option for option in setting if option != left] if left else setting)
        return dict(
            zip(names, found if len(names) > 1 else [found[1] if kinds[0] == "colours" else found], strict=True)
        )

    return drawn


def _table(name: str, raw: Row, known: Known) -> Callable[[np.random.Generator, Names], Names]:
    """Return what looks a value up by another: the entry under that value, or else the one under "other"."""
    found = {key: _unpacked([name], option, known)[name] for key, option in raw.items() if key != "by"}
    if raw["by"] not in known:
        raise ValueError(f"{raw['by']!r} has no value here.{did_you_mean(raw['by'], known)}")
    return lambda _, old: {name: found.get(str(old[raw["by"]]), found.get("other"))(old)}


def maker_of(category: str, row: Row, shared: Row) -> Maker:
    """Return the maker that a row describes. Raises ValueError that says what is wrong where."""
    unknown = set(row) - {"about", "lies", "parts", "room", "unit", "values", "words"}
    if unknown:
        raise ValueError(f"unknown key {min(unknown)!r}")
    known = frozenset(("category", "width", "height", "depth"))
    values = []
    for key, raw in row.get("values", {}).items():
        values.append(_value(key, raw, known, shared))
        known |= set(key.split(", "))
    steps = _steps(row.get("parts", []), known)
    words = [_text(word, known, "y") for word in row.get("words", [])]
    takes_room, is_unit = row.get("room", True), row.get("unit", False)

    def make(size: Vec3, rng: np.random.Generator, levels: Sequence[float]) -> Asset:
        builder = Builder(category, size)
        names = {"category": category, "width": size.x, "height": size.y, "depth": size.z}
        names |= zip(SIDES, (1.0, 1.0, 1.0) if is_unit else size, strict=True)
        for value in values:
            names |= value(rng, names)
        steps(builder, names)
        return builder.build(filter(None, (word(names) for word in words)), takes_room=takes_room)

    return ARRANGED[row["lies"]](make) if "lies" in row else make


ARRANGED = {"lengthwise": lengthwise, "along_longest": along_longest}


def makers_in(path: Path) -> dict[str, Maker]:
    """Return the makers of a file of rows, by category. Raises ValueError that names the file and the row."""
    rows = tomllib.loads(path.read_text(encoding="utf-8"))
    found, shared = {}, rows.pop("shared", {})
    for category, row in rows.items():
        try:
            found[category] = maker_of(category, rows[row["like"]] if "like" in row else row, shared)
        except (ValueError, KeyError) as error:
            raise ValueError(f"{path.name}: {category}: {error}") from None
    return found
