"""Proposals of chores about a state: open, close or switch something, make sure of a state, or say which it is."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

from vigil.assets.catalog import CATALOG
from vigil.authoring.chores.proposed import Proposals, ProposedChore, distractor_of, in_turn
from vigil.authoring.chores.sentences import ACT_ORDERS, CLOSE_EVERY_DRAWER, IF_SO, MAKE_SURE, QUESTIONS
from vigil.authoring.closure.everything import ALL_ACTS
from vigil.authoring.closure.kinds.already.tasks import LABELS
from vigil.authoring.closure.kinds.if_so.tasks import may_be_alternative, order_it_again
from vigil.authoring.closure.kinds.impossible.tasks import may_block
from vigil.authoring.closure.states import phrase_for_state, unfinished_setup
from vigil.authoring.closure.tasks import FLAMES
from vigil.authoring.drafting.house_context import HouseContext
from vigil.authoring.drafting.proposals import (
    SV_TOGGLES,
    allows,
    can_be_searched_for,
    goal_for,
    setup_for,
    with_laptop_open,
)
from vigil.authoring.families.cr.drafts import is_furniture, is_low, obstacles, placements_in_the_way
from vigil.authoring.families.sv.drafts import LABELS as STATE_CHANGES
from vigil.authoring.language.wording import Act, order_slots
from vigil.authoring.solving.evidence import notice_evidence
from vigil.protocol.goals import MAX_CHORE_PARTS, STATE_LABELS, Chore, ObjectInState, ReportStatus
from vigil.protocol.world import ObjectSetup, Setup, StateQuery
from vigil.scene.supports import drawers_of
from vigil.scene.things import Thing
from vigil.sim.core.motion import CollisionMap
from vigil.sim.core.opening import opening_blocker
from vigil.sim.core.state import AGENT, SceneState

TRIED_BLOCKERS = 2
"""Number of pieces of furniture that are tried as an obstacle in front of one door."""
CONDITION_LABELS: dict[Act, str] = {"close": "open", "turn_off": "on"}
"""Act that is asked for if a condition holds -> word for the state in the condition."""
_IMPOSSIBLE = {"kind": "impossible", "distractor": None}


def targets_of(context: HouseContext, act: Act) -> list[Thing]:
    """Return the things for which an act may be asked, in random order."""
    return context.things(lambda thing: allows(thing, act) and can_be_searched_for(context, thing))


def goal_of(thing: Thing, act: Act) -> ObjectInState:
    """Return the goal that an act other than picking up reaches."""
    goal = goal_for(thing, act)
    assert isinstance(goal, ObjectInState)
    return goal


def is_plain(thing: Thing, act: Act) -> bool:
    """Return whether an agent can clearly see on a thing whether the act is still to be done."""
    return act in ("open", "close") or thing.category in SV_TOGGLES - FLAMES


def acts(context: HouseContext) -> Proposals:
    """Yield chores to open, close or switch a thing; the acts take turns."""
    yield from in_turn(*(_acts(context, act) for act in ALL_ACTS))


def _acts(context: HouseContext, act: Act) -> Proposals:
    for thing in targets_of(context, act):
        if context.phrase(thing.id) is not None:
            yield act_on(context, thing, act)


def act_on(context: HouseContext, thing: Thing, act: Act) -> ProposedChore:
    """Return the chore to open, close or switch a thing. There must be a phrase that means only this thing."""
    changes, distractor = dict(setup_for(thing, act).objects), distractor_of(context, thing.id)
    if distractor is not None and allows(context.thing(distractor), act):
        changes |= setup_for(context.thing(distractor), act).objects
    slots = order_slots(act, thing.category, str(context.phrase(thing.id)), context.rng)
    return ProposedChore(
        kind="plain" if distractor is None else "look_alike",
        form=act,
        sentence=context.say(ACT_ORDERS, **slots),
        chore=Chore(parts=(goal_of(thing, act),)),
        meant=frozenset({thing.id}),
        changes=changes,
        distractor=distractor,
    )


def every_drawer(context: HouseContext) -> Proposals:
    """Yield chores to close all drawers of a piece of furniture that has two to four."""
    for chest in context.things(lambda thing: is_furniture(thing) and not thing.is_drawer):
        found = close_drawers(context, chest)
        if found is not None:
            yield found


def close_drawers(context: HouseContext, chest: Thing) -> ProposedChore | None:
    """Return the chore to close all drawers of a piece of furniture; one is open, the others are open or closed.

    None if it has fewer than two drawers or more than four, or no unambiguous phrase.
    """
    drawers = sorted(drawers_of(context.view.scene, chest), key=lambda each: (-each.position.y, each.id))
    if not 2 <= len(drawers) <= MAX_CHORE_PARTS or context.phrase(chest.id) is None:
        return None
    first = int(context.rng.integers(len(drawers)))
    return ProposedChore(
        kind="plain",
        form="close_every",
        sentence=context.say(CLOSE_EVERY_DRAWER, whole=str(context.phrase(chest.id))),
        chore=Chore(parts=tuple(goal_of(each, "close") for each in drawers)),
        meant=frozenset(each.id for each in drawers),
        changes={
            each.id: ObjectSetup(openness=1.0 if place == first else float(context.rng.integers(2)))
            for place, each in enumerate(drawers)
        },
    )


def make_sure(context: HouseContext) -> Proposals:
    """Yield chores to make sure of a state; the states take turns, and about half hold from the start."""
    yield from in_turn(*(_make_sure(context, act) for act in ALL_ACTS))


def _make_sure(context: HouseContext, act: Act) -> Proposals:
    for thing in [each for each in targets_of(context, act) if is_plain(each, act)]:
        if context.phrase(thing.id) is not None and distractor_of(context, thing.id) is None:
            yield sure_of(context, thing, act, is_met=bool(context.rng.integers(2)))


def sure_of(context: HouseContext, thing: Thing, act: Act, *, is_met: bool) -> ProposedChore:
    """Return the chore to make sure of the state that `act` brings about; if `is_met`, the state holds at the start."""
    goal, setup = goal_of(thing, act), setup_for(thing, act)
    if is_met:
        changes = {thing.id: made_so(setup.objects[thing.id], goal)}
    else:
        changes = unfinished_setup(context, setup, thing, act)[0].objects
    slots = {"whole": phrase_for_state(context, thing, act), "label": LABELS[act]}
    return ProposedChore(
        kind="already" if is_met else "plain",
        form=f"sure_{act}",
        sentence=context.say(MAKE_SURE, **slots),
        chore=Chore(parts=(goal,)),
        meant=frozenset({thing.id}),
        changes=changes,
    )


def questions(context: HouseContext) -> Proposals:
    """Yield chores to say whether something is on or off, open or closed; the states take turns."""
    yield from in_turn(*(_questions(context, query) for query in STATE_LABELS))


def _questions(context: HouseContext, query: StateQuery) -> Proposals:
    act: Act = "open" if query == "is_open" else "turn_on"
    for thing in [each for each in targets_of(context, act) if is_plain(each, act) and not each.is_drawer]:
        if context.phrase(thing.id) is None or distractor_of(context, thing.id) is not None:
            continue
        labels = STATE_LABELS[query]
        label = labels[int(context.rng.integers(2))]
        change = with_laptop_open(thing, STATE_CHANGES[label][1])
        one, other = labels if context.rng.integers(2) else labels[::-1]
        slots = {"whole": phrase_for_state(context, thing, act), "one": one, "other": other, "it": "it"}
        yield ProposedChore(
            kind="question",
            form=label,
            sentence=context.say(QUESTIONS, **slots),
            chore=Chore(parts=(ReportStatus(object_id=thing.id, state=query),)),
            meant=frozenset({thing.id}),
            changes={thing.id: change},
        )


def conditional(context: HouseContext) -> Proposals:
    """Yield chores that ask for one act if a condition holds, and otherwise for another act on another thing."""
    yield from in_turn(*(_conditional(context, act) for act in CONDITION_LABELS))


def _conditional(context: HouseContext, act: Act) -> Proposals:
    for thing in [each for each in targets_of(context, act) if is_plain(each, act)]:
        others = context.things(lambda other, thing=thing: may_be_alternative(context, other, thing))
        named = [each for each in (thing, *others[:1]) if distractor_of(context, each.id) is None]
        if len(named) == 2 and all(context.phrase(each.id) is not None for each in named):
            yield _branching(context, thing, others[0], act, is_met=bool(context.rng.integers(2)))


def _branching(context: HouseContext, thing: Thing, other: Thing, act: Act, *, is_met: bool) -> ProposedChore:
    """Return the conditional chore about `thing`, with an act on `other` if its condition fails (not `is_met`)."""
    instead: Act = "turn_on" if allows(other, "turn_on") else "open"
    goal, asked = goal_of(thing, act), goal_of(other, instead)
    left = asked.model_copy(update={"value": not asked.value})
    changes = {**setup_for(other, instead).objects, **setup_for(thing, act).objects}
    if not is_met:
        changes[thing.id] = made_so(changes.get(thing.id, ObjectSetup()), goal)
    slots = {
        "whole": phrase_for_state(context, thing, act),
        "label": CONDITION_LABELS[act],
        "order_it": order_it_again(context, thing, act),
        "other": order_slots(instead, other.category, str(context.phrase(other.id)), context.rng)["order"],
    }
    return ProposedChore(
        kind="conditional",
        form=f"{act}_{'so' if is_met else 'otherwise'}",
        sentence=context.say(IF_SO, **slots),
        chore=Chore(
            parts=(goal, left) if is_met else (asked, goal),
            condition=goal.model_copy(update={"value": not goal.value}),
            is_met=is_met,
        ),
        meant=frozenset({thing.id, other.id}),
        changes=changes,
    )


def made_so(change: ObjectSetup, goal: ObjectInState) -> ObjectSetup:
    """Return an object's change, extended so that the goal holds at the start."""
    fact = {"openness": float(goal.value)} if goal.state == "is_open" else {"is_toggled": goal.value}
    return change.model_copy(update=fact)


