"""Tasks about several things of a room: all of a name, or all that are on or stand open."""

import re
from collections.abc import Iterable

import numpy as np

from vigil.authoring.closure.tasks import FLAMES, LEVEL_DEG, ClosureTask, Tasks, in_turn, refused
from vigil.authoring.drafting.drafts import Rejection
from vigil.authoring.drafting.house_context import HouseContext, TaskSpec
from vigil.authoring.drafting.proposals import allows, goal_for, is_target, setup_for
from vigil.authoring.language.ordinals import bare
from vigil.authoring.language.referring import ROOM_NAMES, Phrase, referents
from vigil.authoring.language.wording import VERBS, Act, say
from vigil.goals import AllOf, ObjectInState
from vigil.pose import Pose
from vigil.scene.things import Thing
from vigil.world import ObjectSetup, Setup

FEWEST, MOST = 2, 5
"""Targets of an `all_of` task."""
TRIED_STARTS = 40
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
DOORS = frozenset({"Doorway", "Doorframe"})


def all_of(context: HouseContext) -> Tasks:
    """Yields tasks about several things of a room: all of a name, or all that are on or stand open."""
    yield from in_turn(context, _by_name(context), _by_state(context, "turn_off"), _by_state(context, "close"))


def _by_name(context: HouseContext) -> Tasks:
    for act in ALL_ACTS:
        groups: dict[tuple[str, str, str], list[Thing]] = {}
        for thing in context.shuffled([each for each in context.oracle.scene.things.values() if each.is_present]):
            item = context.items[thing.id]
            if is_target(thing) and allows(thing, act) and item.room and item.room_id and thing.category not in FLAMES:
                groups.setdefault((bare(item.name), item.room, item.room_id), []).append(thing)
        for (name, room, room_id), things in groups.items():
            if len(things) < FEWEST:
                continue
            if not _are_all(context, name, room, {thing.id for thing in things}):
                yield refused(context, "all_of", "told_apart", f"every {name} in the {room}: others answer to it too")
            elif len(things) > MOST:
                yield refused(context, "all_of", "few_enough", f"{len(things)} things are a {name} in {room_id}")
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
            yield refused(context, "all_of", "few_enough", f"{len(fit)} things can be asked for in the {name}")
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
        return refused(context, "all_of", "can_be_set_up", sentence)
    start = _start_missing_some(context, things)
    context.begin(Setup())
    if start is None:
        return refused(context, "all_of", "some_out_of_view", sentence)
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
