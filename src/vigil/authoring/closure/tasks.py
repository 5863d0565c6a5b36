"""Tasks of the closure-stress suite: what is proposed of each kind in a house, twins together.

A task is made of a draft of Search and Interact, so that the side which can be done obeys every rule of that family.
`vigil.authoring.closure.certify` decides which tasks hold. Source: decision 30.
"""

import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import islice

import numpy as np

from vigil.authoring.drafting.constraints import fits_on_floor, interlocked, spots_before, swing_blocked
from vigil.authoring.drafting.drafts import Rejection
from vigil.authoring.drafting.house_context import HouseContext, TaskSpec
from vigil.authoring.drafting.leaves import HEAVY, LIGHT
from vigil.authoring.drafting.proposals import allows, goal_for, is_target, seeking, setup_for
from vigil.authoring.language.referring import ROOM_NAMES, DescribedThing, Phrase, referents
from vigil.authoring.language.sentences import ORDERS, SEARCH_ORDERS
from vigil.authoring.language.wording import VERBS, Act, opened, order, say, spoken_of
from vigil.authoring.ways.synthetic_records import with_change
from vigil.closure import ALIKE, Evidence, Kind
from vigil.episode import Episode
from vigil.goals import AllOf, ObjectInState
from vigil.pose import EYE_HEIGHT_M, Pose, Vec3
from vigil.scene.supports import children, level_surfaces
from vigil.scene.things import Thing
from vigil.world import ObjectSetup, Setup

FEWEST, MOST = 2, 5
"""Targets of an `all_of` task."""
TRIED_STARTS = 40
TRIED_FURNITURE = 4
BELOW_EYES_M = 0.2
"""How far below the eyes a surface must be to be looked at from above."""
SPOT_SHARES = (-0.3, 0.3)
"""Where on a surface, from its middle and as shares of its size, evidence is looked for."""
LEVEL_DEG = 15.0
ALL_ACTS: tuple[Act, ...] = ("turn_off", "close", "turn_on", "open")
EVERY = (
    "{Verb} every {name} in the {room}.",
    "Please {verb} every {name} in the {room}.",
    "Go through the {room}: {verb} every {name} in the {room}.",
    "I would like you to {verb} every {name} in the {room}.",
)
EVERYTHING: dict[Act, tuple[str, ...]] = {
    "turn_off": (
        "Turn off everything that is on in the {room}.",
        "Please switch off everything that is on in the {room}.",
        "We are leaving: turn off everything that is on in the {room}.",
    ),
    "close": (
        "Close everything that stands open in the {room}, except for the doors between rooms.",
        "Please shut everything that stands open in the {room}, but leave the doors between rooms as they are.",
        "Tidy up: close everything that stands open in the {room}, except for the doors between rooms.",
    ),
}
_ROOM = f"(?P<room>{'|'.join(ROOM_NAMES.values())})"
NAMED = re.compile(rf"\bevery (?P<name>[\w -]+?) in the {_ROOM}\b")
STANDING = re.compile(rf"\beverything that (?P<state>is on|stands open) in the {_ROOM}\b")
MAKE_SURE = (
    "Make sure that {whole} {are} {label}.",
    "See to it that {whole} {are} {label}.",
    "Please make sure that {whole} {are} {label}.",
    "Before we leave, make sure that {whole} {are} {label}.",
)
LABELS: dict[Act, str] = {"open": "open", "close": "closed", "turn_on": "on", "turn_off": "off"}
DOORS = frozenset({"Doorway", "Doorframe"})
ANY_MOVE_M = 0.01
FLAMES = frozenset({"Candle"})
"""Nobody says that it is on or off."""


@dataclass(frozen=True, slots=True)
class ClosureTask:
    """One episode, or two twins, the side first that the families' rules bind."""

    kind: Kind
    episodes: tuple[Episode, ...]
    removed: str = ""
    """Id of the object about which twins differ."""
    evidence: tuple[Evidence, ...] = ()


Tasks = Iterator[ClosureTask | Rejection]


def all_of(context: HouseContext) -> Tasks:
    """Yields tasks about several things of a room: all of a name, or all that are on or stand open."""
    yield from _in_turn(_by_name(context), _by_state(context, "turn_off"), _by_state(context, "close"))


