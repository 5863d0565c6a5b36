"""Pictures that cover a face once: paintings, screens, book covers and printed paper.

They are drawn with numpy and PIL from a fixed random stream and, unlike textures, do not tile. Row 0 is the top.
"""

from collections.abc import Callable
from functools import partial

import numpy as np
from PIL import Image, ImageDraw, ImageFilter, ImageFont

Colour = tuple[int, int, int]

Drawing = Callable[[np.random.Generator], np.ndarray]

_WIDE, _TALL = 256, 192
SOFT_PX = 0.8


def draw(kind: str, variant: str, rng: np.random.Generator) -> np.ndarray:
    """Return the picture with the name "kind/variant" as (h, w, 3) uint8."""
    choices = KINDS[kind]
    maker = choices.get(variant)
    if maker is None:
        names = [name for name in choices if name.isdigit()] or sorted(choices)
        number = int(variant) if variant.isdigit() else int(rng.integers(len(names)))
        maker = choices[names[number % len(names)]]
    return maker(rng)


def _sheet(size: tuple[int, int], colour: Colour) -> tuple[Image.Image, ImageDraw.ImageDraw]:
    """Return a picture of one colour, and the brush that paints on it; `size` is its width and height (px)."""
    image = Image.new("RGB", size, colour)
    return image, ImageDraw.Draw(image)


def _gradient(
    top: Colour, bottom: Colour, width: int = _WIDE, height: int = _TALL
) -> tuple[Image.Image, ImageDraw.ImageDraw]:
    """Return a picture whose colour changes from top to bottom, and the brush that paints on it."""
    part = np.linspace(0, 1, height)[:, None, None]
    shades = np.array(top) * (1 - part) + np.array(bottom) * part
    image = Image.fromarray(np.broadcast_to(shades, (height, width, 3)).astype(np.uint8).copy())
    return image, ImageDraw.Draw(image)


def _vary(rng: np.random.Generator, colour: Colour, by: int = 18) -> Colour:
    red, green, blue = (int(np.clip(part + rng.integers(-by, by + 1), 0, 255)) for part in colour)
    return red, green, blue


def _canvas(image: Image.Image, rng: np.random.Generator, grain: float = 3.0) -> np.ndarray:
    """Return a painted picture with the grain of a canvas and with edges that look smooth from nearby."""
    pixels = np.asarray(image.filter(ImageFilter.GaussianBlur(SOFT_PX)), np.float64)
    return np.clip(pixels + rng.normal(0, grain, pixels.shape[:2])[..., None], 0, 255).astype(np.uint8)


def _mountains(rng: np.random.Generator) -> np.ndarray:
    image, brush = _gradient(_vary(rng, (96, 150, 214)), _vary(rng, (240, 214, 180)))
    x, y = int(rng.integers(40, 216)), int(rng.integers(25, 60))
    brush.ellipse((x - 14, y - 14, x + 14, y + 14), fill=(255, 240, 190))
    for step, colour in enumerate(((122, 136, 168), (84, 104, 136), (58, 92, 70), (44, 74, 42))):
        across = np.linspace(0, 2 * np.pi, _WIDE)
        waves = sum(rng.normal() / (k + 1) * np.sin((k + 1) * across + rng.uniform(0, 6.3)) for k in range(6))
        ridge = 85 + 27 * step + (15 - 2 * step) * np.asarray(waves)
        points = [*((int(x), float(y)) for x, y in enumerate(ridge)), (_WIDE, _TALL), (0, _TALL)]
        brush.polygon(points, fill=_vary(rng, colour, 10))
    return _canvas(image, rng)


