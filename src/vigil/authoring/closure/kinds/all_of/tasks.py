"""Functions that propose tasks about several things, and that check such tasks."""

import re
from collections.abc import Iterator, Sequence

import numpy as np

from vigil.authoring.closure.everything import (
    ALL_ACTS,
    FINISHED_STATE,
    HOME,
    MIN_TARGETS,
    ROOM,
    Places,
    draft_about_all,
    faults_of_referents,
    home,
    is_counted,
    is_shut_away,
    may_be_asked,
    on_or_open,
    rooms_named_once,
    things_in_room,
)
from vigil.authoring.closure.tasks import BY_NAME, LEVEL_DEG, ClosureTask, Tasks, interleave
from vigil.authoring.drafting.drafts import Rejection
from vigil.authoring.drafting.house_context import HouseContext
from vigil.authoring.drafting.proposals import setup_for
from vigil.authoring.language.drawer_names import without_position
from vigil.authoring.language.referring import Phrase, items_of, referents
from vigil.authoring.language.wording import VERBS, Act, say
from vigil.authoring.solving.evidence import can_be_partly_open, random_partial_openness
from vigil.authoring.solving.privileged_view import PrivilegedView
from vigil.base.geometry import Pose
from vigil.protocol.actions import Action
from vigil.protocol.episode import Episode
from vigil.protocol.world import ObjectSetup, Setup
from vigil.scene.things import Thing

MAX_TARGETS = 5
"""Maximum number of targets of one task."""
MIN_TARGETS_BY_STATE = 3
"""Minimum number of targets if the instruction identifies them by their state ("everything that is on")."""
MIN_CANDIDATES: dict[Act, tuple[int, int]] = {"turn_off": (5, 9), "close": (8, 14)}
"""Act -> minimum numbers of things, in a room and in the home, that may need the act, so that the agent must search."""
TRIED_STARTS, FACING_SPREAD_DEG = 40, 40.0
"""Number of places tried for a start, and maximum angle (deg) between the start's heading and the first target."""
TRIED_CHOICES = 3
"""Number of random choices of targets that are tried for each place."""
PARTLY_OPEN_SHARE = 0.6
"""Share of the open targets that are only partly open; the other open targets are wide open."""
MAX_ACTING_SHARE = 0.6
"""Maximum share of the step budget that acting may use if the agent must first look for the targets."""
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
BY_NAME_PATTERN = re.compile(rf"\bevery (?P<name>[\w -]+?) in the {ROOM}\b")
BY_STATE_PATTERN = re.compile(
    rf"\bevery(?:thing|.* door).* in (?:the {ROOM}|{HOME}) that (?P<state>is on|is not fully closed|stands open)\b"
)