def _by_name(context: HouseContext) -> Tasks:
    for act in ALL_ACTS:
        groups: dict[tuple[str, str, str], list[Thing]] = {}
        for thing in context.shuffled([each for each in context.oracle.scene.things.values() if each.is_present]):
            item = context.items[thing.id]
            if is_target(thing) and allows(thing, act) and item.room and item.room_id and thing.category not in FLAMES:
                groups.setdefault((item.name, item.room, item.room_id), []).append(thing)
        for (name, room, room_id), things in groups.items():
            if len(things) < FEWEST:
                continue
            if not _are_all(context, name, room, {thing.id for thing in things}):
                yield _refused(context, "all_of", "told_apart", f"every {name} in the {room}: others answer to it too")
            elif len(things) > MOST:
                yield _refused(context, "all_of", "few_enough", f"{len(things)} things are a {name} in {room_id}")
            else:
                verb = VERBS[act][int(context.rng.integers(len(VERBS[act])))].replace(" {}", "")
                sentence = say(EVERY, context.rng, verb=verb, name=name, room=room)
                objects = {key: change for thing in things for key, change in setup_for(thing, act).objects.items()}
                yield _about_all(context, act, sentence, things, Setup(objects=objects))


def _by_state(context: HouseContext, act: Act) -> Tasks:
    for room in context.oracle.scene.rooms:
        name = ROOM_NAMES.get(room.room_type)
        things = [context.thing(item.id) for item in context.items.values() if item.room_id == room.id]
        fit = [each for each in things if is_target(each) and allows(each, act) and each.category not in FLAMES]
        if name is None or sum(each.room_type == room.room_type for each in context.oracle.scene.rooms) > 1:
            continue
        if len(fit) < FEWEST:
            yield _refused(context, "all_of", "few_enough", f"{len(fit)} things can be asked for in the {name}")
            continue
        chosen = context.shuffled(fit)[: int(context.rng.integers(FEWEST, MOST))]
        asked = {key: change for thing in chosen for key, change in setup_for(thing, act).objects.items()}
        at_rest = ObjectSetup(is_toggled=False) if act == "turn_off" else ObjectSetup(openness=0.0)
        others = {each.id: at_rest for each in standing(things, act) if each.id not in asked}
        sentence = say(EVERYTHING[act], context.rng, room=name)
        yield _about_all(context, act, sentence, chosen, Setup(objects={**others, **asked}))


def standing(things: Iterable[Thing], act: Act) -> list[Thing]:
    """Returns which things are on, or stand open, but for doors between rooms."""
    if act == "turn_off":
        return [thing for thing in things if thing.is_toggled]
    return [thing for thing in things if thing.is_openable and thing.openness > 0.0 and thing.category not in DOORS]


def _are_all(context: HouseContext, name: str, room: str, ids: set[str]) -> bool:
    """Whether just these things answer to a name in a room."""
    return {item.id for item in referents(Phrase(name, room=room), context.items.values())} == ids


def _about_all(
    context: HouseContext, act: Act, sentence: str, things: list[Thing], setup: Setup
) -> ClosureTask | Rejection:
    parts = [part for thing in things if isinstance(part := goal_for(thing, act), ObjectInState)]
    if not context.can_begin(setup):
        return _refused(context, "all_of", "can_be_set_up", sentence)
    start = _start_missing_some(context, things)
    context.begin(Setup())
    if start is None:
        return _refused(context, "all_of", "some_out_of_view", sentence)
    task = TaskSpec(
        start=start,
        setup=setup,
        instruction=sentence,
        goal=AllOf(object_id=parts[0].object_id, parts=tuple(parts)),
        bindings={"target": things[0].id, **{f"target_{n}": each.id for n, each in enumerate(things[1:], start=2)}},
        template=act,
    )
    return ClosureTask("all_of", (context.draft("SI", task),))


def _start_missing_some(context: HouseContext, things: list[Thing]) -> Pose | None:
    """Returns a start pose in the things' room that does not see all of them; None without one."""
    home = context.oracle.room_at(things[0].position)
    for place in context.starts(lambda places: np.full(len(places), True), TRIED_STARTS):
        if context.oracle.room_at(place) != home:
            continue
        pose = context.facing(place, things[0], LEVEL_DEG, 40.0)
        with context.oracle.standing_at(pose):
            seen = [context.oracle.state_of(thing.id).visible_px for thing in things]
        if min(seen) == 0 < max(seen):
            return pose
    return None