def _seascape(rng: np.random.Generator) -> np.ndarray:
    image, brush = _gradient(_vary(rng, (250, 170, 110)), _vary(rng, (255, 226, 180)))
    brush.ellipse((150, 62, 190, 102), fill=(255, 236, 170))
    brush.rectangle((0, 100, _WIDE, _TALL), fill=_vary(rng, (38, 96, 140)))
    for _ in range(60):
        y = int(rng.integers(102, _TALL))
        x = int(rng.integers(0, _WIDE))
        brush.line((x, y, x + int(rng.integers(8, 40)), y), fill=_vary(rng, (110, 160, 190), 30), width=1)
    x = int(rng.integers(50, 120))
    brush.polygon(((x, 118), (x + 44, 118), (x + 36, 130), (x + 8, 130)), fill=(92, 54, 32))
    brush.polygon(((x + 20, 70), (x + 20, 115), (x + 42, 115)), fill=(246, 242, 232))
    brush.polygon(((x + 17, 76), (x + 17, 115), (x + 2, 115)), fill=(230, 222, 210))
    return _canvas(image, rng)


def _portrait(rng: np.random.Generator) -> np.ndarray:
    image, brush = _gradient(_vary(rng, (72, 62, 52)), _vary(rng, (112, 88, 64)), 192, 240)
    shade = rng.uniform(0.55, 1.05)
    skin = _vary(rng, (int(214 * shade), int(170 * shade), int(138 * shade)), 4)
    hair = _vary(rng, (70, 44, 26), 30)
    coat = _vary(rng, (60, 70, 110), 45)
    brush.ellipse((50, 38, 142, 158), fill=hair)
    brush.ellipse((18, 165, 174, 330), fill=coat)
    brush.rectangle((80, 130, 112, 178), fill=skin)
    brush.ellipse((60, 54, 132, 152), fill=skin)
    brush.polygon(((80, 168), (112, 168), (96, 206)), fill=(240, 236, 226))
    for x in (80, 112):
        brush.ellipse((x - 7, 92, x + 7, 102), fill=(246, 244, 240))
        brush.ellipse((x - 3, 93, x + 3, 101), fill=(46, 34, 24))
        brush.line((x - 9, 85, x + 9, 84), fill=hair, width=3)
    shadow = (int(176 * shade), int(130 * shade), int(104 * shade))
    brush.line((96, 100, 92, 120, 99, 121), fill=shadow, width=2)
    brush.arc((82, 118, 110, 138), 20, 160, fill=(168, 70, 64), width=4)
    return _canvas(image, rng)


def _abstract(rng: np.random.Generator) -> np.ndarray:
    image, brush = _sheet((_WIDE, _TALL), (238, 232, 218))
    paints: tuple[Colour, ...] = ((206, 62, 46), (34, 82, 150), (240, 190, 60), (40, 44, 48), (86, 148, 120))
    for _ in range(9):
        x, y = int(rng.integers(-20, 220)), int(rng.integers(-20, 160))
        width, height = int(rng.integers(30, 100)), int(rng.integers(30, 90))
        colour = _vary(rng, paints[rng.integers(len(paints))])
        if rng.random() < 0.5:
            brush.ellipse((x, y, x + width, y + width), fill=colour)
        else:
            brush.rectangle((x, y, x + width, y + height), fill=colour)
    for _ in range(4):
        points = rng.integers(0, 256, 4).tolist()
        brush.line(points, fill=(24, 24, 28), width=int(rng.integers(2, 6)))
    return _canvas(image, rng)


def _flowers(rng: np.random.Generator) -> np.ndarray:
    image, brush = _gradient(_vary(rng, (186, 196, 176)), _vary(rng, (216, 206, 186)), 192, 240)
    brush.rectangle((0, 190, 192, 240), fill=_vary(rng, (134, 94, 62)))
    vase = _vary(rng, (70, 104, 160), 40)
    petals = tuple(
        _vary(rng, colour, 20) for colour in ((222, 66, 84), (246, 196, 72), (240, 236, 240), (176, 92, 176))
    )
    heads = np.c_[rng.uniform(36, 156, 11), rng.uniform(30, 112, 11)]
    for x, y in heads:
        brush.line((x, y, 96, 150), fill=(64, 110, 58), width=3)
    brush.ellipse((64, 140, 128, 216), fill=vase)
    brush.rectangle((82, 128, 110, 156), fill=vase)
    for index, (x, y) in enumerate(heads):
        colour = petals[index % len(petals)]
        for angle in np.arange(6) * np.pi / 3:
            px, py = x + 9 * np.cos(angle), y + 9 * np.sin(angle)
            brush.ellipse((px - 8, py - 8, px + 8, py + 8), fill=colour)
        brush.ellipse((x - 6, y - 6, x + 6, y + 6), fill=(120, 84, 30))
    return _canvas(image, rng)


