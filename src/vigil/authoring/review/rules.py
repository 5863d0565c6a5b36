"""The rules about an episode's start, each with its name, the families to which it applies, and its reason.

A rule has a function that takes an `EpisodeStart` and yields messages about what is wrong. Source: `protocol.md`
section 4.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from vigil.authoring.language.disambiguation import anchor_of, look_alikes
from vigil.authoring.language.implicit_constraints import constraint_giveaways, is_implicit
from vigil.authoring.language.wording import asks_inside
from vigil.authoring.review.containers import MAX_CLOSED, not_found_by_opening
from vigil.authoring.review.episode_start import EpisodeStart
from vigil.authoring.solving.goal_actions import closed_containers_around, is_doable
from vigil.authoring.solving.look_targets import surface_points
from vigil.authoring.solving.macro_actions import MacroActions
from vigil.authoring.solving.privileged_view import PrivilegedView
from vigil.base.geometry import Pose, Vec3
from vigil.packs.pack import protocol_faults
from vigil.protocol.actions import REACH_HEIGHT_M, REACH_M
from vigil.protocol.episode import Episode
from vigil.protocol.families import FAMILIES, Family
from vigil.protocol.goals import (
    STATE_LABELS,
    AgentNearTarget,
    AllOf,
    Goal,
    ObjectAtReceptacle,
    ObjectHeld,
    ObjectInState,
    ReportStatus,
    is_observable,
)
from vigil.scene.floor import places_within
from vigil.scene.geometry import body_box
from vigil.scene.outlines import room_floor
from vigil.scene.things import Thing

MARGIN_M, MARGIN_PX = 0.02, 20
"""Margins (m, pixels) by which a start or a solution must be better than each threshold."""
START_PX, SMALL_START_PX, STATE_START_PX = 100, 40, 150
"""Minimum visible pixels at the start: of the object to act on, a small PG target, and the parts that show a state."""
ALMOST_CLOSED, WIDE_OPEN = 0.02, 0.8
"""Maximum openness at which a thing is clearly closed, and minimum openness at which it is clearly open."""
STANDARDS_IN_WORDS = (
    "within about one and a half metres of",
    "no farther than about one and a half metres from",
)
NEAR_MARGIN_M, SURFACE_POINTS = 0.01, (16, 128, 1024)
"""Values for `place_blind_to`: tolerance (m) of "near" and of "in another room", and numbers of sampled points."""
INSIDE_TEMPLATE = "pick_inside"
"""Template of searches in which the target is in a closed container that the instruction does not name."""
LOOK_ALIKE_TEMPLATE = "look_alike"
"""Template of episodes about one of several look-alikes."""

Faults = Iterator[str]


@dataclass(frozen=True, slots=True)
class Rule:
    """A rule about an episode's start."""

    is_for: Callable[[Family], bool] | None
    """Function that returns whether the rule applies to a family; None if it applies to families that list it."""
    reason: str
    faults: Callable[[EpisodeStart], Faults]
    """Function that yields a message for each way in which an episode breaks the rule."""


def _objects(case: EpisodeStart) -> Faults:
    for object_id in case.episode.bound_ids():
        thing = case.view.scene.things.get(object_id)
        if thing is None or not thing.is_present:
            yield f"object {object_id!r} is not in the scene"


def _start(case: EpisodeStart) -> Faults:
    place = case.episode.start.position
    if not case.view.plan().can_stand((place.x, place.z)):
        yield f"the body does not fit at the start ({place.x:.2f}, {place.z:.2f})"


def _unmet(case: EpisodeStart) -> Faults:
    if case.row.semantic:
        yield "the goal already holds at the reset"


def _visible(case: EpisodeStart) -> Faults:
    least = SMALL_START_PX if case.episode.target_size == "small" else START_PX
    state = case.first
    if state.visible_px < least + MARGIN_PX:
        yield f"{state.visible_px} px of the object to act on are in view at the start, {least + MARGIN_PX} are needed"
    elif not is_observable(state):
        yield "the object to act on is too far away at the start to be observable"


def _hidden(case: EpisodeStart) -> Faults:
    if case.view.is_in_frame(case.episode.goal.object_id):
        yield f"the target is in view at the start ({case.target.visible_px} px by samples), but should not be"


