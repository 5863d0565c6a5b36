"""Contact sheets: pictures with the first frames and instructions of many episodes, for people who check episodes."""

import textwrap
from collections.abc import Callable, Sequence
from pathlib import Path

from PIL import Image, ImageDraw, ImageFont

from vigil.authoring.review.reviews import queue
from vigil.protocol.episode import Episode
from vigil.protocol.families import FAMILIES
from vigil.protocol.house import House
from vigil.sim.protocol import Simulator

COLUMNS = 2
WIDTH, HEIGHT = 480, 360
"""Size (px) of one frame on a sheet."""
TEXT_HEIGHT = 74
"""Height (px) of the text below a frame."""
TEXT_COLUMNS = 62
"""Maximum number of characters in a line of text."""
FONT_SIZE = 15
GAP = 10
INK, FAINT, GROUND = "#1c1f24", "#6a7079", "#ffffff"
QUALITY = 70


def pick_sample(episodes: Sequence[Episode], count: int, seed: int = 0) -> list[Episode]:
    """Return up to `count` episodes, drawn at random by `seed`, evenly over families, and sorted by family and id."""
    return sorted(queue(episodes, seed)[:count], key=lambda episode: (list(FAMILIES).index(episode.family), episode.id))


def write_sheets(
    episodes: Sequence[Episode], house_of: Callable[[Episode], House], simulator: Simulator, folder: Path
) -> list[Path]:
    """Write a sheet (WebP) for each family into `folder`, and return the paths of the sheets."""
    folder.mkdir(parents=True, exist_ok=True)
    written: list[Path] = []
    for family in FAMILIES:
        shown = [episode for episode in episodes if episode.family == family]
        if shown:
            frames = [_start_frame(episode, house_of(episode), simulator) for episode in shown]
            written.append(folder / f"{family}.webp")
            sheet_of([episode.instruction for episode in shown], frames).save(written[-1], quality=QUALITY, method=6)
    return written


def sheet_of(texts: Sequence[str], frames: Sequence[Image.Image]) -> Image.Image:
    """Return a picture of numbered frames with their texts below them, in two columns."""
    rows = -(-len(frames) // COLUMNS)
    pitch_x, pitch_y = WIDTH + GAP, HEIGHT + TEXT_HEIGHT
    sheet = Image.new("RGB", (COLUMNS * pitch_x + GAP, rows * pitch_y + GAP), GROUND)
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(FONT_SIZE)
    for index, (text, frame) in enumerate(zip(texts, frames, strict=True)):
        x, y = GAP + index % COLUMNS * pitch_x, GAP + index // COLUMNS * pitch_y
        sheet.paste(frame.resize((WIDTH, HEIGHT), Image.Resampling.LANCZOS), (x, y))
        draw.text((x, y + HEIGHT + 4), f"{index + 1}", fill=FAINT, font=font)
        lines = textwrap.wrap(text, TEXT_COLUMNS)
        draw.multiline_text((x + 24, y + HEIGHT + 4), "\n".join(lines), fill=INK, font=font)
    return sheet


def _start_frame(episode: Episode, house: House, simulator: Simulator) -> Image.Image:
    simulator.load(house)
    simulator.reset(episode.start, episode.setup)
    return Image.fromarray(simulator.frame())
