"""Bathroom fixtures that stand on the floor: toilets, bathtubs and shower doors."""

from collections.abc import Sequence

import numpy as np

from vigil.assets.kernel import shapes
from vigil.assets.kernel.asset import Asset, Mesh
from vigil.assets.kernel.builder import Builder, PartStyle
from vigil.assets.kernel.palette import one_of
from vigil.base.geometry import Vec3

_GLAZE = "ceramic/#fffefc"
_LID_GAP_M = 0.004
"""Gap (m) between a toilet's seat and its lid, which lies on buffers."""


def toilet(size: Vec3, rng: np.random.Generator, levels: Sequence[float]) -> Asset:
    """Return a toilet: cistern at the back, bowl, seat, and a lid that folds up."""
    builder = Builder("Toilet", size)
    width, height, depth = size
    (x0, x1), (z0, z1) = builder.across, builder.through
    rim = min(0.42, 0.54 * height)
    tank = min(0.2, 0.28 * depth)
    wide = min(0.37, 0.95 * width)
    seat = one_of(rng, ("plastic/#8d7b5a", "plastic/#6c7883", "wood/oak", "plastic/#2d2e31"))
    long = depth - tank - 0.03
    middle = z1 - long / 2
    _bowl(builder, wide, long, rim - 0.03, middle)
    oval = _oval(wide, long, middle)
    builder.add(seat, _ring(oval, 0.72, rim - 0.028, rim - 0.01))
    back = z0 + tank + 0.03
    joint = builder.hinge("lid", (1, 0, 0), (0, rim - 0.006, back + 0.015), -90.0)
    lid = PartStyle(seat, joint, bears_open=True)
    low, high = rim - 0.01 + _LID_GAP_M, rim + 0.012
    tiers = ((0.97, low), (1.0, low + 0.004), (1.0, low + 0.009), (0.96, high - 0.003), (0.86, high))
    builder.add(lid, shapes.loft(np.stack([_closed(_shrunk(oval, share), y) for share, y in tiers])))
    buffers = [(x, rim - 0.01 + _LID_GAP_M / 2, z1 - 0.2 * long) for x in (-0.3 * wide, 0.3 * wide)]
    builder.add(seat, *(shapes.cylinder(0.012, _LID_GAP_M, at, segments=8) for at in buffers))
    for x in (-0.2 * wide, 0.2 * wide):
        hinge = shapes.cylinder(0.013, 0.04, (x, rim - 0.008, back + 0.012), "x", 10)
        builder.add("chrome", hinge)
    _cistern(builder, rim, tank)
    builder.block(_GLAZE, (-0.1, 0.1), (0.1, rim - 0.01), (z0 + 0.02, back + 0.025), 0.012)
    if rng.random() < 0.5:
        builder.add("chrome", shapes.cylinder(0.022, 0.012, (0, height - 0.004, z0 + tank / 2), segments=14))
    else:
        lever = shapes.box((0.07, 0.014, 0.014), (0.38 * width, height - 0.08, z0 + tank + 0.022), 0.004)
        builder.add("chrome", lever)
    builder.solid((x0, rim - 0.05, z0), (x1, height, z0 + tank + 0.02))
    builder.solid((-0.12, 0, z0 + 0.02), (0.12, rim, back + 0.05))
    builder.prism(_oval(wide, long, middle, 8), 0, rim)
    builder.prism(_oval(wide, long, middle, 8), rim - 0.01, rim + 0.012, joint)
    builder.surface("cistern", (0, height, z0 + tank / 2 + 0.01), (width - 0.06, tank - 0.03))
    return builder.build(("white",))


def _cistern(builder: Builder, rim: float, tank: float) -> None:
    """Add the tank at a toilet's back, with its lid."""
    width, height, z = builder.width, builder.height, builder.through[0] + tank / 2 + 0.01
    body = shapes.rounded_box((min(0.42, width), height - rim - 0.01, tank), (0, (height + rim) / 2 - 0.02, z), 0.025)
    builder.add(_GLAZE, body)
    builder.add(_GLAZE, shapes.rounded_box((width, 0.035, tank + 0.02), (0, height - 0.0175, z), 0.014))


def _oval(width: float, length: float, middle: float, count: int = 20) -> np.ndarray:
    """Return an egg-shaped outline (n, 2) of x, z, blunter at its back."""
    angles = np.linspace(0, 2 * np.pi, count, endpoint=False)
    x = width / 2 * np.cos(angles) * np.where(np.sin(angles) < 0, 1.0, 1 - 0.12 * np.sin(angles))
    return np.stack([x / np.abs(x).max() * width / 2, middle + length / 2 * np.sin(angles)], 1)


def _shrunk(outline: np.ndarray, share: float) -> np.ndarray:
    middle = outline.mean(0)
    return (outline - middle) * share + middle


def _closed(outline: np.ndarray, height: float) -> np.ndarray:
    """Return the outline as a ring (n + 1, 3) at a height."""
    ring = np.concatenate([outline, outline[:1]])
    return np.stack([ring[:, 0], np.full(len(ring), height), ring[:, 1]], 1)


def _ring(outline: np.ndarray, inner: float, low: float, high: float) -> Mesh:
    """Return a flat ring between an outline and its shrunken self."""
    hole = _shrunk(outline, inner)
    loops = [_closed(hole, low), _closed(hole, high), _closed(outline, high), _closed(outline, low), _closed(hole, low)]
    return shapes.merge(shapes.loft(np.stack(loops[i : i + 2]), cap=False) for i in range(4))


