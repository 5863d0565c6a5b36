"""Small things: food, books, laptops, pillows and cloths."""

from collections.abc import Sequence

import numpy as np

from vigil.assets.kernel import shapes
from vigil.assets.kernel.arrange import Maker, creased, lengthwise, lowered_into
from vigil.assets.kernel.asset import Asset
from vigil.assets.kernel.builder import Builder, PartStyle
from vigil.assets.kernel.materials import material
from vigil.assets.kernel.meshes import cross
from vigil.assets.kernel.palette import colour, one_of, word_for
from vigil.base.geometry import Vec3


def tomato(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a tomato: ribbed, with a green star of sepals."""
    builder = Builder("Tomato", size)
    width, height, depth = size
    tint = one_of(rng, ("#cf2b1f", "#d9441f", "#b9201c"))
    ball = shapes.ellipsoid((width, 0.93 * height, depth), (0, 0.465 * height, 0), segments=20, rings=8)
    vertices = ball.vertices.astype(np.float64)
    ribs = 1 - 0.035 * (1 + np.cos(5 * np.arctan2(vertices[:, 0], vertices[:, 2])))
    vertices[:, [0, 2]] *= ribs[:, None]
    builder.add(f"plastic/{tint}", shapes.mesh(vertices, ball.faces, ball.normals, ball.uvs))
    green = "plastic/#4f8a35"
    for k in range(5):
        leaf = shapes.extrude([(0.0, -0.05), (0.2, -0.06), (0.34, 0.0), (0.2, 0.06), (0.0, 0.05)], 0.0, 0.012)
        leaf = shapes.rotate(shapes.scale(leaf, (width, width, width)), "z", -14)
        builder.add(green, shapes.translate(shapes.rotate(leaf, "y", 72 * k + 10), (0, 0.925 * height, 0)))
    builder.add(green, shapes.cylinder(0.03 * width, 0.08 * height, (0, 0.96 * height, 0), segments=6))
    return builder.build(["red"])


def potato(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a potato: a lumpy ellipsoid with dark eyes."""
    builder = Builder("Potato", size)
    tint = one_of(rng, ("#b08a52", "#9c7443", "#c2a066", "#8f4f43"))
    lump = shapes.ellipsoid(size, (0, size.y / 2, 0), segments=16, rings=9)
    phase = rng.uniform(0, 6, 3)
    low, high = shapes.bounds([lump])
    unit = (lump.vertices - (low + high) / 2) / (high - low)
    waves = np.sin(7 * unit[:, 0] + phase[0]) + np.sin(8 * unit[:, 1] + phase[1]) + np.sin(9 * unit[:, 2] + phase[2])
    vertices = (low + high) / 2 + unit * (high - low) * (1 + 0.09 * waves / 3)[:, None]
    builder.add(f"skin/{tint}", shapes.mesh(vertices, lump.faces, lump.normals, lump.uvs))
    for _ in range(5):
        angle, along = rng.uniform(0.3, 2.8), rng.uniform(-0.3, 0.3)
        radius = np.sqrt(1 - (2 * along) ** 2) / 2
        x, y = radius * np.cos(angle) * size.x * 0.93, size.y / 2 + radius * np.sin(angle) * size.y * 0.93
        spot = (x, y, along * size.z)
        builder.add("plastic/#5f452b", shapes.ellipsoid(np.array(size) * 0.09, spot, segments=6, rings=4))
    return builder.build()


def bread(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a loaf of bread along z: a tin loaf, a round-topped loaf with cuts, or a long loaf like a baguette."""
    builder = Builder("Bread", size)
    width, height, length = size
    kind = one_of(rng, ("tin", "oval", "tin"))
    crust = f"skin/{one_of(rng, ('#b9783a', '#a5652c', '#c68a4a'))}"
    crumb = "plastic/#e8cf9f"
    if kind == "tin":
        wall = [(-0.44, 0.0), (-0.46, 0.5), (-0.5, 0.62), (-0.46, 0.82), (-0.3, 0.96), (0.0, 1.0)]
        outline = [(x * width, y * height) for x, y in wall + [(-x, y) for x, y in reversed(wall[:-1])]]
        builder.add(crust, shapes.extrude(outline, -0.49 * length, 0.47 * length, "z"))
        face = [(0.88 * x, 0.02 * height + 0.93 * y) for x, y in outline]
        builder.add(crumb, shapes.extrude(face, 0.46 * length, 0.49 * length, "z"))
        builder.add(crust, shapes.extrude(outline, 0.482 * length, 0.4821 * length + 0.018 * length, "z"))
        builder.add(crumb, shapes.extrude(face, 0.499 * length, 0.502 * length, "z"))
    else:
        loaf = shapes.ellipsoid((width, 1.5 * height, length), (0, 0.25 * height, 0), segments=18, rings=10)
        vertices = loaf.vertices.astype(np.float64)
        vertices[:, 1] = np.maximum(vertices[:, 1], 0.0)  # it lies flat
        builder.add(crust, shapes.mesh(vertices, loaf.faces, loaf.normals, loaf.uvs))
    for z in (-0.3, -0.1, 0.1, 0.3):
        if kind == "oval":
            cut = shapes.ellipsoid((0.5 * width, 0.05 * height, 0.05 * length), segments=8, rings=4)
            top = 0.25 + 0.75 * np.sqrt(1 - (2 * z) ** 2)
            cut = shapes.rotate(cut, "y", 25)
            builder.add(crumb, shapes.translate(cut, (0, top * height * 0.985, z * length)))
    return builder.build([kind, "brown"])


def lettuce(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a head of lettuce: layers of frilled leaves around a pale heart."""
    builder = Builder("Lettuce", size)
    tints = one_of(
        rng, (("#5c9a3c", "#86bd55", "#b9d98a"), ("#4a8a3a", "#74ad4c", "#a8cf7a"), ("#6a8f45", "#94b862", "#c6dc9a"))
    )
    heart = shapes.ellipsoid((0.6, 0.78, 0.6), (0, 0.52, 0), segments=9, rings=5)
    pieces = [(tints[2], heart)]
    for layer, (count, lean, reach) in enumerate(((5, 22, 0.95), (4, 8, 0.98))):
        for k in range(count):
            leaf = _leaf_bowl(rng)
            leaf = shapes.rotate(shapes.scale(leaf, (0.62, reach, 0.3)), "x", lean)
            leaf = shapes.translate(leaf, (0, 0.02, 0.16 - 0.06 * layer))
            pieces.append((tints[min(layer, 1)], shapes.rotate(leaf, "y", 360 * (k + 0.5 * layer) / count)))
    for tint, piece in pieces:
        builder.add(f"leaf/{tint}", shapes.scale(piece, size))
    return builder.build(["green"])


def _leaf_bowl(rng: np.random.Generator) -> shapes.Mesh:
    """Return a leaf that stands on its stem, 1 high and about 1 wide; its hollow side faces inward (-z)."""
    wide = np.array([0.12, 0.62, 1.0, 0.95, 0.55])
    rings = []
    for level, half in enumerate(wide / 2):
        across = np.linspace(-1, 1, 4)
        ruffle = 0.12 * level / 4 * np.sin(5 * across + rng.uniform(0, 6))
        y = 0.25 * level - 0.06 * across**2 * (level == 4)
        out = 0.7 * np.sin(0.75 * np.pi * level / 4) - 0.5 * across**2 + ruffle
        front = np.c_[half * across, np.full(4, y), out]
        back = front[::-1] - [0, 0, 0.06]
        rings.append(np.concatenate([front, back, front[:1]]))
    return creased(shapes.loft(np.array(rings)))


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


WEAVES = ("fabric", "fabric", "stripes", "plaid", "dots", "knit", "velvet")


def pillow(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a pillow, thick in the middle, with pinched corners. It lies flat or, in an upright box, stands."""
    builder = Builder("Pillow", size)
    name, tint = colour(
        rng, "white", "red", "blue", "teal", "yellow", "grey", "green", "pink", "navy", "cream", "orange"
    )
    weave = one_of(rng, WEAVES)
    thin = int(np.argmin(size))
    order = {0: [1, 0, 2], 1: [0, 1, 2], 2: [0, 2, 1]}[thin]
    part = _plump(np.array(size)[order])
    if thin != 1:
        part = shapes.rotate(part, "z" if thin == 0 else "x", 90)
    builder.add(f"{weave}/{tint}", shapes.translate(part, (0, size.y / 2, 0)))
    return builder.build([name] if weave in ("fabric", "velvet") else [name, weave])


def _plump(size: np.ndarray) -> shapes.Mesh:
    """Return a cushion around the origin, thinnest along y. Its seam is pulled in between the corners."""
    width, height, depth = size
    steps = 8
    ticks = np.linspace(-1, 1, steps + 1)
    u, v = (grid.ravel() for grid in np.meshgrid(ticks, ticks, indexing="ij"))
    pinch_u, pinch_v = 1 - 0.07 * (1 - v**2), 1 - 0.07 * (1 - u**2)
    thick = np.clip((1 - u**2) * (1 - v**2), 0, 1) ** 0.45
    x, z = u * pinch_v * width / 2, v * pinch_u * depth / 2
    faces = []
    for i in range(steps):
        for j in range(steps):
            a, b = i * (steps + 1) + j, (i + 1) * (steps + 1) + j
            faces += [(a, a + 1, b + 1), (a, b + 1, b)]
    top_faces = np.array(faces)
    top = np.c_[x, thick * height / 2, z]
    bulge = thick.reshape(steps + 1, -1)
    slope_u, slope_v = (np.asarray(np.gradient(bulge, axis=axis)).ravel() * steps / 2 for axis in (0, 1))
    normals = np.c_[-slope_u * height / width, np.ones(len(u)) + 0.05, -slope_v * height / depth]
    first, second, third = top[top_faces[0]]
    if cross(second - first, third - first)[1] < 0:
        top_faces = top_faces[:, ::-1]
    upper = shapes.mesh(top, top_faces, normals, np.c_[x, z])
    return shapes.merge([upper, shapes.scale(upper, (1, -1, 1))])


def cleaning_cloth(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a crumpled cleaning cloth."""
    builder = Builder("Cloth", size)
    width, height, depth = size
    name, tint = colour(rng, "blue", "yellow", "green", "pink", "white", "orange", "red")
    weave = one_of(rng, ("fabric", "dots", "stripes", "plaid", "knit"))
    steps = 9
    ticks = np.linspace(-1, 1, steps)
    u, v = np.meshgrid(ticks, ticks, indexing="ij")
    phase = rng.uniform(0, 6, 6)
    waves = np.sin(3 * u + phase[0]) + np.sin(4 * v + phase[1]) + np.sin(3 * (u - v) + phase[2])
    edge = 1 + 0.06 * np.sin(5 * np.arctan2(v, u) + phase[3])
    lift = (waves - waves.min()) / np.ptp(waves)
    rings = []
    for row in range(steps):
        front = np.c_[u[row] * edge[row] * width / 2, lift[row] * 0.8 * height, v[row] * edge[row] * depth / 2]
        back = front[::-1] + np.array([0, 0.16 * height, 0])
        rings.append(np.concatenate([front, back, front[:1]]))
    builder.add(f"{weave}/{tint}", creased(shapes.loft(np.array(rings))))
    return builder.build([name])


MAKERS: dict[str, Maker] = {
    "Book": book,
    "Bread": lengthwise(bread),
    "Cloth": cleaning_cloth,
    "Laptop": laptop,
    "Lettuce": lettuce,
    "Pillow": pillow,
    "Potato": potato,
    "Tomato": tomato,
}
