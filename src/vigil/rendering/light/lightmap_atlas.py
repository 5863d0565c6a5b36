"""The lightmap atlas: one picture that stores the light on all planes of walls, floors and ceilings, side by side."""

from dataclasses import dataclass

import numpy as np

TEXEL_M = 0.12
BORDER = 2
WIDTH = 512
_BLUR = np.array([1, 4, 6, 4, 1], np.float32) / 16
INSET_M = 0.02
"""The light at the edge of a plane is computed this far (m) inside the edge, away from the neighbouring plane."""


@dataclass(frozen=True, slots=True, eq=False)
class LightmapAtlas:
    """Where each plane is in the atlas."""

    places: np.ndarray
    """Position (n, 2) of each vertex in the picture, in 0..1."""
    points: np.ndarray
    """Point (height, width, 3) of each texel in metres."""
    normals: np.ndarray
    """Unit normal (height, width, 3) of each texel; 0 outside the planes."""
    is_used: np.ndarray
    """Whether (height, width) each texel belongs to a plane."""
    boxes: list[tuple[int, int, int, int]]
    """Place of each plane, including its border: (row, column, height, width)."""
    owners: list[int]
    """Number of the geom to which each plane belongs."""


def pack_atlas(vertices: np.ndarray, normals: np.ndarray, owners: np.ndarray) -> LightmapAtlas:
    """Return an atlas of the planes on which vertices (n, 3) lie; each plane belongs to one of the `owners` (n,)."""
    heights = (vertices * normals).sum(axis=1, keepdims=True)
    keys = np.concatenate([np.round(normals * 50), np.round(heights * 100), owners[:, None]], axis=1)
    _, first, plane = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    plane = plane.reshape(-1)
    frames = [_axes(normals[one]) for one in first]
    flat = np.empty((len(vertices), 2))
    boxes, spans = [], []
    for number, axes in enumerate(frames):
        chosen = plane == number
        flat[chosen] = vertices[chosen] @ axes.T
        low, high = flat[chosen].min(axis=0), flat[chosen].max(axis=0)
        spans.append((low, high))
        boxes.append(np.maximum(np.ceil((high - low) / TEXEL_M).astype(int), 1) + 2 * BORDER)
    corners, height = _packed(boxes)
    points = np.zeros((height, WIDTH, 3), np.float32)
    facing = np.zeros((height, WIDTH, 3), np.float32)
    places = np.empty((len(vertices), 2))
    out = []
    for number, (axes, (low, high), (wide, tall), (left, top)) in enumerate(
        zip(frames, spans, boxes, corners, strict=True)
    ):
        chosen, normal = plane == number, normals[first[number]]
        scale = np.maximum(high - low, 1e-6) / (np.array([wide, tall]) - 2 * BORDER)
        u = _inside(low[0] + (np.arange(wide) - BORDER + 0.5) * scale[0], low[0], high[0])
        v = _inside(low[1] + (np.arange(tall) - BORDER + 0.5) * scale[1], low[1], high[1])
        base = normal * float(vertices[first[number]] @ normal)
        points[top : top + tall, left : left + wide] = base + u[None, :, None] * axes[0] + v[:, None, None] * axes[1]
        facing[top : top + tall, left : left + wide] = normal
        places[chosen] = (np.array([left, top]) + BORDER + (flat[chosen] - low) / scale) / (WIDTH, height)
        out.append((top, left, int(tall), int(wide)))
    return LightmapAtlas(places, points, facing, np.any(facing, axis=2), out, owners[first].tolist())


def _inside(places: np.ndarray, low: float, high: float) -> np.ndarray:
    inset = min(INSET_M, (high - low) / 4)
    return np.clip(places, low + inset, high - inset)


def _axes(normal: np.ndarray) -> np.ndarray:
    """Return two unit vectors (2, 3) along a plane with this normal."""
    up = np.array([0.0, 0.0, 1.0]) if abs(normal[2]) < 0.7 else np.array([0.0, 1.0, 0.0])
    across = np.cross(up, normal)
    across /= np.linalg.norm(across)
    return np.stack([across, np.cross(normal, across)])


def _packed(boxes: list[np.ndarray]) -> tuple[list[tuple[int, int]], int]:
    """Return the upper left corner of each box, and the total height. Boxes are put into rows, the highest first."""
    corners: list[tuple[int, int]] = [(0, 0)] * len(boxes)
    left = top = row = 0
    for number in sorted(range(len(boxes)), key=lambda one: (-boxes[one][1], one)):
        wide, tall = (int(side) for side in boxes[number])
        if left + wide > WIDTH:
            left, top, row = 0, top + row, 0
        corners[number] = (left, top)
        left, row = left + wide, max(row, tall)
    return corners, max(top + row, 1)


def averaged_texels(light: np.ndarray, is_known: np.ndarray) -> np.ndarray:
    """Return a plane's light (height, width, k), averaged over neighbouring texels in the mask `is_known`."""
    sums = _blurred(np.where(is_known[..., None], light, 0.0))
    known = _blurred(is_known[..., None].astype(np.float32))
    return np.where(known > 0.0, sums / np.maximum(known, 1e-6), light)


def _blurred(values: np.ndarray) -> np.ndarray:
    tall, wide = values.shape[:2]
    padded = np.pad(values, ((2, 2), (2, 2), (0, 0)), mode="edge")
    rows = np.tensordot(_BLUR, [padded[row : row + tall] for row in range(len(_BLUR))], 1)
    return np.tensordot(_BLUR, [rows[:, column : column + wide] for column in range(len(_BLUR))], 1)
