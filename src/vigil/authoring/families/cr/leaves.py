"""Drafts with an open leaf (door, lid or drawer) in the way (CR `leaf`): it blocks the only way until it is closed.

In most houses, few leaves do this. So furniture that cannot be carried may be put next to a leaf.
"""

from collections.abc import Iterator
from itertools import islice
from typing import Any

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from vigil.authoring.drafting.house_context import HouseContext
from vigil.authoring.drafting.proposals import Drafts, acts_for, is_in_view, is_target, setup_for, shows_px
from vigil.authoring.families.cr.drafts import (
    FACING_SPREAD_DEG,
    PartialTask,
    drafts_of_task,
    floor_placement,
    footprints_at,
)
from vigil.base.geometry import Pose
from vigil.protocol.family import DEFAULT_HORIZON_DEG
from vigil.protocol.goals import Constraint
from vigil.protocol.world import ObjectSetup, Placement, Setup
from vigil.scene.floor import is_cut_off
from vigil.scene.geometry import body_box
from vigil.scene.outlines import BODY_RADIUS_M, thing_shapes
from vigil.scene.things import Thing

LEAVES = ("Doorway", "Fridge", "Cabinet", "WashingMachine", "ClothesDryer", "Drawer", "Safe", "Stove")
LIGHT_FURNITURE = ("Chair", "Stool", "GarbageCan", "LaundryHamper", "HousePlant", "VacuumCleaner")
HEAVY_FURNITURE = ("Ottoman", "FloorLamp", "RoomDecor", "Cart", "ArmChair", "DogBed", "SideTable", "CoffeeTable")
"""Categories of furniture that cannot be carried, and that may be put next to an open leaf in the same room."""
MIN_ROOM_M2 = 0.2
"""Area (m2) below which a separate part of the free floor is ignored."""
GAP_M = 2 * BODY_RADIUS_M
"""Minimum width (m) of a gap through which the agent's body can pass."""
AROUND_M, STEP_M = 1.0, 0.12
"""Furniture is put at most this far (m) from the floor that a leaf sweeps; step (m) of the grid of tried places."""
TRIED_PLACES, TRIED_FURNITURE, MAX_SETUPS = 400, 4, 2
TRIED_TARGETS, TRIED_STARTS, MIN_VISIBLE_POINTS = 10, 24, 6
AWAY_M = (1.6, 6.0)
"""Minimum and maximum distance (m) from the target to the start."""
HEADINGS_DEG = (0.0, 90.0)
"""Headings (deg) that are tried for furniture next to a leaf."""
LEAF_PX = 8000
"""Minimum number of visible pixels of the leaf at the start. It is large so that it is clear which leaf is meant."""


def leaf_in_the_way(context: HouseContext) -> Drafts:
    """Yield drafts in which an open leaf blocks the only way to the target. The target is visible at the start."""
    for leaf in context.things(lambda thing: thing.is_openable and thing.category in LEAVES):
        for setup in islice(_blocking_setups(context, leaf), MAX_SETUPS):
            for target in context.things(lambda thing: is_target(thing) and bool(acts_for(thing)))[:TRIED_TARGETS]:
                act = acts_for(target)[int(context.rng.integers(len(acts_for(target))))]
                asked = Setup(objects={**setup_for(target, act).objects, **setup.objects})
                start = _start_behind(context, target, leaf, asked) if target.id not in setup.objects else None
                if start is not None:
                    constraint = Constraint(kind="object_closed", object_id=leaf.id, latched=True)
                    yield from drafts_of_task(context, PartialTask("leaf", asked, target, act, constraint), start)
                    break


def _blocking_setups(context: HouseContext, leaf: Thing) -> Iterator[Setup]:
    """Yield setups in which the free floor is split into parts when a leaf is open, but not when it is closed."""
    opened = {leaf.id: ObjectSetup(openness=1.0)}
    if not context.can_begin(Setup(objects=opened)):
        return
    shut = _LeafFloor(context, leaf, 0.0)
    open_ = _LeafFloor(context, leaf, 1.0)
    if _is_split(open_.free, shut.free):
        yield Setup(objects=opened)
    swung = open_.shape.difference(shut.shape)
    if swung.is_empty:
        return
    furniture = context.things(lambda thing: _may_stand_by(context, leaf, thing) and _is_alone(context, thing))
    for thing in furniture[:TRIED_FURNITURE]:
        for spot, shape in _tight_spots(context, thing, swung, open_, shut):
            grown = shape.buffer(BODY_RADIUS_M)
            if _is_split(open_.free.difference(grown), shut.free.difference(grown)):
                yield Setup(objects={**opened, thing.id: ObjectSetup(placement=spot)})
                break


