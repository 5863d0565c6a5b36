"""Tasks about several things: all things of one name in a room, or whatever is on or open in a room or the home."""

import re
from collections.abc import Callable, Iterable, Iterator, Sequence

import numpy as np

from vigil.authoring.closure.partly_open import DRAWERS_AND_DOORS, can_be_partly_open, random_partial_openness
from vigil.authoring.closure.tasks import FLAMES, LEVEL_DEG, ClosureTask, Tasks, interleave, rejection
from vigil.authoring.drafting.drafts import Rejection
from vigil.authoring.drafting.house_context import HouseContext, TaskSpec
from vigil.authoring.drafting.proposals import allows, goal_for, is_target, setup_for
from vigil.authoring.language.drawer_names import without_position
from vigil.authoring.language.referring import ROOM_NAMES, Phrase, referents
from vigil.authoring.language.wording import VERBS, Act, say
from vigil.authoring.solving.goal_actions import closed_containers_around
from vigil.base.geometry import Pose
from vigil.protocol.goals import AllOf, ObjectInState
from vigil.protocol.world import ObjectSetup, Setup
from vigil.scene.things import Thing

MIN_TARGETS, MAX_TARGETS = 2, 5
"""Least and greatest number of targets of an `all_of` task."""
MIN_TARGETS_BY_STATE = 3
"""Least number of targets that are identified by their state."""
MIN_CANDIDATES: dict[Act, tuple[int, int]] = {"turn_off": (5, 9), "close": (8, 14)}
"""Act -> least number of things that might need it, in a room and in the home, so that the agent must look around."""
TRIED_STARTS, FACING_SPREAD_DEG = 40, 40.0
"""Number of places tried for a start, and greatest angle (deg) between its heading and the first target's direction."""
TRIED_CHOICES = 3
"""Number of random choices of targets tried in a place."""
PARTLY_OPEN_SHARE = 0.6
"""Share of the open targets that are partly open; the others are wide open."""
ALL_ACTS: tuple[Act, ...] = ("turn_off", "close", "turn_on", "open")
FINISHED_STATE: dict[Act, ObjectSetup] = {"turn_off": ObjectSetup(is_toggled=False), "close": ObjectSetup(openness=0.0)}
"""Act -> state of a thing that does not need it."""
EVERY = (
    "{Verb} every {name} in the {room}.",
    "Please {verb} every {name} in the {room}.",
    "Go through the {room}: {verb} every {name} in the {room}.",
    "I would like you to {verb} every {name} in the {room}.",
)
EVERYTHING: dict[Act, tuple[str, ...]] = {
    "turn_off": (
        "Turn off everything in {place} that is on, except for ceiling lights and candles.",
        "Please switch off everything in {place} that is on, but leave ceiling lights and candles.",
        "We are leaving: turn off everything in {place} that is on, except for ceiling lights and candles.",
    ),
    "close": (
        "Close every drawer and every door of furniture and appliances in {place} that is not fully closed.",
        "Please shut every drawer and every door of furniture and appliances in {place} that stands open, if only a "
        "little.",
        "Tidy up: close every drawer and every door of furniture and appliances in {place} that is not fully closed.",
    ),
}
LIGHTS = frozenset({"CeilingLamp", "LightSwitch"})
"""Categories that remain on when everything else must be off."""
HOME = "this home"
"""Words for all rooms together in an instruction."""
_ROOM = f"(?P<room>{'|'.join(ROOM_NAMES.values())})"
BY_NAME_PATTERN = re.compile(rf"\bevery (?P<name>[\w -]+?) in the {_ROOM}\b")
BY_STATE_PATTERN = re.compile(
    rf"\bevery(?:thing|.* door).* in (?:the {_ROOM}|{HOME}) that (?P<state>is on|is not fully closed|stands open)\b"
)


