"""Fridges, which are hollow behind their doors; washing machines and dryers, with a drum behind a front door.

The two machines differ as real ones do. A washing machine has a round door with bulging glass, and a soap drawer. A
dryer has a flat, nearly square door, a lint filter below the opening and a vent grille at its foot, but no soap drawer.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vigil.assets.kernel import shapes
from vigil.assets.kernel.arrange import Maker
from vigil.assets.kernel.asset import Asset, Glow
from vigil.assets.kernel.builder import Builder, PartStyle, Range
from vigil.assets.kernel.furniture_parts import (
    Corner,
    Finish,
    add_case,
    add_shelves,
    lining,
    shelf_heights,
)
from vigil.assets.kernel.palette import one_of
from vigil.base.geometry import Vec3

SHELLS = (
    Finish("plastic/#f1f1ee", "white"),
    Finish("metal/steel", "stainless steel"),
    Finish("plastic/#26282b", "black"),
    Finish("metal/#8f9398", "grey"),
)
_RETRO = (Finish("plastic/#a8322d", "red"), Finish("plastic/#e9dfc3", "cream"), Finish("plastic/#9cc4bd", "mint green"))
_LINER = "plastic/#eef1f2"
_FRIDGE_WALL, _FRIDGE_BASE = 0.045, 0.05
_GLASS_SHELF = "glass/#6f9aa6"

_NOTES_M, _DISPENSER_TOP_M = 1.5, 1.42
"""Greatest heights (m) of the upper edges of a fridge's notes and of its water dispenser."""
_NOTES = (
    ("paper/#f2e27a", 0.09, 0.09, 0.0, 0.0),
    ("picture/4", 0.15, 0.12, 0.2, 0.06),
    ("paper/#b9dcef", 0.11, 0.15, -0.04, 0.16),
)
"""Row for each note: paper, width and height (m), offset to the side (as a share of the door's width) and distance (m)
below the top."""
_MAGNETS = ("plastic/#c8322e", "plastic/#2f5ba0")


@dataclass(frozen=True, slots=True)
class _Door:
    """A fridge's door: the name of its joint, its extent, and the side (-1 or 1 along x) of its hinge."""

    name: str
    x: Range
    y: Range
    hinge: int


def fridge(size: Vec3, rng: np.random.Generator, levels: Sequence[float]) -> Asset:
    """Return a refrigerator: with the freezer above, with the freezer below, or with two doors side by side.

    Notes under magnets, a badge and often a water dispenser distinguish its front from the front of a wardrobe.
    """
    builder = Builder("Fridge", size)
    shell = one_of(rng, (*SHELLS[:2], *SHELLS, *SHELLS[:2], *_RETRO))
    width, height, depth = size
    is_wide = width > 0.88
    style = "double" if is_wide and rng.random() < 0.6 else one_of(rng, ("top", "bottom", "top"))
    wall, door, grip = _FRIDGE_WALL, 0.055, 0.045
    face = depth / 2 - grip
    body = face - door
    (x0, x1), z0 = builder.across, builder.through[0]
    base = _FRIDGE_BASE
    add_case(builder, shell.material, (x0, base, z0), (x1, height, body), wall)
    builder.block("plastic/#1d1e20", (x0 + 0.02, x1 - 0.02), (0, base), (z0 + 0.02, body - 0.006))
    slats = np.linspace(x0 + 0.05, x1 - 0.05, 16)
    builder.add(
        shell.material,
        *(shapes.span((x - 0.004, 0.01, body - 0.006), (x + 0.004, base - 0.01, body)) for x in slats),
    )
    low: Corner = (x0 + wall + 0.001, base + wall + 0.001, z0 + wall + 0.001)
    high: Corner = (x1 - wall - 0.001, height - wall - 0.001, body)
    builder.add(_LINER, lining(low, high))
    heights = shelf_heights(levels, low[1], high[1], 4 if height > 1.5 else 3)
    add_shelves(builder, _GLASS_SHELF, low, (high[0], high[1], body - 0.11), heights, needs_opening=True)
    builder.add(
        _LINER, *(shapes.span((low[0], y - 0.022, body - 0.125), (high[0], y + 0.004, body - 0.11)) for y in heights)
    )
    if not levels and heights[0] - 0.04 - low[1] > 0.08:  # a clear vegetable drawer
        crisper = shapes.span((low[0] + 0.01, low[1], body - 0.14), (high[0], heights[0] - 0.04, body - 0.13))
        builder.add(_GLASS_SHELF, crisper)
    builder.solid((x0, 0, z0), (x1, base, body))
    builder.surface("top", (0, height, (z0 + body) / 2), (width - 0.04, body - z0 - 0.04))
    doors = _fridge_doors(builder, shell, style, 1 if rng.random() < 0.5 else -1, (body, face))
    has_dispenser = style == "double" or (shell not in _RETRO and bool(rng.random() < 0.6))
    _fridge_front(builder, rng, doors, face, has_dispenser=has_dispenser)
    return builder.build((shell.word,))


