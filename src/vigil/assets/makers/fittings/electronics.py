"""Electronics: screens, phones, clocks, remote controls and switches."""

from collections.abc import Sequence

import numpy as np

from vigil.assets.kernel import shapes
from vigil.assets.kernel.arrange import Maker, lengthwise, lowered_into
from vigil.assets.kernel.asset import Asset
from vigil.assets.kernel.builder import Builder, PartStyle
from vigil.assets.kernel.palette import COLOURS, colour, one_of
from vigil.base.geometry import Vec3

DARK = "plastic/#17181a"
OFF_SCREEN = "plastic/#0b0d11"
CASES = ("plastic/#1f2022", "plastic/#2d2f33", "plastic/#8b8d90", "plastic/#d9d9d6")


def television(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a television: flat, with a foot when the box is deep enough, or in a very deep box one with a tube."""
    builder = Builder("Television", size)
    width, height, depth = size
    case = one_of(rng, CASES[:3])
    picture = PartStyle(OFF_SCREEN, on=f"screen/{rng.integers(4)}", bears_toggle=True)
    if depth > 0.42 * width:
        return _tube_set(builder, case, picture)
    stands = depth > 0.12 * width
    foot = 0.11 * height if stands else 0.0
    slab = min(0.35 * depth, 0.06) if stands else depth
    back = (-0.1 * depth if stands else 0.0) - slab / 2
    front = back + slab
    edge = min(0.02, 0.03 * width)
    builder.add(case, shapes.span((-width / 2, foot, back), (width / 2, height, front - 0.0015), 0.006))
    builder.add(DARK, shapes.panel(width - edge, height - foot - edge, (0, (height + foot) / 2, front - 0.0008)))
    glass = (width - 2 * edge, height - foot - 2 * edge)
    builder.add(picture, shapes.panel(*glass, (0, (height + foot) / 2, front)))
    builder.add(case, shapes.box((0.04 * width, edge / 5, 0.001), (0, foot + edge / 2, front)))
    if stands and rng.random() < 0.5:
        builder.add(case, shapes.slab((0.45 * width, 0.1 * foot, depth), (0, 0.05 * foot, 0), 0.2 * depth))
        builder.add(case, shapes.box((0.1 * width, 1.3 * foot, 0.7 * slab), (0, 0.65 * foot, (back + front) / 2)))
    elif stands:
        for x in (-0.36, 0.36):
            toe, top = 0.03, (x * width, 1.05 * foot, (back + front) / 2)
            for z in (-depth / 2, depth / 2 - toe):
                builder.add(case, shapes.tube([(x * width, 0.012, z + toe / 2), top], 0.012, 6))
    return builder.build(["flat"])


def _tube_set(builder: Builder, case: str, picture: PartStyle) -> Asset:
    width, height, depth = builder.width, builder.height, builder.depth
    builder.add(case, shapes.span((-width / 2, 0, 0.05 * depth), (width / 2, height, depth / 2 - 0.004), 0.015))
    rings = [
        _frame_ring(0.5 * width, 0.06 * height, 0.94 * height, 0.06 * depth),
        _frame_ring(0.4 * width, 0.12 * height, 0.86 * height, -0.2 * depth),
        _frame_ring(0.28 * width, 0.2 * height, 0.75 * height, -0.5 * depth),
    ]
    builder.add(DARK, shapes.loft(np.array(rings)))
    builder.add(picture, shapes.panel(0.7 * width, 0.8 * height, (-0.1 * width, 0.52 * height, depth / 2)))
    for y in (0.75, 0.6):
        builder.add(DARK, shapes.cylinder(0.045 * width, 0.008, (0.38 * width, y * height, depth / 2 - 0.004), "z"))
    builder.add(DARK, shapes.panel(0.12 * width, 0.3 * height, (0.38 * width, 0.28 * height, depth / 2 - 0.003)))
    return builder.build(["old", "tube"])


def _frame_ring(half: float, bottom: float, top: float, z: float) -> list[tuple[float, float, float]]:
    return [(-half, bottom, z), (half, bottom, z), (half, top, z), (-half, top, z), (-half, bottom, z)]


def laptop(size: Vec3, rng: np.random.Generator, levels: Sequence[float]) -> Asset:
    """Return a laptop whose lid with the screen opens by 110 degrees.

    A box too high for a closed laptop was measured open: the laptop then fills it while open, and lies at its bottom
    while shut.
    """
    if size.y > 0.25 * size.z:
        thick, lean, depth = _measured_open(size)
        flat = _laptop(Vec3(size.x, thick, depth), rng, 90.0 + lean)
        return lowered_into(flat, size, forward=float(size.z - depth) / 2)
    return _laptop(size, rng, 110.0)


def _measured_open(size: Vec3) -> tuple[float, float, float]:
    """Return the thickness (m), the lean of the lid (deg) and the depth (m) of a laptop that fills a box while open.

    Its height is then 0.6 of its thickness and 0.99 of its depth; its depth 0.4 and 0.99 of them, and the lean.
    """
    thick = 0.085 * size.z
    rise, run = size.y - 0.6 * thick, size.z - 0.4 * thick
    if rise > run:
        thick = float(np.clip(2.0 * (size.y - size.z), thick, 0.14 * size.z))
        return thick, 0.0, (size.y + size.z - thick) / 1.98
    lean = np.pi / 2 - 2 * np.arctan2(rise, run)
    return thick, float(np.degrees(lean)), float(run / (0.99 * (1 + np.sin(lean))))


def _laptop(size: Vec3, rng: np.random.Generator, opens_deg: float) -> Asset:
    builder = Builder("Laptop", size)
    width, height, depth = size
    name, tint = one_of(rng, (("silver", "#b9bcc0"), ("black", "#232427"), ("grey", "#6c7076"), ("white", "#e8e8e6")))
    case = f"plastic/{tint}"
    seam = 0.6 * height
    builder.add(case, shapes.slab((width, seam, depth), (0, seam / 2, 0), 0.04 * depth))
    keys = (0.86 * width, 0.42 * depth)
    builder.add(DARK, shapes.panel(*keys, (0, seam + 4e-4, -0.16 * depth), "+y"))
    caps = "plastic/#d9d9d6" if name == "black" else "plastic/#3c3e42"
    for row in range(5):
        for column in range(12):
            x = (column - 5.5) * keys[0] / 12.4
            z = -0.16 * depth + (row - 2) * keys[1] / 5.3
            builder.add(caps, shapes.panel(0.85 * keys[0] / 12.4, 0.8 * keys[1] / 5.3, (x, seam + 8e-4, z), "+y"))
    builder.add("plastic/#8b8d90", shapes.panel(0.3 * width, 0.26 * depth, (0, seam + 4e-4, 0.29 * depth), "+y"))
    lid = builder.hinge("lid", (1, 0, 0), (0, seam + 1e-3, -0.49 * depth), -opens_deg)
    leaf = PartStyle(case, joint=lid, bears_open=True)
    low = seam + 0.0015
    builder.add(leaf, shapes.slab((width, height - low, depth), (0, (height + low) / 2, 0), 0.04 * depth))
    face = shapes.rotate(shapes.panel(0.94 * width, 0.9 * depth, facing="-y"), "y", 180)
    dark = shapes.panel(0.98 * width, 0.97 * depth, (0, low - 2e-4, 0), "-y")
    builder.add(PartStyle(DARK, joint=lid, bears_open=True), dark)
    on = one_of(rng, ("screen/desktop", "screen/desktop", "screen/0"))
    glass = PartStyle(OFF_SCREEN, joint=lid, on=on, bears_open=True, bears_toggle=True)
    builder.add(glass, shapes.translate(face, (0, low - 6e-4, 0.01 * depth)))
    logo = one_of(rng, ("#f2f2f0", "#2d2f33"))
    badge = shapes.disc(0.06 * depth, (0, height, 0), segments=10)
    builder.add(PartStyle(f"plastic/{logo}", joint=lid, bears_open=True), badge)
    builder.solid((-width / 2, 0, -depth / 2), (width / 2, seam, depth / 2))
    builder.solid((-width / 2, seam, -depth / 2), (width / 2, height, depth / 2), lid)
    return builder.build([name])


def desktop(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a desktop computer: a monitor, with keyboard and mouse in front, and in a wide box a tower."""
    builder = Builder("Desktop", size)
    width, height, depth = size
    case = one_of(rng, ("plastic/#1f2022", "plastic/#b9bcc0", "plastic/#d9d9d6"))
    tower = 0.26 * width if width > 1.05 * height else 0.0
    middle = -tower / 2
    across = width - tower - (0.02 if tower else 0.0)
    back = -0.12 * depth
    low = 0.2 * height
    builder.add(
        case, shapes.span((middle - across / 2, low, back - 0.12 * depth), (middle + across / 2, height, back), 0.006)
    )
    glass = (across - 0.035, height - low - 0.035)
    screen = PartStyle(OFF_SCREEN, on="screen/desktop", bears_toggle=True)
    builder.add(screen, shapes.panel(*glass, (middle, (height + low) / 2 + 0.004, back + 0.001)))
    builder.add(case, shapes.box((0.1 * across, 1.2 * low, 0.06 * depth), (middle, 0.6 * low, back - 0.12 * depth)))
    builder.add(case, shapes.slab((0.42 * across, 0.012, 0.4 * depth), (middle, 0.006, -0.3 * depth), 0.02))
    board = (0.8 * across, 0.02, 0.34 * depth)
    z = depth / 2 - board[2] / 2
    builder.add(case, shapes.box(board, (middle - 0.06 * across, 0.01, z), 0.004))
    caps = "plastic/#d9d9d6" if case.endswith("2022") else "plastic/#3c3e42"
    for row in range(4):
        for column in range(12):
            x = middle - 0.06 * across + (column - 5.5) * board[0] / 12.6
            key = shapes.panel(board[0] / 15, board[2] / 5.5, (x, 0.0212, z + (row - 1.5) * board[2] / 4.6), "+y")
            builder.add(caps, key)
    builder.add(case, shapes.ellipsoid((0.06, 0.034, 0.09), (middle + 0.43 * across, 0.015, z), segments=10, rings=6))
    if tower:
        low_x = width / 2 - tower * 0.8
        builder.add(case, shapes.span((low_x, 0, -depth / 2), (width / 2, 0.86 * height, 0.46 * depth), 0.006))
        x = (low_x + width / 2) / 2
        for y in (0.74, 0.66):
            builder.add(DARK, shapes.panel(0.6 * tower, 0.04 * height, (x, y * height, 0.462 * depth)))
        lamp = PartStyle(DARK, on="glow/#59ff8c", bears_toggle=True)
        builder.add(lamp, shapes.disc(0.012, (x, 0.5 * height, 0.463 * depth), "z", 10))
    return builder.build(["desktop"])


def cell_phone(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a phone lying on its back; older ones have keys below a smaller screen."""
    builder = Builder("CellPhone", size)
    width, height, length = size
    name, tint = colour(rng, "black", "white", "blue", "red", "grey", "pink")
    builder.add("metal/steel", shapes.slab((width, height * 0.9, length), (0, 0.45 * height, 0), 0.13 * width))
    face = (0.95 * width, 0.1 * height, length - 0.05 * width)
    builder.add(f"plastic/{tint}", shapes.slab(face, (0, 0.92 * height, 0), 0.11 * width))
    has_keys = rng.random() < 0.2
    glass = shapes.rotate(shapes.panel(0.86 * width, (0.5 if has_keys else 0.76) * length, facing="+y"), "y", 0)
    screen = PartStyle(OFF_SCREEN, on="screen/phone", bears_toggle=True)
    builder.add(screen, shapes.translate(glass, (0, height, -0.2 * length if has_keys else 0)))
    if has_keys:
        for row, looks in enumerate((("#2f9e4f", "#d9d9d6", "#d3242c"), *[("#d9d9d6",) * 3] * 4)):
            for column, look in enumerate(looks):
                spot = ((column - 1) * 0.28 * width, height * 0.985, (0.11 + 0.075 * row) * length)
                builder.add(f"plastic/{look}", shapes.panel(0.22 * width, 0.045 * length, spot, "+y"))
    else:
        print_tone = "plastic/#a9abad" if name in ("black", "grey", "blue", "red") else "plastic/#55585c"
        builder.add(print_tone, shapes.panel(0.26 * width, 0.016 * length, (0, height * 0.985, -0.435 * length), "+y"))
        button = shapes.lathe(
            [(0.075 * width, 0.985 * height), (0.055 * width, 0.985 * height)], (0, 0, 0.435 * length)
        )
        builder.add(print_tone, button)
    return builder.build([name] if name == "black" else [])


def remote_control(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a remote control: a slim case with rows of buttons."""
    builder = Builder("RemoteControl", size)
    width, height, length = size
    name, tint = colour(rng, "black", "dark grey", "white", "black")
    builder.add(
        f"plastic/{tint}", shapes.rounded_box((width, 0.82 * height, length), (0, 0.41 * height, 0), 0.4 * height)
    )
    keys = "plastic/#3c3e42" if name == "white" else "plastic/#c9cacc"
    top, tall = 0.82 * height, 0.17 * height
    red = shapes.cylinder(0.09 * width, 0.18 * height, (-0.25 * width, top + tall / 2, -0.42 * length), segments=10)
    builder.add("plastic/#d3242c", red)
    for row in range(4):
        for column in (-1, 0, 1):
            spot = (column * 0.27 * width, top + tall / 2, (-0.31 + 0.08 * row) * length)
            builder.add(keys, shapes.box((0.18 * width, tall, 0.045 * length), spot))
    builder.add(keys, shapes.cylinder(0.28 * width, tall, (0, top + 0.45 * tall, 0.16 * length), segments=14))
    builder.add(
        "plastic/#1f2022", shapes.cylinder(0.1 * width, tall, (0, top + 0.5 * tall, 0.16 * length), segments=10)
    )
    for x, tone in ((-0.3, "#2f9e4f"), (-0.1, "#e2b93b"), (0.1, "#2f5ba0"), (0.3, "#d3242c")):
        spot = (x * width, top + 0.4 * tall, 0.36 * length)
        builder.add(f"plastic/{tone}", shapes.box((0.14 * width, 0.8 * tall, 0.03 * length), spot))
    return builder.build([name])


def alarm_clock(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return an alarm clock: digital with lit figures, or in a squarish box perhaps a round one with two bells."""
    builder = Builder("AlarmClock", size)
    width, height, depth = size
    name, tint = colour(rng, "black", "white", "red", "teal", "yellow", "brown", "light blue")
    if width < 1.7 * height and rng.random() < 0.6:
        return _bell_clock(builder, f"plastic/{tint}", name)
    look = f"wood/{one_of(rng, ('oak', 'walnut'))}" if name == "brown" else f"plastic/{tint}"
    lean = 0.25 * depth
    profile = [(-depth / 2, 0.0), (depth / 2, 0.0), (depth / 2 - lean, 0.9 * height), (-depth / 2, 0.9 * height)]
    builder.add(look, shapes.extrude(profile, -width / 2, width / 2, "x"))
    angle = np.degrees(np.arctan2(lean, 0.9 * height))
    shown = f"screen/{one_of(rng, ('green', 'red', 'blue', 'red'))}"
    for key, share, off in ((DARK, 0.92, 0.0008), (shown, 0.84, 0.0016)):
        face = shapes.panel(share * width, (share - 0.15) * height, (0, 0, off))
        builder.add(key, shapes.translate(shapes.rotate(face, "x", -angle), (0, 0.45 * height, depth / 2 - lean / 2)))
    bar = shapes.rounded_box(
        (0.4 * width, 0.14 * height, 0.3 * depth), (0, 0.93 * height, -0.15 * depth), 0.04 * height
    )
    builder.add("plastic/#8b8d90", bar)
    return builder.build([name, "digital"])


def _bell_clock(builder: Builder, case: str, name: str) -> Asset:
    width, height, depth = builder.width, builder.height, builder.depth
    radius = min(0.46 * width, 0.38 * height)
    y = 0.08 * height + radius
    builder.add(case, shapes.cylinder(radius, 0.8 * depth, (0, y, 0), "z", 20))
    builder.add("paper/#f4f1e6", shapes.disc(0.86 * radius, (0, y, 0.42 * depth), "z", 20))
    for k in range(12):
        angle = k * np.pi / 6
        spot = (0.72 * radius * np.sin(angle), y + 0.72 * radius * np.cos(angle), 0.43 * depth)
        tick = shapes.panel(0.06 * radius, 0.06 * radius * (3 if k % 3 == 0 else 1.5))
        builder.add(DARK, shapes.translate(shapes.rotate(tick, "z", -np.degrees(angle)), spot))
    for angle, reach in ((-55, 0.45), (40, 0.65)):
        hand = shapes.panel(0.06 * radius, reach * radius, (0, 0.5 * reach * radius, 0))
        builder.add(DARK, shapes.translate(shapes.rotate(hand, "z", -angle), (0, y, 0.44 * depth)))
    for side in (-1, 1):
        bell = shapes.ellipsoid((0.75 * radius, 0.5 * radius, 0.6 * depth), segments=10, rings=6)
        bell = shapes.translate(shapes.rotate(bell, "z", -35 * side), (0.55 * side * radius, y + 1.02 * radius, 0))
        builder.add("chrome", bell)
        leg = [(0.45 * side * radius, y - 0.8 * radius, 0), (0.75 * side * radius, 0.015 * height, 0)]
        builder.add("chrome", shapes.tube(leg, 0.03 * height, 6))
    loop = [(0.3 * np.cos(a) * radius, y + radius * (1.15 + 0.4 * np.sin(a)), 0) for a in np.linspace(0, np.pi, 7)]
    builder.add("chrome", shapes.tube(loop, 0.02 * height, 5))
    builder.add("plastic/#8b8d90", shapes.cylinder(0.2 * radius, 0.2 * depth, (0, y, -0.4 * depth), "z", 8))
    return builder.build([name, "round"])


_SPECTRUM = ("#e86a6a", "#eec25e", "#8fd07a", "#62bfd8", "#7d84dd", "#c58ad6")
_RAY_DEG = 13.0
"""Colours into which light breaks, angles of two fans of narrow rays across a disc, and width of each ray."""


def _ray(width: float, depth: float, level: float, degrees: float) -> shapes.Mesh:
    """Return one ray of a fan on a disc: a flat four-sided piece that faces up."""
    first, last = np.radians([degrees, degrees + _RAY_DEG])
    ends = [(0.46, first), (0.94, first), (0.94, last), (0.46, last)]
    outline = [(share * width / 2 * np.cos(angle), share * depth / 2 * np.sin(angle)) for share, angle in ends]
    return shapes.extrude(outline, 0.5 * level, level)


def compact_disc(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a CD: a silver disc on which the light breaks into colours, its hub printed."""
    builder = Builder("CD", size)
    width, height, depth = size
    name, tint = colour(rng, "light blue", "purple", "orange", "green", "red")
    ring = shapes.lathe([(0.12, 0.0), (1.0, 0.0), (1.0, height), (0.12, height), (0.12, 0.0)], segments=28)
    builder.add("metal/#e3e6ea", shapes.scale(ring, (width / 2, 0.9, depth / 2)))
    rim = shapes.lathe([(1.0, 0.99 * height), (0.94, 0.99 * height)], segments=28)
    builder.add("metal/#868b91", shapes.scale(rim, (width / 2, 1.0, depth / 2)))
    label = shapes.lathe([(0.4, height), (0.24, height)], segments=28)
    builder.add(f"plastic/{tint}", shapes.scale(label, (width / 2, 1.0, depth / 2)))
    turn = float(rng.uniform(0.0, 180.0))
    for side in (0.0, 180.0):
        for index, hue in enumerate(_SPECTRUM):
            ray = _ray(width, depth, 0.96 * height, turn + side + index * _RAY_DEG)
            builder.add(f"plastic/{hue}", ray)
    return builder.build([name])


def light_switch(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a light switch: a plate with one or two rockers, which tilt the other way and light up while on."""
    builder = Builder("LightSwitch", size)
    width, height, depth = size
    name, tint = one_of(rng, (("white", COLOURS["white"]), ("cream", COLOURS["cream"]), ("grey", "#a9abad")))
    builder.add(
        f"plastic/{tint}", shapes.span((-width / 2, 0, -depth / 2), (width / 2, height, 0.1 * depth), 0.15 * depth)
    )
    count = 2 if width > 1.05 * height else 1
    across = 0.62 * width / count
    for k in range(count):
        x = (k - (count - 1) / 2) * 1.25 * across
        builder.add("plastic/#55585c", shapes.panel(across, 0.64 * height, (x, height / 2, 0.115 * depth)))
        for shown, top in (("off", 0.5), ("on", 0.22)):
            wedge = [(0.0, 0.2), (top, 0.2), (0.72 - top, 0.8), (0.0, 0.8)]
            rocker = shapes.extrude(
                [(z * depth * 0.8, y * height) for z, y in wedge], -0.45 * across, 0.45 * across, "x"
            )
            look = PartStyle(
                f"plastic/{'#ffffff' if shown == 'on' else tint}",
                bears_toggle=True,
                shown="on" if shown == "on" else "off",
            )
            builder.add(look, shapes.translate(rocker, (x, 0, 0.1 * depth)))
    lamp = PartStyle("plastic/#6b2a22", on="glow/#ff7a3c", bears_toggle=True)
    builder.add(lamp, shapes.box((0.34 * width, 0.07 * height, 0.44 * depth), (0, 0.085 * height, 0)))
    return builder.build([name])


MAKERS: dict[str, Maker] = {
    "AlarmClock": alarm_clock,
    "CD": compact_disc,
    "CellPhone": lengthwise(cell_phone),
    "Desktop": desktop,
    "Laptop": laptop,
    "LightSwitch": light_switch,
    "RemoteControl": lengthwise(remote_control),
    "Television": television,
}