def _city(rng: np.random.Generator) -> np.ndarray:
    image, brush = _gradient(_vary(rng, (28, 34, 74)), _vary(rng, (236, 132, 96)))
    x = 0
    while x < _WIDE:
        width, top = int(rng.integers(16, 40)), int(rng.integers(50, 130))
        brush.rectangle((x, top, x + width, _TALL), fill=_vary(rng, (34, 34, 52), 12))
        for row in range(top + 5, _TALL - 6, 9):
            for column in range(x + 4, x + width - 4, 8):
                if rng.random() < 0.45:
                    brush.rectangle((column, row, column + 3, row + 4), fill=(250, 220, 140))
        x += width + int(rng.integers(0, 4))
    return _canvas(image, rng, 3)


def _news(rng: np.random.Generator) -> np.ndarray:
    image, brush = _gradient((30, 60, 130), (16, 28, 70))
    brush.rectangle((140, 22, 246, 116), fill=(96, 150, 200))
    brush.polygon(((140, 116), (180, 60), (210, 90), (230, 70), (246, 116)), fill=(70, 110, 70))
    brush.ellipse((34, 90, 118, 230), fill=(44, 46, 60))
    brush.ellipse((56, 38, 98, 94), fill=(222, 176, 146))
    brush.pieslice((52, 30, 102, 84), 180, 360, fill=(60, 40, 26))
    brush.polygon(((68, 92), (86, 92), (77, 130)), fill=(240, 240, 240))
    brush.rectangle((0, 150, _WIDE, 172), fill=(200, 30, 40))
    brush.rectangle((0, 172, _WIDE, _TALL), fill=(240, 240, 244))
    for x in range(10, 240, 26):
        brush.rectangle((x, 157, x + int(rng.integers(10, 22)), 165), fill=(255, 255, 255))
        brush.rectangle((x, 179, x + int(rng.integers(10, 22)), 185), fill=(60, 60, 70))
    return np.asarray(image)


def _football(rng: np.random.Generator) -> np.ndarray:
    image, brush = _sheet((_WIDE, _TALL), (60, 150, 60))
    for x in range(0, _WIDE, 64):
        brush.rectangle((x, 0, x + 31, _TALL), fill=(72, 168, 70))
    brush.rectangle((0, 0, _WIDE, 34), fill=(70, 74, 96))
    for _ in range(260):
        x, y = int(rng.integers(0, _WIDE)), int(rng.integers(2, 32))
        brush.rectangle((x, y, x + 2, y + 2), fill=_vary(rng, (170, 150, 140), 70))
    brush.line((128, 36, 128, _TALL), fill=(240, 250, 240), width=3)
    brush.ellipse((88, 80, 168, 150), outline=(240, 250, 240), width=3)
    for index in range(12):
        x, y = int(rng.integers(14, 240)), int(rng.integers(52, 168))
        shirt = (220, 40, 40) if index % 2 else (245, 245, 250)
        brush.rectangle((x, y, x + 7, y + 10), fill=shirt)
        brush.ellipse((x + 1, y - 6, x + 6, y - 1), fill=(200, 150, 120))
        brush.rectangle((x + 1, y + 10, x + 6, y + 18), fill=(30, 30, 60))
    return np.asarray(image)


def _cartoon(rng: np.random.Generator) -> np.ndarray:
    image, brush = _gradient((120, 200, 250), (190, 232, 255))
    brush.ellipse((-60, 120, 330, 300), fill=(104, 190, 80))
    brush.rectangle((150, 70, 220, 140), fill=(240, 200, 120))
    brush.polygon(((140, 72), (185, 32), (230, 72)), fill=(204, 70, 60))
    brush.rectangle((176, 104, 196, 140), fill=(120, 74, 44))
    brush.ellipse((40, 70, 100, 130), fill=(250, 196, 60))
    brush.ellipse((54, 86, 66, 100), fill=(20, 20, 20))
    brush.ellipse((76, 86, 88, 100), fill=(20, 20, 20))
    brush.arc((54, 92, 88, 120), 20, 160, fill=(120, 30, 30), width=4)
    return np.asarray(image)