def _tight_spots(
    context: HouseContext, thing: Thing, swung: BaseGeometry, open_: "_LeafFloor", shut: "_LeafFloor"
) -> Iterator[tuple[Placement, BaseGeometry]]:
    """Yield, in a random order, placements of furniture next to an open leaf, each with the outline of the furniture.

    The gaps that remain are too narrow to walk through. `swung` is the floor that the leaf covers only when it is open.
    """
    places = _places(context, swung)
    shapes: Any = np.empty(len(places), dtype=object)
    for yaw in HEADINGS_DEG:
        chosen = places[:, 2] == yaw
        shapes[chosen] = footprints_at(thing, places[chosen, :2], yaw)
    left = np.flatnonzero(shapely.distance(shapes, swung) < GAP_M)
    left = left[shapely.distance(shapes[left], shut.bare.boundary) < GAP_M]
    for index in left[shapely.covers(open_.bare, shapes[left])].tolist():
        x, z, yaw = places[index].tolist()
        yield floor_placement(thing, x, z, yaw), shapes[index]


class _LeafFloor:
    """Floor areas while a leaf is open or closed: where the agent can be, what is bare, and what the leaf covers."""

    def __init__(self, context: HouseContext, leaf: Thing, openness: float) -> None:
        context.begin(Setup(objects={leaf.id: ObjectSetup(openness=openness)}))
        self.free = context.view.plan().tight
        self.bare = context.view.bare_floor()
        self.shape = shapely.unary_union(thing_shapes(context.thing(leaf.id)))


def _may_stand_by(context: HouseContext, leaf: Thing, thing: Thing) -> bool:
    is_at_home = context.view.room_at(thing.position) == context.view.room_at(leaf.position)
    return thing.category in LIGHT_FURNITURE or (thing.category in HEAVY_FURNITURE and is_at_home)


def _is_alone(context: HouseContext, thing: Thing) -> bool:
    """Return whether a thing stands on the floor, cannot be carried, and has no other thing on it."""
    others = context.view.scene.things.values()
    return thing.parent is None and not thing.is_pickupable and all(other.parent != thing.id for other in others)


def _places(context: HouseContext, swung: BaseGeometry) -> np.ndarray:
    """Return at most `TRIED_PLACES` poses (n, 3) around an open leaf, shuffled: x (m), z (m) and heading (deg)."""
    left, low, right, high = swung.buffer(AROUND_M).bounds
    x, z = np.meshgrid(np.arange(left, right, STEP_M), np.arange(low, high, STEP_M))
    count = len(HEADINGS_DEG)
    found = np.column_stack([np.repeat(x.ravel(), count), np.repeat(z.ravel(), count), np.tile(HEADINGS_DEG, x.size)])
    return found[context.rng.permutation(len(found))[:TRIED_PLACES]]


def _is_split(open_: BaseGeometry, shut: BaseGeometry) -> bool:
    """Return whether the floor with the leaf open has two separate parts that are one part when the leaf is closed."""
    inside = [part.representative_point() for part in _rooms(open_)]
    if len(inside) < 2:
        return False
    homes = [next((n for n, part in enumerate(shapely.get_parts(shut)) if part.covers(each)), -1) for each in inside]
    known = [home for home in homes if home >= 0]
    return len(set(known)) < len(known)


def _rooms(free: BaseGeometry) -> list[BaseGeometry]:
    return [part for part in shapely.get_parts(free) if part.area >= MIN_ROOM_M2]


def _start_behind(context: HouseContext, target: Thing, leaf: Thing, setup: Setup) -> Pose | None:
    """Return a start pose with a leaf and a target in view. The target can be reached only if the leaf is closed.

    None if there is no such pose.
    """
    closed = {**setup.objects, leaf.id: ObjectSetup(openness=0.0)}
    if not context.can_begin(setup.model_copy(update={"objects": closed})):
        return None
    shut = context.view.plan().tight
    if not context.can_begin(setup):
        return None
    for part in _rooms(context.view.plan().tight):
        inside = part.representative_point()
        place = inside.x, inside.y
        is_cut = is_cut_off(part, place, body_box(target)) and shut.covers(inside)
        if not is_cut or is_cut_off(shut, place, body_box(target)):
            continue
        for spot in context.places_in(part, context.away_from(target, *AWAY_M), TRIED_STARTS):
            if context.visible_points(spot, target).is_at_least(MIN_VISIBLE_POINTS):
                start = context.facing(spot, target, DEFAULT_HORIZON_DEG, FACING_SPREAD_DEG)
                is_met = context.has_room_to_move(start) and context.sees_clearly(start, [leaf.id], shows_px(LEAF_PX))
                if is_met and context.sees_clearly(start, [target.id], is_in_view(context)):
                    return start
    return None
