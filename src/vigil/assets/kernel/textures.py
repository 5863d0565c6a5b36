"""Procedural surface textures: seamless, in neutral colours (a material adds its tint), made on demand.

`texture(name)` returns (h, w, 3) uint8, row 0 at the top; u goes along a row, v up a column. Wood grain, planks and
brushing go along u. Each name has its own fixed random stream, so that equal names give equal bytes. Pictures and
screens are in `vigil.assets.kernel.pictures`.
"""

import threading
import zlib
from collections.abc import Callable
from functools import lru_cache, partial

import numpy as np
from cachetools import LRUCache, cached

from vigil.assets.kernel import pictures

SIZE = 256
MAX_TEXTURE_BYTES = 64 * 2**20
"""Greatest size in bytes of all cached textures together. One texture has 0.2 MB."""
FLOOR_GRAIN = 0.6
"""Strength of the grain of wooden floors; stronger grain looks like smeared shadows."""


@cached(LRUCache(MAX_TEXTURE_BYTES, getsizeof=lambda pixels: pixels.nbytes), lock=threading.Lock())
def texture(name: str) -> np.ndarray:
    """Return the read-only texture called "wood", "tiles", ..., or the picture called "picture/3", "screen/1", ..."""
    rng = np.random.default_rng(zlib.crc32(name.encode()))
    kind, _, variant = name.partition("/")
    image = pictures.draw(kind, variant, rng) if kind in pictures.KINDS else PATTERNS[kind](rng)
    pixels = image if image.dtype == np.uint8 else _as_bytes(image)
    if pixels.ndim == 2:
        pixels = np.repeat(pixels[..., None], 3, axis=2)
    pixels = np.ascontiguousarray(pixels)
    pixels.flags.writeable = False
    return pixels


def _as_bytes(image: np.ndarray) -> np.ndarray:
    """Return a picture with values in 0..1 as bytes."""
    scaled = np.clip(image, 0, 1)
    scaled *= 255
    scaled += 0.5
    return scaled.astype(np.uint8)


def noise(rng: np.random.Generator, across: int, down: int, size: int = SIZE) -> np.ndarray:
    """Return smooth seamless noise in 0..1, shape (size, size), with `across` x `down` cells."""
    lattice = rng.random((down, across))
    (top, bottom, v), (left, _, u) = _cells(size, down), _cells(size, across)
    tall = lattice[top] + (lattice[bottom] - lattice[top]) * v[:, None]
    steps = np.roll(tall, -1, axis=1) - tall
    image = np.take(steps, left, axis=1)
    image *= u
    image += np.take(tall, left, axis=1)
    return image