def all_of(context: HouseContext) -> Tasks:
    """Yield tasks about several things: all things of one name, or all things that are on or open."""
    yield from interleave(
        context,
        _by_name(context),
        *(_by_state(context, act, over) for act in EVERYTHING for over in (rooms_named_once, home)),
    )


def _by_name(context: HouseContext) -> Tasks:
    for act in ALL_ACTS:
        groups: dict[tuple[str, str, str], list[Thing]] = {}
        for thing in context.shuffled([each for each in context.view.scene.things.values() if each.is_present]):
            item = context.items[thing.id]
            if may_be_asked(thing, act) and item.room and item.room_id:
                groups.setdefault((without_position(item.name), item.room, item.room_id), []).append(thing)
        for (name, room, room_id), things in groups.items():
            if len(things) < MIN_TARGETS:
                continue
            if not _means_exactly(context, name, room, {thing.id for thing in things}):
                yield rejection(
                    context, "all_of", "distinguished", f"every {name} in the {room}: the words also mean other things"
                )
            elif len(things) > MAX_TARGETS:
                yield rejection(context, "all_of", "few_enough", f"{len(things)} things are a {name} in {room_id}")
            else:
                verb = VERBS[act][int(context.rng.integers(len(VERBS[act])))].replace(" {}", "")
                sentence = say(EVERY, context.rng, verb=verb, name=name, room=room)
                objects = {
                    key: change for each in things for key, change in setup_on_or_open(context, each, act).items()
                }
                yield _task_about_all(context, act, sentence, things, Setup(objects=objects), "named")


PlaceObjects = Callable[[HouseContext], Iterator[tuple[str, list[Thing]]]]
"""A function that yields the places that "everything" can refer to, each with the things that are there."""


def _by_state(context: HouseContext, act: Act, over: PlaceObjects) -> Tasks:
    for place, things in over(context):
        fit = [each for each in things if is_counted(each, act) and not is_shut_away(context, each)]
        rooms = {context.items[each.id].room_id for each in fit}
        if len(fit) < MIN_CANDIDATES[act][place == HOME] or (place == HOME and len(rooms) < 2):
            yield rejection(context, "all_of", "few_enough", f"{len(fit)} things can be asked for in {place}")
            continue
        for _ in range(TRIED_CHOICES):
            most = min(MAX_TARGETS, len(fit))
            chosen = _random_targets(context, fit, int(context.rng.integers(MIN_TARGETS_BY_STATE, most + 1)))
            asked = {key: change for thing in chosen for key, change in setup_on_or_open(context, thing, act).items()}
            others = {each.id: FINISHED_STATE[act] for each in on_or_open(things, act) if each.id not in asked}
            sentence = say(EVERYTHING[act], context.rng, place=place)
            form = form_for_place("on" if act == "turn_off" else "open", place)
            yield _task_about_all(context, act, sentence, chosen, Setup(objects={**others, **asked}), form)


def form_for_place(form: str, place: str) -> str:
    """Return the name of a form for a place, which is one room or the home."""
    return f"{form}_home" if place == HOME else f"{form}_room"


def home(context: HouseContext) -> Iterator[tuple[str, list[Thing]]]:
    """Yield the home with all things in its rooms, if it has several rooms."""
    if len(context.view.scene.rooms) > 1:
        yield HOME, [context.thing(item.id) for item in context.items.values() if item.room_id is not None]


def rooms_named_once(context: HouseContext) -> Iterator[tuple[str, list[Thing]]]:
    """Yield the rooms whose name is unique, each in words and with the things that are there."""
    rooms = context.view.scene.rooms
    for room in rooms:
        name = ROOM_NAMES.get(room.room_type)
        if name is not None and sum(each.room_type == room.room_type for each in rooms) == 1:
            yield f"the {name}", [context.thing(item.id) for item in context.items.values() if item.room_id == room.id]