def impossible(context: HouseContext) -> Tasks:
    """Yields twins of which one cannot be done: what is asked for is gone, or furniture bars the door."""
    yield from _in_turn(_gone(context), _locked(context))


def _in_turn(*proposals: Tasks) -> Tasks:
    """Yields one task of each in turn, with what was refused before it, until none has any left."""
    left = list(proposals)
    while left:
        for each in list(left):
            is_over = True
            for found in each:
                yield found
                if isinstance(found, ClosureTask):
                    is_over = False
                    break
            if is_over:
                left.remove(each)


def _gone(context: HouseContext) -> Tasks:
    for episode in seeking(context, "pick"):
        target = context.thing(episode.goal.object_id)
        item = context.items[target.id]
        phrase, support = _placed(context, item), context.oracle.scene.things.get(target.parent or "")
        if phrase is None or support is None:
            yield _refused(context, "impossible", "told_apart", f"{target.id!r} cannot be told by where it lies")
            continue
        spots = _spots(support, target)
        if not spots or children(context.oracle.scene, target.id):
            yield _refused(context, "impossible", "place_can_be_seen", f"{support.id!r} cannot be looked at from above")
            continue
        words = order("pick", target.category, str(phrase), context.rng) | spoken_of(target.category)
        first = episode.model_copy(
            update={
                "instruction": context.say(SEARCH_ORDERS, target=str(phrase), **words),
                "bindings": {"target": target.id, "place": support.id},
            }
        )
        gone = with_change(first.setup, target.id, is_absent=True)
        evidence = tuple(Evidence(object_id=support.id, spot=spot) for spot in spots)
        yield ClosureTask("impossible", (first, first.model_copy(update={"setup": gone})), target.id, evidence)


def _placed(context: HouseContext, item: DescribedThing) -> Phrase | None:
    """Returns what to call a thing by what it lies on or in; None when that does not single it out."""
    items = list(context.items.values())
    if item.support is None or {each.id for each in referents(Phrase(item.support), items)} != {item.support_id}:
        return None
    colours = item.colours[:1] if len(item.colours) == 1 else ()
    for colour in (None, *colours):
        phrase = Phrase(
            item.name,
            colour=colour,
            support=item.support,
            is_inside=item.is_inside,
            is_on_shelf=item.is_on_shelf,
        )
        if [each.id for each in referents(phrase, items)] == [item.id]:
            return phrase
    return None


def _spots(support: Thing, target: Thing) -> list[Vec3]:
    """Returns places spread over the surface that a thing lies on; none where it is too high to be looked at."""
    for surface, frame in level_surfaces(support):
        if surface.name == target.surface:
            shares = [(x * surface.size_x, 0.002, z * surface.size_z) for x in SPOT_SHARES for z in SPOT_SHARES]
            found = [Vec3(*(round(float(value), 3) for value in point)) for point in frame(np.array(shares))]
            is_low = all(spot.y <= EYE_HEIGHT_M - BELOW_EYES_M for spot in found)
            return found if is_low and not surface.needs_opening else []
    return []


def _locked(context: HouseContext) -> Tasks:
    for episode in seeking(context, "open"):
        target = context.thing(episode.goal.object_id)
        if target.is_structure or target.is_pickupable or target.parent is not None:
            continue
        room = context.oracle.room_at(target.position)
        furniture = context.things(lambda thing, room=room, target=target: _may_bar(context, thing, target, room))
        for blocker in islice(furniture, TRIED_FURNITURE):
            spot = next(
                (
                    spot
                    for spot in spots_before(target, blocker)
                    if fits_on_floor(context, blocker, spot, episode.setup)
                ),
                None,
            )
            if spot is None:
                continue
            first = episode.model_copy(update={"bindings": {"target": target.id, "blocker": blocker.id}})
            barred = with_change(first.setup, blocker.id, placement=spot)
            evidence = (Evidence(object_id=target.id), Evidence(object_id=blocker.id))
            yield ClosureTask("impossible", (first, first.model_copy(update={"setup": barred})), blocker.id, evidence)


