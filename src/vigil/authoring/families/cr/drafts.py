"""Drafts of Constraint Resolving (CR): an obstacle in the way, a blocked door, an interlock, a full hand.

Drafts with an open leaf (door, lid or drawer) in the way are in `vigil.authoring.families.cr.leaves`. A draft may turn
out to be solvable without resolving its constraint; the rule `constraint_holds` of `vigil.authoring.review.rules`
checks this.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np
import shapely

from vigil.assets.catalog import CATALOG
from vigil.authoring.drafting.house_context import HouseContext, TaskSpec
from vigil.authoring.drafting.proposals import (
    Drafts,
    act_of,
    acts_for,
    allows,
    goal_for,
    is_in_view,
    is_target,
    setup_for,
    shows_px,
)
from vigil.authoring.language.implicit_constraints import implicit_kind
from vigil.authoring.language.referring import Phrase, referents, without_repeats
from vigil.authoring.language.sentences import ORDERS, read_sentences
from vigil.authoring.language.wording import Act, opening_phrase, order_slots, pronoun_slots
from vigil.authoring.solving.look_targets import SEEN_POINTS
from vigil.base.geometry import Box, Pose, Vec3, rotate_floor
from vigil.protocol.family import DEFAULT_HORIZON_DEG
from vigil.protocol.goals import Constraint
from vigil.protocol.world import ObjectSetup, Placement, Setup
from vigil.scene.floor import is_cut_off
from vigil.scene.geometry import body_box, box_distances
from vigil.scene.outlines import BODY_RADIUS_M, floor_corners, footprint
from vigil.scene.things import Thing

CONSTRAINTS = read_sentences(Path(__file__).with_name("sentences.toml"))
"""Kind of constraint -> forms of instructions that state the constraint."""
OBSTACLES = (
    *("Box", "BasketBall", "WateringCan", "Boots", "TeddyBear", "Footstool", "Vase", "Statue", "Kettle", "Pot"),
    *("Plunger", "TissueBox", "Dumbbell", "TableTopDecor"),
)
"""Categories that may stand on the floor as obstacles."""
MOVED_M = 0.5
"""Distance (m) by which an obstacle must be moved to resolve its constraint."""
OBSTACLE_PX = 800
"""Minimum number of visible pixels of an obstacle at the start."""
LOW_M = 0.3
"""Obstacles can block only drawers whose bottom is below this height (m); higher drawers pass over most obstacles."""
TRIED_OBSTACLES, TRIED_TARGETS, TRIED_STARTS = 4, 12, 5
TRIED_HELD = 2
"""Number of objects that are tried as the object in the hand, for each target."""
MAX_HELD_M = 0.45
"""Objects whose longest side exceeds this (m) are not put into the hand at the start."""
START_AWAY_M = (0.9, 4.0)
"""Minimum and maximum distance (m) from the target to the start, unless an obstacle must lie in between."""
FAR_START_AWAY_M = (2.2, 6.0)
"""Minimum and maximum distance (m) from the target to the start if an obstacle must lie in between."""
TRIED_FAR_PLACES = 40
FACING_SPREAD_DEG = 25.0
"""Maximum angle (deg) between a start's heading and the direction of its target."""
NEAR_TARGET_M, BEFORE_START_M, SPOT_STEP_M = 1.2, 0.7, 0.1
"""Distances (m): between the target and the end of the walk, between the start and the first place tried for an
obstacle, and between tried places."""
GAPS_M = (0.04, 0.12, 0.25)
"""Gaps (m) that are tried between the front of a target and an obstacle."""
SHIFTS = (0.0, 0.3, -0.3)
"""Sideways shifts of an obstacle that are tried at each gap, as shares of the target's width."""


@dataclass(frozen=True, slots=True)
class PartialTask:
    """A task that does not have a start pose and an instruction yet."""

    template: str
    setup: Setup
    target: Thing
    act: Act
    constraint: Constraint
    words: str = ""
    """Key of `CONSTRAINTS` for the sentences; empty if it is the same as the template."""


