"""Films: an episode as an animated GIF or WebP or as MP4, for people who judge the episode.

Each slide shows the agent's frame with a mark at its click, the hidden floor plan next to the frame, and the thought
and action below; the last slide shows the verdict. MP4 needs PyAV (the extra `video`); it is H.264 in yuv420p, which
every browser plays. With one version of PyAV, the same frames give the same bytes, because the encoder uses one thread
and the file has no date.
"""

import io
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import chain
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from vigil.errors import SettingError
from vigil.protocol.observation import FRAME_HEIGHT, FRAME_WIDTH
from vigil.scene.plan_image import Colour
from vigil.web.films.plan import PANEL_PX, FilmPlan, font_of

STEP_S = 1.8
LAST_S = 4.0
STRIP_PX = 136
FILM_SIZE = (FRAME_WIDTH + PANEL_PX, FRAME_HEIGHT + STRIP_PX)
GIF_SHARE = 0.75
"""Scale of a GIF relative to an MP4, in width and height, so that it is about as wide as a page of text."""
WEBP_QUALITY = 82
VIDEO_FPS = 10
VIDEO_CRF = "20"
"""x264's constant rate factor. At this quality, the grain of textures is still visible."""
BT709 = 1
"""FFmpeg's number for the colour space, primaries and transfer of BT.709. It is in the file, so that all players show
the same colours."""
THOUGHT_LINES = 2
_PAPER, _INK, _SOFT, _MARK = (24, 28, 32), (240, 242, 244), (170, 178, 186), (214, 21, 95)
_ACTION, _YES, _NO = (124, 196, 240), (70, 181, 134), (236, 123, 113)
_LABELS: dict[str, Colour] = {
    "B": _YES,
    "FR": _NO,
    "NR": (215, 169, 63),
    "IL": (182, 151, 234),
    "Other": (151, 162, 172),
}
_MARGIN_PX = 16


@dataclass(frozen=True, slots=True)
class FilmFrame:
    """The agent's frame (PNG) at a step, and its captions."""

    frame: bytes
    instruction: str
    action: str
    click: list[int] | None
    thought: str = ""
    plan: Image.Image | None = None
    """Picture of the floor plan, made by `FilmPlan.panel`; None if the house cannot be drawn."""
    verdict: dict[str, Any] | None = None
    """The verdict in the timeline; None on all slides but the last."""


def film_frames_of(
    timeline: dict[str, Any], frames: Sequence[bytes | None], plan: FilmPlan | None = None
) -> list[FilmFrame]:
    """Return a slide for each step with a frame, then a slide with the verdict. Raises SettingError without frames."""
    shots = [
        _shot(timeline, step, frame, plan)
        for frame, step in zip(frames, timeline["steps"], strict=True)
        if frame is not None
    ]
    if not shots:
        raise SettingError(f"Episode {timeline['episode']!r} has no frame that could be shown in a film.")
    verdict = timeline["hidden"]["verdict"]
    return shots if verdict is None else [*shots, replace(shots[-1], click=None, verdict=verdict)]


def _shot(timeline: dict[str, Any], step: dict[str, Any], frame: bytes, plan: FilmPlan | None) -> FilmFrame:
    index, rows = step["index"], timeline["hidden"]["rows"]
    holds = rows[index - 1]["W"] if index <= len(rows) else None
    return FilmFrame(
        frame,
        timeline["instruction"],
        f"{index}/{len(timeline['steps'])}  {step['action']}",
        step["click"],
        step["thought"] or step["summary"] or "",
        None if plan is None else plan.panel(timeline["hidden"]["worlds"][:index], holds),
    )


def gif(shots: Sequence[FilmFrame]) -> bytes:
    """Return an animated GIF that repeats forever."""
    slides = [slide.quantize(method=Image.Quantize.FASTOCTREE) for slide in _small_slides(shots)]
    return _animated(slides, "GIF")


def webp(shots: Sequence[FilmFrame]) -> bytes:
    """Return an animated WebP that repeats forever. Its frames have the GIF's width and height, in full colour."""
    return _animated(_small_slides(shots), "WEBP", quality=WEBP_QUALITY, method=6)


def mp4(shots: Sequence[FilmFrame]) -> bytes:
    """Return an MP4 film. Raises SettingError if PyAV is not installed."""
    try:
        import av  # noqa: PLC0415 - an optional library
    except ImportError:
        raise SettingError(
            "MP4 is written with PyAV, which is not installed. Install it: pip install 'vigil-bench[video]' (or "
            "pip install av). A GIF or page does not need it."
        ) from None
    with TemporaryDirectory() as folder:  # FFmpeg reads its own file again to move the index to the front
        path = Path(folder) / "film.mp4"
        with av.open(path, "w", options={"movflags": "+faststart", "fflags": "+bitexact"}) as film:
            stream = film.add_stream("libx264", rate=VIDEO_FPS, options={"crf": VIDEO_CRF, "threads": "1"})
            (stream.width, stream.height), stream.pix_fmt = FILM_SIZE, "yuv420p"
            context = stream.codec_context
            context.colorspace = context.color_primaries = context.color_trc = BT709
            seconds = [*[STEP_S] * (len(shots) - 1), LAST_S]
            slides = (
                [np.asarray(_slide(shot))] * round(each * VIDEO_FPS) for shot, each in zip(shots, seconds, strict=True)
            )
            for number, pixels in enumerate(chain.from_iterable(slides)):
                picture = av.VideoFrame.from_ndarray(pixels, format="rgb24")
                picture = picture.reformat(format="yuv420p", dst_colorspace=BT709)
                picture.pts, picture.time_base = number, Fraction(1, VIDEO_FPS)
                film.mux(stream.encode(picture))
            film.mux(stream.encode())
        return path.read_bytes()