def _fridge_doors(builder: Builder, shell: Finish, style: str, side: int, z: Range) -> list[_Door]:
    """Add two doors, side by side or one above the other; return the doors, the larger first."""
    (x0, x1), height, body = builder.across, builder.height, z[0]
    base, wall, gap = _FRIDGE_BASE, _FRIDGE_WALL, 0.006
    back = (body - 0.012, body)
    if style == "double":
        doors = [_Door("left", (gap, x1), (base, height), 1), _Door("right", (x0, -gap), (base, height), -1)]
        builder.block(PartStyle(shell.material, "left"), (-0.03, 0.03), (base + wall, height - wall), back)
    else:
        split = {"top": 0.68, "bottom": 0.36}[style] * height
        # The free edge swings out a little at first, and stays within the fridge's sides all the same.
        x = (x0 + gap, x1) if side > 0 else (x0, x1 - gap)
        lower = _Door("lower", x, (base, split - gap / 2), side)
        upper = _Door("upper", x, (split + gap / 2, height), side)
        doors = [upper, lower] if style == "bottom" else [lower, upper]
        builder.block(shell.material, (x0 + wall, x1 - wall), (split - 0.012, split + 0.012), back)
    for door in doors:
        _fridge_door(builder, shell, door, z)
    return doors


def _fridge_door(builder: Builder, shell: Finish, door: _Door, z: Range) -> None:
    """Add a thick door with a handle outside and racks inside.

    The door's hinge is at an edge of the fridge's box, so that neither the door nor its handle leaves the box's sides.
    """
    (x0, x1), (y0, y1), (z0, z1), hinge = door.x, door.y, z, door.hinge
    joint = builder.hinge(door.name, (0, 1, 0), (x1 if hinge > 0 else x0, 0, builder.through[1]), hinge * 90.0)
    skin = PartStyle(shell.material, joint)
    builder.block(skin, (x0, x1), (y0, y1), (z0 + 0.006, z1), 0.012)
    inner = PartStyle(_LINER, joint)
    builder.block(inner, (x0 + 0.05, x1 - 0.05), (y0 + 0.04, y1 - 0.04), (z0 - 0.012, z0 + 0.006))
    for y in np.arange(y0 + 0.1, y1 - 0.2, 0.3):
        builder.block(inner, (x0 + 0.06, x1 - 0.06), (y, y + 0.02), (z0 - 0.095, z0))
        builder.block(inner, (x0 + 0.06, x1 - 0.06), (y + 0.02, y + 0.07), (z0 - 0.095, z0 - 0.088))
    tall = y1 - y0
    length = float(np.clip(0.4 * tall, 0.16, 0.6))
    x = x0 + 0.06 if hinge > 0 else x1 - 0.06
    y = y0 + 0.05 + length / 2 if y0 > 0.5 else y1 - 0.06 - length / 2 if y1 < 1.35 else y0 + 0.55 * tall
    metal = PartStyle("chrome", joint)
    for end in (-1, 1):
        builder.block(
            metal,
            (x - 0.01, x + 0.01),
            (y + end * length / 2 - 0.012, y + end * length / 2 + 0.012),
            (z1 - 0.002, z1 + 0.04),
        )
    builder.block(
        metal, (x - 0.013, x + 0.013), (y - length / 2 - 0.02, y + length / 2 + 0.02), (z1 + 0.022, z1 + 0.045), 0.005
    )
    builder.solid((x0, y0, z0 - 0.01), (x1, y1, z1), joint)


