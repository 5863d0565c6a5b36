"""Floor plans as images, for documents, films and inspection."""

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from vigil.base.geometry import heading
from vigil.protocol.house import House
from vigil.scene.plan import FloorPlan, floor_plan
from vigil.scene.things import Scene

Colour = tuple[int, int, int]
LABEL_PX = 15
"""Height (px) of letters."""
EDGE_PX = 2
"""Width (px) of the white edge around the letters of a label, which separates them from dots and lines behind them."""
DOT_PX = 2.5
"""Radius (px) of the dot for a small object."""
GUTTER_PX = 12
NOSE_M, START_RADIUS_M = 0.45, 0.2
"""Sizes (m) of the mark at the agent's start: length of the line in the view direction, radius of the circle."""
WHITE: Colour = (255, 255, 255)
START_RGB: Colour = (40, 120, 60)
_WALL_RGB, _FURNITURE_LINE_RGB = (60, 60, 66), (110, 98, 80)
STYLES: dict[str, tuple[Colour | None, Colour | None, int]] = {
    "room-Kitchen": ((252, 240, 214), None, 0),
    "room-LivingRoom": ((229, 240, 222), None, 0),
    "room-Bedroom": ((224, 233, 246), None, 0),
    "room-Bathroom": ((218, 241, 243), None, 0),
    "rug": ((232, 214, 220), _FURNITURE_LINE_RGB, 1),
    "thing": ((205, 190, 168), _FURNITURE_LINE_RGB, 1),
    "hung": (None, (150, 150, 150), 1),
    "front": (None, (90, 70, 50), 3),
    "wall": (None, _WALL_RGB, 5),
    "door": (WHITE, _WALL_RGB, 1),
    "window": ((90, 160, 220), _WALL_RGB, 1),
    "leaf": ((190, 110, 40), None, 0),
    "small": ((200, 60, 60), None, 0),
}
"""Fill colour, line colour and line width (px) of a shape, by the last word of the shape's kind."""
OTHER_ROOM = ((238, 238, 238), None, 0)
TEXT_RGB: dict[str, Colour] = {"label": (20, 20, 24), "room-name": (105, 105, 125)}
"""Colour of a label, by the label's kind."""


class PlanImage:
    """An image of a plan with north (+z) up; callers can draw on it."""

    def __init__(self, plan: FloorPlan, pixels_per_m: float, ground: Colour = WHITE) -> None:
        """Draw a plan without its labels on a background of colour `ground`."""
        (self._left, low), (right, self._top) = plan.bounds
        self.scale = pixels_per_m
        size = int(np.ceil((right - self._left) * pixels_per_m)), int(np.ceil((self._top - low) * pixels_per_m))
        self.image = Image.new("RGB", size, ground)
        self.draw = ImageDraw.Draw(self.image, "RGBA")
        for shape in plan.shapes:
            fill, line, width = STYLES.get(shape.kind.split()[-1], OTHER_ROOM)
            points = [self.at(x, z) for x, z in shape.points.tolist()]
            if len(points) == 1:
                self.draw.circle(points[0], DOT_PX, fill)
            elif len(points) == 2:
                self.draw.line(points, line, width)
            else:
                self.draw.polygon(points, fill, line, width)

    def at(self, x: float, z: float) -> tuple[int, int]:
        """Return the pixel (x to the right, y down) of a point on the floor."""
        return round((x - self._left) * self.scale), round((self._top - z) * self.scale)


def draw_plan(house: House, scene: Scene, pixels_per_m: float = 100) -> Image.Image:
    """Return an image of a house's plan: rooms, furniture, small objects, doors with leaves, and the agent's start."""
    plan = floor_plan(house, scene.things.values())
    sheet, font = PlanImage(plan, pixels_per_m), ImageFont.load_default(LABEL_PX)
    for label in plan.labels(LABEL_PX / pixels_per_m, detailed=True):
        sheet.draw.text(
            sheet.at(label.x, label.z), label.text, TEXT_RGB[label.kind], font, "mm",
            stroke_width=EDGE_PX, stroke_fill=WHITE,
        )  # fmt: skip
    if house.start is not None:
        (x, _, z), (dx, dz) = house.start.position, heading(house.start.rotation)
        sheet.draw.line([sheet.at(x, z), sheet.at(x + NOSE_M * dx, z + NOSE_M * dz)], START_RGB, 3)
        sheet.draw.circle(sheet.at(x, z), START_RADIUS_M * pixels_per_m, outline=START_RGB, width=2)
    return sheet.image


def plan_and_view(plan: Image.Image, view: np.ndarray) -> Image.Image:
    """Return one image with the plan on the left and `view` (height, width, 3) on the right, scaled to the plan's
    height."""
    picture = Image.fromarray(view)
    width = round(picture.width * plan.height / picture.height)
    scaled = picture.resize((width, plan.height), Image.Resampling.LANCZOS)
    both = Image.new("RGB", (plan.width + GUTTER_PX + width, plan.height), WHITE)
    both.paste(plan, (0, 0))
    both.paste(scaled, (plan.width + GUTTER_PX, 0))
    return both
