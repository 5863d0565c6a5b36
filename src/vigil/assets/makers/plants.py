"""Plants."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from vigil.assets.kernel import shapes
from vigil.assets.kernel.arrange import lathed_oval
from vigil.assets.kernel.asset import Asset
from vigil.assets.kernel.builder import Builder
from vigil.assets.kernel.meshes import cross
from vigil.assets.kernel.palette import colour, one_of
from vigil.base.geometry import Vec3

VASE_FORMS = {
    "classic": [(0.0, 0.0), (0.5, 0.0), (0.6, 0.04), (0.95, 0.4), (1.0, 0.55), (0.85, 0.72), (0.45, 0.88), (0.5, 1.0)],
    "bottle": [(0.0, 0.0), (0.7, 0.0), (0.95, 0.12), (1.0, 0.28), (0.8, 0.46), (0.3, 0.62), (0.24, 0.9), (0.32, 1.0)],
    "cone": [(0.0, 0.0), (1.0, 0.0), (0.95, 0.05), (0.55, 0.75), (0.45, 0.94), (0.5, 1.0)],
    "barrel": [(0.0, 0.0), (0.75, 0.0), (0.95, 0.25), (1.0, 0.5), (0.92, 0.78), (0.72, 0.95), (0.75, 1.0)],
}


class Crown(NamedTuple):
    """The space of a plant above its pot (m)."""

    base: float
    """Height of the earth."""
    across: float
    """Diameter of the pot."""
    reach: float
    """Half the width along x."""
    tall: float
    """Height above the pot."""
    deep: float
    """Half the depth along z."""


def house_plant(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a plant in a pot: broad leaves, sword-shaped leaves, a small tree, a palm or, if small, a cactus."""
    builder = Builder("HousePlant", size)
    width, height, depth = size
    slim = height > 1.3 * width
    kinds = ("sword", "tree", "palm", "broad" if height < 2.0 * width else "sword")
    if not slim:
        kinds = ("broad", "bush", "cactus", "broad")
    kind = one_of(rng, kinds)
    name, tint = colour(rng, "white", "brown", "grey", "teal", "orange", "dark grey", "cream")
    share = {"tree": 0.24, "palm": 0.26, "sword": 0.36, "cactus": 0.42}.get(kind, 0.4)
    pot_top = min(share * height, 0.75 * width)
    across = min((0.62 if kind != "cactus" else 0.9) * min(width, depth), 1.3 * pot_top)
    pot = [(0.0, 0.0), (0.66, 0.0), (0.92, 0.82), (1.0, 0.84), (1.0, 1.0), (0.88, 1.0), (0.86, 0.9)]
    look = f"stone/{'#b8674a' if name == 'orange' else tint}" if rng.random() < 0.4 else f"ceramic/{tint}"
    builder.add(look, lathed_oval([(r, y * pot_top) for r, y in pot], across, across, 16))
    builder.add("carpet/#4a3526", shapes.disc(0.44 * across, (0, 0.9 * pot_top, 0), segments=14))
    green = one_of(rng, ("leaf/#4f8a3f", "leaf/#3c7a46", "leaf/#6b9a44", "leaf/#2f6b3a"))
    grow = {"broad": _broad, "sword": _swords, "tree": _tree, "palm": _palm, "bush": _bush, "cactus": _cactus}[kind]
    grow(builder, rng, green, Crown(0.92 * pot_top, across, width / 2, height - pot_top, depth / 2))
    builder.column(across / 2, 0.0, pot_top)
    builder.octagon(0.8 * width, 0.8 * depth, pot_top, height)
    return builder.build(["green", kind])