def refused(context: HouseContext) -> Proposals:
    """Yield chores whose direct act a machine refuses: opening it while it runs, or starting it while it is open."""
    machines = context.things(lambda thing: CATALOG[thing.category].runs_only_when_closed and thing.is_openable)
    states: tuple[tuple[Act, ObjectSetup], ...] = (
        ("turn_on", ObjectSetup(openness=1.0, is_toggled=False)),
        ("open", ObjectSetup(openness=0.0, is_toggled=True)),
    )
    for thing in machines:
        if distractor_of(context, thing.id) is None:
            act, change = states[int(context.rng.integers(2))]
            plain = act_on(context, thing, act)
            yield replace(plain, kind="refused", form=f"machine_{act}", changes={thing.id: change})


def broken(context: HouseContext) -> Proposals:
    """Yield chores to start a machine that is out of order; a notice on the machine says so."""
    for thing in targets_of(context, "turn_on"):
        if distractor_of(context, thing.id) is None and notice_evidence(thing) is not None:
            plain = act_on(context, thing, "turn_on")
            change = plain.changes[thing.id].model_copy(update={"is_broken": True})
            changes = {thing.id: change}
            yield replace(plain, form="broken", reason="broken", removed=thing.id, changes=changes, **_IMPOSSIBLE)