def _fridge_front(
    builder: Builder, rng: np.random.Generator, doors: Sequence[_Door], face: float, *, has_dispenser: bool
) -> None:
    """Add details to a fridge's two doors (the larger first): a badge, notes under magnets, perhaps a dispenser."""
    large, other = doors
    badge = PartStyle("chrome", other.name)
    middle, top = sum(other.x) / 2, other.y[1] - 0.07
    builder.block(badge, (middle - 0.05, middle + 0.05), (top, top + 0.022), (face - 0.002, face + 0.005))
    if has_dispenser:
        _dispenser(builder, large, face)
    noted = other if has_dispenser else large
    wide, high = noted.x[1] - noted.x[0], min(noted.y[1] - 0.12, _NOTES_M)
    for index, (paper, width, height, aside, drop) in enumerate(_NOTES):
        x = sum(noted.x) / 2 - (0.1 - aside) * noted.hinge * wide
        y = high - drop - height / 2 + float(rng.uniform(-0.02, 0.02))
        if y - height / 2 < noted.y[0] + 0.03:
            continue
        turn = float(rng.uniform(-7, 7))
        sheet = shapes.rotate(shapes.panel(width, height, (x, y, face + 0.0015)), "z", turn, (x, y, 0))
        builder.add(PartStyle(paper, noted.name), sheet)
        magnet = shapes.cylinder(0.017, 0.01, (x, y + 0.4 * height, face + 0.005), "z", 10)
        builder.add(PartStyle(_MAGNETS[index % 2], noted.name), magnet)


def _dispenser(builder: Builder, door: _Door, face: float) -> None:
    """Add a water dispenser: a dark alcove with a bright display above it, a spout and a tray."""
    x, wide = sum(door.x) / 2, min(0.24, 0.5 * (door.x[1] - door.x[0]))
    y1 = min(door.y[1] - 0.08, _DISPENSER_TOP_M)
    y0 = y1 - 1.5 * wide
    frame, dark, metal = (PartStyle(look, door.name) for look in ("plastic/#3a3d41", "plastic/#0f1011", "chrome"))
    builder.block(frame, (x - wide / 2, x + wide / 2), (y0, y1), (face - 0.002, face + 0.008), 0.003)
    builder.add(dark, shapes.panel(0.8 * wide, 0.9 * wide, (x, y0 + 0.55 * wide, face + 0.009)))
    display = shapes.panel(0.7 * wide, 0.2 * wide, (x, y1 - 0.22 * wide, face + 0.009))
    builder.add(PartStyle("plastic/#9fd8f4", door.name), display)
    spout = shapes.cylinder(0.06 * wide, 0.25 * wide, (x, y0 + 0.87 * wide, face + 0.018), segments=8)
    tray = shapes.span((x - 0.4 * wide, y0 + 0.08 * wide, face), (x + 0.4 * wide, y0 + 0.14 * wide, face + 0.03))
    builder.add(metal, spout, tray)


_PANEL_M, _FOOT_M, _WALL_M, _DOOR_M = 0.13, 0.05, 0.02, 0.045
"""Heights of the control panel and of the foot, and thicknesses of the shell and of the door (m)."""
_LID = 1.12
"""Half the side of a machine's door, as a share of the drum's radius."""
_MOUTH, _MOUTH_CORNER = 1.03, 0.3
"""Half the side of a dryer's opening and the radius of its corners, as shares of the drum's radius."""
_DARK, _GREY = "plastic/#1b1d20", "plastic/#a4aaaf"


