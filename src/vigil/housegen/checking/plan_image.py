"""A labelled floor plan of any house, seen from above, for documents and for looking a house over."""

import re

import numpy as np
import shapely
from PIL import Image, ImageDraw, ImageFont

from vigil.assets.catalog import CATALOG
from vigil.house import House
from vigil.pose import heading
from vigil.scene.geometry import moving_prisms_of, whole_box
from vigil.scene.outlines import floor_corners, floor_of, footprint
from vigil.scene.things import Scene, Thing

MARGIN_M = 0.6
LABEL_PX = 11
ROOM_LABEL_PX = 17
LABEL_SHIFTS = (0, 13, -13, 26, -26)
"""Where else (px down) a label goes when another is in its place."""
GUTTER_PX = 12
HUNG_M = 1.2
"""Things that hang higher are drawn as outlines: what is below them shows."""
LABELLED_BELOW_M, LABELLED_DEPTH_M = 1.8, 0.1
"""Things that begin higher than this, or are flatter, carry no label."""
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
TEXT_RGB = (20, 20, 24)
ROOM_TEXT_RGB = (120, 120, 135)


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
        self.room_font = ImageFont.load_default(ROOM_LABEL_PX)
        self._written: list[tuple[float, float, float, float]] = []

    def at(self, x: float, z: float) -> tuple[int, int]:
        """Returns the pixel of a floor point."""
        return round((x - self.low[0]) * self.scale), round((self.high[1] - z) * self.scale)

    def polygon(self, corners: np.ndarray, fill: tuple[int, int, int], line: tuple[int, int, int] | None) -> None:
        """Fills a polygon of floor points."""
        self.draw.polygon([self.at(x, z) for x, z in corners.tolist()], fill=fill, outline=line)

    def label(self, x: float, z: float, text: str) -> None:
        """Writes a text with its middle at or near a floor point, unless other texts leave no place for it."""
        px, py = self.at(x, z)
        for shift in LABEL_SHIFTS:
            left, top, right, bottom = self.draw.textbbox((px, py + shift), text, font=self.font, anchor="mm")
            into = max(0.0, 2 - left) - max(0.0, right + 2 - self.image.width)
            box = (left + into, top, right + into, bottom)
            if all(box[2] < old[0] or box[0] > old[2] or box[3] < old[1] or box[1] > old[3] for old in self._written):
                self.draw.text((px + into, py + shift), text, fill=TEXT_RGB, font=self.font, anchor="mm")
                self._written.append(box)
                return

    def room_label(self, x: float, z: float, text: str) -> None:
        """Writes the name of a room with its middle at a floor point."""
        self.draw.text(self.at(x, z), text, fill=ROOM_TEXT_RGB, font=self.room_font, anchor="mm", align="center")
        box = self.draw.textbbox(self.at(x, z), text, font=self.room_font, anchor="mm")
        self._written.append(box)


def draw_plan(house: House, scene: Scene, pixels_per_m: int = 100) -> Image.Image:
    """Returns the plan of a house: rooms, doors with the way that they swing, furniture, small things, the start."""
    sheet = _Sheet(house, pixels_per_m)
    for room in scene.rooms:
        sheet.polygon(room.polygon, FLOOR_RGB.get(room.room_type, OTHER_FLOOR_RGB), None)
    standing = [thing for thing in scene.things.values() if thing.parent is None and not thing.is_structure]
    bottoms = {thing.id: whole_box(thing).bottom for thing in standing}
    for thing in sorted(standing, key=lambda found: (found.category != "Rug", bottoms[found.id], found.id)):
        _draw_thing(sheet, thing)
    _draw_walls(sheet, scene)
    for thing in scene.things.values():
        if thing.is_structure:
            _draw_opening(sheet, thing)
    for thing in scene.things.values():
        if thing.parent is not None:
            x, y = sheet.at(thing.position.x, thing.position.z)
            sheet.draw.ellipse((x - 2.5, y - 2.5, x + 2.5, y + 2.5), fill=SMALL_RGB)
    _name_rooms(sheet, house, standing)
    for thing in sorted(standing, key=lambda found: -found.asset.size.x * found.asset.size.z):
        if thing.category != "Rug" and bottoms[thing.id] < LABELLED_BELOW_M and thing.asset.size.z > LABELLED_DEPTH_M:
            sheet.label(thing.position.x, thing.position.z, CATALOG[thing.category].spoken)
    _draw_start(sheet, house)
    return sheet.image


def _name_rooms(sheet: _Sheet, house: House, standing: list[Thing]) -> None:
    """Writes each room's type and area where most floor is free about it."""
    things = shapely.union_all([footprint(whole_box(thing)) for thing in standing if thing.category != "Rug"])
    for room in house.document.rooms:
        floor = floor_of(room)
        taken = shapely.union(things, floor.exterior)
        x0, z0, x1, z1 = floor.bounds
        xs, zs = (part.ravel() for part in np.meshgrid(np.arange(x0, x1, 0.1), np.arange(z0, z1, 0.1)))
        inside = shapely.contains_xy(floor, xs, zs)
        if not inside.any():
            continue
        free = shapely.distance(shapely.points(xs[inside], zs[inside]), taken)
        best = int(free.argmax())
        name = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", room.room_type).lower()
        sheet.room_label(float(xs[inside][best]), float(zs[inside][best]), f"{name}\n{floor.area:.0f} m2")


def beside(plan: Image.Image, view: np.ndarray) -> Image.Image:
    """Returns the plan with a picture (height, width, 3) of the same house to its right, as high as the plan."""
    picture = Image.fromarray(view)
    width = round(picture.width * plan.height / picture.height)
    scaled = picture.resize((width, plan.height), Image.Resampling.LANCZOS)
    both = Image.new("RGB", (plan.width + GUTTER_PX + width, plan.height), (255, 255, 255))
    both.paste(plan, (0, 0))
    both.paste(scaled, (plan.width + GUTTER_PX, 0))
    return both


def _draw_thing(sheet: _Sheet, thing: Thing) -> None:
    fill = RUG_RGB if thing.category == "Rug" else FURNITURE_RGB
    box = whole_box(thing)
    corners = floor_corners(box)
    if box.bottom > HUNG_M:
        sheet.draw.polygon([sheet.at(x, z) for x, z in corners.tolist()], outline=(150, 150, 150))
        return
    sheet.polygon(corners, fill, (110, 98, 80))
    front = corners[2:]
    sheet.draw.line([sheet.at(x, z) for x, z in front.tolist()], fill=(90, 70, 50), width=3)


def _draw_walls(sheet: _Sheet, scene: Scene) -> None:
    for panel in scene.panels:
        sheet.draw.line([sheet.at(*panel.start), sheet.at(*panel.end)], fill=WALL_RGB, width=5)


def _draw_opening(sheet: _Sheet, thing: Thing) -> None:
    sheet.polygon(
        floor_corners(whole_box(thing)), WINDOW_RGB if thing.category == "Window" else (255, 255, 255), WALL_RGB
    )
    for leaf in moving_prisms_of(thing):
        sheet.polygon(leaf.polygon, DOOR_RGB, None)


def _draw_start(sheet: _Sheet, house: House) -> None:
    start = house.start
    if start is None:
        return
    (x, _, z), (dx, dz) = start.position, heading(start.rotation)
    sheet.draw.line([sheet.at(x, z), sheet.at(x + 0.45 * dx, z + 0.45 * dz)], fill=START_RGB, width=3)
    px, py = sheet.at(x, z)
    radius = 0.2 * sheet.scale
    sheet.draw.ellipse((px - radius, py - radius, px + radius, py + radius), outline=START_RGB, width=2)