def _state_visible(case: EpisodeStart) -> Faults:
    goal = case.episode.goal
    shown_px = case.target.state_px(goal.state) if isinstance(goal, ReportStatus) else 0
    if shown_px < STATE_START_PX + MARGIN_PX:
        yield f"{shown_px} px show the state at the start, {STATE_START_PX + MARGIN_PX} are needed"
    if not (case.row.semantic and case.row.strict):
        yield "the state cannot be observed at the start"


def _in_reach(case: EpisodeStart) -> Faults:
    box, floor = case.target.box, case.episode.start.position.y
    if case.target.box_distance_m > REACH_M - MARGIN_M or box.bottom - floor > REACH_HEIGHT_M:
        yield f"the target is {case.target.box_distance_m:.2f} m away, but the reach is {REACH_M} m"


def _out_of_reach(case: EpisodeStart) -> Faults:
    if case.target.box_distance_m < REACH_M + MARGIN_M:
        yield f"the target is {case.target.box_distance_m:.2f} m away at the start, which is within reach or almost"


def _parts(goal: Goal) -> tuple[Goal, ...]:
    return goal.parts if isinstance(goal, AllOf) else (goal,)


def _clearly_open_or_closed(case: EpisodeStart) -> Faults:
    goals = [*_parts(case.episode.goal), *case.episode.goal.chain]
    asked = [
        goal.object_id for goal in goals if isinstance(goal, ObjectInState | ReportStatus) and goal.state == "is_open"
    ]
    for object_id in asked:
        openness = case.world.objects[object_id].openness
        if openness is None or ALMOST_CLOSED < openness < WIDE_OPEN:
            yield f"{object_id!r} starts at openness {openness}, neither <= {ALMOST_CLOSED} nor >= {WIDE_OPEN}"


def _other_rooms(case: EpisodeStart) -> Faults:
    goal = case.episode.goal
    assert isinstance(goal, AgentNearTarget)
    place = place_blind_to(case.view, case.view.scene.things[goal.object_id], goal.threshold_m)
    if place is not None:
        yield f"({place.x:.2f}, {place.z:.2f}) is near the target, but in another room and without sight of it"


def place_blind_to(view: PrivilegedView, thing: Thing, threshold_m: float) -> Vec3 | None:
    """Return a free place near a thing but in another room, from which it is not visible; None if there is none.

    An agent that stops there has reached the thing only by chance, because it cannot see the thing.
    """
    home = view.room_at(thing.position)
    floors = {room.id: room_floor(room) for room in view.scene.rooms}
    floor = view.plan().tight
    if home is not None:
        floor = floor.difference(floors[home].buffer(NEAR_MARGIN_M, join_style="mitre"))
    tried = [surface_points(thing, count) for count in SURFACE_POINTS]
    for x, z in places_within(floor, body_box(thing), threshold_m + NEAR_MARGIN_M):
        place = Vec3(float(x), view.agent.position.y, float(z))
        eye = Pose(position=place, rotation=0.0).eye
        if not any(view.sees(eye, points, thing.id, through_glass=True).any() for points in tried):
            return place
    return None


def _standard_stated(case: EpisodeStart) -> Faults:
    if not any(standard in case.episode.instruction for standard in STANDARDS_IN_WORDS):
        yield f"the instruction does not say {' or '.join(map(repr, STANDARDS_IN_WORDS))}"


def _named(case: EpisodeStart) -> Faults:
    meant = [{item.id for item in fitting} for _, fitting in case.mentioned]
    left_out = unnamed_roles(case.episode)
    for role, object_id in sorted(case.episode.bindings.items()):
        if role not in left_out and {object_id} not in meant:
            yield f"no phrase of the instruction means the {role} {object_id!r} only"


def unnamed_roles(episode: Episode) -> frozenset[str]:
    """Return the roles of those bound objects that instructions of the episode's template do not name."""
    if is_implicit(episode.provenance.template):
        return frozenset({"obstacle"})
    return frozenset({"container"} if episode.provenance.template == INSIDE_TEMPLATE else ())


def _constraint_not_given_away(case: EpisodeStart) -> Faults:
    constraint = case.episode.goal.constraint
    if constraint is not None and is_implicit(case.episode.provenance.template):
        is_other = constraint.object_id != case.episode.goal.object_id
        obstacle = case.items.get(constraint.object_id) if is_other else None
        yield from constraint_giveaways(case.episode.instruction, constraint.kind, obstacle.name if obstacle else None)