def leaf(length: float, width: float, droop: float) -> shapes.Mesh:
    """Return a leaf that starts at the origin, rises along +z, and droops at its end; both sides are visible."""
    along = np.array([0.0, 0.3, 0.62, 1.0])
    half = width / 2 * np.array([0.25, 1.0, 0.85, 0.06])
    y = length * (0.75 * along - droop * along**2)
    z = length * along * 0.8
    fold = 0.25 * half
    top = [np.c_[side * half, y + fold * (side != 0), z] for side in (-1.0, 0.0, 1.0)]
    points = np.concatenate(top)
    cells = [(k + 4 * s, k + 1 + 4 * s, k + 5 + 4 * s, k + 4 + 4 * s) for s in (0, 1) for k in range(3)]
    faces = np.array([tri for a, b, c, d in cells for tri in ((a, b, c), (a, c, d))])
    normal = cross(points[faces[:, 1]] - points[faces[:, 0]], points[faces[:, 2]] - points[faces[:, 0]]).sum(0)
    normals = np.tile(normal, (len(points), 1))
    uvs = np.c_[points[:, 0], points[:, 2]]
    upper = shapes.mesh(points, faces, normals, uvs)
    lower = shapes.mesh(points, faces[:, ::-1], -normals, uvs)
    return shapes.merge([upper, lower])


def _broad(builder: Builder, rng: np.random.Generator, green: str, crown: Crown) -> None:
    """Add a crown of broad leaves on stems."""
    base, across, reach, tall, deep = crown
    for k in range(15):
        angle = 360 * k * 0.381966 + rng.uniform(-12, 12)
        level = 1 - (k % 5) / 5
        size = float(rng.uniform(0.75, 1.0)) * min(reach, tall) * (0.8 + 0.25 * (1 - level))
        stem_top = base + level * 0.62 * tall * float(rng.uniform(0.8, 1.05))
        out = 0.3 * reach * (1 - 0.6 * level)
        blade = shapes.rotate(leaf(size, 0.55 * size, 0.55 + 0.35 * (1 - level)), "y", angle)
        radians = np.radians(angle)
        foot = np.array([out * np.sin(radians), stem_top, out * np.cos(radians)])
        builder.add(green, shapes.scale(shapes.translate(blade, foot), (1, 1, deep / reach)))
        root = (0.1 * across * np.sin(radians), base - 0.02 * tall, 0.1 * across * np.cos(radians))
        builder.add(green, shapes.tube([root, foot * [1, 1, deep / reach]], 0.012 * tall + 0.001, 3))


def _swords(builder: Builder, rng: np.random.Generator, green: str, crown: Crown) -> None:
    """Add upright sword-shaped leaves."""
    base, across, reach, tall, deep = crown
    for k in range(13):
        angle = 2 * np.pi * k * 0.381966
        radius = 0.34 * across * np.sqrt((k + 0.5) / 13)
        lean = (0.9 * reach - radius) * float(rng.uniform(0.3, 0.95)) * (k / 12)
        high = base + tall * float(rng.uniform(0.7, 1.0)) * (1 - 0.3 * k / 12)
        foot = np.array([radius * np.cos(angle), base - 0.01, radius * np.sin(angle)])
        tip = np.array([(radius + lean) * np.cos(angle), high, (radius + lean) * np.sin(angle) * deep / reach])
        middle = (foot + tip) / 2 + [0.02 * tall * np.sin(angle), 0.06 * tall, 0]
        wide = 0.13 * across * np.array([0.7, 1.0, 0.08])
        turn = rng.uniform(0, np.pi)
        side = np.array([np.cos(turn), 0, np.sin(turn)])
        thick = np.array([-np.sin(turn), 0, np.cos(turn)]) * 0.02 * across
        rings = []
        for point, half in zip((foot, middle, tip), wide, strict=True):
            a, b = point - half * side, point + half * side
            rings.append([a, point + thick, b, point - thick, a])
        look = green if k % 3 else "leaf/#a8b65a"
        builder.add(look, shapes.loft(np.array(rings)))


