"""Twins that ask for a state that may hold already, or for one of two acts depending on a state.

The state that may hold already is that of one thing, of a room or of the home.
"""

import re
from collections.abc import Iterator

from vigil.authoring.closure.all_of import (
    ALL_ACTS,
    FINISHED_STATE,
    HOME,
    MIN_TARGETS,
    PlaceObjects,
    form_for_place,
    home,
    is_counted,
    is_shut_away,
    on_or_open,
    rooms_named_once,
)
from vigil.authoring.closure.partly_open import can_be_partly_open, gap_evidence, random_partial_openness
from vigil.authoring.closure.tasks import (
    FLAMES,
    LEVEL_DEG,
    NEAR_M,
    ClosureTask,
    Tasks,
    interleave,
    is_out_of_view_from,
    object_evidence,
    rejection,
)
from vigil.authoring.drafting.house_context import HouseContext, TaskSpec
from vigil.authoring.drafting.proposals import (
    SV_TOGGLES,
    allows,
    goal_for,
    is_seen,
    is_target,
    setup_for,
)
from vigil.authoring.families.si.drafts import seeking
from vigil.authoring.language.referring import ROOM_NAMES
from vigil.authoring.language.wording import VERBS, Act, opening_phrase, order_slots, say
from vigil.authoring.review.synthetic_records import changed_setup
from vigil.protocol.episode import Episode
from vigil.protocol.goals import MAX_PARTS, AllOf, ObjectInState
from vigil.protocol.world import ObjectSetup, Setup
from vigil.scene.things import Thing
from vigil.scoring.closure import OTHERWISE, Evidence

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
MAKE_SURE_ALL_PATTERN = re.compile(
    rf"\bevery(?:thing)?\b.* in (?:the (?P<room>{'|'.join(ROOM_NAMES.values())})|{HOME})\b"
)
EVERYTHING_FORMS = ("off_room", "off_home", "closed_room", "closed_home")
"""Forms that ask about everything in a room or in the home."""
IF_SO = (
    "If {whole} is {label}, {order_it}; otherwise {other}.",
    "Check {whole}: if it is {label}, {order_it}; if not, {other}.",
    "Look whether {whole} is {label}. If so, {order_it}. If not, {other}.",
    "Should {whole} be {label}, {order_it}. Otherwise, {other}.",
)
LABELS: dict[Act, str] = {"open": "open", "close": "fully closed", "turn_on": "on", "turn_off": "off"}
CONDITION_LABELS: dict[Act, str] = {"close": "open, even a little", "turn_off": "on"}
"""Act that is asked for if a condition holds -> words of the condition."""
MAX_ALTERNATIVES_TRIED = 3


def already(context: HouseContext) -> Tasks:
    """Yield twins that ask to make sure of a state, which holds from the start on one side."""
    one = interleave(context, *(_make_sure_tasks(context, act) for act in ALL_ACTS))
    yield from interleave(
        context,
        one,
        *(_make_sure_all_tasks(context, act, over) for act in MAKE_SURE_ALL for over in (rooms_named_once, home)),
    )


def _make_sure_tasks(context: HouseContext, act: Act) -> Tasks:
    for episode, goal, target in _of_state(context, act):
        whole = _phrase_for_state(context, target, act)
        sentence = say(MAKE_SURE, context.rng, whole=whole, label=LABELS[act])
        setup, evidence = _unfinished_setup(context, episode.setup, target, act)
        first = episode.model_copy(update={"instruction": sentence, "setup": setup})
        second = first.model_copy(update={"setup": setup_with_goal_met(first, goal)})
        yield ClosureTask("already", (first, second), target.id, evidence, "one_thing")


def _unfinished_setup(
    context: HouseContext, setup: Setup, target: Thing, act: Act
) -> tuple[Setup, tuple[Evidence, ...]]:
    """Return the setup in which an act still has to be done, and the evidence for it.

    What must be closed is partly open if a frame can show that.
    """
    if act != "close" or not can_be_partly_open(target):
        return setup, (object_evidence(target.id),)
    return changed_setup(setup, target.id, openness=random_partial_openness(target, context.rng)), (
        gap_evidence(target, 0.0),
    )


def _make_sure_all_tasks(context: HouseContext, act: Act, over: PlaceObjects) -> Tasks:
    """Yield twins that ask to make sure of a room or the home, where at most one thing still needs the act."""
    for place, things in over(context):
        found = objects_meant(things, act)
        if not MIN_TARGETS <= len(found) <= MAX_PARTS:
            yield rejection(context, "already", "few_enough", f"{len(found)} things can be asked about in {place}")
        elif any(is_shut_away(context, thing) or not is_counted(thing, act) for thing in found):
            yield rejection(
                context, "already", "place_can_be_seen", f"something in {place} cannot be asked about or seen"
            )
        else:
            for target in context.shuffled(found):
                task = _all_but_one_task(context, act, place, target, [thing for thing in found if thing is not target])
                if task is not None:
                    yield task


def objects_meant(things: list[Thing], act: Act) -> list[Thing]:
    """Return the things that must not be on, or open: those that may be asked about, and those that are on or open."""
    ids = {thing.id for thing in on_or_open(things, act)}
    return [thing for thing in things if is_counted(thing, act) or thing.id in ids]


