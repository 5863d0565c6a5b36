"""The textures of all scenes of this process, stored as layers of one array texture."""

from typing import Any

import numpy as np
from PIL import Image

from vigil.rendering.context import moderngl

SIDE = 256


class TextureArray:
    """Layers of `SIDE` x `SIDE` pixels. The first layer is white, for materials without a texture."""

    def __init__(self) -> None:
        self._layers: dict[int, int] = {}
        self._pictures: list[np.ndarray] = []
        self._bytes = [np.full((SIDE, SIDE, 4), 255, np.uint8).tobytes()]
        self._texture: Any = None
        self._count = 0

    def layer_of(self, picture: np.ndarray | None) -> int:
        """Return the layer of a picture (h, w, 3) uint8. A new picture gets a new layer, which is never freed."""
        if picture is None:
            return 0
        if id(picture) not in self._layers:
            self._layers[id(picture)] = len(self._bytes)
            self._pictures.append(picture)
            self._bytes.append(_fitted(picture).tobytes())
        return self._layers[id(picture)]

    @property
    def is_complete(self) -> bool:
        """Whether all layers that were added have been passed to OpenGL."""
        return self._count == len(self._bytes)

    def texture(self, context: Any) -> Any:
        """Return the OpenGL texture with all layers that were added."""
        if not self.is_complete:
            if self._texture is not None:
                self._texture.release()
            count = len(self._bytes)
            self._texture = context.texture_array((SIDE, SIDE, count), 4, b"".join(self._bytes))
            self._texture.build_mipmaps()
            self._texture.filter = moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR
            self._count = count
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