def _tree(builder: Builder, rng: np.random.Generator, green: str, crown: Crown) -> None:
    """Add a thin trunk with a round crown of leaves."""
    base, _, reach, tall, deep = crown
    wiggle = rng.uniform(-0.06, 0.06, 2) * reach
    trunk = [(0, base - 0.01, 0), (wiggle[0], base + 0.3 * tall, wiggle[1]), (0, base + 0.62 * tall, 0)]
    builder.add("wood/walnut", shapes.tube(trunk, [0.05 * reach, 0.04 * reach, 0.035 * reach], 6))
    middle = base + 0.7 * tall
    for k in range(34):
        height = 1 - 2 * (k + 0.5) / 34
        angle = 360 * k * 0.381966
        ring = np.sqrt(1 - height**2)
        size = 0.62 * reach * float(rng.uniform(0.8, 1.1))
        blade = shapes.rotate(leaf(size, 0.5 * size, 0.9 - 0.5 * height), "y", angle)
        radians = np.radians(angle)
        x, z = 0.6 * reach * ring * np.sin(radians), 0.6 * deep * ring * np.cos(radians)
        foot = (x, middle + 0.26 * tall * height, z)
        builder.add(green if k % 3 else "leaf/#78a850", shapes.translate(blade, foot))


def _palm(builder: Builder, rng: np.random.Generator, green: str, crown: Crown) -> None:
    """Add a trunk with long fronds that bend over at their ends."""
    base, _, reach, tall, deep = crown
    top = base + 0.5 * tall
    trunk = [(0, base - 0.01, 0), (0.03 * reach, (base + top) / 2, 0), (0, top, 0)]
    builder.add("wood/worn", shapes.tube(trunk, [0.09 * reach, 0.06 * reach, 0.05 * reach], 7))
    lift = np.array([0, 0.004, 0])
    for k in range(11):
        angle = np.radians(360 * k * 0.381966 + rng.uniform(-8, 8))
        rise = float(rng.uniform(0.35, 0.5)) * tall * (1.0 if k % 2 else 0.7)
        t = np.linspace(0, 1, 6)
        out = reach * float(rng.uniform(0.8, 1.0)) * t
        y = top + rise * np.sin(np.pi * 0.72 * t) * 1.1
        spine = np.c_[out * np.sin(angle), y, out * np.cos(angle) * deep / reach]
        side = np.array([np.cos(angle), 0.0, -np.sin(angle)])
        half = 0.14 * reach * np.array([0.15, 0.7, 1.0, 0.9, 0.6, 0.05])
        rings = []
        for point, wide in zip(spine, half, strict=True):
            a, b = point - wide * side - [0, 0.4 * wide, 0], point + wide * side - [0, 0.4 * wide, 0]
            rings.append([a, point + lift, b, point - lift, a])
        builder.add(green, shapes.loft(np.array(rings)))


def _bush(builder: Builder, rng: np.random.Generator, green: str, crown: Crown) -> None:
    """Add a dense round bush with blossoms."""
    base, _, reach, tall, deep = crown
    _, bloom = colour(rng, "red", "pink", "yellow", "white", "purple")
    core = shapes.ellipsoid((1.3 * reach, 0.8 * tall, 1.3 * deep), (0, base + 0.42 * tall, 0), 10, 6)
    builder.add(green, core)
    for k in range(18):
        height = 1 - 1.6 * (k + 0.5) / 18
        angle = 360 * k * 0.381966
        ring = np.sqrt(max(1 - height**2, 0))
        radians = np.radians(angle)
        x, z = 0.62 * reach * ring * np.sin(radians), 0.62 * deep * ring * np.cos(radians)
        foot = np.array([x, base + 0.42 * tall + 0.38 * tall * height, z])
        size = 0.5 * reach
        blade = shapes.rotate(leaf(size, 0.6 * size, 0.9 - 0.4 * height), "y", angle)
        builder.add(green, shapes.translate(blade, foot))
        if k % 3 == 0:
            spot = foot * [1.3, 1, 1.3] + [0, 0.1 * tall, 0]
            builder.add(f"fabric/{bloom}", shapes.ellipsoid((0.22 * reach, 0.12 * tall, 0.22 * deep), spot, 6, 4))


