"""Frames as files: PNG (the default; small targets are a few pixels wide) or JPEG."""

import base64
import io
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from PIL import Image

from vigil.profile import JPEG_QUALITY, ImageFormat

PNG_LEVEL = 1
"""Faster by half than the usual level, for files a quarter larger; the pixels are the same."""


@dataclass(frozen=True)
class Picture:
    """An encoded frame."""

    data: bytes
    format: ImageFormat

    @property
    def media_type(self) -> str:
        """Its MIME type."""
        return f"image/{self.format}"

    @cached_property
    def base64(self) -> str:
        """The file in base64."""
        return base64.b64encode(self.data).decode("ascii")

    @property
    def data_uri(self) -> str:
        """The file as a `data:` address."""
        return f"data:{self.media_type};base64,{self.base64}"


def encode(rgb: np.ndarray, image_format: ImageFormat = "png") -> Picture:
    """Returns the frame (h, w, 3) uint8 as a file; the same pixels give the same bytes."""
    buffer = io.BytesIO()
    image = Image.fromarray(np.ascontiguousarray(rgb))
    if image_format == "png":
        image.save(buffer, "PNG", compress_level=PNG_LEVEL)
    else:
        image.save(buffer, "JPEG", quality=JPEG_QUALITY)
    return Picture(buffer.getvalue(), image_format)


def decode(data: bytes) -> np.ndarray:
    """Returns the pixels (h, w, 3) uint8 of a picture file."""
    return np.asarray(Image.open(io.BytesIO(data)).convert("RGB"))
