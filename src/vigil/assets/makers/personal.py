"""Books and laptops."""

from collections.abc import Sequence

import numpy as np

from vigil.assets.kernel import shapes
from vigil.assets.kernel.arrange import Maker, lowered_into
from vigil.assets.kernel.asset import Asset
from vigil.assets.kernel.builder import Builder, PartStyle
from vigil.assets.kernel.materials import material
from vigil.assets.kernel.palette import one_of, word_for
from vigil.base.geometry import Vec3

COVERS = 24


def book(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a book that lies on its back cover with its spine at -x; its front cover opens by 165 degrees."""
    builder = Builder("Book", size)
    width, height, length = size
    cover = f"cover/{rng.integers(COVERS)}"
    picture = material(cover).texture
    red, green, blue = (128, 128, 128) if picture is None else (int(part) for part in picture[2, 2])
    name, tint = word_for(red, green, blue), f"#{red:02x}{green:02x}{blue:02x}"
    board = min(0.12 * height, 0.004)
    cloth = f"leather/{tint}"
    builder.add(cloth, shapes.span((-width / 2, 0, -length / 2), (width / 2, board, length / 2)))
    builder.add(cloth, shapes.span((-width / 2, 0, -length / 2), (-width / 2 + board, height - board, length / 2)))
    pages = ((-width / 2 + board, board, -0.485 * length), (0.485 * width, height - 1.4 * board, 0.485 * length))
    builder.add("paper/#efe9d8", shapes.span(*pages))
    text = shapes.panel(0.9 * width, 0.93 * length, (0, height - 1.3 * board, 0), "+y")
    builder.add("print/text", text)
    hinge = builder.hinge("cover", (0, 0, 1), (-width / 2 + board, height - board, 0), 165)
    lid = PartStyle(cloth, joint=hinge)
    builder.add(lid, shapes.span((-width / 2, height - board, -length / 2), (width / 2, 0.999 * height, length / 2)))
    inside = PartStyle("print/text", joint=hinge)
    builder.add(inside, shapes.panel(0.94 * width, 0.96 * length, (0, height - 1.05 * board, 0), "-y"))
    front = PartStyle(cover, joint=hinge)
    builder.add(front, shapes.panel(0.92 * width, 0.99 * length, (0.03 * width, height, 0), "+y"))
    builder.solid((-width / 2, 0, -length / 2), (width / 2, height - board, length / 2))
    builder.solid((-width / 2, height - board, -length / 2), (width / 2, height, length / 2), hinge)
    return builder.build([name] if name else [])


_BLACK = "plastic/#17181a"
_OFF_SCREEN = "plastic/#0b0d11"


def laptop(size: Vec3, rng: np.random.Generator, levels: Sequence[float]) -> Asset:
    """Return a laptop whose lid, with the screen in it, opens by 110 degrees.

    A box that is too high for a closed laptop was measured while it was open. The open laptop then fills the box, and
    the shut laptop lies at the bottom of the box.
    """
    if size.y > 0.25 * size.z:
        thick, lean, depth = _measured_open(size)
        flat = _laptop(Vec3(size.x, thick, depth), rng, 90.0 + lean)
        return lowered_into(flat, size, forward=float(size.z - depth) / 2)
    return _laptop(size, rng, 110.0)


def _measured_open(size: Vec3) -> tuple[float, float, float]:
    """Return the thickness (m), the lean of the lid (deg) and the depth (m) of a laptop that, when open, fills a box.

    The height of the open laptop is 0.6 of its thickness plus 0.99 of the lid's rise. Its depth includes how far the
    lid leans back.
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
    builder.add(_BLACK, shapes.panel(*keys, (0, seam + 4e-4, -0.16 * depth), "+y"))
    caps = "plastic/#d9d9d6" if name == "black" else "plastic/#3c3e42"
    for row in range(5):
        for column in range(12):
            x = (column - 5.5) * keys[0] / 12.4
            z = -0.16 * depth + (row - 2) * keys[1] / 5.3
            builder.add(caps, shapes.panel(0.85 * keys[0] / 12.4, 0.8 * keys[1] / 5.3, (x, seam + 8e-4, z), "+y"))
    builder.add("plastic/#8b8d90", shapes.panel(0.3 * width, 0.26 * depth, (0, seam + 4e-4, 0.29 * depth), "+y"))
    lid = builder.hinge("lid", (1, 0, 0), (0, seam + 1e-3, -0.49 * depth), -opens_deg)
    leaf = PartStyle(case, joint=lid)
    low = seam + 0.0015
    builder.add(leaf, shapes.slab((width, height - low, depth), (0, (height + low) / 2, 0), 0.04 * depth))
    face = shapes.rotate(shapes.panel(0.94 * width, 0.9 * depth, facing="-y"), "y", 180)
    dark = shapes.panel(0.98 * width, 0.97 * depth, (0, low - 2e-4, 0), "-y")
    builder.add(PartStyle(_BLACK, joint=lid), dark)
    on = one_of(rng, ("screen/desktop", "screen/desktop", "screen/0"))
    glass = PartStyle(_OFF_SCREEN, joint=lid, lit=on)
    builder.add(glass, shapes.translate(face, (0, low - 6e-4, 0.01 * depth)))
    logo = one_of(rng, ("#f2f2f0", "#2d2f33"))
    badge = shapes.disc(0.06 * depth, (0, height, 0), segments=10)
    builder.add(PartStyle(f"plastic/{logo}", joint=lid), badge)
    builder.solid((-width / 2, 0, -depth / 2), (width / 2, seam, depth / 2))
    builder.solid((-width / 2, seam, -depth / 2), (width / 2, height, depth / 2), lid)
    return builder.build([name])


MAKERS: dict[str, Maker] = {
    "Book": book,
    "Laptop": laptop,
}
