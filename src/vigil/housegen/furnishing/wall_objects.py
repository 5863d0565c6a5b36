"""Hanging objects: switches, paintings, mirrors, shelves, cabinets, towels, curtains, blinds and ceiling lamps."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from shapely import box

from vigil.assets.kernel.pictures import KINDS, Drawing
from vigil.base.geometry import Vec3
from vigil.housegen.base.models import AssetModel, PlacedObject, draw_model, most_similar
from vigil.housegen.base.randomness import chance, pick, shuffled
from vigil.housegen.furnishing.floor import Floor, rect_of
from vigil.housegen.furnishing.inventory import Inventory
from vigil.housegen.furnishing.occupancy import Occupancy
from vigil.housegen.layout.walls import WallPiece

NEAR_WALL = 0.3
"""Furniture covers a wall up to its own height if its back is at most this far (m) from the wall."""
IN_WALL_M = 0.05
"""Furniture whose back is more than this (m) behind a wall's surface stands at another wall."""
SIDE_GAP = 0.06
"""Distance (m) kept free at the sides of a hanging object."""
ABOVE_GAP = 0.12
"""Distance (m) kept free between furniture and an object that hangs above it."""
SILL_M = 0.08
"""How far (m) a window's frame reaches into the room."""
BELOW_BLINDS_M = 0.5
"""Height (m) of the space below blinds that must be free of objects."""
BUMP_M = 0.06
"""An object that reaches at most this far (m) out of the wall does not take up floor."""
OVERHEAD_M = 1.8
"""An object whose bottom is at least at this height (m) does not take up floor."""
ON_LINE_M = 1e-6
"""Two parallel walls that are at most this far (m) apart count as one wall."""
EDGE_M = 0.01
"""Tolerance (m) in the checks that an opening is in a wall and that an object is over furniture."""
FRAME_M = 0.1
"""Distance (m) kept free around doors and windows."""
UNDER_CEILING_M = 0.1
"""Distance (m) kept free between the ceiling and objects that hang on a wall."""
PLACES_TRIED = 5
"""Number of random places along a wall that are tried after the wall's middle."""
PAINTINGS = {"Kitchen": (1, 3), "LivingRoom": (2, 5), "Bedroom": (2, 4), "Bathroom": (0, 2)}
"""Kind of room -> least and greatest number of its paintings."""
PAINTINGS_DRAWN = 4
"""Number of random paintings from which one with a new subject is chosen."""
SHELF_PROBABILITY = {"LivingRoom": 0.35, "Bedroom": 0.35, "Bathroom": 0.5}
BEDROOM_MIRROR_PROBABILITY, CEILING_LAMP_PROBABILITY, SHOWER_HEAD_PROBABILITY, TOWEL_PROBABILITY = 0.5, 0.85, 0.8, 0.85
WINDOW_DRESSING_PROBABILITY = {"Bedroom": 0.65, "LivingRoom": 0.55, "Kitchen": 0.25, "Bathroom": 0.25}
"""Probability that a window has curtains or blinds."""
DRY_ROOM_BLINDS_PROBABILITY = 0.4
"""Probability of blinds instead of curtains in living rooms and bedrooms; other rooms only have blinds."""
SWITCH_MIDDLE_M, MIRROR_MIDDLE_M, PAPER_MIDDLE_M, BATHROOM_SHELF_MIDDLE_M = 1.2, 1.5, 0.72, 1.35
"""Heights (m) above the floor of the middles of switches, mirrors, paper holders and bathroom shelves."""
SHELF_MIDDLE_M, PAINTING_MIDDLE_M = (1.25, 1.5), (1.5, 1.65)
"""Heights (m) above the floor, least and greatest, of the middle of a shelf and of a painting."""
RAILS = (("TowelHolder", "Towel", 1.35), ("HandTowelHolder", "HandTowel", 1.3))
"""Rows of (category of a rail, category of the towel that hangs over it, height (m) of the rail's middle)."""
CABINET_BOTTOM_M, SHOWER_HEAD_TOP_M, LAMP_BOTTOM_M = 1.42, 2.15, 1.95
"""Heights (m) above the floor of a cabinet's bottom, of a shower head's top and, at least, of a lamp's bottom."""
SWITCH_ASIDE_M = 0.25
"""Distance (m) from the edge of a door's hole to the middle of the light switch next to it."""
MIRROR_ABOVE_M = 0.06
"""How far (m) the lower edge of a mirror is above the space that is kept free above a sink (ABOVE_GAP)."""
BESIDE_GAP_M = 0.12
"""Distance (m) between furniture and an object that hangs next to it."""
CABINETS_UNDER_CEILING_M, DRESSING_UNDER_CEILING_M = 0.15, 0.05
"""Distances (m) kept free between the ceiling and cabinets, and between the ceiling and curtains or blinds."""
CABINET_WIDER_M = 0.02
"""How much (m) a cabinet may be wider than the counter below it."""
TOUCH_M = 0.02
"""Two objects with a vertical gap smaller than this (m) are in each other's way."""
OFF_WALL_M, OFF_RAIL_M = 0.002, 0.003
"""Gaps (m) behind objects on walls, and behind objects over rails, so that surfaces do not touch."""
SAME_YAW_DEG = 1.0
"""A wall is behind furniture only if their yaws differ by less than this (deg)."""
BACK_REACH_M = 0.9
"""A wall is behind furniture only if it is less than this (m) from the furniture's middle."""
WINDOW_ABOVE_M, WINDOW_WIDER_M = 0.12, 0.05
"""How far (m) curtains and blinds reach beyond their window: above it, and on each side."""
FLOOR_LENGTH_M = 0.08
"""Curtains that end below this height (m) are made to reach the floor; loading the house would lower them anyway."""