def interlocked(context: HouseContext) -> Drafts:
    """Yield drafts about a machine that can be turned on only when it is closed, and opened only when it is off."""
    machines = context.things(lambda thing: CATALOG[thing.category].runs_only_when_closed and thing.is_openable)
    for thing in machines:
        is_open = Setup(objects={thing.id: ObjectSetup(openness=1.0, is_toggled=False)})
        is_on = Setup(objects={thing.id: ObjectSetup(openness=0.0, is_toggled=True)})
        closed = Constraint(kind="object_closed", object_id=thing.id, latched=False)
        stopped = Constraint(kind="object_off", object_id=thing.id, latched=False)
        yield from drafts_of_task(context, PartialTask("interlock", is_open, thing, "turn_on", closed, "close_first"))
        yield from drafts_of_task(context, PartialTask("interlock", is_on, thing, "open", stopped, "stop_first"))


def hand_full(context: HouseContext) -> Drafts:
    """Yield drafts that start with an object in the hand, and ask to pick up another object."""
    can_be_held = context.things(
        lambda thing: thing.is_pickupable and is_target(thing) and max(thing.asset.size) < MAX_HELD_M
    )
    for target in context.things(lambda thing: thing.is_pickupable and is_target(thing))[:TRIED_TARGETS]:
        for held in [thing for thing in can_be_held if target.id not in (thing.id, thing.parent)][:TRIED_HELD]:
            constraint = Constraint(kind="object_released", object_id=held.id, latched=False)
            yield from drafts_of_task(context, PartialTask("hand", Setup(held=held.id), target, "pick", constraint))


def swing_blocked(context: HouseContext) -> Drafts:
    """Yield drafts in which an obstacle stands where the target's door must swing to open."""
    doors = context.things(lambda thing: is_target(thing) and allows(thing, "open") and is_low(thing))
    for target in [door for door in doors if not door.is_pickupable]:
        setup = setup_for(target, "open")
        for obstacle in obstacles(context, target):
            for spot in islice(placements_in_the_way(context, target, obstacle, setup), 1):
                blocked = _with(setup, obstacle, spot)
                yield from drafts_of_task(
                    context, PartialTask("swing", blocked, target, "open", _moved_constraint(obstacle))
                )


def is_low(thing: Thing) -> bool:
    """Return whether an obstacle on the floor can keep a thing from opening: furniture, or one of its low drawers."""
    return is_furniture(thing) and (not thing.is_drawer or body_box(thing).bottom < LOW_M)


def is_furniture(thing: Thing) -> bool:
    """Return whether a thing does not rest on another thing, or is a drawer, which is part of its furniture."""
    return thing.parent is None or thing.is_drawer


def obstacle_blocked(context: HouseContext) -> Drafts:
    """Yield drafts in which an obstacle stands in the only way to the target. The target is visible at the start."""
    for target in context.things(lambda thing: is_target(thing) and bool(acts_for(thing)))[:TRIED_TARGETS]:
        act = acts_for(target)[int(context.rng.integers(len(acts_for(target))))]
        setup = setup_for(target, act)
        for start, spots in _starts_with_routes(context, target, setup):
            found = _barrier(context, target, setup, start, spots)
            if found is not None:
                obstacle, blocked = found
                yield from drafts_of_task(
                    context, PartialTask("obstacle", blocked, target, act, _moved_constraint(obstacle)), start
                )
                break