def _desktop(rng: np.random.Generator) -> np.ndarray:
    image, brush = _gradient(_vary(rng, (40, 90, 170)), _vary(rng, (120, 180, 220)))
    brush.rectangle((40, 20, 200, 130), fill=(250, 250, 252))
    brush.rectangle((40, 20, 200, 32), fill=(70, 80, 96))
    for x, colour in ((190, (230, 80, 70)), (180, (240, 190, 70)), (170, (100, 190, 100))):
        brush.ellipse((x, 23, x + 6, 29), fill=colour)
    for y in range(42, 122, 9):
        brush.rectangle((50, y, 60 + int(rng.integers(50, 125)), y + 3), fill=(120, 126, 140))
    brush.rectangle((0, 178, _WIDE, _TALL), fill=(30, 34, 44))
    for index, x in enumerate(range(8, 120, 16)):
        paints: tuple[Colour, ...] = ((230, 90, 70), (90, 170, 230), (250, 200, 80), (120, 200, 120))
        brush.rectangle((x, 181, x + 9, 189), fill=paints[index % 4])
    return np.asarray(image)


def _phone(rng: np.random.Generator) -> np.ndarray:
    image, brush = _gradient(_vary(rng, (80, 60, 160), 40), _vary(rng, (220, 110, 140), 40), 128, 256)
    _digits(brush, "10:24", (30, 30), 12, (255, 255, 255))
    for row in range(4):
        for column in range(4):
            x, y = 12 + column * 28, 100 + row * 36
            colour = _vary(rng, (150, 150, 150), 100)
            brush.rounded_rectangle((x, y, x + 20, y + 20), 5, fill=colour)
    return np.asarray(image)


_SEGMENTS = {
    "0": "abcdef", "1": "bc", "2": "abged", "3": "abgcd", "4": "fgbc", "5": "afgcd", "6": "afgedc", "7": "abc",
    "8": "abcdefg", "9": "abcdfg",
}  # fmt: skip


