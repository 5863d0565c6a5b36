"""The words that rows (`vigil.assets.kernel.rows`) may use for shapes, changes of shapes, additions and random draws.

In a row, the word of a shape or addition is a key whose value is the first argument. Each other argument has a key of
its own.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import reduce
from typing import Any

import numpy as np

from vigil.assets.kernel import shapes
from vigil.assets.kernel.arrange import (
    bend,
    bin_lining,
    bin_shape,
    closed,
    creased,
    drape,
    framed,
    lathed_oval,
    outward,
    strip,
)
from vigil.assets.kernel.asset import Glow
from vigil.assets.kernel.builder import UNBOUNDED_M, Builder
from vigil.assets.kernel.furniture_parts import (
    CLOTHS,
    Finish,
    add_case,
    add_legs,
    cloth,
    front_board,
    hollow,
    lining,
    wood,
)
from vigil.assets.kernel.meshes import ORIGIN
from vigil.assets.kernel.palette import COLOURS, one_of
from vigil.base.geometry import Vec3

Pairs = list[tuple[float, float]]


def _turned(profile: Pairs, wide: float, deep: float, tall: float, at: Any = ORIGIN, segments: int = 18) -> shapes.Mesh:
    return _moved(lathed_oval([(radius, y * tall) for radius, y in profile], wide, deep, segments), at)


def _extruded(outline: Pairs, between: tuple[float, float], axis: shapes.Axis = "y", at: Any = ORIGIN) -> shapes.Mesh:
    return _moved(shapes.extrude(outline, *between, axis), at)


def _moved(part: shapes.Mesh, at: Any) -> shapes.Mesh:
    return part if at is ORIGIN else shapes.translate(part, at)


def _woven(rng: np.random.Generator) -> Finish:
    """Return a random upholstery that is not leather."""
    found = cloth(rng)
    return replace(found, material=found.material.replace("leather", "fabric"))


def _dyed(rng: np.random.Generator) -> Finish:
    """Return fabric in a random colour."""
    word, code = one_of(rng, CLOTHS)
    return Finish(f"fabric/{code}", word)


SHAPES: dict[str, Callable[..., shapes.Mesh]] = {
    "ball": lambda size, at=ORIGIN, segments=16, bands=8: shapes.ellipsoid(size, at, segments, bands),
    "bin": lambda outline, between, foot, wall, open=False: bin_shape(outline, between, foot, wall, has_floor=not open),
    "bin_lining": lambda outline, foot, tall: bin_lining(outline, tall, foot),
    "box": shapes.box,
    "cushion": shapes.cushion,
    "cylinder": shapes.cylinder,
    "disc": shapes.disc,
    "drape": lambda area, waves, thick, cloth, at=ORIGIN: _moved(
        drape(area[0], area[1], waves, thick, thickness=cloth), at
    ),
    "extrude": _extruded,
    "framed_board": lambda ends: front_board(ends[0], ends[1], is_framed=True),
    "frame": lambda outline, hole, between: shapes.extrude(framed(outline, hole), *between),
    "hollow": lambda ends, wall, open="+z": hollow(ends[0], ends[1], wall, open),
    "lathe": shapes.lathe,
    "lining": lambda ends: lining(*ends),
    "loft": lambda rings, open=False: shapes.loft(np.array(rings), cap=not open),
    "panel": lambda area, at=ORIGIN, facing="+z", fit=True: shapes.panel(area[0], area[1], at, facing, fit),
    "rounded": lambda size, at=ORIGIN, bevel=0.02, puff=0.0: shapes.rounded_box(size, at, bevel, puff),
    "skin": lambda tiers, open=True: shapes.loft(np.stack([closed(*tier) for tier in tiers]), cap=not open),
    "slab": lambda size, at=ORIGIN, bevel=0.05: shapes.slab(size, at, bevel),
    "soft": lambda ends, bevel, puff=0.0: shapes.rounded_box(
        np.subtract(ends[1], ends[0]), np.add(ends[0], ends[1]) / 2, bevel, puff
    ),
    "span": lambda ends, bevel=0.0: shapes.span(ends[0], ends[1], bevel),
    "strip": lambda sides, thick, level=0.0, at=ORIGIN: _moved(strip(sides, thick, level), at),
    "tube": shapes.tube,
    "turned": _turned,
}

CHANGES: dict[str, Callable[[shapes.Mesh, Any], shapes.Mesh]] = {
    "bend": bend,
    "crease": lambda part, is_sharp: creased(part) if is_sharp else part,
    "move": shapes.translate,
    "outward": outward,
    "stretch": shapes.scale,
    "turn": lambda part, turns: reduce(lambda turned, turn: shapes.rotate(turned, *turn), turns, part),
}
"""Name of a change -> function that changes a shape. Changes are made in the order in which a row lists them."""


def _surface(
    builder: Builder, name: str, at: Any, area: Any, clearance: float = UNBOUNDED_M,
    inside: bool = False, opening: bool = False, joint: str | None = None,
) -> None:  # fmt: skip
    builder.surface(name, at, area, clearance, is_inside=inside, needs_opening=opening, joint=joint)


def _glow(builder: Builder, rgb: Any, at: Any, strength: float) -> None:
    builder.glow = Glow(Vec3(*map(float, at)), rgb, strength)


ADDITIONS: dict[str, Callable[..., Any]] = {
    "case": lambda builder, ends, look, wall, open="+z": add_case(builder, look, ends[0], ends[1], wall, missing=open),
    "column": lambda builder, radius, between: builder.column(radius, *between),
    "glow": _glow,
    "hinge": lambda builder, name, about, at, degrees: builder.hinge(name, about, at, degrees),
    "legs": lambda builder, area, look, length, thick, style, around=(0.0, 0.0): add_legs(
        builder, look, area, length, thick, style, around
    ),
    "octagon": lambda builder, area, between: builder.octagon(*area, *between),
    "prism": lambda builder, outline, between, joint=None: builder.prism(outline, *between, joint),
    "slide": lambda builder, name, about, metres: builder.slide(name, about, metres),
    "solid": lambda builder, ends, joint=None: builder.solid(*ends, joint),
    "surface": _surface,
    "walls": lambda builder, area, floor, middle=0.0: builder.walls(area[0], area[1], floor, middle),
}
"""Name of an addition -> function that adds something other than a shape to an asset, e.g. a surface or a hinge."""

DRAWS: dict[str, Callable[[np.random.Generator, Any], Any]] = {
    "chance": lambda rng, share: bool(rng.random() < share),
    "choice": lambda rng, options: float(rng.choice(options)),
    "colours": lambda rng, words: (word := one_of(rng, words), COLOURS[word]),
    "finish": lambda rng, kind: (found := WORDS["finish"][kind](rng), (found.word, found.material))[1],
    "integers": lambda rng, count: int(rng.integers(count)),
    "of": one_of,
    "uniform": lambda rng, ends: float(rng.uniform(*ends)),
}
"""Kind of draw -> function that draws a random value. A drawn colour is (word, code); a finish is (word, material)."""
WORDS: dict[str, dict[str, Any]] = {
    "colours": {**COLOURS},
    "finish": {"cloth": cloth, "dyed": _dyed, "wood": wood, "woven": _woven},
}
"""Kind of draw -> words that it may use."""
