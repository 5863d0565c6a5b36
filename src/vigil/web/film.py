"""Films: an episode as an animated GIF or as MP4, each frame with its click marked and the action below.

MP4 needs PyAV, the extra `video`; it is H.264 in yuv420p, which every browser plays. The same frames give the same
bytes with the same version of PyAV: one thread, no date, no clock.
"""

import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import matplotlib
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from vigil.errors import SettingError
from vigil.observation import FRAME_HEIGHT, FRAME_WIDTH

STEP_S = 1.1
LAST_S = 3.0
STRIP_PX = 88
GIF_WIDTH = 480
VIDEO_FPS = 10
VIDEO_CRF = "20"
"""x264's constant quality: the grain of textures stays, a step takes about 40 kB."""
BT709 = 1
"""FFmpeg's number for that colour space, primaries and transfer; said in the file, so that players agree on colours."""
_PAPER, _INK, _SOFT, _MARK = (24, 28, 32), (240, 242, 244), (170, 178, 186), (214, 21, 95)
_MARGIN_PX = 16
_FONT = Path(matplotlib.get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"


@dataclass(frozen=True, slots=True)
class FilmFrame:
    """A frame (PNG) and what is said about it."""

    frame: bytes
    instruction: str
    action: str
    click: list[int] | None


def film_frames_of(timeline: dict[str, Any], frames: Sequence[bytes | None]) -> list[FilmFrame]:
    """Returns what can be shown of a timeline. Raises SettingError when that is nothing."""
    count = len(timeline["steps"])
    shots = [
        FilmFrame(frame, timeline["instruction"], f"{step['index']}/{count}  {step['action']}", step["click"])
        for frame, step in zip(frames, timeline["steps"], strict=True)
        if frame is not None
    ]
    if not shots:
        raise SettingError(f"Episode {timeline['episode']!r} has no frame that could be shown in a film.")
    return shots


def gif(shots: Sequence[FilmFrame]) -> bytes:
    """Returns an animated GIF that repeats for ever."""
    height = GIF_WIDTH * (FRAME_HEIGHT + STRIP_PX) // FRAME_WIDTH
    slides = [_slide(shot).resize((GIF_WIDTH, height), Image.Resampling.LANCZOS) for shot in shots]
    slides = [slide.quantize(method=Image.Quantize.FASTOCTREE) for slide in slides]
    buffer = io.BytesIO()
    durations = [int(1000 * STEP_S)] * (len(slides) - 1) + [int(1000 * LAST_S)]
    slides[0].save(buffer, "GIF", save_all=True, append_images=slides[1:], duration=durations, loop=0)
    return buffer.getvalue()


def mp4(shots: Sequence[FilmFrame]) -> bytes:
    """Returns a film in MP4. Raises SettingError without PyAV."""
    try:
        import av  # noqa: PLC0415 - an optional library
    except ImportError:
        raise SettingError(
            "MP4 is written with PyAV, which is not installed. Install it: pip install 'vigil-bench[video]' (or "
            "pip install av). GIF and page need nothing more."
        ) from None
    with TemporaryDirectory() as folder:  # FFmpeg moves the index to the front by reading its own file again
        path = Path(folder) / "film.mp4"
        with av.open(path, "w", options={"movflags": "+faststart", "fflags": "+bitexact"}) as film:
            stream = film.add_stream("libx264", rate=VIDEO_FPS, options={"crf": VIDEO_CRF, "threads": "1"})
            stream.width, stream.height, stream.pix_fmt = FRAME_WIDTH, FRAME_HEIGHT + STRIP_PX, "yuv420p"
            context = stream.codec_context
            context.colorspace = context.color_primaries = context.color_trc = BT709
            for number, pixels in enumerate(_ticks(shots)):
                picture = av.VideoFrame.from_ndarray(pixels, format="rgb24")
                picture = picture.reformat(format="yuv420p", dst_colorspace=BT709)
                picture.pts, picture.time_base = number, Fraction(1, VIDEO_FPS)
                film.mux(stream.encode(picture))
            film.mux(stream.encode())
        return path.read_bytes()


def _ticks(shots: Sequence[FilmFrame]) -> Iterator[np.ndarray]:
    """Yields each frame of a video."""
    for index, shot in enumerate(shots):
        seconds = LAST_S if index == len(shots) - 1 else STEP_S
        yield from [np.asarray(_slide(shot))] * round(seconds * VIDEO_FPS)


def _slide(shot: FilmFrame) -> Image.Image:
    """Returns a frame with its click, and the strip below."""
    slide = Image.new("RGB", (FRAME_WIDTH, FRAME_HEIGHT + STRIP_PX), _PAPER)
    slide.paste(Image.open(io.BytesIO(shot.frame)).convert("RGB"), (0, 0))
    draw = ImageDraw.Draw(slide)
    if shot.click is not None:
        x, y = shot.click
        for radius, colour, width in ((15, (255, 255, 255), 5), (14, _MARK, 3)):
            draw.ellipse((x - radius, y - radius, x + radius, y + radius), outline=colour, width=width)
    for size, top, colour, text in ((20, 12, _INK, shot.action), (16, 50, _SOFT, shot.instruction)):
        font = _font(size)
        draw.text((_MARGIN_PX, FRAME_HEIGHT + top), _fitting(text, font), fill=colour, font=font)
    return slide


@lru_cache(maxsize=4)
def _font(size: int) -> ImageFont.FreeTypeFont:
    return ImageFont.truetype(_FONT, size)


def _fitting(text: str, font: ImageFont.FreeTypeFont) -> str:
    """Returns a line that fits into the strip: no line breaks, nothing that cannot be printed, cut with an ellipsis."""
    line = "".join(each if each.isprintable() else " " for each in text[:400])
    if font.getlength(line) <= FRAME_WIDTH - 2 * _MARGIN_PX:
        return line
    while line and font.getlength(line + "…") > FRAME_WIDTH - 2 * _MARGIN_PX:
        line = line[:-1]
    return line.rstrip() + "…"
