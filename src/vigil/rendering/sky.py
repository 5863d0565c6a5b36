"""The view through the windows: a lawn, a line of trees and a sky with a few clouds, the same for every house."""

from functools import lru_cache

import numpy as np

SKY_PIXELS = 256
LAWN_DEG, HILLS_DEG, EDGE_DEG = -0.9, 5.15, 0.35
"""Angles (deg): heights above the horizon of the lawn's far end and of the highest hill; width of blended edges."""
_ZENITH, _HORIZON = np.array([0.42, 0.62, 0.86], np.float32), np.array([0.84, 0.90, 0.95], np.float32)
_TREES, _NEAR_TREES = np.array([0.40, 0.50, 0.42], np.float32), np.array([0.30, 0.40, 0.26], np.float32)
_GRASS = np.array([0.42, 0.53, 0.32], np.float32)
_CLOUD = np.array([1.0, 1.0, 1.0], np.float32)
_FACES = np.array(
    [
        # (right, down, outward) of the six faces, in the frame of OpenGL's cube maps
        [(0, 0, -1), (0, -1, 0), (1, 0, 0)],
        [(0, 0, 1), (0, -1, 0), (-1, 0, 0)],
        [(1, 0, 0), (0, 0, 1), (0, 1, 0)],
        [(1, 0, 0), (0, 0, -1), (0, -1, 0)],
        [(1, 0, 0), (0, -1, 0), (0, 0, 1)],
        [(-1, 0, 0), (0, -1, 0), (0, 0, -1)],
    ],
    dtype=np.float32,
)


@lru_cache(maxsize=1)
def sky() -> bytes:
    """Return the six faces of the sky's cube map in turn: `SKY_PIXELS` wide and high, 3 bytes for each pixel."""
    place = ((np.arange(SKY_PIXELS) + 0.5) / SKY_PIXELS * 2.0 - 1.0).astype(np.float32)
    faces = []
    for right, down, outward in _FACES:
        rays = outward + place[None, :, None] * right + place[:, None, None] * down
        rays /= np.linalg.norm(rays, axis=2, keepdims=True)
        # The cube is rotated about x: its (x, y, z) are the world's (x, z, -y).
        faces.append(_paint(rays[..., 0], -rays[..., 2], rays[..., 1]))
    return (np.clip(np.concatenate(faces), 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8).tobytes()


def _paint(x: np.ndarray, y: np.ndarray, up: np.ndarray) -> np.ndarray:
    """Return the colours (..., 3) of the view in unit directions (x, y, up)."""
    colours = np.broadcast_to(_GRASS, (*up.shape, 3)).copy()
    height = np.degrees(np.arcsin(up))
    above = height > LAWN_DEG - EDGE_DEG
    colours[above] = _paint_above(x[above], y[above], up[above], height[above])
    return colours


def _paint_above(x: np.ndarray, y: np.ndarray, up: np.ndarray, height: np.ndarray) -> np.ndarray:
    """Return the colours (n, 3) of the sky and of the landscape in front of it, above the edge of the lawn."""
    colour = _blend(_HORIZON, _ZENITH, np.clip(height / 55.0, 0.0, 1.0) ** 0.7)
    colour = _blend(colour, _CLOUD, _clouds(x, y, up))
    low = np.flatnonzero(height < HILLS_DEG + EDGE_DEG)
    colour[low] = _before_sky(colour[low], np.arctan2(y[low], x[low]), height[low])
    return colour


def _before_sky(colour: np.ndarray, azimuth: np.ndarray, height: np.ndarray) -> np.ndarray:
    """Return the colours (n, 3) of the sky with hills, trees and the lawn drawn in front."""
    hills = 3.2 + 1.1 * np.sin(3 * azimuth + 0.4) + 0.6 * np.sin(7 * azimuth + 2.0) + 0.25 * np.sin(23 * azimuth)
    trees = 1.5 + 0.5 * np.sin(5 * azimuth + 1.0) + 0.35 * np.sin(17 * azimuth) + 0.25 * np.sin(41 * azimuth + 0.7)
    colour = _blend(colour, _blend(_TREES, _HORIZON, np.array(0.45, np.float32)), _edge(hills - height))
    colour = _blend(colour, _NEAR_TREES, _edge(trees - height))
    return _blend(colour, _GRASS, _edge(LAWN_DEG - height))


def _clouds(x: np.ndarray, y: np.ndarray, up: np.ndarray) -> np.ndarray:
    """Return the opacity of the clouds in unit directions, from 0 to 0.75."""
    depth = np.maximum(up, 0.05)
    u, v = x / depth, y / depth
    waves = sum(
        np.sin(a * u + b * v + c + np.sin(d * v - a * u)) / n
        for n, (a, b, c, d) in enumerate([(0.9, 0.4, 0.3, 0.7), (-0.7, 1.5, 2.1, 1.3), (2.3, 1.1, 4.0, 2.9)], start=1)
    )
    return 0.75 * np.clip(waves - 0.35, 0.0, 1.0) * np.clip((up - 0.06) / 0.2, 0.0, 1.0)


def _blend(first: np.ndarray, second: np.ndarray, share: np.ndarray) -> np.ndarray:
    return first + (second - first) * share[..., None]


def _edge(degrees: np.ndarray) -> np.ndarray:
    return np.clip(degrees / EDGE_DEG + 0.5, 0.0, 1.0)
