"""Things in a room or in the home that are on or open: functions that the kinds `all_of` and `already` share."""

from collections.abc import Iterable, Iterator, Sequence

from vigil.authoring.closure.tasks import FLAMES
from vigil.authoring.drafting.house_context import HouseContext, TaskSpec
from vigil.authoring.drafting.proposals import allows, goal_for, is_target
from vigil.authoring.language.referring import ROOM_NAMES, items_of
from vigil.authoring.language.wording import Act
from vigil.authoring.solving.evidence import DRAWERS_AND_DOORS
from vigil.authoring.solving.goal_actions import closed_containers_around
from vigil.authoring.solving.privileged_view import PrivilegedView
from vigil.base.geometry import Pose
from vigil.protocol.episode import Episode
from vigil.protocol.goals import AllOf, ObjectInState
from vigil.protocol.world import ObjectSetup, Setup
from vigil.scene.things import Thing

MIN_TARGETS = 2
"""Minimum number of targets of a task about several things."""
ALL_ACTS: tuple[Act, ...] = ("turn_off", "close", "turn_on", "open")
FINISHED_STATE: dict[Act, ObjectSetup] = {"turn_off": ObjectSetup(is_toggled=False), "close": ObjectSetup(openness=0.0)}
"""Act that an instruction can ask for with "everything" -> state in which a thing does not need the act."""
LIGHTS = frozenset({"CeilingLamp", "LightSwitch"})
"""Categories that may stay on when everything else must be off."""
HOME = "this home"
"""Words in an instruction that mean all rooms together."""
ROOM = f"(?P<room>{'|'.join(ROOM_NAMES.values())})"
"""Regular expression for the name of a room in an instruction."""
Places = Iterator[tuple[str, list[Thing]]]
"""Pairs of a place in words ("the kitchen", "this home") and the things in this place."""


def home(context: HouseContext) -> Places:
    """Yield the home with all things in its rooms; nothing if the home has only one room."""
    if len(context.view.scene.rooms) > 1:
        yield HOME, [context.thing(item.id) for item in context.items.values() if item.room_id is not None]


def rooms_named_once(context: HouseContext) -> Places:
    """Yield the rooms whose name is unique in the home, each with the things in the room."""
    rooms = context.view.scene.rooms
    for room in rooms:
        name = ROOM_NAMES.get(room.room_type)
        if name is not None and sum(each.room_type == room.room_type for each in rooms) == 1:
            yield f"the {name}", [context.thing(item.id) for item in context.items.values() if item.room_id == room.id]


def things_in_room(view: PrivilegedView, room: str | None) -> list[Thing]:
    """Return the things in the rooms called `room` (in all rooms if None), in the current state."""
    items = items_of(view.scene).values()
    return [view.scene.things[item.id] for item in items if item.room_id and room in (None, item.room)]


def may_be_asked(thing: Thing, act: Act) -> bool:
    """Return whether an act may be asked for on a thing: the thing allows it, may be a target, and has no flame."""
    return is_target(thing) and allows(thing, act) and thing.category not in FLAMES


def is_counted(thing: Thing, act: Act) -> bool:
    """Return whether an act may be asked for on a thing, and "everything that is on" or similar includes it."""
    return may_be_asked(thing, act) and _is_meant(thing, act)


def _is_meant(thing: Thing, act: Act) -> bool:
    """Return whether "every drawer and door", or "everything except the ceiling lights", includes a thing."""
    return thing.category in DRAWERS_AND_DOORS if act == "close" else thing.category not in LIGHTS | FLAMES


def on_or_open(things: Iterable[Thing], act: Act) -> list[Thing]:
    """Return the things that need an act: those that are on (not ceiling lights and flames), or those that are open."""
    meant = [thing for thing in things if _is_meant(thing, act)]
    return [thing for thing in meant if (thing.is_toggled if act == "turn_off" else thing.openness > 0.0)]


def is_shut_away(context: HouseContext, thing: Thing) -> bool:
    """Return whether a thing is in a closed container, so that the agent cannot see its state."""
    return bool(closed_containers_around(context.view, thing.id))


def draft_about_all(
    context: HouseContext, act: Act, things: Sequence[Thing], start: Pose, asked: tuple[Setup, str]
) -> Episode:
    """Return the draft of an episode that asks for an act on all of `things`; `asked` is (setup, instruction)."""
    setup, sentence = asked
    parts = tuple(part for thing in things if isinstance(part := goal_for(thing, act), ObjectInState))
    targets = {"target": things[0].id, **{f"target_{n}": each.id for n, each in enumerate(things[1:], start=2)}}
    goal = AllOf(object_id=parts[0].object_id, parts=parts)
    return context.draft("SI", TaskSpec(start, sentence, goal, targets, setup=setup, template=act))


def faults_of_referents(read: set[str], meant: frozenset[str]) -> Iterator[tuple[str, str]]:
    """Yield (rule, message) if the ids that were `read` from an instruction are not the ids that are `meant`."""
    if read != meant:
        yield "distinguished", f"the instruction means {len(read)} things, the goal is about {len(meant)}"
