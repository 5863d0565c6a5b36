"""Washing machines and dryers: a drum behind a door in the front.

They differ as real ones do. A washing machine has a round door with a bulging glass, and a soap drawer. A dryer has a
squarish, flat door, a lint filter below the opening and a vent grille at its foot, but not a soap drawer.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vigil.assets.kernel import shapes
from vigil.assets.kernel.asset import Asset, Glow
from vigil.assets.kernel.builder import Builder, PartStyle, Range
from vigil.assets.kernel.furniture_parts import Finish
from vigil.assets.kernel.palette import one_of
from vigil.assets.makers.fittings.appliances import SHELLS
from vigil.base.geometry import Vec3

_PANEL_M, _FOOT_M, _WALL_M, _DOOR_M = 0.13, 0.05, 0.02, 0.045
"""Heights of the control panel and of the foot, and thicknesses of the shell and of the door (m)."""
_LID = 1.12
"""Half the side of a door, as a share of the drum's radius."""
_MOUTH, _MOUTH_CORNER = 1.03, 0.3
"""Half the side of a dryer's opening and the radius of its corners, as shares of the drum's radius."""
_DARK, _GREY = "plastic/#1b1d20", "plastic/#a4aaaf"


@dataclass(frozen=True, slots=True)
class _Machine:
    """The parts and measures (m) that both machines share."""

    builder: Builder
    shell: Finish
    front: float
    """Front end of the case (z); the door is in front of it."""
    middle: float
    """Height of the drum's middle."""
    radius: float
    """Radius of the drum."""

    @property
    def panel(self) -> Range:
        """Heights between which the controls are."""
        return self.builder.height - _PANEL_M, self.builder.height - 0.025

    def face(self, part: shapes.Mesh, z: float) -> shapes.Mesh:
        """Return a part made lying about the origin, placed upright before the drum with its top towards the viewer."""
        return shapes.translate(shapes.rotate(part, "x", 90), (0.0, self.middle, z))


def washing_machine(size: Vec3, rng: np.random.Generator, levels: Sequence[float]) -> Asset:
    """Return a front loader with a soap drawer and a glass porthole."""
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
    """Return a tumble dryer: a squarish flat door, a lint filter and a vent grille."""
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
    """Return the case of a machine, open in front, with the places on and in it."""
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
    """Add the front plate as two halves; `edge` (n, 2) is the half at +x of the outline of the hole about the drum's
    middle."""
    builder, middle = machine.builder, machine.middle
    y0, y1 = _FOOT_M, machine.panel[0]
    z = (machine.front - _WALL_M, machine.front)
    for side, end in zip((-1, 1), builder.across, strict=True):
        rim = edge * [side, 1.0] + [0.0, middle]
        ends = [(0.0, rim[0, 1]), *rim[np.abs(rim[:, 0]) > 1e-6], (0.0, rim[-1, 1])]
        outline = [(0.0, y0), *ends, (0.0, y1), (end, y1), (end, y0)]
        builder.add(machine.shell.material, shapes.extrude(outline, *z, "z"))


def _controls(machine: _Machine, dial: tuple[float, float], wide: float) -> None:
    """Add the panel with a dial (place along x, radius as a share of the panel's height) and a clock of width
    `wide`."""
    builder, z, (y0, y1) = machine.builder, machine.front, machine.panel
    (x, share), tall, mid = dial, y1 - y0, (y0 + y1) / 2
    builder.block("plastic/#d5d7d9", builder.across, (y0, y1), (z - 0.02, z), 0.002)
    builder.add("chrome", shapes.cylinder(share * tall, 0.022, (x, mid, z + 0.01), "z", 18))
    builder.block("plastic/#33363a", (x - 0.003, x + 0.003), (mid, mid + share * tall), (z + 0.018, z + 0.023))
    clock = shapes.panel(wide, 0.5 * tall, (builder.across[0] + 0.055 + wide / 2, mid, z + 0.001))
    builder.add(PartStyle("plastic/#101314", on="screen/blue", bears_toggle=True), clock)


def _drum(machine: _Machine, light: str) -> None:
    """Add the drum, which is lit while on, and the surface in it."""
    builder, radius, front = machine.builder, machine.radius, machine.front
    depth = front - _WALL_M - builder.through[0] - 0.06
    drum = shapes.lathe([(radius, 0.0), (radius * 0.98, -depth), (0.0, -depth)], segments=20)
    builder.add(PartStyle("metal/brushed", on=light, bears_toggle=True), machine.face(drum, front - 0.004))
    bottom = (0, machine.middle - 0.8 * radius, front - 0.03 - depth / 2)
    builder.surface("drum", bottom, (radius, 0.8 * depth), 1.4 * radius, needs_opening=True)


