"""Functions that propose twins that ask to make sure of a state, and that check these twins."""

import re
from collections.abc import Iterator

from vigil.authoring.closure.asking import start_near
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
    on_or_open,
    rooms_named_once,
    things_in_room,
)
from vigil.authoring.closure.kinds.already import EVERYTHING_FORMS
from vigil.authoring.closure.states import drafts_of_state, phrase_for_state, setup_with_goal_met, unfinished_setup
from vigil.authoring.closure.tasks import ClosureTask, Tasks, interleave
from vigil.authoring.drafting.house_context import HouseContext
from vigil.authoring.drafting.proposals import goal_for, setup_for
from vigil.authoring.language.wording import Act, say
from vigil.authoring.solving.evidence import gap_evidence, object_evidence
from vigil.authoring.solving.privileged_view import PrivilegedView
from vigil.protocol.actions import Action
from vigil.protocol.episode import Episode
from vigil.protocol.goals import MAX_PARTS, AllOf, ObjectInState
from vigil.protocol.world import Setup
from vigil.scene.things import Thing

MAKE_SURE = (
    "Make sure that {whole} is {label}.",
    "See to it that {whole} is {label}.",
    "Please make sure that {whole} is {label}.",
    "Before we leave, make sure that {whole} is {label}.",
)
MAKE_SURE_ALL: dict[Act, tuple[str, ...]] = {
    "turn_off": (
        "Make sure that everything in {place} is off, except for ceiling lights and candles.",
        "Please see to it that everything in {place} is off; only ceiling lights and candles may stay on.",
        "Before we leave, make sure that everything in {place} is off, except for ceiling lights and candles.",
    ),
    "close": (
        "Make sure that every drawer and every door of furniture and appliances in {place} is fully closed.",
        "Please see to it that every drawer and every door of furniture and appliances in {place} is fully closed.",
        "Before we leave, make sure that every drawer and every door of furniture and appliances in {place} is fully "
        "closed.",
    ),
}
MAKE_SURE_ALL_PATTERN = re.compile(rf"\bevery(?:thing)?\b.* in (?:the {ROOM}|{HOME})\b")
LABELS: dict[Act, str] = {"open": "open", "close": "fully closed", "turn_on": "on", "turn_off": "off"}


def already(context: HouseContext) -> Tasks:
    """Yield twins that ask to make sure of a state. On the second side, the state already holds at the start."""
    one = interleave(context, *(_about_one(context, act) for act in ALL_ACTS))
    everything = (_about_all(context, act, over(context)) for act in MAKE_SURE_ALL for over in (rooms_named_once, home))
    yield from interleave(context, one, *everything)


def _about_one(context: HouseContext, act: Act) -> Tasks:
    for episode, goal, target in drafts_of_state(context, act):
        whole = phrase_for_state(context, target, act)
        sentence = say(MAKE_SURE, context.rng, whole=whole, label=LABELS[act])
        setup, evidence = unfinished_setup(context, episode.setup, target, act)
        first = episode.model_copy(update={"instruction": sentence, "setup": setup})
        second = first.model_copy(update={"setup": setup_with_goal_met(first, goal)})
        yield ClosureTask("already", (first, second), target.id, evidence, "one_thing")


def _about_all(context: HouseContext, act: Act, places: Places) -> Tasks:
    """Yield twins that ask to make sure that all things in a place are off or closed. On the first side, one is not."""
    for place, things in places:
        found = _meant(things, act)
        if not MIN_TARGETS <= len(found) <= MAX_PARTS:
            yield context.rejection("SI", "already", "few_enough", f"{len(found)} things can be asked about in {place}")
        elif any(is_shut_away(context, thing) or not is_counted(thing, act) for thing in found):
            yield context.rejection(
                "SI", "already", "place_can_be_seen", f"something in {place} cannot be asked about or seen"
            )
        else:
            for target in context.shuffled(found):
                others = [thing for thing in found if thing is not target]
                yield from _all_but_one(context, act, place, target, others)


def _meant(things: list[Thing], act: Act) -> list[Thing]:
    """Return the things that the instruction is about: all possible targets, and other things that are on or open."""
    ids = {thing.id for thing in on_or_open(things, act)}
    return [thing for thing in things if is_counted(thing, act) or thing.id in ids]


def _all_but_one(context: HouseContext, act: Act, place: str, target: Thing, others: list[Thing]) -> Tasks:
    """Yield twins: on the first side only the target still needs the act, on the second side nothing does.

    The target is out of view at the start. Nothing is yielded if the setup is impossible or no start is found.
    """
    at_rest = {thing.id: FINISHED_STATE[act] for thing in others}
    rest = Setup(objects={**at_rest, **setup_for(target, act).objects})
    setup, _ = unfinished_setup(context, rest, target, act)
    if not context.can_begin(setup):
        return
    evidence = tuple(
        gap_evidence(each, 0.0) if act == "close" else object_evidence(each.id) for each in (target, *others)
    )
    start = start_near(context, others[0], target.id, min_px=1)
    context.begin(Setup())
    if start is None:
        return
    form = f"{'off' if act == 'turn_off' else 'closed'}_{'home' if place == HOME else 'room'}"
    sentence = say(MAKE_SURE_ALL[act], context.rng, place=place)
    first = draft_about_all(context, act, (target, *others), start, (setup, sentence))
    goal = goal_for(target, act)
    assert isinstance(goal, ObjectInState)
    second = first.model_copy(update={"setup": setup_with_goal_met(first, goal)})
    yield ClosureTask("already", (first, second), target.id, evidence, form)


def faults(
    view: PrivilegedView, task: ClosureTask, episode: Episode, _: tuple[Action, ...]
) -> Iterator[tuple[str, str]]:
    """Yield (rule, message) if the instruction means other things than the goal."""
    goal = episode.goal
    if task.form in EVERYTHING_FORMS and isinstance(goal, AllOf):
        found = MAKE_SURE_ALL_PATTERN.search(episode.instruction)
        is_open = isinstance(goal.parts[0], ObjectInState) and goal.parts[0].state == "is_open"
        here = things_in_room(view, found["room"]) if found else []
        read = {thing.id for thing in _meant(here, "close" if is_open else "turn_off")}
        yield from faults_of_referents(read, task.meant)
