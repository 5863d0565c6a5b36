"""Materials of a scene: each look once per model, each picture once per process."""

from functools import lru_cache

import numpy as np
from PIL import Image

from vigil.assets.kernel.materials import Material, material
from vigil.sim.engines.mujoco.binding import NativeSpec, mujoco

Tint = tuple[float, float, float] | None
TEXTURE_PIXELS = 512
"""Longer sides are halved until they are no longer than this."""

EMISSION = 0.5
"""What shines is lit by the room as well; all of its own light on top would bleach it."""
_WHITE = np.full((4, 4, 3), 255, dtype=np.uint8)
"""For materials without a texture: Mesa loses the matrix of the shadow map's texture unit
(`vigil.sim.engines.mujoco.tuning`) for geoms without one."""


class MaterialTable:
    """The materials that a model under construction has so far."""

    def __init__(self, spec: NativeSpec) -> None:
        self._spec = spec
        self._names: dict[tuple[str, Tint], str] = {}
        self._textures: dict[int, str] = {}

    def name_of(self, key: str, tint: Tint = None) -> str:
        """Returns the model's name of a material, adding it when it is new."""
        if (key, tint) not in self._names:
            self._names[key, tint] = self._add(material(key, tint))
        return self._names[key, tint]

    @staticmethod
    def metres(key: str, tint: Tint = None) -> float:
        """Returns how many metres of surface one repeat of the material's texture covers."""
        return material(key, tint).metres

    def _add(self, look: Material) -> str:
        name = f"material{len(self._names)}"
        added = self._spec.add_material(
            name=name,
            rgba=list(look.rgba),
            specular=look.specular,
            shininess=look.shininess,
            emission=look.emission * EMISSION,
            reflectance=0.0,
        )
        added.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = self._texture(
            _WHITE if look.texture is None else look.texture
        )
        return name

    def _texture(self, picture: np.ndarray) -> str:
        if id(picture) not in self._textures:
            name = f"texture{len(self._textures)}"
            height, width, data = _upload_form(_Picture(picture))
            texture = self._spec.add_texture(
                name=name, type=mujoco.mjtTexture.mjTEXTURE_2D, width=width, height=height, nchannel=3
            )
            texture.data = data
            self._textures[id(picture)] = name
        return self._textures[id(picture)]


class _Picture:
    """A picture that hashes by identity and keeps it alive, so that its identity stays its own."""

    def __init__(self, pixels: np.ndarray) -> None:
        self.pixels = pixels

    def __hash__(self) -> int:
        return id(self.pixels)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Picture) and other.pixels is self.pixels


@lru_cache(maxsize=512)
def _upload_form(picture: _Picture) -> tuple[int, int, bytes]:
    """Returns (height, width, bytes) with the first row at the bottom, as v = 0 asks for.

    Sides are powers of two: Mesa compiles its mipmaps and shaders anew for each other kind of size, 0.1 s each.
    """
    pixels = picture.pixels
    while max(pixels.shape[:2]) > TEXTURE_PIXELS:
        height, width = pixels.shape[0] // 2, pixels.shape[1] // 2
        quads = pixels[: height * 2, : width * 2].reshape(height, 2, width, 2, 3)
        pixels = quads.mean(axis=(1, 3)).round().astype(np.uint8)
    height, width = (1 << (side - 1).bit_length() for side in pixels.shape[:2])
    if (height, width) != pixels.shape[:2]:
        pixels = np.asarray(Image.fromarray(pixels).resize((width, height), Image.Resampling.BILINEAR))
    return pixels.shape[0], pixels.shape[1], np.ascontiguousarray(pixels[::-1]).tobytes()