def _bulkhead(machine: _Machine) -> None:
    """Add the transition from a dryer's squarish opening to its round drum, with the lint filter at its bottom."""
    builder, radius, middle, z = machine.builder, machine.radius, machine.middle, machine.front - 0.012
    corner = shapes.rounded_rectangle(2 * _MOUTH * radius, 2 * _MOUTH * radius, _MOUTH_CORNER * radius)
    plate = shapes.extrude(_framed(corner, _circle(0.99 * radius)), 0.0, 0.008)
    builder.add(_GREY, machine.face(plate, z - 0.008))
    low = middle - _MOUTH * radius
    builder.block("plastic/#2f6f8f", (-0.5 * radius, 0.5 * radius), (low, low + 0.13 * radius), (z, z + 0.008), 0.002)
    slots = np.linspace(-0.42, 0.42, 8) * radius
    tall = (low + 0.03 * radius, low + 0.1 * radius)
    builder.add(_DARK, *(shapes.span((x - 0.006, tall[0], z), (x + 0.006, tall[1], z + 0.0095)) for x in slots))


def _grille(machine: _Machine) -> None:
    """Add the vent at a dryer's foot: a dark field with slats across it."""
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
    ring, pane = _looks(joint, "chrome", "glass/#5d6a72")
    machine.builder.add(ring, machine.face(shapes.lathe(profile, segments=24), machine.front))
    window = 0.75 * radius
    bowl = [(0, 0.25 * thick), (window, 0.25 * thick), (0.6 * window, 0.75 * thick), (0, 0.85 * thick)]
    machine.builder.add(pane, machine.face(shapes.lathe(bowl, segments=20), machine.front))
    _grip(machine, joint, 0.4)


def _flat_door(machine: _Machine) -> None:
    """Add a dryer's door: a squarish frame about a flat squarish window."""
    radius, thick = _LID * machine.radius, _DOOR_M - 0.012
    joint = _door(machine)
    frame, pane = _looks(joint, _GREY, "glass/#3c4146")
    outer = shapes.rounded_rectangle(2 * radius, 2 * radius, 0.16 * radius)
    hole = shapes.rounded_rectangle(1.4 * radius, 1.4 * radius, 0.42 * radius)
    machine.builder.add(frame, machine.face(shapes.extrude(_framed(outer, hole), 0.0, thick), machine.front))
    machine.builder.add(pane, machine.face(shapes.extrude(1.02 * hole, 0.3 * thick, 0.7 * thick), machine.front))
    _grip(machine, joint, 1.1)


def _door(machine: _Machine) -> str:
    """Add the joint at a door's edge at +x (the left, seen from the front) and the door's solid; return the joint's
    name."""
    builder, radius, (front, end) = machine.builder, _LID * machine.radius, (machine.front, machine.builder.through[1])
    joint = builder.hinge("door", (0, 1, 0), (radius, 0, front), 100.0)
    builder.solid((-radius, machine.middle - radius, front), (radius, machine.middle + radius, end), joint)
    return joint


def _looks(joint: str, frame: str, pane: str) -> tuple[PartStyle, PartStyle]:
    return PartStyle(frame, joint, bears_open=True), PartStyle(pane, joint, bears_open=True, is_glass=True)


def _grip(machine: _Machine, joint: str, length: float) -> None:
    """Add a door's handle; `length` is a share of half the door's side."""
    radius, z = _LID * machine.radius, machine.builder.through[1]
    grip = shapes.box((0.02, length * radius, 0.018), (-0.88 * radius, machine.middle, z - 0.009), 0.005)
    machine.builder.add(PartStyle("plastic/#4b4e52", joint, bears_open=True), grip)


def _circle(radius: float, segments: int = 20) -> np.ndarray:
    angles = np.linspace(0, 2 * np.pi, segments, endpoint=False)
    return radius * np.c_[np.cos(angles), np.sin(angles)]


def _framed(outer: np.ndarray, hole: np.ndarray) -> np.ndarray:
    """Return the outline (n, 2) of a frame, slit where its outer and inner outlines (n, 2) come nearest +x."""
    outer, hole = (np.roll(each, -int(np.argmax(each[:, 0])), 0) for each in (outer, hole))
    return np.concatenate([outer, outer[:1], hole[:1], hole[:0:-1], hole[:1]])


MAKERS = {"ClothesDryer": clothes_dryer, "WashingMachine": washing_machine}