def _found_inside(case: EpisodeStart) -> Faults:
    if case.episode.provenance.template == INSIDE_TEMPLATE:
        target = case.view.scene.things[case.episode.goal.object_id]
        phrases = [phrase for phrase, _ in case.mentioned]
        yield from not_found_by_opening(case.view, case.items, target, phrases, MAX_CLOSED)


def _has_look_alike(case: EpisodeStart) -> Faults:
    if case.episode.provenance.template != LOOK_ALIKE_TEMPLATE:
        return
    others = look_alikes(case.items[case.episode.goal.object_id], case.items.values())
    if not others:
        yield "no other object in the house has the target's name"
    elif FAMILIES[case.episode.family].visible_at_start:
        states = case.view.world([other.id for other in others]).objects.values()
        if not any(is_observable(state) for state in states):
            yield "no other object with the target's name is in view at the start"
        anchors = [anchor_of(phrase, case.items.values()) for phrase, _ in case.mentioned]
        for anchor in filter(None, anchors):
            if not is_observable(case.view.state_of(anchor.id)):
                yield f"{anchor.id!r}, by which the instruction identifies the target, is out of view at the start"


def _unambiguous(case: EpisodeStart) -> Faults:
    bound = set(case.episode.bindings.values())
    for phrase, items in case.mentioned:
        fitting = [item.id for item in items]
        if len(fitting) != 1:
            yield f"{str(phrase)!r} fits {len(fitting)} things: {', '.join(fitting[:4])}"
        elif fitting[0] not in bound:
            yield f"{str(phrase)!r} means {fitting[0]!r}, which the episode does not bind"


def _state_not_given_away(case: EpisodeStart) -> Faults:
    goal = case.episode.goal
    assert isinstance(goal, ReportStatus)
    words = case.episode.instruction.lower().replace(".", " ").replace(",", " ").replace("?", " ").split()
    said = [label for label in STATE_LABELS[goal.state] if label in words]
    if len(said) == 1:
        yield f"the instruction says {said[0]!r} but not the other label: it gives the state away"


def _chained(case: EpisodeStart) -> Faults:
    kinds = FAMILIES[case.episode.family].kinds
    if case.episode.provenance.template not in kinds:
        yield f"template {case.episode.provenance.template!r} is not one of {', '.join(kinds)}"
    if len(set(case.episode.bindings.values())) < 2:
        yield "a sequence binds at least two objects"
    goal = case.episode.goal
    for part in goal.parts if isinstance(goal, AllOf) else ():
        if isinstance(part, ObjectAtReceptacle) and case.at_reset(part).semantic:
            yield f"{part.object_id!r} is already where it must be put"
    for link in case.episode.goal.chain:
        state = case.world.objects[link.object_id]
        if isinstance(link, ObjectInState) and link.state == "is_open" and link.value:
            if (state.openness or 0.0) > ALMOST_CLOSED:
                yield f"{link.object_id!r} is open at the start, so that it need not be opened"
        elif isinstance(link, ObjectInState) and case.at_reset(link).semantic:
            yield f"{link.object_id!r} is already in the required state at the start"
        if isinstance(link, ObjectHeld) and state.is_held:
            yield f"{link.object_id!r} is in the hand at the start"


def _inside_as_worded(case: EpisodeStart) -> Faults:
    for goal in _parts(case.episode.goal):
        if isinstance(goal, ObjectAtReceptacle) and goal.inside != asks_inside(case.episode.instruction):
            wanted = "inside" if goal.inside else "on"
            yield f"the goal is {wanted} {goal.receptacle_id!r}, but the instruction says otherwise"


def _found(case: EpisodeStart) -> Faults:
    goals = [*_parts(case.episode.goal), *case.episode.goal.chain]
    taken = {goal.object_id for goal in goals if isinstance(goal, ObjectAtReceptacle | ObjectHeld)}
    for object_id in sorted(taken):
        for container in closed_containers_around(case.view, object_id):
            if container not in case.episode.bindings.values():
                yield f"{object_id!r} lies in {container!r}, which is closed and not bound"


def _has_target_size(case: EpisodeStart) -> Faults:
    if case.episode.target_size is None:
        yield "the episode has no target size"


def _seen_constraint(case: EpisodeStart) -> Faults:
    constraint = case.episode.goal.constraint
    assert constraint is not None
    state = case.world.objects[constraint.object_id]
    if not state.is_held and state.visible_px < START_PX + MARGIN_PX:
        yield f"{state.visible_px} px of {constraint.object_id!r} are in view, {START_PX + MARGIN_PX} are needed"


