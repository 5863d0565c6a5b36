"""Placeholder for a category without a maker: a box with round edges and a label."""

import colorsys

import numpy as np

from vigil.assets.kernel import shapes
from vigil.assets.kernel.asset import Asset
from vigil.assets.kernel.builder import Builder
from vigil.base.geometry import Vec3


def labelled_box(category: str, size: Vec3, rng: np.random.Generator) -> Asset:
    """Return a box with round edges, a quiet colour and a label on its front."""
    builder = Builder(category, size)
    least = min(size)
    red, green, blue = (round(255 * part) for part in colorsys.hls_to_rgb(rng.random(), 0.6, 0.35))
    radius = 0.12 * least
    builder.add(f"plastic/#{red:02x}{green:02x}{blue:02x}", shapes.rounded_box(size, (0, size.y / 2, 0), radius))
    label = shapes.panel(0.5 * size.x, 0.4 * size.y, (0, 0.55 * size.y, size.z / 2 - 1e-4 * size.z))
    builder.add("print/label", shapes.translate(label, (0, 0, 2e-4 * size.z)))
    builder.surface("top", (0, size.y, 0), (size.x - 2 * radius, size.z - 2 * radius))
    return builder.build()