def all_of(context: HouseContext) -> Tasks:
    """Yield tasks about several things: all things of one name, or all things that are on or open."""
    yield from interleave(
        context,
        _by_name(context),
        *(_by_state(context, act, over(context)) for act in EVERYTHING for over in (rooms_named_once, home)),
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
            meant = referents(Phrase(name, room=room), context.items.values())
            if {item.id for item in meant} != {thing.id for thing in things}:
                yield context.rejection(
                    "SI", "all_of", "distinguished", f"every {name} in the {room}: the words also mean other things"
                )
            elif len(things) > MAX_TARGETS:
                yield context.rejection(
                    "SI", "all_of", "few_enough", f"{len(things)} things in {room_id} are called {name!r}"
                )
            else:
                verb = VERBS[act][int(context.rng.integers(len(VERBS[act])))].replace(" {}", "")
                sentence = say(EVERY, context.rng, verb=verb, name=name, room=room)
                yield _task(context, act, sentence, things, Setup(objects=_unfinished(context, things, act)), BY_NAME)


def _by_state(context: HouseContext, act: Act, places: Places) -> Tasks:
    for place, things in places:
        fit = [each for each in things if is_counted(each, act) and not is_shut_away(context, each)]
        rooms = {context.items[each.id].room_id for each in fit}
        if len(fit) < MIN_CANDIDATES[act][place == HOME] or (place == HOME and len(rooms) < 2):
            yield context.rejection("SI", "all_of", "few_enough", f"{len(fit)} things can be asked for in {place}")
            continue
        form = f"{'on' if act == 'turn_off' else 'open'}_{'home' if place == HOME else 'room'}"
        for _ in range(TRIED_CHOICES):
            count = int(context.rng.integers(MIN_TARGETS_BY_STATE, min(MAX_TARGETS, len(fit)) + 1))
            chosen = _random_targets(context, fit, count)
            asked = _unfinished(context, chosen, act)
            others = {each.id: FINISHED_STATE[act] for each in on_or_open(things, act) if each.id not in asked}
            sentence = say(EVERYTHING[act], context.rng, place=place)
            yield _task(context, act, sentence, chosen, Setup(objects={**others, **asked}), form)


def _unfinished(context: HouseContext, things: list[Thing], act: Act) -> dict[str, ObjectSetup]:
    """Return changes to things, after which each thing needs the act. Some of the things may be only partly open."""
    changes: dict[str, ObjectSetup] = {}
    for thing in things:
        if act == "close" and can_be_partly_open(thing) and context.rng.random() < PARTLY_OPEN_SHARE:
            changes[thing.id] = ObjectSetup(openness=random_partial_openness(thing, context.rng))
        else:
            changes |= setup_for(thing, act).objects
    return changes


def _random_targets(context: HouseContext, things: list[Thing], count: int) -> list[Thing]:
    """Return `count` random things. If the things are in several rooms, those returned are in at least two rooms."""
    chosen = context.shuffled(things)
    first = context.items[chosen[0].id].room_id
    elsewhere = next((each for each in chosen if context.items[each.id].room_id != first), chosen[1])
    return [chosen[0], elsewhere, *(each for each in chosen[1:] if each is not elsewhere)][:count]


def _task(
    context: HouseContext, act: Act, sentence: str, things: list[Thing], setup: Setup, form: str
) -> ClosureTask | Rejection:
    if not context.can_begin(setup):
        return context.rejection("SI", "all_of", "can_be_set_up", sentence)
    start = _start_missing_some(context, things)
    context.begin(Setup())
    if start is None:
        return context.rejection("SI", "all_of", "some_out_of_view", sentence)
    return ClosureTask("all_of", (draft_about_all(context, act, things, start, (setup, sentence)),), form=form)


def _start_missing_some(context: HouseContext, things: list[Thing]) -> Pose | None:
    """Return a start pose in the first thing's room with at least one of the things in view, but at most half of them;
    None if there is no such pose."""
    room = context.view.room_at(things[0].position)
    for place in context.starts(lambda places: np.full(len(places), True), TRIED_STARTS):
        if context.view.room_at(place) != room:
            continue
        pose = context.facing(place, things[0], LEVEL_DEG, FACING_SPREAD_DEG)
        with context.view.at_pose(pose):
            seen = [context.view.is_in_frame(thing.id) for thing in things]
        if any(seen) and _hides_half(seen) and context.has_room_to_move(pose):
            return pose
    return None


def _hides_half(seen: Sequence[bool]) -> bool:
    """Return whether at least half of several things are out of view; `seen` says of each whether it is in view."""
    return 2 * sum(seen) <= len(seen)


def faults(
    view: PrivilegedView, task: ClosureTask, episode: Episode, actions: tuple[Action, ...]
) -> Iterator[tuple[str, str]]:
    """Yield (rule, message) if the instruction means other things than the goal, if too many targets are in view at the
    start, or if the step budget is too small to look for the targets."""
    yield from faults_of_referents(_read_back(view, episode.instruction), task.meant)
    seen = [view.is_in_frame(thing_id) for thing_id in set(task.meant)]
    if not _hides_half(seen):
        yield "some_out_of_view", f"more than half of the {len(seen)} targets are in view at the start"
    if task.form != BY_NAME and len(actions) > MAX_ACTING_SHARE * episode.max_steps:
        yield "time_to_look", f"acting alone takes {len(actions)} of {episode.max_steps} steps"


def _read_back(view: PrivilegedView, instruction: str) -> set[str]:
    """Return the ids of all things that the words "every ..." or "everything that ..." mean in the current state."""
    if by_state := BY_STATE_PATTERN.search(instruction):
        act: Act = "turn_off" if by_state["state"] == "is on" else "close"
        return {thing.id for thing in on_or_open(things_in_room(view, by_state["room"]), act)}
    if named := BY_NAME_PATTERN.search(instruction):
        phrase = Phrase(named["name"], room=named["room"])
        return {item.id for item in referents(phrase, items_of(view.scene).values())}
    return set()