def _all_but_one_task(
    context: HouseContext, act: Act, place: str, target: Thing, others: list[Thing]
) -> ClosureTask | None:
    """Return twins: on the first side only the target still needs the act, on the second nothing does.

    The target is out of view at the start. None if the setup is impossible or no start is found.
    """
    at_rest = {thing.id: FINISHED_STATE[act] for thing in others}
    rest = Setup(objects={**at_rest, **setup_for(target, act).objects})
    setup, _ = _unfinished_setup(context, rest, target, act)
    if not context.can_begin(setup):
        return None
    evidence = tuple(
        gap_evidence(each, 0.0) if act == "close" else object_evidence(each.id) for each in (target, *others)
    )
    start = context.start_seeing(
        others[0], NEAR_M, LEVEL_DEG, is_seen(1), lambda pose: is_out_of_view_from(context, pose, target.id)
    )
    context.begin(Setup())
    if start is None:
        return None
    parts = [part for each in (target, *others) if isinstance(part := goal_for(each, act), ObjectInState)]
    form = form_for_place("off" if act == "turn_off" else "closed", place)
    first = context.draft(
        "SI",
        TaskSpec(
            start=start,
            setup=setup,
            instruction=say(MAKE_SURE_ALL[act], context.rng, place=place),
            goal=AllOf(object_id=target.id, parts=tuple(parts)),
            bindings={"target": target.id, **{f"target_{n}": each.id for n, each in enumerate(others, start=2)}},
            template=act,
        ),
    )
    second = first.model_copy(update={"setup": setup_with_goal_met(first, parts[0])})
    return ClosureTask("already", (first, second), target.id, evidence, form)


def _of_state(context: HouseContext, act: Act) -> Iterator[tuple[Episode, ObjectInState, Thing]]:
    """Yield SI drafts of an act that changes a clearly visible state, with goal and target."""
    for episode in seeking(context, act):
        goal, target = episode.goal, context.thing(episode.goal.object_id)
        is_plain = act in ("open", "close") or target.category in SV_TOGGLES - FLAMES
        if isinstance(goal, ObjectInState) and is_plain:
            yield episode, goal, target


def _phrase_for_state(context: HouseContext, target: Thing, act: Act) -> str:
    """Return the words for the thing, or its part, whose state is asked about."""
    phrase = str(context.phrase(target.id))
    return opening_phrase(target.category, phrase).whole if act in ("open", "close") else phrase


def setup_with_goal_met(episode: Episode, goal: ObjectInState) -> Setup:
    """Return an episode's setup in which the goal holds from the start."""
    change = ObjectSetup(openness=float(goal.value)) if goal.state == "is_open" else ObjectSetup(is_toggled=goal.value)
    facts = change.model_dump(exclude_none=True, exclude={"is_absent", "is_broken"})
    return changed_setup(episode.setup, goal.object_id, **facts)


def if_so(context: HouseContext) -> Tasks:
    """Yield twins that ask for one act if a state holds, and for another act if it does not."""
    yield from interleave(context, *(_conditional_tasks(context, act) for act in CONDITION_LABELS))


def _conditional_tasks(context: HouseContext, act: Act) -> Tasks:
    for episode, goal, target in _of_state(context, act):
        room = context.view.room_at(target.position)
        others = context.things(
            lambda thing, target=target, room=room: _may_be_alternative(context, thing, target, room)
        )
        for other in others[:MAX_ALTERNATIVES_TRIED]:
            task = _conditional_task(context, episode, goal, target, other, act)
            if task is not None:
                yield task
                break


def _order_it(context: HouseContext, target: Thing, act: Act) -> str:
    """Return the order about the thing that was just named with the part that opens."""
    if act in ("open", "close"):
        return VERBS[act][int(context.rng.integers(len(VERBS[act])))].format("it")
    return order_slots(act, target.category, "", context.rng)["order_it"]


def _may_be_alternative(context: HouseContext, thing: Thing, target: Thing, room: str | None) -> bool:
    is_machine = is_target(thing) and (allows(thing, "turn_on") or allows(thing, "open"))
    is_plain = thing.category not in FLAMES and not thing.is_pickupable
    is_apart = thing.id != target.id and target.id not in (thing.parent,) and thing.id != target.parent
    return is_machine and is_plain and is_apart and context.view.room_at(thing.position) == room


def _conditional_task(
    context: HouseContext, episode: Episode, goal: ObjectInState, target: Thing, other: Thing, act: Act
) -> ClosureTask | None:
    """Return twins: on the first side the condition holds, on the second the other thing has to be acted on.

    None if the setup is impossible or one of the things cannot be named.
    """
    instead: Act = "turn_on" if allows(other, "turn_on") else "open"
    both = Setup(objects={**setup_for(other, instead).objects, **episode.setup.objects})
    setup, evidence = _unfinished_setup(context, both, target, act)
    if not context.can_begin(setup):
        return None
    phrase, other_phrase = context.phrase(target.id), context.phrase(other.id)
    whole = "" if phrase is None else _phrase_for_state(context, target, act)
    context.begin(Setup())
    if phrase is None or other_phrase is None:
        return None
    sentence = say(
        IF_SO,
        context.rng,
        whole=whole,
        label=CONDITION_LABELS[act],
        order_it=_order_it(context, target, act),
        other=order_slots(instead, other.category, str(other_phrase), context.rng)["order"],
    )
    state = "is_toggled" if instead == "turn_on" else "is_open"
    left = ObjectInState(object_id=other.id, state=state, value=False)
    asked = ObjectInState(object_id=other.id, state=state)
    facts = {"instruction": sentence, "setup": setup, "bindings": {"target": target.id, OTHERWISE: other.id}}
    first = episode.model_copy(update={**facts, "goal": AllOf(object_id=target.id, parts=(goal, left))})
    second = first.model_copy(
        update={
            "setup": setup_with_goal_met(first, goal),
            "goal": AllOf(object_id=other.id, parts=(asked, goal)),
        }
    )
    return ClosureTask("if_so", (first, second), target.id, evidence, f"{act} {instead}")