def locked(context: HouseContext) -> Proposals:
    """Yield chores to open something that furniture blocks; the furniture cannot be carried away."""
    for thing in _bulky(context):
        furniture = context.things(lambda each, thing=thing: may_block(context, each, thing))
        for blocker, change in _barriers(context, thing, furniture):
            plain = act_on(context, thing, "open")
            changes, roles = {**plain.changes, blocker.id: change}, {"blocker": blocker.id}
            facts = {"form": "locked", "reason": "locked", "removed": blocker.id, "roles": roles}
            yield replace(plain, changes=changes, **facts, **_IMPOSSIBLE)
            break


def blocked(context: HouseContext) -> Proposals:
    """Yield chores to open something that an object blocks; the object must first be carried away."""
    for thing in [each for each in _bulky(context) if is_low(each)]:
        for obstacle, change in _barriers(context, thing, obstacles(context, thing)):
            plain = act_on(context, thing, "open")
            changes, roles = {**plain.changes, obstacle.id: change}, {"obstacle": obstacle.id}
            if _is_refused(context, plain, Setup(objects=changes)):
                yield replace(plain, kind="refused", form="swing", changes=changes, roles=roles)
                break


def _is_refused(context: HouseContext, chore: ProposedChore, setup: Setup) -> bool:
    """Return whether, after a setup, an obstacle prevents the chore's thing from opening.

    The certifier of lists proves this again, from every place where the agent can stand.
    """
    if not context.can_begin(setup):
        return False
    scene = context.view.scene
    state = SceneState(scene, context.view.agent, CollisionMap(scene))
    blocker = opening_blocker(state, scene.things[chore.chore.parts[0].object_id], 1.0)
    context.begin(Setup())
    return blocker not in (None, AGENT)


def _bulky(context: HouseContext) -> Iterator[Thing]:
    """Yield furniture that can be opened and does not have look-alikes."""
    for thing in targets_of(context, "open"):
        is_bulky = is_furniture(thing) and not thing.is_structure and not thing.is_pickupable
        if is_bulky and distractor_of(context, thing.id) is None:
            yield thing


def _barriers(context: HouseContext, thing: Thing, blockers: Sequence[Thing]) -> Iterator[tuple[Thing, ObjectSetup]]:
    """Yield (obstacle, its placement) for places in front of a closed thing."""
    for blocker in blockers[:TRIED_BLOCKERS]:
        for spot in placements_in_the_way(context, thing, blocker, setup_for(thing, "open")):
            yield blocker, ObjectSetup(placement=spot)
