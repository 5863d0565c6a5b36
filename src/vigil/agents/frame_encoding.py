"""Frames as image files: PNG or JPEG.

PNG is the default, because it preserves targets that are only a few pixels wide.
"""

import base64
import io
import zlib
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from PIL import Image

from vigil.errors import RecordError
from vigil.protocol.observation import FRAME_HEIGHT, FRAME_WIDTH
from vigil.protocol.profile import JPEG_QUALITY, ImageFormat

MAX_FRAME_PIXELS = 4 * FRAME_WIDTH * FRAME_HEIGHT
"""Greatest number of pixels of an image file that `decode_frame` accepts."""
PNG_LEVEL = 1
"""Compression level of PNG files. This level takes half the time of the usual level; files are a quarter larger."""


@dataclass(frozen=True)
class EncodedFrame:
    """The bytes of an image file with a frame, and the file's format."""

    data: bytes
    format: ImageFormat

    @property
    def media_type(self) -> str:
        """MIME type of the frame's image file."""
        return f"image/{self.format}"

    @cached_property
    def base64(self) -> str:
        """The image file as a text in base64."""
        return base64.b64encode(self.data).decode("ascii")

    @property
    def data_uri(self) -> str:
        """The image file as a `data:` URI."""
        return f"data:{self.media_type};base64,{self.base64}"


def encode_frame(rgb: np.ndarray, image_format: ImageFormat = "png") -> EncodedFrame:
    """Return the frame (h, w, 3) uint8 as a file; the same pixels give the same bytes."""
    buffer = io.BytesIO()
    image = Image.fromarray(np.ascontiguousarray(rgb))
    if image_format == "png":
        image.save(buffer, "PNG", compress_level=PNG_LEVEL)
    else:
        image.save(buffer, "JPEG", quality=JPEG_QUALITY)
    return EncodedFrame(buffer.getvalue(), image_format)


def decode_frame(data: bytes) -> np.ndarray:
    """Return the pixels (h, w, 3) uint8 of a file that `encode_frame` made. Raises RecordError for any other file."""
    try:
        image = Image.open(io.BytesIO(data), formats=("PNG", "JPEG"))
        if image.width * image.height > MAX_FRAME_PIXELS:
            raise RecordError(
                f"The image has {image.width} x {image.height} pixels; a frame has at most {MAX_FRAME_PIXELS:,} in all."
            )
        return np.asarray(image.convert("RGB"))
    except (OSError, SyntaxError, ValueError, zlib.error) as error:
        raise RecordError(f"The file is not an image of a frame: {error}.") from None