@lru_cache(maxsize=64)
def _cells(size: int, cells: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return, for each pixel, the lattice points before and after it, and how far the pixel is between them (0..1).

    The caller uses these as indices, not in matrix products: multi-threaded algebra is slower here and differs between
    processors.
    """
    place = np.arange(size) * cells / size
    low = place.astype(int)
    part = place - low
    return low, (low + 1) % cells, part * part * (3 - 2 * part)


def _grain(rng: np.random.Generator, size: int = SIZE) -> np.ndarray:
    """Return wood grain along u with values in 0..1; 1 is the darkest."""
    bend = noise(rng, 2, 4, size) * 2.2 + noise(rng, 4, 12, size) * 0.5
    height = np.linspace(0, 1, size, endpoint=False)[:, None]
    rings = 0.5 + 0.5 * np.sin(2 * np.pi * (7 * height + bend))
    fibres = noise(rng, 4, min(128, size // 2), size)
    pores = np.clip((noise(rng, 16, min(128, size // 2), size) - 0.72) * 3, 0, 1)
    return np.clip(0.35 * rings**2 + 0.35 * fibres + 0.4 * pores, 0, 1)


def _tinted(dark: np.ndarray, strength: float = 1.0) -> np.ndarray:
    """Return a picture that is white where `dark` is 0 and warm brown where it is 1; it multiplies a wood's colour."""
    return 1 - strength * dark[..., None] * np.array([0.38, 0.47, 0.55])


def _planks(rng: np.random.Generator) -> np.ndarray:
    size, rows = 512, 8
    band = size // rows
    image = _tinted(_grain(rng, size), FLOOR_GRAIN)
    image = np.roll(image, rng.integers(size), axis=1)
    for row in range(rows):
        lines = slice(row * band, (row + 1) * band)
        strip = np.roll(image[lines], rng.integers(size), axis=1)
        seams = np.sort((rng.integers(size) + np.array([0, size * 0.45 + rng.integers(size // 10)])) % size).astype(int)
        inside = (np.arange(size) >= seams[0]) & (np.arange(size) < seams[1])
        shade = np.where(inside, *rng.uniform(0.78, 1.0, 2))
        strip = strip * shade[None, :, None]
        strip[0] *= 0.5
        strip[:, seams] *= 0.55
        image[lines] = strip
    return image


def _parquet(rng: np.random.Generator) -> np.ndarray:
    size, blocks, slats = 512, 4, 4
    block = size // blocks
    grain = _tinted(_grain(rng, size), FLOOR_GRAIN)
    image = np.empty((size, size, 3))
    for i in range(blocks):
        for j in range(blocks):
            top, left = (int(rng.integers(size - block)) for _ in range(2))
            tile = grain[top : top + block, left : left + block].copy()
            shades = np.repeat(rng.uniform(0.78, 1.0, slats), block // slats)
            tile *= shades[:, None, None]
            tile[:: block // slats] *= 0.55
            tile[:, 0] *= 0.55
            image[i * block : (i + 1) * block, j * block : (j + 1) * block] = (
                tile if (i + j) % 2 else tile.transpose(1, 0, 2)
            )
    return image


def _concrete(rng: np.random.Generator) -> np.ndarray:
    pits = np.clip(noise(rng, 64, 64) - 0.8, 0, 1)
    return 0.82 + 0.1 * noise(rng, 5, 5) + 0.08 * noise(rng, 24, 24) - 0.7 * pits


def _tile_grid(
    rng: np.random.Generator, across: int, down: int, joint: float, shift: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Return two values for each pixel: the shade of its tile (0..1), and 0 (in a joint) to 1 (inside the tile)."""
    place = np.arange(SIZE) / SIZE
    row = (place * down).astype(int)
    u = place[None, :] * across + shift * (row[:, None] % 2)
    column = np.floor(u).astype(int) % across
    shade = rng.random((down, across))[np.broadcast_to(row[:, None], column.shape), column]
    du = np.abs(u % 1 - 0.5) / across
    dv = np.abs((place * down) % 1 - 0.5)[:, None] / down
    edge = np.minimum(0.5 / across - du, 0.5 / down - dv)
    return shade, np.clip((edge - joint) / 0.006 + 0.5, 0, 1)


def _tiled(
    across: int, down: int, joint: float, rng: np.random.Generator, shift: float = 0.0, vary: float = 0.06
) -> np.ndarray:
    shade, inside = _tile_grid(rng, across, down, joint, shift)
    glaze = 0.03 * noise(rng, 12, 12)
    return (1 - vary * shade - glaze) * inside + 0.66 * (1 - inside)


def _checker(rng: np.random.Generator) -> np.ndarray:
    _, inside = _tile_grid(rng, 4, 4, 0.004)
    place = np.arange(SIZE) * 4 // SIZE
    odd = (place[:, None] + place[None, :]) % 2
    return (np.where(odd == 1, 0.22, 0.98) - 0.03 * noise(rng, 12, 12)) * inside + 0.5 * (1 - inside)


def _hexagons(rng: np.random.Generator) -> np.ndarray:
    across, down, pitch = 7, 8, 0.8660254
    place = (np.arange(SIZE) + 0.5) / SIZE
    u, v = np.meshgrid(place * across, place * down * pitch)
    below = np.floor(v / pitch - 0.5)
    gaps = []
    for row in (below, below + 1):
        du = (u - 0.5 * (row % 2) + 0.5) % 1 - 0.5
        dv = v - (row + 0.5) * pitch
        gaps += [np.hypot(du, dv), np.hypot(1 - np.abs(du), dv)]
    nearest, second = np.partition(np.stack(gaps), 1, axis=0)[:2]
    inside = np.clip((second - nearest - 0.07) / 0.06, 0, 1)
    return (0.97 - 0.03 * noise(rng, 10, 10)) * inside + 0.6 * (1 - inside)


def _brick(rng: np.random.Generator) -> np.ndarray:
    shade, inside = _tile_grid(rng, 4, 12, 0.007, 0.5)
    rough = noise(rng, 60, 60)
    clay = (0.72 + 0.28 * shade)[..., None] * (0.9 + 0.14 * rough)[..., None] * np.ones(3)
    mortar = (0.9 + 0.1 * rough)[..., None] * np.array([1.0, 1.0, 1.0])
    return clay * inside[..., None] * 0.92 + mortar * (1 - inside[..., None])


def _marble(rng: np.random.Generator) -> np.ndarray:
    flow = noise(rng, 3, 3) + 0.5 * noise(rng, 7, 7) + 0.25 * noise(rng, 15, 15)
    veins = np.exp(-(((flow * 5) % 1 - 0.5) ** 2) / 0.004)
    return 0.985 - 0.07 * veins * noise(rng, 4, 4) - 0.03 * noise(rng, 5, 5)


def _marble_tiles(rng: np.random.Generator) -> np.ndarray:
    _, inside = _tile_grid(rng, 3, 3, 0.003)
    return _marble(rng) * inside + 0.72 * (1 - inside)


def _granite(rng: np.random.Generator) -> np.ndarray:
    grains = rng.random((SIZE // 2, SIZE // 2)).repeat(2, 0).repeat(2, 1)
    specks = np.where(grains > 0.93, 0.45, np.where(grains < 0.08, 1.0, 0.84 + 0.08 * grains))
    return specks * (0.94 + 0.06 * noise(rng, 16, 16))


def _weave(rng: np.random.Generator) -> np.ndarray:
    wave = np.arange(SIZE) * 2 * np.pi * 32 / SIZE
    over = np.sin(wave[:, None]) * np.sin(wave[None, :])
    return 0.86 + 0.07 * over + 0.05 * rng.random((SIZE, SIZE)) + 0.05 * noise(rng, 8, 8)


def _knit(rng: np.random.Generator) -> np.ndarray:
    u, v = np.meshgrid(np.arange(SIZE) / SIZE * 16, np.arange(SIZE) / SIZE * 16)
    stitch = np.abs(np.sin(np.pi * (v + 0.5 * np.abs((u * 2) % 2 - 1))))
    return 0.72 + 0.24 * stitch * (0.8 + 0.2 * np.abs(np.sin(2 * np.pi * u))) + 0.04 * rng.random((SIZE, SIZE))


def _leather(rng: np.random.Generator) -> np.ndarray:
    folds = np.abs(noise(rng, 40, 40) - 0.5) + np.abs(noise(rng, 70, 70) - 0.5)
    return 0.82 + 0.2 * folds + 0.06 * (noise(rng, 5, 5) - 0.5)


def _wicker(rng: np.random.Generator) -> np.ndarray:
    u, v = np.meshgrid(np.arange(SIZE) * 16 / SIZE, np.arange(SIZE) * 16 / SIZE)
    flat = (np.floor(u) + np.floor(v)) % 2 == 0
    strand = np.where(flat, np.sin(np.pi * (v % 1)), np.sin(np.pi * (u % 1)))
    dip = np.where(flat, np.sin(np.pi * (u % 1)), np.sin(np.pi * (v % 1)))
    return _tinted(1 - (0.25 + 0.55 * np.sqrt(strand) * (0.55 + 0.45 * dip)) - 0.15 * rng.random((SIZE, SIZE)), 1.1)


def _cardboard(rng: np.random.Generator) -> np.ndarray:
    ribs = np.sin(np.arange(SIZE) * 2 * np.pi * 40 / SIZE)[None, :]
    return 0.93 + 0.015 * ribs + 0.06 * (noise(rng, 30, 60) - 0.5) + 0.05 * noise(rng, 4, 4)


def _speckle(rng: np.random.Generator) -> np.ndarray:
    spots = np.clip((noise(rng, 40, 40) - 0.78) * 4, 0, 1)
    return 0.9 + 0.1 * noise(rng, 6, 6) - 0.28 * spots


def _bumps(rng: np.random.Generator) -> np.ndarray:
    dots = np.sin(np.arange(SIZE) * 2 * np.pi * 32 / SIZE)
    return 0.85 + 0.15 * dots[:, None] * dots[None, :] + 0 * rng.random()


def _stripes(rng: np.random.Generator) -> np.ndarray:
    band = np.where((np.arange(SIZE) * 8 // SIZE) % 2 == 0, 1.0, 0.62)
    return np.broadcast_to(band[None, :], (SIZE, SIZE)) * (0.95 + 0.05 * rng.random((SIZE, SIZE)))


def _plaid(rng: np.random.Generator) -> np.ndarray:
    place = np.arange(SIZE) * 4 / SIZE % 1
    band = np.where(place < 0.35, 0.62, 1.0) * np.where(np.abs(place - 0.68) < 0.04, 0.7, 1.0)
    return band[:, None] * band[None, :] * (0.95 + 0.05 * rng.random((SIZE, SIZE)))


def _dots(rng: np.random.Generator) -> np.ndarray:
    u, v = np.meshgrid(np.arange(SIZE) * 6 / SIZE, np.arange(SIZE) * 6 / SIZE)
    gap = np.hypot((u + 0.5 * (np.floor(v) % 2)) % 1 - 0.5, v % 1 - 0.5)
    return np.where(gap < 0.24, 0.55, 1.0) * (0.95 + 0.05 * rng.random((SIZE, SIZE)))


def _grass(rng: np.random.Generator) -> np.ndarray:
    blades = noise(rng, 128, 64)
    return np.stack([0.38 + 0.22 * blades, 0.52 + 0.24 * blades, 0.29 + 0.16 * blades], -1) * (
        0.85 + 0.3 * noise(rng, 6, 6)[..., None]
    )


def _leaf(rng: np.random.Generator) -> np.ndarray:
    u, v = np.meshgrid(np.arange(SIZE) / SIZE, np.arange(SIZE) / SIZE)
    across = np.abs(u % 1 - 0.5)
    ribs = np.clip(1 - np.abs(((v + across * 1.2) * 9) % 1 - 0.5) * 9, 0, 1)
    middle = np.clip(1 - across * 30, 0, 1)
    return 0.82 + 0.12 * noise(rng, 8, 8) + 0.1 * ribs + 0.15 * middle


PATTERNS: dict[str, Callable[[np.random.Generator], np.ndarray]] = {
    "brick": _brick,
    "brushed": lambda rng: 0.86 + 0.1 * noise(rng, 3, 128) + 0.05 * noise(rng, 2, 6),
    "bumps": _bumps,
    "cardboard": _cardboard,
    "carpet": lambda rng: 0.72 + 0.2 * rng.random((SIZE, SIZE)) + 0.08 * noise(rng, 10, 10),
    "checker": _checker,
    "concrete": _concrete,
    "dots": _dots,
    "granite": _granite,
    "grass": _grass,
    "hexagons": _hexagons,
    "knit": _knit,
    "leaf": _leaf,
    "leather": _leather,
    "marble": _marble,
    "marble_tiles": _marble_tiles,
    "paint": lambda rng: 1 - 0.1 * _grain(rng),
    "paper": lambda rng: 0.96 + 0.04 * rng.random((SIZE, SIZE)),
    "parquet": _parquet,
    "plaid": _plaid,
    "planks": _planks,
    "plaster": lambda rng: 0.955 + 0.03 * noise(rng, 6, 6) + 0.03 * (noise(rng, 90, 90) - 0.5),
    "small_tiles": partial(_tiled, 8, 8, 0.006, vary=0.1),
    "speckle": _speckle,
    "streaks": lambda rng: 0.82 + 0.18 * noise(rng, 48, 2) * (0.7 + 0.3 * noise(rng, 6, 6)),
    "stripes": _stripes,
    "subway": partial(_tiled, 4, 8, 0.005, shift=0.5),
    "tiles": partial(_tiled, 2, 2, 0.003),
    "velvet": lambda rng: 0.8 + 0.16 * noise(rng, 7, 7) + 0.04 * rng.random((SIZE, SIZE)),
    "weave": _weave,
    "wicker": _wicker,
    "wood": lambda rng: _tinted(_grain(rng)),
}