def _constraint_binds(case: EpisodeStart) -> Faults:
    """Yield a message if the goal's interaction works from some place although the constraint is not resolved."""
    kinds = FAMILIES[case.episode.family].kinds
    if case.episode.provenance.template not in kinds:
        yield f"template {case.episode.provenance.template!r} is not one of {', '.join(kinds)}"
    if is_doable(case.episode.goal, MacroActions(case.view, may_tilt=True, is_exhaustive=True)):
        yield "the goal can be reached without resolving the constraint"


def every_family(_: Family) -> bool:
    """Return True. This is the value of `Rule.is_for` for rules that apply to every family."""
    return True


def _asks_state(family: Family) -> bool:
    return "report_status" in FAMILIES[family].goal_kinds


def _asks_action(family: Family) -> bool:
    return not _asks_state(family)


def _starts_in_view(family: Family) -> bool:
    return _asks_action(family) and FAMILIES[family].visible_at_start


def _starts_out_of_view(family: Family) -> bool:
    return _asks_action(family) and not FAMILIES[family].visible_at_start


RULES: dict[str, Rule] = {
    "protocol": Rule(
        every_family,
        "the step budget and the camera's pitch at the start are those of the family",
        lambda case: iter(protocol_faults(case.episode)),
    ),
    "objects_exist": Rule(every_family, "every bound object is in the scene", _objects),
    "start_free": Rule(every_family, "the body fits at the start", _start),
    "goal_unmet": Rule(_asks_action, "the goal does not hold at the start", _unmet),
    "visible_at_start": Rule(_starts_in_view, "the object to act on is in view", _visible),
    "hidden_at_start": Rule(_starts_out_of_view, "the target of a search is out of view", _hidden),
    "state_visible_at_start": Rule(_asks_state, "the first frame shows the state that is asked about", _state_visible),
    "graded": Rule(None, "pointing tasks are graded by the size of the target", _has_target_size),
    "in_reach_at_start": Rule(None, "pointing does not require walking", _in_reach),
    "out_of_reach_at_start": Rule(None, "the target is not yet within reach", _out_of_reach),
    "clear_openness": Rule(every_family, "things are clearly open or clearly closed", _clearly_open_or_closed),
    "near_sees_target": Rule(None, "being near on the other side of a wall does not count", _other_rooms),
    "standard_in_words": Rule(None, "the instruction says how near is near", _standard_stated),
    "target_named": Rule(every_family, "for each bound object, a phrase of the instruction means only it", _named),
    "unambiguous": Rule(every_family, "each phrase of the instruction means one thing", _unambiguous),
    "found_by_opening": Rule(
        None, "people expect the target in its closed container, and at most four containers may hold it", _found_inside
    ),
    "look_alike_present": Rule(
        _asks_action, "an episode about a look-alike has another object with the same name", _has_look_alike
    ),
    "state_not_given_away": Rule(_asks_state, "the instruction does not contain the answer", _state_not_given_away),
    "chain_of_objects": Rule(None, "a sequence has a template and several objects", _chained),
    "not_shut_away": Rule(None, "closed containers around objects to take are named", _found),
    "inside_in_words": Rule(
        every_family, 'the instruction says "into" if, and only if, the object must be inside', _inside_as_worded
    ),
    "constraint_implicit": Rule(
        None, "the instruction does not give away an implicit constraint", _constraint_not_given_away
    ),
    "constraint_visible": Rule(None, "the obstacle is in view at the start", _seen_constraint),
    "constraint_holds": Rule(None, "the goal is out of reach until the constraint is resolved", _constraint_binds),
}
"""Rule name -> rule, in the order in which they are checked."""


def binds(rule: Rule, name: str, family: Family) -> bool:
    """Return whether a rule, whose name is `name`, applies to a family."""
    return name in FAMILIES[family].rules if rule.is_for is None else rule.is_for(family)


def broken_by(case: EpisodeStart) -> Iterator[tuple[str, str]]:
    """Yield (rule, message) for each fault of an episode's start. If `objects_exist` is broken, stop there."""
    for name, rule in RULES.items():
        if not binds(rule, name, case.episode.family):
            continue
        found = list(rule.faults(case))
        yield from ((name, message) for message in found)
        if found and name == "objects_exist":
            return