def _small_slides(shots: Sequence[FilmFrame]) -> list[Image.Image]:
    size = (round(GIF_SHARE * FILM_SIZE[0]), round(GIF_SHARE * FILM_SIZE[1]))
    return [_slide(shot).resize(size, Image.Resampling.LANCZOS) for shot in shots]


def _animated(slides: Sequence[Image.Image], kind: str, **options: Any) -> bytes:
    buffer = io.BytesIO()
    durations = [int(1000 * STEP_S)] * (len(slides) - 1) + [int(1000 * LAST_S)]
    slides[0].save(buffer, kind, save_all=True, append_images=slides[1:], duration=durations, loop=0, **options)
    return buffer.getvalue()


def _slide(shot: FilmFrame) -> Image.Image:
    """Return a slide: the frame with its click, the plan next to it, and the strip of captions below."""
    slide = Image.new("RGB", FILM_SIZE, _PAPER)
    slide.paste(Image.open(io.BytesIO(shot.frame)).convert("RGB"), (0, 0))
    draw = ImageDraw.Draw(slide, "RGBA")
    if shot.click is not None:
        x, y = shot.click
        for radius, colour, width in ((15, (255, 255, 255), 5), (14, _MARK, 3)):
            draw.ellipse((x - radius, y - radius, x + radius, y + radius), outline=colour, width=width)
    if shot.verdict is not None:
        _draw_verdict(draw, shot.verdict)
    if shot.plan is not None:
        slide.paste(shot.plan, (FRAME_WIDTH, 0))
    _draw_strip(draw, shot)
    return slide


def _draw_strip(draw: ImageDraw.ImageDraw, shot: FilmFrame) -> None:
    width, left, top = FILM_SIZE[0] - 2 * _MARGIN_PX, _MARGIN_PX, FRAME_HEIGHT
    draw.text((left, top + 10), _cut_to_width(shot.instruction, font_of(17), width), fill=_SOFT, font=font_of(17))
    for number, line in enumerate(_wrapped(shot.thought, font_of(20), width)[:THOUGHT_LINES]):
        draw.text((left, top + 40 + 27 * number), line, fill=_INK, font=font_of(20))
    bold = font_of(18, is_bold=True)
    draw.text((left, top + 102), _cut_to_width(shot.action, bold, width), fill=_ACTION, font=bold)


def _draw_verdict(draw: ImageDraw.ImageDraw, verdict: dict[str, Any]) -> None:
    """Darken the frame and write the verdict over it."""
    draw.rectangle((0, 0, FRAME_WIDTH - 1, FRAME_HEIGHT - 1), fill=(*_PAPER, 214))
    large = font_of(64, is_bold=True)
    for name, x in (("W", 40), ("B", 250)) if verdict["label"] else (("W", 40),):
        draw.text((x, 60), f"{name} {int(verdict[name])}", fill=_YES if verdict[name] else _NO, font=large)
    colour, top = _LABELS.get(verdict["label"], _INK), 172
    for sentence in (verdict["why"][-1], *verdict["why"][:-1]):
        for line in _wrapped(sentence, font_of(20), FRAME_WIDTH - 80):
            draw.text((40, top), line, fill=colour, font=font_of(20))
            top += 29
        colour, top = _INK, top + 14


def _cut_to_width(text: str, font: ImageFont.FreeTypeFont, width: int) -> str:
    """Return a text as one line of at most `width` pixels, without unprintable characters, cut with an ellipsis."""
    line = "".join(each if each.isprintable() else " " for each in text[:400])
    if font.getlength(line) <= width:
        return line
    while line and font.getlength(line + "…") > width:
        line = line[:-1]
    return line.rstrip() + "…"


def _wrapped(text: str, font: ImageFont.FreeTypeFont, width: int) -> list[str]:
    """Return a text as at most two lines of at most `width` pixels; if it is longer, the second line is cut."""
    words, line = text[:400].split(), ""
    while words and font.getlength(f"{line} {words[0]}") <= width:
        line = f"{line} {words.pop(0)}".strip()
    if not words:
        return [_cut_to_width(line, font, width)]
    rest = _cut_to_width(" ".join(words), font, width)
    return [_cut_to_width(line, font, width), rest] if line else [rest]
