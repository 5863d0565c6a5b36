"""The textures of all scenes of this process, stored as layers of one array texture."""

from typing import Any

import numpy as np
from PIL import Image

from vigil.rendering.context import moderngl

SIDE = 256
GROWTH = 16
"""Number of layers by which the OpenGL texture grows."""


class TextureArray:
    """Layers of `SIDE` x `SIDE` pixels. The first layer is white, for materials without a texture."""

    def __init__(self) -> None:
        self._layers: dict[int, int] = {}
        self._pictures: list[np.ndarray] = [np.full((SIDE, SIDE, 3), 255, np.uint8)]
        self._texture: Any = None
        self._count = 0

    def layer_of(self, picture: np.ndarray | None) -> int:
        """Return the layer of a picture (h, w, 3) uint8. A new picture gets a new layer, which is never freed."""
        if picture is None:
            return 0
        if id(picture) not in self._layers:
            self._layers[id(picture)] = len(self._pictures)
            self._pictures.append(picture)
        return self._layers[id(picture)]

    @property
    def is_complete(self) -> bool:
        """Whether all layers that were added have been passed to OpenGL."""
        return self._count == len(self._pictures)

    def texture(self, context: Any) -> Any:
        """Return the OpenGL texture with all layers that were added."""
        if self.is_complete:
            return self._texture
        if self._texture is None or len(self._pictures) > self._texture.layers:
            if self._texture is not None:
                self._texture.release()
            layers = -(-len(self._pictures) // GROWTH) * GROWTH
            self._texture, self._count = context.texture_array((SIDE, SIDE, layers), 4), 0
            self._texture.filter = moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR
        for layer in range(self._count, len(self._pictures)):
            self._texture.write(_fitted(self._pictures[layer]).tobytes(), (0, 0, layer, SIDE, SIDE, 1))
        self._texture.build_mipmaps()
        self._count = len(self._pictures)
        return self._texture


def _fitted(picture: np.ndarray) -> np.ndarray:
    """Return the picture scaled to (`SIDE`, `SIDE`, 4), with its first row at the bottom, where v is 0.

    It has four channels, because software renderers read three channels much more slowly.
    """
    if picture.shape[:2] != (SIDE, SIDE):
        picture = np.asarray(Image.fromarray(picture).resize((SIDE, SIDE), Image.Resampling.BOX))
    fitted = np.full((SIDE, SIDE, 4), 255, np.uint8)
    for channel in range(3):
        fitted[..., channel] = picture[::-1, :, channel]
    return fitted