@dataclass(frozen=True, slots=True)
class _Machine:
    """The parts and sizes (m) that washing machines and dryers have in common."""

    builder: Builder
    shell: Finish
    front: float
    """Coordinate z (m) of the front of the case; the door is in front of the case."""
    middle: float
    """Height (m) of the drum's middle."""
    radius: float
    """Radius (m) of the drum."""

    @property
    def panel(self) -> Range:
        """Lowest and highest height (m) of the control panel."""
        return self.builder.height - _PANEL_M, self.builder.height - 0.025

    def face(self, part: shapes.Mesh, z: float) -> shapes.Mesh:
        """Stand a part upright in front of the drum, and return it; `part` lies at the origin, and its top will face
        the viewer."""
        return shapes.translate(shapes.rotate(part, "x", 90), (0.0, self.middle, z))


def washing_machine(size: Vec3, rng: np.random.Generator, levels: Sequence[float]) -> Asset:
    """Return a front-loading washing machine with a soap drawer and a round glass door."""
    machine = _machine("WashingMachine", size, rng)
    builder, front, (low, high), end = machine.builder, machine.front, machine.panel, size.x / 2
    angles = np.linspace(-np.pi / 2, np.pi / 2, 13)
    _front(machine, machine.radius * np.c_[np.cos(angles), np.sin(angles)])
    _controls(machine, (0.04, 0.3), 0.17)
    builder.block("plastic/#c4c7ca", (end - 0.2, end - 0.015), (low + 0.012, high - 0.012),
                  (front - 0.01, front + 0.008), 0.003)  # fmt: skip
    builder.add("print/washer", shapes.panel(0.16, 0.04, (end - 0.108, (low + high) / 2, front + 0.0086)))
    _drum(machine, "glow/#cfe8ff")
    _porthole(machine)
    builder.glow = Glow(Vec3(0, machine.middle, front - 0.1), (0.8, 0.9, 1.0), 0.1)
    return builder.build((machine.shell.word,))


def clothes_dryer(size: Vec3, rng: np.random.Generator, levels: Sequence[float]) -> Asset:
    """Return a tumble dryer with a flat, nearly square door, a lint filter and a vent grille."""
    machine = _machine("ClothesDryer", size, rng)
    builder, front, radius = machine.builder, machine.front, machine.radius
    outline = shapes.rounded_rectangle(2 * _MOUTH * radius, 2 * _MOUTH * radius, _MOUTH_CORNER * radius)
    half = outline[outline[:, 0] > 0]
    _front(machine, half[np.argsort(half[:, 1], kind="stable")])
    _controls(machine, (-0.06 * size.x, 0.34), 0.24 * size.x)
    wide = min(0.44 * size.x, 3.6 * (machine.panel[1] - machine.panel[0]))
    name = shapes.panel(wide, wide / 4, (0.25 * size.x, sum(machine.panel) / 2, front + 0.001))
    builder.add("print/dryer", name)
    _drum(machine, "glow/#dcecf8")
    _bulkhead(machine)
    _grille(machine)
    _flat_door(machine)
    builder.glow = Glow(Vec3(0, machine.middle, front - 0.1), (0.95, 0.97, 1.0), 0.1)
    return builder.build((machine.shell.word,))


def _machine(category: str, size: Vec3, rng: np.random.Generator) -> _Machine:
    """Return a machine that so far has only its case, which is open in front, and the surface on its top."""
    builder = Builder(category, size)
    shell = one_of(rng, (SHELLS[0], SHELLS[0], SHELLS[1], SHELLS[3], SHELLS[2]))
    (x0, x1), (z0, z1), height = builder.across, builder.through, builder.height
    front, low, wall = z1 - _DOOR_M, 0.02, _WALL_M
    for a, b in ((x0, x0 + wall), (x1 - wall, x1)):
        builder.block(shell.material, (a, b), (low, height), (z0, front))
    builder.block(shell.material, (x0, x1), (height - 0.025, height), (z0, front), 0.006)
    builder.block(shell.material, (x0, x1), (low, _FOOT_M), (z0, front))
    builder.block(shell.material, (x0 + wall, x1 - wall), (_FOOT_M, height - 0.025), (z0, z0 + wall))
    builder.block("plastic/#2a2c2f", (x0 + 0.03, x1 - 0.03), (0, low), (z0 + 0.03, front - 0.03))
    builder.solid((x0, 0, z0), (x1, height, front))
    builder.surface("top", (0, height, (z0 + front) / 2), (size.x - 0.04, front - z0 - 0.04))
    return _Machine(builder, shell, front, 0.47 * height, min(0.36 * size.x, 0.3 * height))


