"""A labelled floor plan of any house, seen from above, for documents and inspection."""

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from vigil.base.geometry import heading
from vigil.protocol.house import House
from vigil.scene.plan import FloorPlan, PlanOpening, PlanThing, floor_plan
from vigil.scene.things import Scene

MARGIN_M = 0.6
LABEL_PX = 14
ROOM_LABEL_PX = 18
EDGE_PX = 2
"""Width (px) of the white edge around a label, which separates it from dots and lines below it."""
LABEL_SHIFTS = (0, 16, -16, 32, -32)
"""Offsets (px down) that are tried for a label when another one is in its place."""
GUTTER_PX = 12
BOX_CORNERS = 4
WALL_PX = 5
NOSE_M, START_RADIUS_M = 0.45, 0.2
"""Sizes of the mark at the start: the line in the direction of view, and the circle."""
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
FURNITURE_LINE_RGB = (110, 98, 80)
FRONT_RGB = (90, 70, 50)
HUNG_RGB = (150, 150, 150)
RUG_RGB = (232, 214, 220)
SMALL_RGB = (200, 60, 60)
START_RGB = (40, 120, 60)
TEXT_RGB = (20, 20, 24)
LABEL_EDGE_RGB = (255, 255, 255)
ROOM_TEXT_RGB = (120, 120, 135)


class PlanDrawing:
    """An image of a plan, with north (+z) up, to draw on."""

    def __init__(self, plan: FloorPlan, pixels_per_m: float, ground: tuple[int, int, int] = (255, 255, 255)) -> None:
        low, high = plan.bounds
        self.low, self.high = low - MARGIN_M, high + MARGIN_M
        self.scale = pixels_per_m
        width, height = np.ceil((self.high - self.low) * pixels_per_m).astype(int)
        self.image = Image.new("RGB", (int(width), int(height)), ground)
        self.draw = ImageDraw.Draw(self.image, "RGBA")
        self.font = ImageFont.load_default(LABEL_PX)
        self.room_font = ImageFont.load_default(ROOM_LABEL_PX)
        self._label_boxes: list[tuple[float, float, float, float]] = []

    def at(self, x: float, z: float) -> tuple[int, int]:
        """Return the pixel (x right, y down) of a floor point."""
        return round((x - self.low[0]) * self.scale), round((self.high[1] - z) * self.scale)

    def draw_contents(self, plan: FloorPlan) -> None:
        """Draw floors, furniture, walls, openings and small objects, without labels."""
        for room in plan.rooms:
            self.polygon(room.corners, FLOOR_RGB.get(room.room_type, OTHER_FLOOR_RGB), None)
        for thing in plan.things:
            _draw_thing(self, thing)
        for start, end in plan.walls:
            self.draw.line([self.at(*start), self.at(*end)], fill=WALL_RGB, width=WALL_PX)
        for opening in plan.openings:
            _draw_opening(self, opening)
        for _, x, z in plan.small:
            px, py = self.at(x, z)
            self.draw.ellipse((px - 2.5, py - 2.5, px + 2.5, py + 2.5), fill=SMALL_RGB)

    def polygon(self, corners: np.ndarray, fill: tuple[int, int, int], line: tuple[int, int, int] | None) -> None:
        """Fill a polygon of floor points."""
        self.draw.polygon([self.at(x, z) for x, z in corners.tolist()], fill=fill, outline=line)

    def label(self, x: float, z: float, text: str) -> None:
        """Write a text with its middle at or near a floor point, or nothing if other texts leave no room."""
        px, py = self.at(x, z)
        for shift in LABEL_SHIFTS:
            left, top, right, bottom = self.draw.textbbox((px, py + shift), text, font=self.font, anchor="mm")
            into = max(0.0, 2 - left) - max(0.0, right + 2 - self.image.width)
            box = (left + into, top, right + into, bottom)
            if all(
                box[2] < old[0] or box[0] > old[2] or box[3] < old[1] or box[1] > old[3] for old in self._label_boxes
            ):
                self.draw.text(
                    (px + into, py + shift), text, fill=TEXT_RGB, font=self.font, anchor="mm",
                    stroke_width=EDGE_PX, stroke_fill=LABEL_EDGE_RGB,
                )  # fmt: skip
                self._label_boxes.append(box)
                return

    def room_label(self, x: float, z: float, text: str) -> None:
        """Write the name of a room with its middle at a floor point."""
        self.draw.text(self.at(x, z), text, fill=ROOM_TEXT_RGB, font=self.room_font, anchor="mm", align="center")
        box = self.draw.textbbox(self.at(x, z), text, font=self.room_font, anchor="mm")
        self._label_boxes.append(box)


def draw_plan(house: House, scene: Scene, pixels_per_m: float = 100) -> Image.Image:
    """Return the plan of a house as an image: rooms, furniture, small objects, doors with their leaves, the start."""
    plan = floor_plan(house, scene.things.values())
    sheet = PlanDrawing(plan, pixels_per_m)
    sheet.draw_contents(plan)
    for room in plan.rooms:
        sheet.room_label(*room.name_at, f"{room.name}\n{room.area_m2:.0f} m2")
    for thing in plan.labelled:
        sheet.label(*thing.middle, thing.label)
    _draw_start(sheet, house)
    return sheet.image


def side_by_side(plan: Image.Image, view: np.ndarray) -> Image.Image:
    """Return the plan with an image (height, width, 3) of the same house to its right, as high as the plan."""
    picture = Image.fromarray(view)
    width = round(picture.width * plan.height / picture.height)
    scaled = picture.resize((width, plan.height), Image.Resampling.LANCZOS)
    both = Image.new("RGB", (plan.width + GUTTER_PX + width, plan.height), (255, 255, 255))
    both.paste(plan, (0, 0))
    both.paste(scaled, (plan.width + GUTTER_PX, 0))
    return both


def _draw_thing(sheet: PlanDrawing, thing: PlanThing) -> None:
    if thing.kind == "hung":
        sheet.draw.polygon([sheet.at(x, z) for x, z in thing.corners.tolist()], outline=HUNG_RGB)
        return
    sheet.polygon(thing.corners, RUG_RGB if thing.kind == "rug" else FURNITURE_RGB, FURNITURE_LINE_RGB)
    if len(thing.corners) == BOX_CORNERS:
        front = thing.corners[2:]
        sheet.draw.line([sheet.at(x, z) for x, z in front.tolist()], fill=FRONT_RGB, width=3)


def _draw_opening(sheet: PlanDrawing, opening: PlanOpening) -> None:
    sheet.polygon(opening.corners, WINDOW_RGB if opening.is_window else (255, 255, 255), WALL_RGB)
    for leaf in opening.leaves:
        sheet.polygon(leaf, DOOR_RGB, None)


def _draw_start(sheet: PlanDrawing, house: House) -> None:
    start = house.start
    if start is None:
        return
    (x, _, z), (dx, dz) = start.position, heading(start.rotation)
    sheet.draw.line([sheet.at(x, z), sheet.at(x + NOSE_M * dx, z + NOSE_M * dz)], fill=START_RGB, width=3)
    px, py = sheet.at(x, z)
    radius = START_RADIUS_M * sheet.scale
    sheet.draw.ellipse((px - radius, py - radius, px + radius, py + radius), outline=START_RGB, width=2)