NARROW_ON_WALL = frozenset({"Faucet"})
"""Categories that stand on furniture and block the wall behind them only in their own width."""


class Span(NamedTuple):
    """A rectangle (m) on a wall that an object covers or needs."""

    left: float
    right: float
    bottom: float
    top: float
    gap: float = 0.0
    """Distance (m) from the wall at which the object begins; a flatter object can hang behind it."""


class WallObjectPlacer:
    """Chooses and places the hanging objects of one room."""

    def __init__(
        self,
        floor: Floor,
        furniture: list[PlacedObject],
        height_m: float,
        inventory: Inventory,
        rng: np.random.Generator,
    ) -> None:
        self.floor = floor
        self.furniture = furniture
        self.height_m = height_m
        self.inventory = inventory
        self.rng = rng
        self.hung: list[PlacedObject] = []
        self.occupancy = Occupancy(floor, furniture)
        self._spans: list[list[Span]] = [self._taken_spans(edge) for edge in floor.edges]

    def hang(self) -> list[PlacedObject]:
        """Hang objects in the room and return them."""
        kind = self.floor.room.kind
        self._hang_switch()
        if kind == "Bathroom":
            self._equip_bathroom()
        if kind == "Kitchen":
            self._hang_cabinets()
        self._dress_windows()
        if kind in ("LivingRoom", "Bedroom") and chance(self.rng, SHELF_PROBABILITY[kind]):
            self._hang_anywhere("Shelf", float(self.rng.uniform(*SHELF_MIDDLE_M)))
        if kind == "Bedroom" and chance(self.rng, BEDROOM_MIRROR_PROBABILITY):
            self._hang_anywhere("Mirror", MIRROR_MIDDLE_M)
        low, high = PAINTINGS[kind]
        for _ in range(int(self.rng.integers(low, high + 1))):
            self._hang_on_some_wall(self._painting(), float(self.rng.uniform(*PAINTING_MIDDLE_M)))
        if chance(self.rng, CEILING_LAMP_PROBABILITY):
            self._hang_ceiling_lamp()
        return self.hung

    def _taken_spans(self, edge: WallPiece) -> list[Span]:
        spans: list[Span] = []
        for opening in self.floor.openings:
            wall, left, right = self.floor.holes[opening.id]
            if abs(edge.into(wall.start)) > ON_LINE_M or abs(wall.direction[0] - edge.direction[0]) > ON_LINE_M:
                continue
            ends = sorted((edge.along(wall.at(left)), edge.along(wall.at(right))))
            if ends[1] > -EDGE_M and ends[0] < edge.length + EDGE_M:
                bottom, top = opening.bottom - FRAME_M, opening.top + FRAME_M
                spans.append(Span(ends[0] - FRAME_M, ends[1] + FRAME_M, bottom, top))
        for piece in self.furniture:
            spans.extend(self._covered_spans(edge, piece))
        return spans

    def _covered_spans(self, edge: WallPiece, piece: PlacedObject) -> list[Span]:
        """Return the spans of a wall that a piece of furniture covers, and those that the objects on it cover."""
        along, depths = _extent(edge, piece)
        if not -IN_WALL_M <= min(depths) <= NEAR_WALL or max(along) < 0 or min(along) > edge.length:
            return []
        spans = []
        for found in piece.with_contents():
            is_slim = found.category in NARROW_ON_WALL
            wide, off_wall = _extent(edge, found) if is_slim else (along, [0.0])
            spans.append(Span(min(wide), max(wide), found.bottom - TOUCH_M, found.top, min(off_wall)))
        return spans

    def _is_free(self, index: int, span: Span, depth: float) -> bool:
        """Return whether a span of a wall is free for an object that reaches `depth` metres into the room."""
        edge = self.floor.edges[index]
        if span.left < SIDE_GAP or span.right > edge.length - SIDE_GAP or span.top > self.height_m - UNDER_CEILING_M:
            return False
        return all(
            span.right + SIDE_GAP <= taken.left
            or span.left - SIDE_GAP >= taken.right
            or span.bottom >= taken.top + ABOVE_GAP
            or span.top + SIDE_GAP <= taken.bottom
            or depth < taken.gap
            for taken in self._spans[index]
        )

    def _hang(
        self, model: AssetModel, index: int, along: float, middle: float, draped: AssetModel | None = None
    ) -> PlacedObject | None:
        """Hang an object on wall `index` and return it; None if it does not fit.

        `along` and `middle` (m) are the position of the object's middle along the wall and above the floor. `draped` is
        the model of an object that will hang over this one, such as a towel over a rail.
        """
        size = model.size
        drop = size.y / 2 if draped is None else max(size.y / 2, draped.size.y - size.y / 2)
        span = Span(along - size.x / 2, along + size.x / 2, middle - drop, middle + size.y / 2)
        edge, depth = self.floor.edges[index], size.z + (draped.size.z if draped else 0.0)
        if not self._is_free(index, span, depth + OFF_WALL_M) or not self.inventory.may_have(model.category):
            return None
        bump = rect_of(edge.at(span.left), edge.at(span.right, depth))
        x, z = edge.at(along, size.z / 2 + OFF_WALL_M)
        piece = PlacedObject(model, Vec3(x, middle, z), edge.yaw, self.floor.room.number, is_on_wall=True)
        if not self.occupancy.has_room_for(piece) or not self._leaves_room(bump, depth, span.bottom):
            return None
        self._spans[index].append(span)
        self._add(piece)
        return piece

    def _add(self, piece: PlacedObject) -> None:
        self.inventory[piece.category] += 1
        self.hung.append(piece)
        self.occupancy.add(piece)

    def _leaves_room(self, bump: tuple[float, float, float, float], depth: float, bottom: float) -> bool:
        """Return whether there is still room to walk if an object reaches `depth` metres out of the wall.

        If there is, mark the floor under the object as taken.
        """
        if depth <= BUMP_M or bottom >= OVERHEAD_M:
            return True
        shape = box(*bump)
        if any(shape.intersects(box(*rect)) for rect in self.floor.clear):
            return False
        is_over = any(box(*rect).buffer(EDGE_M).contains(shape) for rect in self.floor.taken)
        if not is_over:
            if not self.floor.can_walk([bump], []):
                return False
            self.floor.taken.append(bump)
        return True

    def _hang_anywhere(self, category: str, middle: float) -> PlacedObject | None:
        return self._hang_on_some_wall(draw_model(category, self.rng), middle)

    def _hang_on_some_wall(
        self, model: AssetModel, middle: float, draped: AssetModel | None = None
    ) -> PlacedObject | None:
        if not self.inventory.may_have(model.category):
            return None
        for index in shuffled(self.rng, range(len(self.floor.edges))):
            edge = self.floor.edges[index]
            low, high = model.size.x / 2 + SIDE_GAP, edge.length - model.size.x / 2 - SIDE_GAP
            if high <= low:
                continue
            for along in [edge.length / 2, *self.rng.uniform(low, high, PLACES_TRIED)]:
                piece = self._hang(model, index, float(along), middle, draped)
                if piece is not None:
                    return piece
        return None

    def _painting(self) -> AssetModel:
        """Return a painting whose subject no other painting in the room has, if one is found."""
        shown = {_subject(piece.model) for piece in self.hung if piece.category == "Painting"}
        models = (draw_model("Painting", self.rng) for _ in range(PAINTINGS_DRAWN))
        return next((model for model in models if _subject(model) not in shown), draw_model("Painting", self.rng))

    def _hang_switch(self) -> None:
        """Hang a light switch on a wall next to one of the room's doors."""
        doors = [opening for opening in self.floor.openings if opening.is_door]
        model = draw_model("LightSwitch", self.rng)
        for door in shuffled(self.rng, doors):
            wall, left, right = self.floor.holes[door.id]
            for at in shuffled(self.rng, (left - SWITCH_ASIDE_M, right + SWITCH_ASIDE_M)):
                point = wall.at(at)
                for index, edge in enumerate(self.floor.edges):
                    (dx, dz), (other_dx, other_dz) = edge.direction, wall.direction
                    is_same = abs(dx - other_dx) + abs(dz - other_dz) < ON_LINE_M
                    is_on_line = is_same and abs(edge.into(point)) < ON_LINE_M
                    if is_on_line and self._hang(model, index, edge.along(point), SWITCH_MIDDLE_M):
                        return

    def _equip_bathroom(self) -> None:
        sink = next((p for top in self.furniture for p in top.with_contents() if p.category == "Sink"), None)
        if sink is not None:
            mirror = draw_model("Mirror", self.rng)
            self._hang_behind(sink, mirror, sink.top + ABOVE_GAP + MIRROR_ABOVE_M + mirror.size.y / 2)
            if chance(self.rng, SHELF_PROBABILITY["Bathroom"]):
                self._hang_anywhere("Shelf", BATHROOM_SHELF_MIDDLE_M)
        toilet = next((piece for piece in self.furniture if piece.category == "Toilet"), None)
        if toilet is not None:
            self._hang_beside(toilet, draw_model("ToiletPaperHanger", self.rng), PAPER_MIDDLE_M)
        tub = next((piece for piece in self.furniture if piece.category == "Bathtub"), None)
        if tub is not None and chance(self.rng, SHOWER_HEAD_PROBABILITY):
            model = draw_model("ShowerHead", self.rng)
            self._hang_behind(tub, model, SHOWER_HEAD_TOP_M - model.size.y / 2)
        for holder, towel, middle in RAILS:
            if chance(self.rng, TOWEL_PROBABILITY):
                self._hang_towel(holder, towel, middle)

    def _hang_towel(self, holder: str, towel: str, middle: float) -> None:
        """Hang a towel rail with a towel over it."""
        rail_model, model = draw_model(holder, self.rng), draw_model(towel, self.rng)
        if not self.inventory.may_have(towel):
            return
        rail = self._hang_on_some_wall(rail_model, middle, model)
        if rail is None:
            return
        x, z = rail.to_floor_point(0.0, rail.model.size.z / 2 + model.size.z / 2 + OFF_RAIL_M)
        cloth = PlacedObject(model, Vec3(x, rail.top - model.size.y / 2, z), rail.yaw, rail.room, is_on_wall=True)
        rail.children.append(cloth)
        self.inventory[towel] += 1

    def _hang_behind(
        self, piece: PlacedObject, model: AssetModel, middle: float, aside: float = 0.0
    ) -> PlacedObject | None:
        """Hang an object on the wall behind `piece`, `aside` metres from the middle of `piece`. None if it cannot hang
        there."""
        wall = next(self._walls_behind(piece), None)
        return None if wall is None else self._hang(model, wall[0], wall[1] + aside, middle)

    def _walls_behind(self, piece: PlacedObject) -> Iterator[tuple[int, float]]:
        """Yield (index of a wall behind a piece, place of the piece's middle along this wall in metres)."""
        place = piece.position.x, piece.position.z
        for index, edge in enumerate(self.floor.edges):
            is_near = 0 < edge.into(place) < BACK_REACH_M and 0 < edge.along(place) < edge.length
            if is_near and abs(edge.yaw - piece.yaw) < SAME_YAW_DEG:
                yield index, edge.along(place)

    def _hang_beside(self, piece: PlacedObject, model: AssetModel, middle: float) -> PlacedObject | None:
        """Hang an object on the wall behind `piece`, next to `piece`; return None if it does not fit."""
        away = piece.model.size.x / 2 + model.size.x / 2 + BESIDE_GAP_M
        for index, along in self._walls_behind(piece):
            for sign in shuffled(self.rng, (-1, 1)):
                hung = self._hang(model, index, along + sign * away, middle)
                if hung is not None:
                    return hung
        return None

    def _hang_cabinets(self) -> None:
        """Hang one or two cabinets above counters."""
        counters = [piece for piece in self.furniture if piece.category == "CounterTop"]
        if not counters:
            return
        model = most_similar(counters[0].model, [draw_model("Cabinet", self.rng) for _ in range(8)])
        middle = CABINET_BOTTOM_M + model.size.y / 2
        for counter in shuffled(self.rng, counters)[: pick(self.rng, (1, 2, 2))]:
            has_height = middle + model.size.y / 2 < self.height_m - CABINETS_UNDER_CEILING_M
            spare = counter.model.size.x - model.size.x
            if not has_height or spare < -CABINET_WIDER_M:
                continue
            for aside in (0.0, *shuffled(self.rng, (-spare / 2, spare / 2))):
                if self._hang_behind(counter, model, middle, aside) is not None:
                    break

    def _dress_windows(self) -> None:
        for opening in self.floor.openings:
            kind = self.floor.room.kind
            if opening.is_door or not chance(self.rng, WINDOW_DRESSING_PROBABILITY[kind]):
                continue
            has_blinds = kind in ("Kitchen", "Bathroom") or chance(self.rng, DRY_ROOM_BLINDS_PROBABILITY)
            category = "Blinds" if has_blinds else "Curtains"
            model = draw_model(category, self.rng)
            wall, left, right = self.floor.holes[opening.id]
            if model.size.x < right - left + WINDOW_WIDER_M or not self.inventory.may_have(category):
                continue
            bottom = opening.top + WINDOW_ABOVE_M - model.size.y
            bottom = 0.0 if bottom < FLOOR_LENGTH_M else bottom
            self._hang_dressing(wall, (left + right) / 2, bottom + model.size.y / 2, model)

    def _hang_dressing(self, wall: WallPiece, along: float, middle: float, model: AssetModel) -> None:
        """Hang curtains or blinds in front of a window if nothing else is there."""
        x, z = wall.at(along, model.size.z / 2 + SILL_M)
        piece = PlacedObject(model, Vec3(x, middle, z), wall.yaw, self.floor.room.number, is_on_wall=True)
        shape = box(*piece.footprint())
        low = piece.bottom - (0.0 if model.category == "Curtains" else BELOW_BLINDS_M)
        in_way = any(
            found.top > low - TOUCH_M and shape.intersects(box(*found.footprint()))
            for top in [*self.furniture, *self.hung]
            for found in top.with_contents()
        )
        if (
            in_way
            or not self.floor.room.polygon.contains(shape)
            or any(shape.intersects(box(*rect)) for rect in self.floor.clear)
            or piece.top > self.height_m - DRESSING_UNDER_CEILING_M
            or not self.occupancy.has_room_for(piece)
            or not self.floor.can_walk([piece.footprint()], [])
        ):
            return
        self.floor.taken.append(piece.footprint())
        self._spans = [
            [*spans, *self._covered_spans(edge, piece)]
            for edge, spans in zip(self.floor.edges, self._spans, strict=True)
        ]
        self._add(piece)

    def _hang_ceiling_lamp(self) -> None:
        middle = self.floor.room.middle
        model = draw_model("CeilingLamp", self.rng)
        if self.height_m - model.size.y >= LAMP_BOTTOM_M:
            place = Vec3(round(middle.x, 3), self.height_m - model.size.y / 2, round(middle.y, 3))
            self._add(PlacedObject(model, place, 0.0, self.floor.room.number, is_on_wall=True))


def _subject(painting: AssetModel) -> Drawing:
    """Return the function that draws a painting's picture; paintings with the same function have the same subject."""
    materials = [part.material.partition("/") for part in painting.asset.parts]
    return next(KINDS[kind][number] for kind, _, number in materials if kind == "picture")


def _extent(edge: WallPiece, piece: PlacedObject) -> tuple[list[float], list[float]]:
    """Return the corners of a piece's footprint as distances (m) along a wall, and as distances away from the wall."""
    x0, z0, x1, z1 = piece.footprint()
    corners = [(x0, z0), (x0, z1), (x1, z0), (x1, z1)]
    return [edge.along(corner) for corner in corners], [edge.into(corner) for corner in corners]
