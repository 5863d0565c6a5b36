"""Floor plan next to a film's frames: the hidden house, the agent's path so far, and the objects of the goal."""

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from vigil.base.geometry import heading
from vigil.scene.plan import FloorPlan
from vigil.scene.plan_image import PlanImage

PANEL_PX = 480
CAPTION_PX, LEGEND_PX = 44, 36
SUPERSAMPLING = 3
"""Factor by which the plan is drawn larger and then scaled down, for smooth edges."""
MAX_PX_PER_M = 100
"""Greatest scale of a plan (pixels per metre), so that a single room is not drawn too large."""
VIEW_DEG = 106
"""Horizontal field of view (degrees) of the agent's camera, whose vertical field of view is 90 degrees at 4:3."""
VIEW_M, AGENT_M, STEP_DOT_M = 1.3, 0.17, 0.06
SAME_PLACE_M = 0.05
"""Tolerance (m): an object has not been moved if its box and its outline on the plan differ by at most this."""
RING_M = 0.3
"""Radius (m) of the ring that is drawn around an object that is too small to notice."""
GROUND, INK, SOFT = (247, 246, 243), (28, 33, 38), (83, 91, 99)
PATH, AGENT, TARGET = (11, 92, 138), (179, 55, 47), (27, 122, 83)


@lru_cache(maxsize=16)
def font_of(size: int, *, is_bold: bool = False) -> ImageFont.FreeTypeFont:
    """Return the font of films at a size (pixels)."""
    import matplotlib  # noqa: PLC0415 - loads over 100 modules

    fonts = Path(matplotlib.get_data_path()) / "fonts" / "ttf"
    return ImageFont.truetype(fonts / ("DejaVuSans-Bold.ttf" if is_bold else "DejaVuSans.ttf"), size)


class FilmPlan:
    """Plan of one house, drawn at each step of an episode."""

    def __init__(self, plan: FloorPlan) -> None:
        low, high = plan.bounds
        width, height = high - low
        scale = float(min(PANEL_PX / width, (PANEL_PX - CAPTION_PX - LEGEND_PX) / height, MAX_PX_PER_M))
        self._sheet = PlanImage(plan, SUPERSAMPLING * scale, GROUND)
        self._outlines = {thing.id: thing.corners for thing in plan.things}
        font = font_of(14 * SUPERSAMPLING)
        for room in plan.rooms:
            self._sheet.draw.text(self._sheet.at(*room.name_at), room.name, fill=SOFT, font=font, anchor="mm")

    def panel(self, worlds: Sequence[dict[str, Any]], holds: bool | None) -> Image.Image:
        """Return the plan at the last of `worlds` (all states so far); `holds` says whether the goal holds then."""
        sheet = self._sheet
        large = sheet.image.copy()
        if worlds:
            draw = ImageDraw.Draw(large, "RGBA")
            self._draw_targets(draw, worlds[-1])
            way = [self._at(world) for world in worlds]
            draw.line(way, fill=PATH, width=3 * SUPERSAMPLING, joint="curve")
            for place in way:
                draw.circle(place, STEP_DOT_M * sheet.scale, fill=PATH)
            self._draw_agent(draw, worlds[-1])
        panel = Image.new("RGB", (PANEL_PX, PANEL_PX), GROUND)
        small = large.resize((large.width // SUPERSAMPLING, large.height // SUPERSAMPLING), Image.Resampling.LANCZOS)
        free = PANEL_PX - CAPTION_PX - LEGEND_PX
        panel.paste(small, ((PANEL_PX - small.width) // 2, CAPTION_PX + (free - small.height) // 2))
        _draw_caption(panel, holds)
        _draw_legend(panel)
        return panel

    def _at(self, world: dict[str, Any]) -> tuple[int, int]:
        return self._sheet.at(world["x"], -world["y"])

    def _draw_targets(self, draw: ImageDraw.ImageDraw, world: dict[str, Any]) -> None:
        """Draw each object of the goal: its outline on the plan if it has not moved, else its box."""
        for name, thing in world["objects"].items():
            corners = np.array([corner.split(",") for corner in thing["corners"].split()], dtype=float) * (1.0, -1.0)
            drawn = self._outlines.get(name)
            if drawn is not None and np.allclose(_extent(drawn), _extent(corners), atol=SAME_PLACE_M):
                corners = drawn
            points = [self._sheet.at(x, z) for x, z in corners.tolist()]
            draw.polygon(points, fill=(*TARGET, 110), outline=TARGET, width=2 * SUPERSAMPLING)
            (low_x, low_y), (high_x, high_y) = (tuple(map(pick, zip(*points, strict=True))) for pick in (min, max))
            radius = RING_M * self._sheet.scale
            if max(high_x - low_x, high_y - low_y) < radius:
                x, y = (low_x + high_x) / 2, (low_y + high_y) / 2
                draw.circle((x, y), radius, outline=TARGET, width=3 * SUPERSAMPLING)

    def _draw_agent(self, draw: ImageDraw.ImageDraw, world: dict[str, Any]) -> None:
        """Draw the agent's position and its camera's field of view; a heading of 0 degrees points up."""
        (x, y), (dx, dz) = self._at(world), heading(world["yaw"])
        far, radius = VIEW_M * self._sheet.scale, AGENT_M * self._sheet.scale
        turn = world["yaw"] - 90
        draw.pieslice((x - far, y - far, x + far, y + far), turn - VIEW_DEG / 2, turn + VIEW_DEG / 2, fill=(*AGENT, 50))
        draw.circle((x, y), radius, fill=AGENT, outline=GROUND, width=2 * SUPERSAMPLING)
        draw.line([(x, y), (x + radius * dx, y - radius * dz)], fill=GROUND, width=2 * SUPERSAMPLING)


def _extent(corners: np.ndarray) -> np.ndarray:
    return np.concatenate([corners.min(axis=0), corners.max(axis=0)])


def _draw_caption(panel: Image.Image, holds: bool | None) -> None:
    draw = ImageDraw.Draw(panel)
    middle = CAPTION_PX // 2
    draw.text((14, middle), "Hidden from the agent", fill=INK, font=font_of(17, is_bold=True), anchor="lm")
    if holds is None:
        return
    text, font = "goal reached" if holds else "goal not reached", font_of(16, is_bold=True)
    left = PANEL_PX - 26 - font.getlength(text)
    draw.rounded_rectangle((left - 10, 8, PANEL_PX - 14, CAPTION_PX - 8), 8, fill=TARGET if holds else SOFT)
    draw.text((left - 1, middle), text, fill=(255, 255, 255), font=font, anchor="lm")


def _draw_legend(panel: Image.Image) -> None:
    draw, font = ImageDraw.Draw(panel), font_of(15)
    x, y = 14.0, PANEL_PX - LEGEND_PX // 2
    for colour, word in ((AGENT, "agent"), (PATH, "path"), (TARGET, "what the goal is about")):
        draw.circle((x + 6, y), 6, fill=colour)
        draw.text((x + 18, y), word, fill=SOFT, font=font, anchor="lm")
        x += 18 + font.getlength(word) + 22
