"""Kettles: electric ones with a beak, and ones for a stove with a spout that whistles."""

from collections.abc import Sequence

import numpy as np

from vigil.assets.kernel import shapes
from vigil.assets.kernel.arrange import lathed_oval
from vigil.assets.kernel.asset import Asset
from vigil.assets.kernel.builder import Builder, PartStyle
from vigil.assets.kernel.palette import colour, one_of
from vigil.base.geometry import Vec3

_DARK, _GAUGE = "plastic/#1a1b1d", "plastic/#8cc4e6"
_NECK_ELECTRIC, _NECK_STOVE = 0.72, 0.56
"""Radius of the opening under the lid, as a share of the body's."""
_LID_DEG = 80.0


def kettle(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a kettle with its spout at +x, its handle at -x or above, and a hinged lid."""
    builder = Builder("Kettle", size)
    is_electric = bool(rng.random() < 0.5)
    name, tint = colour(rng, "red", "white", "black", "teal", "cream", "light blue")
    body = one_of(rng, ("chrome", f"ceramic/{tint}"))
    grip = f"plastic/{one_of(rng, ('#1f2022', '#3a2a20'))}"
    (_electric if is_electric else _stove_top)(builder, body, grip)
    return builder.build([name if body != "chrome" else "steel", "electric" if is_electric else "whistling"])


def _electric(builder: Builder, body: str, grip: str) -> None:
    """Add a jug that narrows upwards on its stand, with a beak at its rim, a gauge for water and a handle behind."""
    width, height, depth = builder.width, builder.height, builder.depth
    across, middle, top = min(depth, 0.76 * width), 0.03 * width, 0.88 * height
    neck, base = _NECK_ELECTRIC, 0.07 * height
    stand = [(0.0, 0.0), (1.0, 0.0), (1.0, 0.6 * base), (0.88, base), (0.0, base)]
    wall = [(0.9, base), (0.97, 1.6 * base), (0.93, 0.4 * top), (neck + 0.04, 0.94 * top), (neck, top)]
    _turned(builder, _DARK, stand, (middle, across))
    _turned(builder, body, wall, (middle, across))
    _turned(builder, _DARK, [(neck, 0.97 * top), (0.0, 0.97 * top)], (middle, across))
    heights = np.linspace(0.24, 0.76, 4) * top
    bulge = np.interp(heights, *np.transpose([(y, radius) for radius, y in wall]))
    for side in (-1, 1):
        path = np.c_[np.full(4, middle), heights, side * (bulge * depth / 2 - 0.004 * depth)]
        builder.add(_GAUGE, shapes.tube(path, 0.035 * across, 5))
    builder.add(body, _beak((middle, across), width / 2, top, 0.3 * depth))
    thick = 0.05 * height
    start, back = middle - 0.36 * across, -width / 2 + thick
    handle = [(start, 0.9 * height), (0.5 * (start + back), 0.94 * height), (back, 0.84 * height),
              (back, 0.46 * height), (0.6 * back + 0.4 * start, 0.26 * height), (start, 0.24 * height)]  # fmt: skip
    builder.add(grip, shapes.tube([(x, y, 0.0) for x, y in handle], thick, 8))
    _lid(builder, (body, grip), (middle, across), (neck, top), 0.05 * height)


def _beak(x: tuple[float, float], tip: float, top: float, wide: float) -> shapes.Mesh:
    """Return the short spout at a jug's rim (`x` is its middle and width), which ends at `tip`."""
    middle, across = x
    root, wall = middle + 0.3 * across, middle + 0.45 * across
    low = [(x, 0.62 * top, share * wide) for x, share in ((root, -0.1), (wall, -0.04), (wall, 0.04), (root, 0.1))]
    high = [(x, 0.985 * top, share * wide) for x, share in ((root, -0.5), (tip, -0.12), (tip, 0.12), (root, 0.5))]
    return shapes.loft(np.array([[*ring, ring[0]] for ring in (low, high)]))


def _stove_top(builder: Builder, body: str, grip: str) -> None:
    """Add a round kettle with a bow over it and a short stout spout under a dark whistle."""
    width, height, depth = builder.width, builder.height, builder.depth
    across, middle, top = min(depth, 0.78 * width), -0.07 * width, 0.6 * height
    neck = _NECK_STOVE
    wall = [(0.0, 0.0), (0.9, 0.0), (1.0, 0.1 * height), (0.98, 0.4 * top), (neck + 0.14, 0.88 * top), (neck, top)]
    _turned(builder, body, wall, (middle, across))
    _turned(builder, _DARK, [(neck, 0.97 * top), (0.0, 0.97 * top)], (middle, across))
    root, tip = middle + 0.4 * across, width / 2 - 0.05 * width
    ends = np.array([(root, 0.46 * top, 0.0), (0.45 * root + 0.55 * tip, 0.72 * top, 0.0), (tip, 1.04 * top, 0.0)])
    builder.add(body, shapes.tube(ends, [share * across for share in (0.17, 0.11, 0.075)]))
    whistle = ends[2] + (ends[2] - ends[1]) / np.linalg.norm(ends[2] - ends[1]) * 0.05 * height
    builder.add(grip, shapes.tube([ends[2], whistle], 0.09 * across))
    thick = 0.045 * height
    angles, rise = np.linspace(0, np.pi, 10), height - thick - 0.8 * top
    xs, ys = middle + 0.43 * across * np.cos(angles), 0.8 * top + rise * np.sin(angles)
    builder.add(grip, shapes.tube(np.c_[xs, ys, 0 * angles], thick))
    _lid(builder, (body, grip), (middle, across), (neck, top), 0.1 * height)


def _lid(
    builder: Builder, looks: tuple[str, str], x: tuple[float, float], at: tuple[float, float], knob: float
) -> None:
    """Add a lid in a steel ring, with a knob of the given height in the second look, hinged at the back.

    `x` is the kettle's middle and width; `at` is the opening's radius as a share, and its height.
    """
    (middle, across), (neck, top), depth = x, at, builder.depth
    hinge_x = middle - neck * across / 2
    joint = builder.hinge("lid", (0, 0, 1), (hinge_x, top, 0), _LID_DEG)
    cover, button = (PartStyle(look, joint, bears_open=True) for look in looks)
    ring = PartStyle("metal/brushed", joint, bears_open=True)
    dome = top + 0.35 * knob
    _turned(builder, cover, [(0.0, 0.99 * top), (0.9 * neck, 0.99 * top), (0.9 * neck, top + 0.1 * knob),
                             (0.5 * neck, dome), (0.0, dome)], (middle, across))  # fmt: skip
    rim = (0.985 * top, top + 0.12 * knob)
    edge = [(0.88 * neck, rim[0]), (neck, rim[0]), (neck, rim[1]), (0.88 * neck, rim[1])]
    _turned(builder, ring, edge, (middle, across))
    _turned(builder, button, [(0.0, dome), (0.12, dome), (0.19, top + 0.7 * knob), (0.17, top + knob),
                              (0.0, top + knob)], (middle, across), 12)  # fmt: skip
    builder.solid(
        (hinge_x, 0.99 * top, -neck * depth / 2), (middle + neck * across / 2, top + knob, neck * depth / 2), joint
    )


def _turned(
    builder: Builder,
    look: PartStyle | str,
    profile: Sequence[tuple[float, float]],
    x: tuple[float, float],
    segments: int = 18,
) -> None:
    """Add a profile of (share of half the width, height) turned about a kettle's middle; `x` is that middle and its
    width."""
    middle, across = x
    builder.add(look, shapes.translate(lathed_oval(profile, across, builder.depth, segments), (middle, 0, 0)))


MAKERS = {"Kettle": kettle}