def _starts_with_routes(context: HouseContext, target: Thing, setup: Setup) -> Iterator[tuple[Pose, np.ndarray]]:
    """Yield start poses with a distant target in view, and points (n, 2) in x, z on the shortest walk to the target."""
    if not context.can_begin(setup):
        return
    see = is_in_view(context)
    places = context.starts(context.away_from(target, *FAR_START_AWAY_M), TRIED_FAR_PLACES)
    starts = (place for place in places if context.visible_points(place, target).is_at_least(SEEN_POINTS))
    for place in islice(starts, TRIED_STARTS):
        start = context.facing(place, target, DEFAULT_HORIZON_DEG, FACING_SPREAD_DEG)
        if not context.has_room_to_move(start) or not context.sees_clearly(start, [target.id], see):
            continue
        walks = context.view.plan().walks_from((place.x, place.z))
        cells = walks.plan.cells
        lengths = np.where(box_distances(body_box(target), cells) < NEAR_TARGET_M, walks.lengths, np.inf)
        goal = int(lengths.argmin()) if len(lengths) else 0
        corners = walks.corners_to(goal) if len(lengths) and np.isfinite(lengths[goal]) else None
        if corners:
            line = shapely.LineString([(place.x, place.z), *corners])
            along = np.arange(BEFORE_START_M, line.length, SPOT_STEP_M)
            yield start, shapely.get_coordinates(shapely.line_interpolate_point(line, along))
            context.begin(setup)


def _barrier(
    context: HouseContext, target: Thing, setup: Setup, start: Pose, spots: np.ndarray
) -> tuple[Thing, Setup] | None:
    """Return an obstacle, and the setup in which it stands on one of the spots (n, 2) in x, z and cuts off the target.

    None if there is no such obstacle, or if the obstacle and the target are not both visible from the start pose.
    """
    context.begin(setup)
    free, bare = context.view.plan().tight, context.view.bare_floor()
    place = start.position.x, start.position.z
    for obstacle in obstacles(context, target)[:TRIED_OBSTACLES]:
        shapes = footprints_at(obstacle, spots, 0.0)
        for index in np.flatnonzero(shapely.covers(bare, shapes)):
            left = free.difference(shapes[index].buffer(BODY_RADIUS_M))
            if is_cut_off(left, place, body_box(target)):
                x, z = spots[index].tolist()
                blocked = _with(setup, obstacle, floor_placement(obstacle, x, z, 0.0))
                can_stand = context.can_begin(blocked)
                is_met = can_stand and context.sees_clearly(start, [obstacle.id], shows_px(OBSTACLE_PX))
                if is_met and context.sees_clearly(start, [target.id], is_in_view(context)):
                    return obstacle, blocked
    return None


def obstacles(context: HouseContext, target: Thing) -> list[Thing]:
    """Return the objects that may be put in the way to a target, in a random order."""
    return context.things(
        lambda thing: (
            thing.category in OBSTACLES
            and thing.is_pickupable
            and target.id not in (thing.id, thing.parent)
            and target.parent != thing.id
        )
    )


def placements_in_the_way(context: HouseContext, target: Thing, obstacle: Thing, setup: Setup) -> Iterator[Placement]:
    """Yield placements of an obstacle in front of a target, at which the obstacle covers only bare floor.

    The house has the setup only while the floor is checked. When a placement is yielded, the house is reset without the
    setup.
    """
    deep = target.asset.size.z / 2 + obstacle.asset.size.z / 2
    for gap in GAPS_M:
        for share in SHIFTS:
            x, z = rotate_floor(share * target.asset.size.x, deep + gap, target.rotation.y)
            spot = floor_placement(obstacle, target.position.x + x, target.position.z + z, target.rotation.y)
            outline = footprint(Box(center=spot.position, size=obstacle.asset.size, yaw=spot.rotation.y))
            fits = context.can_begin(setup) and context.view.bare_floor().covers(outline)
            context.begin(Setup())
            if fits:
                yield spot


def floor_placement(thing: Thing, x: float, z: float, yaw: float) -> Placement:
    """Return the placement of a thing on the floor at x, z (m), turned by `yaw` (deg)."""
    position = Vec3(round(x, 3), round(thing.asset.size.y / 2, 4), round(z, 3))
    return Placement(position=position, rotation=Vec3(0.0, yaw, 0.0))


