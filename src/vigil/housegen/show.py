"""A labelled floor plan of any house, seen from above, for documents and for looking a house over."""

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from vigil.assets.catalog import CATALOG
from vigil.assets.sizes import AssetDatabase
from vigil.house import House
from vigil.housegen.solids import Body, bodies_of
from vigil.pose import heading

MARGIN_M = 0.6
LABEL_PX = 11
FLOOR_RGB = {
    "Kitchen": (252, 240, 214),
    "LivingRoom": (229, 240, 222),
    "Bedroom": (224, 233, 246),
    "Bathroom": (218, 241, 243),
}
OTHER_FLOOR_RGB = (238, 238, 238)
WALL_RGB = (60, 60, 66)
DOOR_RGB = (190, 110, 40)
WINDOW_RGB = (90, 160, 220)
FURNITURE_RGB = (205, 190, 168)
RUG_RGB = (232, 214, 220)
SMALL_RGB = (200, 60, 60)
START_RGB = (40, 120, 60)


class _Sheet:
    """The picture, with north (+z) up."""

    def __init__(self, house: House, pixels_per_m: int) -> None:
        corners = np.array([(point.x, point.z) for room in house.document.rooms for point in room.floor_polygon])
        self.low = corners.min(axis=0) - MARGIN_M
        self.high = corners.max(axis=0) + MARGIN_M
        self.scale = pixels_per_m
        width, height = np.ceil((self.high - self.low) * pixels_per_m).astype(int)
        self.image = Image.new("RGB", (int(width), int(height)), (255, 255, 255))
        self.draw = ImageDraw.Draw(self.image)
        self.font = ImageFont.load_default(LABEL_PX)

    def at(self, x: float, z: float) -> tuple[float, float]:
        """Returns the pixel of a floor point."""
        return float((x - self.low[0]) * self.scale), float((self.high[1] - z) * self.scale)

    def polygon(self, corners: np.ndarray, fill: tuple[int, int, int], line: tuple[int, int, int] | None) -> None:
        """Fills a polygon of floor points."""
        self.draw.polygon([self.at(x, z) for x, z in corners.tolist()], fill=fill, outline=line)

    def label(self, x: float, z: float, text: str) -> None:
        """Writes a text with its middle at a floor point."""
        self.draw.text(self.at(x, z), text, fill=(20, 20, 24), font=self.font, anchor="mm")


def draw_plan(house: House, assets: AssetDatabase, pixels_per_m: int = 100) -> Image.Image:
    """Returns the plan of a house: rooms, doors with the way that they swing, furniture, small things, the start."""
    sheet = _Sheet(house, pixels_per_m)
    for room in house.document.rooms:
        corners = np.array([(point.x, point.z) for point in room.floor_polygon])
        sheet.polygon(corners, FLOOR_RGB.get(room.room_type, OTHER_FLOOR_RGB), None)
    bodies, _ = bodies_of(house, assets)
    standing = [body for body in bodies if body.parent is None and not body.is_opening]
    for body in sorted(standing, key=lambda found: (found.category != "Rug", found.bottom, found.id)):
        _draw_thing(sheet, body)
    _draw_walls(sheet, house)
    for body in bodies:
        if body.is_opening:
            _draw_opening(sheet, body)
    for body in bodies:
        if body.parent is not None:
            x, y = sheet.at(body.position.x, body.position.z)
            sheet.draw.ellipse((x - 2.5, y - 2.5, x + 2.5, y + 2.5), fill=SMALL_RGB)
    for body in standing:
        if body.category != "Rug" and body.bottom < 1.8 and body.asset.size.z > 0.15:
            sheet.label(body.position.x, body.position.z, CATALOG[body.category].spoken)
    _draw_start(sheet, house)
    return sheet.image


def _draw_thing(sheet: _Sheet, body: Body) -> None:
    fill = RUG_RGB if body.category == "Rug" else FURNITURE_RGB
    corners = body.box_corners()
    if body.bottom > 1.8:
        sheet.draw.polygon([sheet.at(x, z) for x, z in corners.tolist()], outline=(150, 150, 150))
        return
    sheet.polygon(corners, fill, (110, 98, 80))
    front = corners[2:]
    sheet.draw.line([sheet.at(x, z) for x, z in front.tolist()], fill=(90, 70, 50), width=3)


def _draw_walls(sheet: _Sheet, house: House) -> None:
    for wall in house.document.walls:
        ends = [(point.x, point.z) for point in wall.polygon[:2]]
        sheet.draw.line([sheet.at(x, z) for x, z in ends], fill=WALL_RGB, width=5)


def _draw_opening(sheet: _Sheet, body: Body) -> None:
    corners = body.box_corners()
    sheet.polygon(corners, WINDOW_RGB if body.category == "Window" else (255, 255, 255), WALL_RGB)
    for prism in body.prisms():
        if prism.joint is not None:
            sheet.polygon(prism.corners, DOOR_RGB, None)


def _draw_start(sheet: _Sheet, house: House) -> None:
    start = house.start
    if start is None:
        return
    (x, _, z), (dx, dz) = start.position, heading(start.rotation)
    sheet.draw.line([sheet.at(x, z), sheet.at(x + 0.45 * dx, z + 0.45 * dz)], fill=START_RGB, width=3)
    px, py = sheet.at(x, z)
    radius = 0.2 * sheet.scale
    sheet.draw.ellipse((px - radius, py - radius, px + radius, py + radius), outline=START_RGB, width=2)
