"""Writes a blind round: numbered pictures on sheets, instructions and answers for readers, and a separate key.

FOLDER/sheet_01.png ... are for readers; FOLDER/README.txt has their instructions; they fill in FOLDER/answers.jsonl.
FOLDER.key.json says what is shown, and readers may not open it.
"""

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from tools.blind.forms import CROP_CELL_PX, LAYOUTS, RoundKind, RoundLayout, instructions

LABEL_PX, FONT_PX, GAP_PX = 19, 16, 5
"""Height of the line with a picture's number, size of its letters, and the space between pictures; small, because some
viewers shrink sheets of more than 1.18 million pixels."""
MARK_PX, MARK_GAP_PX = 7, 9
"""Sides of the corners that mark a subject in a blind round, and how far off its box they are."""
ANSWERS = "answers.jsonl"
SIDES = ("A", "B")
PixelBox = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class RoundItem:
    """One number of a round: its pictures, and what they show."""

    pictures: Sequence[Image.Image]
    """One picture; for a pair two, left and right."""
    truth: dict[str, Any]


@dataclass(frozen=True, slots=True)
class BlindRound:
    """The contents of a round, and how they were chosen."""

    kind: RoundKind
    seed: int
    shown: Sequence[RoundItem]
    left_out: list[dict[str, Any]] = field(default_factory=list)
    """Drawn pictures that are not shown, with the reasons."""
    facts: dict[str, Any] = field(default_factory=dict)
    """Facts about the whole round."""


def key_of(folder: Path) -> Path:
    """Return where the key of a round is."""
    return folder.with_name(f"{folder.name}.key.json")


def refuse_existing(folder: Path) -> None:
    """Raise SystemExit when the folder already has a round."""
    if key_of(folder).exists() or (folder.exists() and any(folder.iterdir())):
        raise SystemExit(f"There is something at {str(folder)!r} already; give another folder, or take that away.")


def write(folder: Path, made: BlindRound) -> None:
    """Write a round to a new folder, and its key next to that folder."""
    folder.mkdir(parents=True, exist_ok=True)
    form = LAYOUTS[made.kind]
    cells = [each for number, shown in enumerate(made.shown, start=1) for each in _cells(number, shown)]
    size = form.columns * form.rows
    for first in range(0, len(cells), size):
        sheet(form, cells[first : first + size]).save(folder / f"sheet_{first // size + 1:02}.png")
    numbers = range(1, len(made.shown) + 1)
    (folder / "README.txt").write_text(instructions(made.kind), encoding="utf-8")
    write_lines(folder / ANSWERS, ({"n": number, **form.blank} for number in numbers))
    pictures = [{"n": number, **shown.truth} for number, shown in zip(numbers, made.shown, strict=True)]
    key = {"kind": made.kind, "seed": made.seed, **made.facts, "left_out": made.left_out, "pictures": pictures}
    key_of(folder).write_text(json.dumps(key, indent=1) + "\n", encoding="utf-8")


def _cells(number: int, shown: RoundItem) -> list[tuple[str, Image.Image]]:
    """Return the pictures of a number, with what is written above each."""
    if len(shown.pictures) == 1:
        return [(str(number), shown.pictures[0])]
    return [(f"{number} {side}", picture) for side, picture in zip(SIDES, shown.pictures, strict=True)]


def write_lines(path: Path, rows: Iterable[dict[str, Any]]) -> None:
    """Write one JSON object a line."""
    path.write_text("".join(json.dumps(row, ensure_ascii=False) + "\n" for row in rows), encoding="utf-8")


def sheet(form: RoundLayout, cells: Sequence[tuple[str, Image.Image]]) -> Image.Image:
    """Return labelled pictures side by side, as many rows as they need."""
    (width, height), rows = form.cell_px, -(-len(cells) // form.columns)
    step_x, step_y = width + GAP_PX, height + LABEL_PX + GAP_PX
    image = Image.new("RGB", (form.columns * step_x - GAP_PX, rows * step_y - GAP_PX), "white")
    pen, font = ImageDraw.Draw(image), ImageFont.load_default(FONT_PX)
    for number, (label, picture) in enumerate(cells):
        left, top = number % form.columns * step_x, number // form.columns * step_y
        pen.text((left + 2, top), label, fill="black", font=font)
        image.paste(picture, (left, top + LABEL_PX))
    return image


def crop_around(frame: Image.Image, box_px: PixelBox) -> Image.Image:
    """Return 400 x 300 pixels around a thing's box, with corners about it; of large things the whole frame, shrunk."""
    left, top, right, bottom = box_px
    width, height = CROP_CELL_PX
    room = 2 * (MARK_GAP_PX + 1)
    if right - left > width - room or bottom - top > height - room:
        scale = width / frame.width
        whole = frame.resize(CROP_CELL_PX, Image.Resampling.LANCZOS)
        return marked(np.asarray(whole), (left * scale, top * scale, right * scale, bottom * scale))
    x = round(min(max((left + right - width) / 2, 0), frame.width - width))
    y = round(min(max((top + bottom - height) / 2, 0), frame.height - height))
    part = frame.crop((x, y, x + width, y + height))
    return marked(np.asarray(part), (left - x, top - y, right - x, bottom - y))


def marked(picture: np.ndarray, box_px: PixelBox) -> Image.Image:
    """Return a picture (h, w, 3) with a bright corner, edged dark, off each corner of a box that is in it."""
    image = Image.fromarray(picture)
    left, top = (int(max(side - MARK_GAP_PX, 1)) for side in box_px[:2])
    right = int(min(box_px[2] + MARK_GAP_PX, image.width - 2))
    bottom = int(min(box_px[3] + MARK_GAP_PX, image.height - 2))
    pen = ImageDraw.Draw(image)
    for colour, width in (("black", 3), ("white", 1)):
        for x, inward in ((left, MARK_PX), (right, -MARK_PX)):
            for y, down in ((top, MARK_PX), (bottom, -MARK_PX)):
                pen.line((x + inward, y, x, y, x, y + down), fill=colour, width=width)
    return image