def footprints_at(thing: Thing, spots: np.ndarray, yaw: float) -> np.ndarray:
    """Return the outlines (n,) of a thing on the floor at the spots (n, 2) in x, z, turned by `yaw` (deg)."""
    corners = floor_corners(Box(center=Vec3(0.0, 0.0, 0.0), size=thing.asset.size, yaw=yaw))
    rounded = np.array([(round(x, 3), round(z, 3)) for x, z in spots.tolist()])  # as in `floor_placement`
    return np.asarray(shapely.polygons(rounded.reshape(-1, 1, 2) + corners))


def _with(setup: Setup, obstacle: Thing, spot: Placement) -> Setup:
    return Setup(objects={**setup.objects, obstacle.id: ObjectSetup(placement=spot)})


def _moved_constraint(obstacle: Thing) -> Constraint:
    return Constraint(kind="object_moved", object_id=obstacle.id, latched=True, distance_m=MOVED_M)


def drafts_of_task(context: HouseContext, sketch: PartialTask, start: Pose | None = None) -> Drafts:
    """Yield one draft, or nothing if no start pose or no phrase is found. If `start` is given, it is the start pose."""
    target, obstacle = sketch.target, context.thing(sketch.constraint.object_id)
    also = [obstacle.id] if sketch.template == "swing" else []

    def find_start(_: object) -> Pose | None:
        return start or context.start_seeing(
            target,
            START_AWAY_M,
            DEFAULT_HORIZON_DEG,
            is_in_view(context),
            lambda pose: context.sees_clearly(pose, also, is_in_view(context)),
        )

    found = context.start_and_phrases(sketch.setup, {"target": target, "obstacle": obstacle}, find_start)
    if found is None:
        return
    pose, phrases = found
    bindings = {"target": target.id, "obstacle": obstacle.id} if obstacle is not target else {"target": target.id}
    task = TaskSpec(
        start=pose,
        setup=sketch.setup,
        instruction=_instruction(context, sketch, phrases),
        goal=goal_for(target, sketch.act).model_copy(update={"constraint": sketch.constraint}),
        bindings=bindings,
        template=sketch.template,
    )
    yield context.draft("CR", task)


def _instruction(context: HouseContext, sketch: PartialTask, phrases: dict[str, Phrase]) -> str:
    """Return a random sentence that states the constraint; `phrases` has the phrases for `target` and `obstacle`."""
    target, obstacle = sketch.target, context.thing(sketch.constraint.object_id)
    phrase, other = phrases["target"], phrases["obstacle"]
    if sketch.template == "hand" and not referents(other.without_place, [context.items[target.id]]):
        other = other.without_place
    words = sketch.words or sketch.template
    slots = order_slots(sketch.act, target.category, str(phrase), context.rng) | {
        "target": str(phrase),
        "obstacle": str(other),
        **pronoun_slots(target.category, "target_"),
        **pronoun_slots(obstacle.category, "obstacle_"),
    }
    if words == "leaf":
        slots |= opening_phrase(obstacle.category, str(other)).slots("blocker")
    elif sketch.act in ("open", "close"):
        slots |= opening_phrase(target.category, str(phrase)).slots()
    return context.say(CONSTRAINTS[words], **slots)


def without_constraint(context: HouseContext, drafts: Callable[[HouseContext], Drafts]) -> Drafts:
    """Yield the drafts of a kind, with instructions that do not state the constraint.

    Agents must find out what prevents the act. Setup, bindings and goal are not changed.
    """
    for episode in drafts(context):
        context.begin(episode.setup)
        target, names = context.thing(episode.goal.object_id), [item.name for item in context.items.values()]
        sentence = context.order(ORDERS, act_of(episode.goal), target, context.phrase(target.id))
        context.begin(Setup())
        template = implicit_kind(episode.provenance.template)
        yield episode.model_copy(
            update={
                "instruction": without_repeats(sentence, names),
                "provenance": episode.provenance.model_copy(update={"template": template}),
            }
        )