def _digits(brush: ImageDraw.ImageDraw, text: str, at: tuple[int, int], size: int, colour: Colour) -> None:
    """Draw digits and colons as seven segments; `size` is half a digit's height."""
    x, y = at
    thick = max(2, size // 4)
    for sign in text:
        if sign == ":":
            for dy in (size // 2, size + size // 2):
                brush.rectangle((x, y + dy, x + thick, y + dy + thick), fill=colour)
            x += 2 * thick
            continue
        ends = {
            "a": (0, 0, size, 0), "b": (size, 0, size, size), "c": (size, size, size, 2 * size),
            "d": (0, 2 * size, size, 2 * size), "e": (0, size, 0, 2 * size), "f": (0, 0, 0, size),
            "g": (0, size, size, size),
        }  # fmt: skip
        for name in _SEGMENTS[sign]:
            x0, y0, x1, y1 = ends[name]
            brush.line((x + x0, y + y0, x + x1, y + y1), fill=colour, width=thick)
        x += size + 2 * thick


def _clock(text: str, colour: Colour, rng: np.random.Generator) -> np.ndarray:
    image, brush = _sheet((128, 64), (10, 14, 12))
    _digits(brush, text, (10, 14), 17, _vary(rng, colour, 6))
    return np.asarray(image)


def _text_page(rng: np.random.Generator) -> np.ndarray:
    image, brush = _sheet((192, 256), (246, 244, 236))
    for y in range(22, 236, 9):
        if rng.random() < 0.08:
            continue
        end = 172 if rng.random() < 0.8 else int(rng.integers(70, 150))
        _words(brush, rng, 20, end, y)
    return np.asarray(image)


def _words(brush: ImageDraw.ImageDraw, rng: np.random.Generator, start: int, end: int, y: int, height: int = 3) -> None:
    x = start
    while x < end:
        width = int(rng.integers(4, 16))
        brush.rectangle((x, y, min(x + width, end), y + height), fill=(70, 68, 66))
        x += width + 4


def _newspaper(rng: np.random.Generator) -> np.ndarray:
    image, brush = _sheet((256, 320), (226, 222, 210))
    _words(brush, rng, 30, 226, 12, 16)
    brush.line((12, 36, 244, 36), fill=(60, 60, 60), width=2)
    _words(brush, rng, 14, 242, 44, 9)
    brush.rectangle((14, 62, 124, 140), fill=(150, 150, 148))
    brush.polygon(((14, 140), (50, 90), (80, 120), (100, 100), (124, 140)), fill=(90, 90, 90))
    for left, top in ((14, 148), (74, 148), (134, 62), (192, 62)):
        for y in range(top, 306, 6):
            _words(brush, rng, left, left + 52, y, 2)
    return np.asarray(image)


def _label(rng: np.random.Generator) -> np.ndarray:
    image, brush = _sheet((192, 128), (244, 242, 236))
    band = _vary(rng, (180, 70, 60), 60)
    brush.rectangle((0, 0, 192, 34), fill=band)
    _words(brush, rng, 20, 170, 12, 12)
    for y in (50, 66, 82):
        _words(brush, rng, 16, 150, y, 5)
    for x in range(20, 90, 5):
        brush.rectangle((x, 100, x + int(rng.integers(1, 4)), 120), fill=(20, 20, 20))
    return np.asarray(image)


def _lettering(text: str, ink: Colour, paper: Colour, _rng: np.random.Generator) -> np.ndarray:
    """Return one word on a face that is four times as wide as high."""
    image, brush = _sheet((256, 64), paper)
    font = ImageFont.load_default(56)
    brush.text((128, 32), text, fill=ink, font=font, anchor="mm", stroke_width=2, stroke_fill=ink)
    return np.asarray(image)


def _cover(rng: np.random.Generator) -> np.ndarray:
    paints = ((150, 34, 40), (30, 70, 120), (34, 98, 74), (216, 160, 50), (84, 50, 100), (40, 42, 48))
    base = _vary(rng, paints[rng.integers(len(paints))], 20)
    image, brush = _sheet((160, 224), base)
    light = (246, 236, 210)
    brush.rectangle((10, 10, 149, 213), outline=light, width=2)
    for y, size in ((34, 15), (58, 15)):
        _title(brush, rng, y, size, light)
    if rng.random() < 0.5:
        brush.ellipse((45, 96, 115, 166), fill=_vary(rng, (230, 190, 110), 40))
    else:
        brush.polygon(((80, 92), (124, 168), (36, 168)), fill=_vary(rng, (230, 190, 110), 40))
    _title(brush, rng, 188, 8, light)
    return np.asarray(image)


def _title(brush: ImageDraw.ImageDraw, rng: np.random.Generator, y: int, height: int, colour: Colour) -> None:
    x, end = 24 + int(rng.integers(20)), 136 - int(rng.integers(20))
    while x < end:
        width = int(rng.integers(8, 26))
        brush.rectangle((x, y, min(x + width, end), y + height), fill=colour)
        x += width + 6


KINDS: dict[str, dict[str, Drawing]] = {
    "picture": {
        str(index): (_mountains, _portrait, _abstract, _seascape, _flowers, _city)[index % 6] for index in range(24)
    },
    "screen": {
        "0": _mountains,
        "1": _news,
        "2": _football,
        "3": _cartoon,
        "desktop": _desktop,
        "phone": _phone,
        "green": partial(_clock, "12:30", (70, 240, 120)),
        "red": partial(_clock, "07:45", (250, 60, 50)),
        "blue": partial(_clock, "02:15", (90, 200, 255)),
    },
    "cover": {str(index): _cover for index in range(24)},
    "print": {
        "text": _text_page,
        "news": _newspaper,
        "label": _label,
        "foil": partial(_lettering, "FOIL", (24, 40, 92), (240, 240, 236)),
        "dryer": partial(_lettering, "DRYER", (30, 32, 36), (213, 215, 217)),
        "washer": partial(_lettering, "WASHER", (30, 32, 36), (196, 199, 202)),
    },
}
"""Kind -> variant -> drawing. Numbers beyond the last variant start again at the first variant."""
