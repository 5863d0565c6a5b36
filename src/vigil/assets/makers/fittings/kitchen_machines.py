"""Small kitchen machines: toasters and coffee machines."""

from collections.abc import Sequence

import numpy as np

from vigil.assets.kernel import shapes
from vigil.assets.kernel.arrange import lengthwise
from vigil.assets.kernel.asset import Asset, Glow
from vigil.assets.kernel.builder import Builder, PartStyle
from vigil.assets.kernel.furniture_parts import Finish
from vigil.assets.kernel.palette import HOT, one_of
from vigil.base.geometry import Vec3

_MACHINES = (
    Finish("plastic/#232528", "black"), Finish("plastic/#a8322d", "red"), Finish("metal/steel", "steel"),
    Finish("plastic/#efede6", "white"),
)  # fmt: skip


def toaster(size: Vec3, rng: np.random.Generator, levels: Sequence[float]) -> Asset:
    """Return a toaster whose length lies along z: two slots that glow, a lever and a dial on its end."""
    builder = Builder("Toaster", size)
    shell = one_of(rng, (Finish("chrome", "chrome"), Finish("metal/steel", "steel"), Finish("plastic/#a8322d", "red"),
                         Finish("plastic/#25272a", "black"), Finish("plastic/#eeece4", "white")))  # fmt: skip
    width, height, depth = size
    foot, front = 0.06 * height, 0.5 * depth - 0.05 * depth
    body = (width, height - foot, 0.95 * depth)
    builder.add(
        shell.material, shapes.rounded_box(body, (0, foot + body[1] / 2, -0.025 * depth), 0.2 * min(width, height))
    )
    builder.block("plastic/#1d1f22", (-0.42 * width, 0.42 * width), (0, 1.6 * foot), (-0.46 * depth, 0.42 * depth))
    for side in (-1, 1):
        slot = (0.15 * width, 0.004, 0.66 * depth)
        at = (side * 0.19 * width, height - 0.0016, -0.025 * depth)
        builder.add(PartStyle("plastic/#141516", on=HOT, bears_toggle=True), shapes.box(slot, at))
    lever = shapes.box((0.22 * width, 0.07 * height, 0.05 * depth))
    builder.add(
        PartStyle("plastic/#1d1f22", bears_toggle=True, shown="off"),
        shapes.translate(lever, (0, 0.78 * height, front + 0.025 * depth)),
    )
    builder.add(
        PartStyle("plastic/#1d1f22", bears_toggle=True, shown="on"),
        shapes.translate(lever, (0, 0.36 * height, front + 0.025 * depth)),
    )
    builder.block(
        "plastic/#1d1f22", (-0.03 * width, 0.03 * width), (0.3 * height, 0.82 * height), (front - 0.01, front + 0.002)
    )
    builder.add(
        "plastic/#33363a", shapes.cylinder(0.11 * width, 0.03 * depth, (0.27 * width, 0.3 * height, front), "z", 14)
    )
    builder.surface("slots", (0, height, 0), (0.6 * width, 0.66 * depth))
    builder.glow = Glow(Vec3(0, height, 0), (1.0, 0.45, 0.2), 0.04)
    return builder.build((shell.word,))


def coffee_machine(size: Vec3, rng: np.random.Generator, levels: Sequence[float]) -> Asset:
    """Return a coffee machine: a tower with a tank, a head with spouts over a drip tray, keys that light up."""
    builder = Builder("CoffeeMachine", size)
    shell = one_of(rng, _MACHINES)
    (x0, x1), (z0, z1), height = builder.across, builder.through, builder.height
    width, depth = builder.width, builder.depth
    wide = min(0.5 * width, 0.15)
    base, head = 0.11 * height, 0.66 * height
    back = z0 + 0.5 * depth
    builder.block(shell.material, (x0, x1), (0, base), (z0, z1), 0.01)
    builder.block(shell.material, (x0, x1), (base - 0.01, height), (z0 + 0.16 * depth, back), 0.015)
    builder.block(shell.material, (x0, x1), (head, height), (back - 0.02, z1 - 0.04 * depth), 0.02)
    builder.block(
        PartStyle("glass/#b9d4df", is_glass=True),
        (x0 + 0.1 * width, x1 - 0.1 * width),
        (base, 0.92 * height),
        (z0, z0 + 0.16 * depth),
    )
    builder.block("metal/brushed", (-wide, wide), (base - 0.002, base + 0.008), (back + 0.02, z1 - 0.02), 0.002)
    slots = [
        shapes.box((1.7 * wide, 0.002, 0.006), (0, base + 0.0085, z)) for z in np.linspace(back + 0.05, z1 - 0.05, 5)
    ]
    builder.add("plastic/#16171a", *slots)
    builder.add("chrome", shapes.cylinder(0.03, 0.05, (0, head - 0.012, back + 0.25 * depth), segments=14))
    builder.add(
        "chrome",
        *(shapes.cylinder(0.006, 0.03, (x, head - 0.045, back + 0.25 * depth), segments=8) for x in (-0.014, 0.014)),
    )
    face = z1 - 0.04 * depth
    clock = shapes.panel(0.34 * width, 0.1 * height, (0, 0.88 * height, face + 0.001))
    builder.add(PartStyle("plastic/#0f1113", on="screen/blue", bears_toggle=True), clock)
    lamps = [shapes.cylinder(0.011, 0.008, (x * width, 0.76 * height, face + 0.003), "z", 12) for x in (-0.2, 0.0, 0.2)]
    builder.add(PartStyle("plastic/#5d6166", on="glow/#35e06a", bears_toggle=True), *lamps)
    pour = shapes.cylinder(0.004, head - 0.06 - base, (0, (head - 0.06 + base) / 2, back + 0.25 * depth), segments=8)
    builder.add(PartStyle("plastic/#3a2114", bears_toggle=True, shown="on"), pour)
    builder.solid((x0, 0, z0), (x1, base, z1))
    builder.solid((x0, base, z0), (x1, height, back))
    builder.solid((x0, head, back), (x1, height, face))
    builder.surface("tray", (0, base + 0.01, (back + z1) / 2 + 0.005), (2 * wide, z1 - back - 0.05), head - base - 0.02)
    return builder.build((shell.word,))


MAKERS = {"CoffeeMachine": coffee_machine, "Toaster": lengthwise(toaster)}