def _front(machine: _Machine, edge: np.ndarray) -> None:
    """Add the front plate in two halves; `edge` (n, 2) is the +x half of the outline of the hole around the drum."""
    builder, middle = machine.builder, machine.middle
    y0, y1 = _FOOT_M, machine.panel[0]
    z = (machine.front - _WALL_M, machine.front)
    for side, end in zip((-1, 1), builder.across, strict=True):
        rim = edge * [side, 1.0] + [0.0, middle]
        ends = [(0.0, rim[0, 1]), *rim[np.abs(rim[:, 0]) > 1e-6], (0.0, rim[-1, 1])]
        outline = [(0.0, y0), *ends, (0.0, y1), (end, y1), (end, y0)]
        builder.add(machine.shell.material, shapes.extrude(outline, *z, "z"))


def _controls(machine: _Machine, dial: tuple[float, float], wide: float) -> None:
    """Add the control panel with a dial and a clock.

    `dial` has the dial's place along x, and its radius as a share of the panel's height. `wide` is the clock's width.
    """
    builder, z, (y0, y1) = machine.builder, machine.front, machine.panel
    (x, share), tall, mid = dial, y1 - y0, (y0 + y1) / 2
    builder.block("plastic/#d5d7d9", builder.across, (y0, y1), (z - 0.02, z), 0.002)
    builder.add("chrome", shapes.cylinder(share * tall, 0.022, (x, mid, z + 0.01), "z", 18))
    builder.block("plastic/#33363a", (x - 0.003, x + 0.003), (mid, mid + share * tall), (z + 0.018, z + 0.023))
    clock = shapes.panel(wide, 0.5 * tall, (builder.across[0] + 0.055 + wide / 2, mid, z + 0.001))
    builder.add(PartStyle("plastic/#101314", lit="screen/blue"), clock)


def _drum(machine: _Machine, light: str) -> None:
    """Add the drum, which is lit while the machine is on, and the surface inside it."""
    builder, radius, front = machine.builder, machine.radius, machine.front
    depth = front - _WALL_M - builder.through[0] - 0.06
    drum = shapes.lathe([(radius, 0.0), (radius * 0.98, -depth), (0.0, -depth)], segments=20)
    builder.add(PartStyle("metal/brushed", lit=light), machine.face(drum, front - 0.004))
    bottom = (0, machine.middle - 0.8 * radius, front - 0.03 - depth / 2)
    builder.surface("drum", bottom, (radius, 0.8 * depth), 1.4 * radius, needs_opening=True)


def _bulkhead(machine: _Machine) -> None:
    """Add the plate between a dryer's nearly square opening and its round drum, with the lint filter at its bottom."""
    builder, radius, middle, z = machine.builder, machine.radius, machine.middle, machine.front - 0.012
    corner = shapes.rounded_rectangle(2 * _MOUTH * radius, 2 * _MOUTH * radius, _MOUTH_CORNER * radius)
    angles = np.linspace(0, 2 * np.pi, 20, endpoint=False)
    circle = 0.99 * radius * np.c_[np.cos(angles), np.sin(angles)]
    plate = shapes.extrude(_framed(corner, circle), 0.0, 0.008)
    builder.add(_GREY, machine.face(plate, z - 0.008))
    low = middle - _MOUTH * radius
    builder.block("plastic/#2f6f8f", (-0.5 * radius, 0.5 * radius), (low, low + 0.13 * radius), (z, z + 0.008), 0.002)
    slots = np.linspace(-0.42, 0.42, 8) * radius
    tall = (low + 0.03 * radius, low + 0.1 * radius)
    builder.add(_DARK, *(shapes.span((x - 0.006, tall[0], z), (x + 0.006, tall[1], z + 0.0095)) for x in slots))