def _bowl(builder: Builder, wide: float, long: float, rim: float, middle: float) -> None:
    """Add the bowl: a foot that widens to an oval rim, hollow, with water at its bottom."""
    outline = _oval(wide, long, middle)

    def at(height: float, share: float) -> np.ndarray:
        shift = np.array([0.0, -0.12 * long * (1 - share)])
        return _closed(_shrunk(outline, share) + shift, height)

    outer = [at(rim, 1.0), at(0.82 * rim, 0.98), at(0.45 * rim, 0.68), at(0.12 * rim, 0.6), at(0.0, 0.64)]
    inner = [at(0.5 * rim, 0.3), at(0.7 * rim, 0.66), at(rim, 0.8)]
    builder.add(
        _GLAZE,
        shapes.loft(np.stack(outer), cap=False),
        shapes.loft(np.stack(inner), cap=False),
        shapes.loft(np.stack([at(rim, 0.8), at(rim, 1.0)]), cap=False),
    )
    water = at(0.52 * rim, 0.34)[:-1]
    builder.add("water", shapes.extrude(water[:, [0, 2]], 0.5 * rim, 0.52 * rim))


def bathtub(size: Vec3, rng: np.random.Generator, levels: Sequence[float]) -> Asset:
    """Return a bathtub: built in with a straight apron, or freestanding with sloping sides; its length along x."""
    builder = Builder("Bathtub", size)
    width, height, depth = size
    is_free = rng.random() < 0.4
    radius = 0.42 * min(width, depth) if is_free else 0.06 * min(width, depth)
    outer = shapes.rounded_rectangle(width, depth, radius, 5)
    hollow = shapes.rounded_rectangle(width - 0.14, depth - 0.14, max(0.4 * min(width, depth) - 0.07, 0.05), 5)
    floor = 0.14 * height
    foot = 0.84 if is_free else 1.0
    skirt = [_closed(outer, height), _closed(outer * (1 + foot) / 2, 0.45 * height), _closed(outer * foot, 0.0)]
    basin = [_closed(0.72 * hollow, floor), _closed(0.88 * hollow, 0.4 * height), _closed(hollow, height)]
    shell = one_of(rng, (_GLAZE, _GLAZE, "ceramic/#e8e2d2"))
    builder.add(shell, shapes.loft(np.stack(skirt), cap=False), shapes.loft(np.stack(basin), cap=False))
    builder.add(shell, shapes.loft(np.stack([_closed(hollow, height), _closed(outer, height)]), cap=False))
    builder.add(shell, shapes.extrude(0.73 * hollow, 0.5 * floor, floor + 0.002))
    builder.add(
        "chrome", shapes.lathe([(0, 0), (0.03, 0), (0.03, 0.004), (0, 0.002)], (-0.28 * width, floor + 0.002, 0), 14)
    )
    builder.solid((-width / 2, 0, -depth / 2), (width / 2, height, depth / 2))
    builder.surface("floor", (0, floor + 0.004, 0), (0.55 * width, 0.5 * depth), is_inside=True)
    builder.surface("edge", (0, height, -depth / 2 + 0.03), (0.7 * width, 0.04))
    return builder.build(("white" if shell == _GLAZE else "cream", "freestanding" if is_free else "built in"))


def shower_door(size: Vec3, rng: np.random.Generator, levels: Sequence[float]) -> Asset:
    """Return a glass door in a slim frame that swings to +z."""
    builder = Builder("ShowerDoor", size)
    (x0, x1), height = builder.across, builder.height
    metal = one_of(rng, ("chrome", "metal/black"))
    thick = min(0.03, 0.6 * builder.depth)
    half = thick / 2
    for a, b in ((x0, x0 + 0.03), (x1 - 0.03, x1)):
        builder.block(metal, (a, b), (0, height), (-half, half), 0.004)
        builder.solid((a, 0, -half), (b, height, half))
    builder.block(metal, (x0 + 0.03, x1 - 0.03), (height - 0.03, height), (-half, half))
    joint = builder.hinge("door", (0, 1, 0), (x0 + 0.034, 0, half), -90.0)
    pane = PartStyle("glass", joint, bears_open=True, is_glass=True)
    builder.block(pane, (x0 + 0.034, x1 - 0.034), (0.012, height - 0.034), (-0.004, 0.004))
    edge = PartStyle(metal, joint, bears_open=True)
    builder.block(edge, (x0 + 0.034, x0 + 0.05), (0.012, height - 0.034), (-0.008, 0.008))
    builder.block(edge, (x0 + 0.034, x1 - 0.034), (0.0, 0.014), (-0.008, 0.008))
    for side in (-1, 1):
        reach = builder.depth / 2 - 0.01
        bar = shapes.cylinder(0.01, 0.4, (x1 - 0.1, 1.0, side * reach), segments=8)
        posts = [shapes.cylinder(0.006, reach, (x1 - 0.1, y, side * reach / 2), "z", 8) for y in (0.84, 1.16)]
        builder.add(edge, bar, *posts)
    builder.solid((x0 + 0.034, 0.012, -half), (x1 - 0.034, height - 0.034, half), joint)
    return builder.build(("glass",))


MAKERS = {"Bathtub": bathtub, "ShowerDoor": shower_door, "Toilet": toilet}