def _cactus(builder: Builder, rng: np.random.Generator, green: str, crown: Crown) -> None:
    """Add a ribbed column with two arms and a blossom."""
    base, across, reach, tall, _ = crown
    radius = 0.3 * across
    angles = np.linspace(0, 2 * np.pi, 33)
    ribs = 1 + 0.09 * np.cos(8 * angles)
    rings = []
    for share, level in ((0.85, 0.0), (1.0, 0.3), (1.0, 0.75), (0.75, 0.92), (0.25, 1.0)):
        r = radius * share * ribs
        rings.append(np.c_[r * np.sin(angles), np.full(33, base - 0.01 + level * 0.93 * tall), r * np.cos(angles)])
    builder.add(green, shapes.loft(np.array(rings)))
    for quarter, low, share in ((0, 0.45, 0.85), (1, 0.35, 0.7), (2, 0.3, 0.85), (3, 0.5, 0.7)):
        out = share * 0.9 * reach
        thick = 0.36 * radius
        bends = ((0, 0), (0.75, 0), (1, 0.1), (1, 0.28), (1, 0.32))
        arm = [(x * out, base + (low + rise) * tall, 0) for x, rise in bends]
        limb = shapes.tube(arm, [thick, thick, thick, thick, 0.3 * thick], 7)
        builder.add(green, shapes.rotate(limb, "y", 90 * quarter + 20))
    bloom = f"fabric/{colour(rng, 'pink', 'red', 'yellow')[1]}"
    builder.add(bloom, shapes.ellipsoid((0.7 * radius, 0.14 * tall, 0.7 * radius), (0, base + 0.93 * tall, 0), 8, 4))


def room_decor(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a tall vase on the floor with branches or dry grass."""
    builder = Builder("RoomDecor", size)
    width, height, depth = size
    name, tint = colour(rng, "white", "black", "brown", "teal", "beige", "red")
    low = 0.45 * height
    across = min(0.62 * width, 0.5 * low)
    form = VASE_FORMS[one_of(rng, ("classic", "bottle", "cone", "barrel"))]
    inner = [(0.8 * form[-1][0], 1.0), (0.7 * form[-1][0], 0.8), (0.0, 0.8)]
    builder.add(f"ceramic/{tint}", lathed_oval([(r, y * low) for r, y in [*form, *inner]], across, across))
    wood = one_of(rng, ("wood/walnut", "wood/worn"))
    blossom = one_of(rng, ("fabric/#e8d9b8", "fabric/#d98ea3", "leaf/#6b9a44", "fabric/#b4262b"))
    for k in range(7):
        angle = 2 * np.pi * k * 0.381966
        lean = (0.35 + 0.65 * k / 6) * 0.96
        x, z = width / 2 * lean * np.cos(angle), depth / 2 * lean * np.sin(angle)
        tip = np.array([x, height * (1 - 0.14 * k / 6), z])
        foot = np.array([0.1 * across * np.cos(angle), 0.8 * low, 0.1 * across * np.sin(angle)])
        bend = (foot + tip) / 2 + [0, 0.08 * height, 0]
        builder.add(wood, shapes.tube([foot, bend, tip], [0.008, 0.006, 0.003], 4))
        for share in (0.4, 0.7, 1.0):
            spot = bend + (tip - bend) * share + rng.uniform(-0.03, 0.03, 3) * width
            builder.add(blossom, shapes.ellipsoid((0.1 * width, 0.04 * height, 0.1 * width), spot, 5, 3))
    builder.column(across / 2, 0.0, low)
    builder.octagon(0.7 * width, 0.7 * depth, low, height)
    return builder.build([name])


MAKERS = {"HousePlant": house_plant, "RoomDecor": room_decor}
