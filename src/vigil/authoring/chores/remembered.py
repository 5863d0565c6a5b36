"""Proposals of chores that depend on how a thing was at the start, next to chores that change this thing.

An agent that changes the thing before it looks, or forgets what it saw, cannot know which act is asked for.
"""

from collections.abc import Iterator
from dataclasses import replace

from vigil.authoring.chores.pairs import order_pairs
from vigil.authoring.chores.proposed import ProposedChore, distractor_of, in_turn
from vigil.authoring.chores.sentences import IF_AT_FIRST
from vigil.authoring.chores.states import CONDITION_LABELS, goal_of, is_plain, made_so, sure_of, targets_of
from vigil.authoring.closure.states import phrase_for_state
from vigil.authoring.closure.tasks import FLAMES
from vigil.authoring.drafting.house_context import HouseContext
from vigil.authoring.drafting.proposals import allows, is_target, setup_for
from vigil.authoring.language.wording import Act, order_slots
from vigil.protocol.goals import Chore, ObjectAtReceptacle
from vigil.scene.things import Thing

Group = tuple[ProposedChore, ...]


def remembered(context: HouseContext) -> Iterator[Group]:
    """Yield groups of two or three chores, of which the last is conditional.

    It asks for an act on one of two other things, depending on how a thing was at the start. The other chores of the
    group change this thing, or make sure of its state: one chore, or a pair of kind `order` about a container.
    """
    yield from in_turn(*(_with_sure(context, act) for act in CONDITION_LABELS), _with_pairs(context))


def _with_sure(context: HouseContext, act: Act) -> Iterator[Group]:
    acts: tuple[Act, ...] = ("open", "close") if act == "close" else ("turn_on", "turn_off")
    for thing in [each for each in targets_of(context, act) if is_plain(each, act)]:
        later = _later(context, thing, act, is_met=bool(context.rng.integers(2)))
        if later is not None:
            wanted = acts[int(context.rng.integers(2))]
            is_met = (wanted in ("open", "turn_on")) == later.chore.is_met
            yield replace(sure_of(context, thing, wanted, is_met=is_met), changes=later.changes), later


def _with_pairs(context: HouseContext) -> Iterator[Group]:
    for pair in order_pairs(context):
        part = pair[0].chore.parts[0]
        assert isinstance(part, ObjectAtReceptacle)
        thing = context.thing(part.receptacle_id)
        start = pair[0].changes.get(thing.id)
        if thing.is_openable and not thing.is_toggleable and start is not None and start.openness is not None:
            later = _later(context, thing, "close", is_met=start.openness == 1.0)
            if later is not None:
                changes = {**later.changes, **pair[0].changes}
                yield *(replace(each, kind="order", changes=changes) for each in pair), replace(later, changes=changes)


def _later(context: HouseContext, thing: Thing, act: Act, *, is_met: bool) -> ProposedChore | None:
    """Return the conditional chore about a thing and two others; None if there are no others, or no clear words."""
    if not _is_clear(context, thing):
        return None
    others = context.things(lambda each: _may_be_asked_instead(each, thing) and _is_clear(context, each))[:2]
    return _remembering(context, (thing, others[0], others[1]), act, is_met=is_met) if len(others) == 2 else None


def _is_clear(context: HouseContext, thing: Thing) -> bool:
    """Return whether a thing has no look-alikes and an unambiguous phrase."""
    return distractor_of(context, thing.id) is None and context.phrase(thing.id) is not None


def _may_be_asked_instead(thing: Thing, condition: Thing) -> bool:
    """Return whether a machine or a piece of furniture may be acted on, depending on the state of another thing."""
    is_plain = is_target(thing) and thing.category not in FLAMES and not thing.is_pickupable and not thing.is_drawer
    is_apart = condition.id not in (thing.id, thing.parent) and thing.id != condition.parent
    return is_plain and is_apart and (allows(thing, "turn_on") or allows(thing, "open"))


def _remembering(context: HouseContext, things: tuple[Thing, Thing, Thing], act: Act, *, is_met: bool) -> ProposedChore:
    """Return the chore to act on the second of the things if the first needed `act` at the start, else on the third."""
    thing, *others = things
    acts: list[Act] = ["turn_on" if allows(each, "turn_on") else "open" for each in others]
    goal, asked = goal_of(thing, act), [goal_of(each, instead) for each, instead in zip(others, acts, strict=True)]
    orders = [
        order_slots(instead, each.category, str(context.phrase(each.id)), context.rng)["order"]
        for each, instead in zip(others, acts, strict=True)
    ]
    done, left = asked if is_met else asked[::-1]
    changes = dict(setup_for(thing, act).objects)
    if not is_met:
        changes[thing.id] = made_so(changes[thing.id], goal)
    for each, instead in zip(others, acts, strict=True):
        changes |= setup_for(each, instead).objects
    slots = {"whole": phrase_for_state(context, thing, act), "label": CONDITION_LABELS[act]}
    return ProposedChore(
        kind="conditional",
        form=f"remember_{act}_{'so' if is_met else 'otherwise'}",
        sentence=context.say(IF_AT_FIRST, **slots, order=orders[0], other=orders[1]),
        chore=Chore(
            parts=(done, left.model_copy(update={"value": not left.value})),
            condition=goal.model_copy(update={"value": not goal.value}),
            is_met=is_met,
        ),
        meant=frozenset(each.id for each in things),
        changes=changes,
    )