def _grille(machine: _Machine) -> None:
    """Add the vent grille at a dryer's foot: a dark area with slats."""
    builder, z = machine.builder, machine.front
    x = (builder.across[0] + 0.05, builder.across[1] - 0.05)
    low, high = _FOOT_M + 0.005, machine.middle - _LID * machine.radius - 0.012
    builder.block(_DARK, x, (low, high), (z, z + 0.003))
    edges = np.linspace(low, high, 9)
    for bottom, top in zip(edges[1:-1:2], edges[2::2], strict=False):
        builder.block("plastic/#8f9398", x, (bottom, top), (z, z + 0.008), 0.002)


def _porthole(machine: _Machine) -> None:
    """Add a washing machine's door: a round ring of chrome with a bulging glass."""
    radius, thick = _LID * machine.radius, _DOOR_M - 0.006
    joint = _door(machine)
    profile = [(0.72 * radius, 0.0), (radius, 0.0), (0.97 * radius, 0.7 * thick), (0.86 * radius, thick),
               (0.74 * radius, 0.8 * thick), (0.72 * radius, 0.0)]  # fmt: skip
    ring, pane = PartStyle("chrome", joint), PartStyle("smoked_glass/#3a4248", joint)
    machine.builder.add(ring, machine.face(shapes.lathe(profile, segments=24), machine.front))
    window = 0.75 * radius
    bowl = [(0, 0.25 * thick), (window, 0.25 * thick), (0.6 * window, 0.75 * thick), (0, 0.85 * thick)]
    machine.builder.add(pane, machine.face(shapes.lathe(bowl, segments=20), machine.front))
    _grip(machine, joint, 0.4)


def _flat_door(machine: _Machine) -> None:
    """Add a dryer's door: a nearly square frame around a flat window."""
    radius, thick = _LID * machine.radius, _DOOR_M - 0.012
    joint = _door(machine)
    frame, pane = PartStyle(_GREY, joint), PartStyle("smoked_glass/#2c3034", joint)
    outer = shapes.rounded_rectangle(2 * radius, 2 * radius, 0.16 * radius)
    hole = shapes.rounded_rectangle(1.4 * radius, 1.4 * radius, 0.42 * radius)
    machine.builder.add(frame, machine.face(shapes.extrude(_framed(outer, hole), 0.0, thick), machine.front))
    machine.builder.add(pane, machine.face(shapes.extrude(1.02 * hole, 0.3 * thick, 0.7 * thick), machine.front))
    _grip(machine, joint, 1.1)


def _door(machine: _Machine) -> str:
    """Add the hinge at a door's +x edge (seen from the front, on the left) and the door's solid; return the joint."""
    builder, radius, (front, end) = machine.builder, _LID * machine.radius, (machine.front, machine.builder.through[1])
    joint = builder.hinge("door", (0, 1, 0), (radius, 0, front), 90.0)
    builder.solid((-radius, machine.middle - radius, front), (radius, machine.middle + radius, end), joint)
    return joint


def _grip(machine: _Machine, joint: str, length: float) -> None:
    """Add a door's handle; `length` is its length as a share of half the door's side."""
    radius, z = _LID * machine.radius, machine.builder.through[1]
    grip = shapes.box((0.02, length * radius, 0.018), (-0.88 * radius, machine.middle, z - 0.009), 0.005)
    machine.builder.add(PartStyle("plastic/#4b4e52", joint), grip)


def _framed(outer: np.ndarray, hole: np.ndarray) -> np.ndarray:
    """Return the outline (n, 2) of a frame with a hole as one line, cut open where both outlines are farthest to +x."""
    outer, hole = (np.roll(each, -int(np.argmax(each[:, 0])), 0) for each in (outer, hole))
    return np.concatenate([outer, outer[:1], hole[:1], hole[:0:-1], hole[:1]])


MAKERS: dict[str, Maker] = {
    "ClothesDryer": clothes_dryer,
    "Fridge": fridge,
    "WashingMachine": washing_machine,
}