def setup_on_or_open(context: HouseContext, thing: Thing, act: Act) -> dict[str, ObjectSetup]:
    """Return the changes after which an act still has to be done; what must be closed is partly or wide open."""
    if act == "close" and can_be_partly_open(thing) and context.rng.random() < PARTLY_OPEN_SHARE:
        return {thing.id: ObjectSetup(openness=random_partial_openness(thing, context.rng))}
    return dict(setup_for(thing, act).objects)


def may_be_asked(thing: Thing, act: Act) -> bool:
    """Return whether a thing may be a target of an act."""
    return is_target(thing) and allows(thing, act) and thing.category not in FLAMES


def is_counted(thing: Thing, act: Act) -> bool:
    """Return whether a thing counts as one of "all that are on or open" and may be asked for."""
    return may_be_asked(thing, act) and _is_meant(thing, act)


def _is_meant(thing: Thing, act: Act) -> bool:
    """Return whether "every drawer and door", or "everything except the ceiling lights", includes a thing."""
    return thing.category in DRAWERS_AND_DOORS if act == "close" else thing.category not in LIGHTS | FLAMES


def is_shut_away(context: HouseContext, thing: Thing) -> bool:
    """Return whether a thing lies in a closed container, so that its state cannot be seen."""
    return bool(closed_containers_around(context.view, thing.id))


def _random_targets(context: HouseContext, things: list[Thing], count: int) -> list[Thing]:
    """Return `count` random things, from at least two rooms if they are in several."""
    chosen = context.shuffled(things)
    first = context.items[chosen[0].id].room_id
    elsewhere = next((each for each in chosen if context.items[each.id].room_id != first), chosen[1])
    return [chosen[0], elsewhere, *(each for each in chosen[1:] if each is not elsewhere)][:count]


def on_or_open(things: Iterable[Thing], act: Act) -> list[Thing]:
    """Return the things that are on (except ceiling lights and flames), or the open drawers and doors, by act."""
    meant = [thing for thing in things if _is_meant(thing, act)]
    return [thing for thing in meant if (thing.is_toggled if act == "turn_off" else thing.openness > 0.0)]


def _means_exactly(context: HouseContext, name: str, room: str, ids: set[str]) -> bool:
    """Return whether a name refers to exactly these things."""
    return {item.id for item in referents(Phrase(name, room=room), context.items.values())} == ids


def _task_about_all(
    context: HouseContext, act: Act, sentence: str, things: list[Thing], setup: Setup, form: str
) -> ClosureTask | Rejection:
    parts = [part for thing in things if isinstance(part := goal_for(thing, act), ObjectInState)]
    if not context.can_begin(setup):
        return rejection(context, "all_of", "can_be_set_up", sentence)
    start = _start_missing_some(context, things)
    context.begin(Setup())
    if start is None:
        return rejection(context, "all_of", "some_out_of_view", sentence)
    task = TaskSpec(
        start=start,
        setup=setup,
        instruction=sentence,
        goal=AllOf(object_id=parts[0].object_id, parts=tuple(parts)),
        bindings={"target": things[0].id, **{f"target_{n}": each.id for n, each in enumerate(things[1:], start=2)}},
        template=act,
    )
    return ClosureTask("all_of", (context.draft("SI", task),), form=form)


def _start_missing_some(context: HouseContext, things: list[Thing]) -> Pose | None:
    """Return a start pose in the first thing's room that sees some of the things, at most half; None without one."""
    home = context.view.room_at(things[0].position)
    for place in context.starts(lambda places: np.full(len(places), True), TRIED_STARTS):
        if context.view.room_at(place) != home:
            continue
        pose = context.facing(place, things[0], LEVEL_DEG, FACING_SPREAD_DEG)
        with context.view.at_pose(pose):
            seen = [context.view.state_of(thing.id).visible_px for thing in things]
        if max(seen) > 0 and hides_half(seen) and context.has_room_to_move(pose):
            return pose
    return None


def hides_half(seen_px: Sequence[int]) -> bool:
    """Return whether at least half of several things are out of view, given the visible pixels of each."""
    return 2 * sum(px == 0 for px in seen_px) >= len(seen_px)