def _may_bar(context: HouseContext, thing: Thing, target: Thing, room: str | None) -> bool:
    is_furniture = thing.category in (*LIGHT, *HEAVY) and not thing.is_pickupable and thing.parent is None
    is_bare = not children(context.oracle.scene, thing.id)
    return is_furniture and is_bare and thing.id != target.id and context.oracle.room_at(thing.position) == room


def already(context: HouseContext) -> Tasks:
    """Yields twins that ask to make sure of a state, which on one side holds from the start."""
    yield from _in_turn(*(_sure(context, act) for act in ALL_ACTS))


def _sure(context: HouseContext, act: Act) -> Tasks:
    for episode in seeking(context, act):
        goal, target = episode.goal, context.thing(episode.goal.object_id)
        if not isinstance(goal, ObjectInState) or target.category in FLAMES:
            continue
        phrase = str(context.phrase(target.id))
        is_part = act in ("open", "close")
        words = opened(target.category, phrase) if is_part else None
        sentence = say(
            MAKE_SURE,
            context.rng,
            whole=words.whole if words else phrase,
            are="are" if words and words.is_plural else "is",
            label=LABELS[act],
        )
        first = episode.model_copy(update={"instruction": sentence})
        change = ObjectSetup(openness=float(goal.value)) if is_part else ObjectSetup(is_toggled=goal.value)
        done = with_change(first.setup, target.id, **change.model_dump(exclude_none=True, exclude={"is_absent"}))
        second = first.model_copy(update={"setup": done})
        yield ClosureTask("already", (first, second), target.id, (Evidence(object_id=target.id),))


def silent_refusal(context: HouseContext) -> Tasks:
    """Yields tasks whose obvious action is refused for a reason that is seen and not told: a machine runs or stands
    open, or something stands before a door."""
    yield from _in_turn(_untold(context, swing_blocked(context)), _untold(context, interlocked(context)))


def _untold(context: HouseContext, drafts: Iterable[Episode]) -> Tasks:
    for episode in drafts:
        goal, constraint = episode.goal, episode.goal.constraint
        target = context.thing(goal.object_id)
        if constraint is None or not isinstance(goal, ObjectInState):
            continue
        act: Act = "open" if goal.state == "is_open" else "turn_on"
        phrase = str(context.phrase(target.id))
        words = order(act, target.category, phrase, context.rng) | spoken_of(target.category)
        if constraint.kind == "object_moved":  # whoever opens it has moved what stood there, however far
            constraint = constraint.model_copy(update={"distance_m": ANY_MOVE_M})
        bare = episode.model_copy(
            update={
                "instruction": context.say(ORDERS, target=phrase, **words),
                "bindings": {"target": target.id},
                "goal": goal.model_copy(update={"constraint": constraint}),
            }
        )
        yield ClosureTask("silent_refusal", (bare,))


def look_alike(context: HouseContext) -> Tasks:
    """Yields tasks about one of two things of a kind in a room that differ in colour."""
    yield from _in_turn(*(_of_a_colour(context, act) for act in ("pick", *ALL_ACTS)))


def _of_a_colour(context: HouseContext, act: Act) -> Tasks:
    for episode in seeking(context, act):
        target = context.items[episode.goal.object_id]
        phrase = context.phrase(target.id)
        alike = next((item for item in context.items.values() if _is_other_colour(target, item)), None)
        if alike is None or phrase is None or phrase.colour is None or phrase != phrase.placeless:
            continue
        objects = {**episode.setup.objects, **setup_for(context.thing(alike.id), act).objects}
        both = {
            "bindings": {"target": target.id, ALIKE: alike.id},
            "setup": episode.setup.model_copy(update={"objects": objects}),
        }
        yield ClosureTask("look_alike", (episode.model_copy(update=both),))


def _is_other_colour(target: DescribedThing, item: DescribedThing) -> bool:
    is_alike = item.category == target.category and item.room_id == target.room_id
    return is_alike and bool(item.colours) and not set(item.colours) & set(target.colours)


def _refused(context: HouseContext, kind: Kind, rule: str, message: str) -> Rejection:
    return Rejection(family="SI", kind=kind, house=context.house.name, rule=rule, message=message)


PROPOSALS: dict[Kind, Callable[[HouseContext], Tasks]] = {
    "all_of": all_of,
    "impossible": impossible,
    "already": already,
    "silent_refusal": silent_refusal,
    "look_alike": look_alike,
}
"""Kind -> what proposes it."""
