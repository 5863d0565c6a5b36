"""Proposals of chores, possible and impossible, that put an object on or into a receptacle."""

from dataclasses import replace

from vigil.authoring.chores.proposed import MAX_SEARCHED, Proposals, ProposedChore, distractor_of, in_turn
from vigil.authoring.chores.sentences import PUT_AWAY, PUT_INTO_ORDERS, PUT_ON_ORDERS
from vigil.authoring.closure.asking import phrase_by_support
from vigil.authoring.closure.kinds.impossible.tasks import STANDS, may_occupy, takes_enough_room
from vigil.authoring.closure.kinds.out_of_sight.tasks import may_go_in
from vigil.authoring.closure.receptacle_space import fits_on
from vigil.authoring.drafting.filling import can_be_put
from vigil.authoring.drafting.house_context import HouseContext
from vigil.authoring.families.si.drafts import placeless_phrase
from vigil.authoring.families.sm.plans import SequencePlan, emptying, putting_in, rearranging
from vigil.authoring.language.referring import Phrase
from vigil.authoring.language.wording import opening_phrase, pronoun_slots
from vigil.authoring.review.containers import BELONGS_IN, not_found_by_opening
from vigil.authoring.review.placements import placements_on
from vigil.authoring.solving.evidence import surface_evidence
from vigil.authoring.solving.goal_actions import achieve_goal, closed_containers_around
from vigil.authoring.solving.macro_actions import MacroActions, Unsolvable
from vigil.authoring.solving.solvers import carry_out
from vigil.protocol.goals import Chore, ObjectAtReceptacle, ObjectHeld, ObjectInState
from vigil.protocol.world import ObjectSetup, Setup
from vigil.scene.geometry import body_box
from vigil.scene.supports import children, level_surfaces
from vigil.scene.things import Thing

TRIED_STANDS, TRIED_OCCUPANTS, TRIED_TARGETS = 4, 2, 4
CLEARLY_LARGER = 1.3
"""Minimum length of the shorter side of an object, as a multiple of the width of a strip that is visibly too narrow."""
EASY_M = 0.02
"""Minimum length (m) by which the inside of a container must exceed each side of an object that is put into it."""
_STACKED = ("{target} on", "{target} into", "{target} inside")
"""Word orders in which the place of the target would directly precede the receptacle ("the cup on the desk on the
shelf")."""


def put(context: HouseContext) -> Proposals:
    """Yield chores that put an object on or into a receptacle, one for each object. Objects may have look-alikes.

    Containers that can be closed are closed at the start.
    """
    taken: set[str] = set()
    for plan in in_turn(rearranging(context), putting_in(context), emptying(context)):
        target = plan.roles["target"]
        found = None if target.id in taken else _of_plan(context, plan)
        if found is not None:
            taken.add(target.id)
            yield found


def _of_plan(context: HouseContext, plan: SequencePlan) -> ProposedChore | None:
    goal = plan.facts[-1]
    assert isinstance(goal, ObjectAtReceptacle)
    if children(context.view.scene, goal.object_id):
        return None
    return putting(context, goal.model_copy(update={"chain": ()}), plan.setup)


def putting(
    context: HouseContext, goal: ObjectAtReceptacle, setup: Setup, phrase: Phrase | None = None
) -> ProposedChore | None:
    """Return the chore of putting an object somewhere, worded for the world after `setup`.

    `phrase` means the object; by default it is the shortest one, which names a closed container around the object.
    Return None if no wording is unambiguous, if the object would almost fill the container, because few clicks would
    then put it there, or if the top of the receptacle cannot be seen from above, because a click must hit it.
    """
    is_easy = _fits_easily(context, goal) if goal.inside else _has_visible_top(context.thing(goal.receptacle_id))
    if not is_easy or not context.can_begin(setup):
        return None
    phrases = phrase or _phrase_of_object(context, goal.object_id), context.phrase(goal.receptacle_id)
    context.begin(Setup())
    if phrases[0] is None or phrases[1] is None:
        return None
    distractor = distractor_of(context, goal.object_id)
    return ProposedChore(
        kind="plain" if distractor is None else "look_alike",
        form="put_into" if goal.inside else "put_on",
        sentence=_sentence(context, goal, phrases[0], phrases[1]),
        chore=Chore(parts=(goal,)),
        meant=frozenset({goal.object_id, goal.receptacle_id}),
        changes=setup.objects,
        distractor=distractor,
    )


def _fits_easily(context: HouseContext, goal: ObjectAtReceptacle) -> bool:
    """Return whether a surface inside the receptacle is `EASY_M` longer and wider than the object, and high enough."""
    x, height, z = context.thing(goal.object_id).asset.size
    inner = [each for each, _ in level_surfaces(context.thing(goal.receptacle_id)) if each.is_inside]
    pairs = [(each, zip(sorted((x, z)), sorted((each.size_x, each.size_z)), strict=True)) for each in inner]
    return any(height <= each.clearance and all(a + EASY_M <= b for a, b in sides) for each, sides in pairs)


def _has_visible_top(receptacle: Thing) -> bool:
    """Return whether an upper surface of a receptacle can be seen from above."""
    tops = [surface for surface, _ in level_surfaces(receptacle) if not surface.is_inside]
    return any(surface_evidence(receptacle, each.name) for each in tops)


def _phrase_of_object(context: HouseContext, thing_id: str) -> Phrase | None:
    """Return a unique phrase for a thing; if it lies in a closed container, the phrase names the container.

    None if there is no such phrase.
    """
    if closed_containers_around(context.view, thing_id):
        return phrase_by_support(context, context.items[thing_id])
    return context.phrase(thing_id)


def _phrase_of_hidden(context: HouseContext, thing_id: str, setup: Setup) -> Phrase | None:
    """Return a unique phrase that does not say what a thing lies in after `setup`; None if the search for it is
    unfair."""
    if not context.can_begin(setup):
        return None
    thing = context.thing(thing_id)
    phrase = placeless_phrase(context, thing, MAX_SEARCHED)
    is_fair = phrase and not any(not_found_by_opening(context.view, context.items, thing, [phrase], MAX_SEARCHED))
    context.begin(Setup())
    return phrase if is_fair else None


def _sentence(context: HouseContext, goal: ObjectAtReceptacle, target: Phrase, receptacle: Phrase) -> str:
    """Return a random sentence that asks to put an object somewhere, without two places in direct succession."""
    sentences = PUT_INTO_ORDERS if goal.inside else PUT_ON_ORDERS
    if target != target.without_place:
        sentences = sentences.with_halves(_unstacked)
    slots = pronoun_slots(context.thing(goal.object_id).category)
    return context.say(sentences, target=str(target), receptacle=str(receptacle), **slots)


def _unstacked(forms: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(form for form in forms if not any(words in form for words in _STACKED))


def hidden(context: HouseContext) -> Proposals:
    """Yield chores about an object in a closed container that the sentence does not name, one for each object.

    People would look for the object there, and only a few other containers need to be opened to find it.
    """
    taken, phrases = set[str](), dict[tuple[str, str], Phrase | None]()
    for plan in emptying(context):
        target, container, goal = plan.roles["target"], plan.roles["container"], plan.facts[-1]
        assert isinstance(goal, ObjectAtReceptacle)
        if target.id in taken or children(context.view.scene, target.id):
            continue
        lies = target.id, container.id
        if lies not in phrases:
            phrases[lies] = _phrase_of_hidden(context, target.id, plan.setup)
        phrase = phrases[lies]
        found = phrase and putting(context, goal.model_copy(update={"chain": ()}), plan.setup, phrase)
        if found and _can_be_taken_out(context, target.id, plan.setup):
            taken.add(target.id)
            yield replace(found, kind="hidden", distractor=None)
        elif found:
            phrases[lies] = None


def _can_be_taken_out(context: HouseContext, thing_id: str, setup: Setup) -> bool:
    """Return whether an agent can open the containers around a thing, as `setup` leaves them, and pick it up."""
    macro_actions = MacroActions(context.view, may_tilt=True)
    try:
        context.begin(setup)
        carry_out(achieve_goal(ObjectHeld(object_id=thing_id), macro_actions), context.view)
    except Unsolvable:
        return False
    finally:
        context.begin(Setup())
    return True


def put_away(context: HouseContext) -> Proposals:
    """Yield chores that put an object into a container and close it, so that the result cannot be seen."""
    for container in context.things(lambda thing: thing.category in BELONGS_IN and thing.is_openable):
        targets = context.things(lambda thing, container=container: may_go_in(context, thing, container))
        for target in targets[:1]:
            goal = ObjectAtReceptacle(object_id=target.id, receptacle_id=container.id, inside=True)
            is_toggled = False if container.is_toggleable else None
            openness = float(context.rng.integers(2))
            setup = Setup(objects={container.id: ObjectSetup(openness=openness, is_toggled=is_toggled)})
            found = putting(context, goal, setup)
            phrases = _phrase_of_object(context, target.id), context.phrase(container.id)
            if found is None or phrases[0] is None or phrases[1] is None:
                continue
            parts = opening_phrase(container.category, str(phrases[1]))
            shut = parts.whole if parts.piece == "it" else parts.piece
            words = {"target": str(phrases[0]), "receptacle": str(phrases[1]), "shut": shut, "whole": parts.whole}
            is_shut = ObjectInState(object_id=container.id, state="is_open", value=False)
            is_placed = phrases[0] != phrases[0].without_place
            sentences = PUT_AWAY.with_halves(_unstacked) if is_placed else PUT_AWAY
            sentence = context.say(sentences, **words)
            yield replace(found, form="put_away", sentence=sentence, chore=Chore(parts=(goal, is_shut)))


def absent(context: HouseContext) -> Proposals:
    """Yield chores whose object is not at the place that the sentence names, and not elsewhere under the same name."""
    for plan in rearranging(context):
        goal = plan.facts[-1]
        assert isinstance(goal, ObjectAtReceptacle)
        target, items = context.thing(goal.object_id), context.items
        support, phrase = (
            context.view.scene.things.get(target.parent or ""),
            phrase_by_support(context, items[target.id]),
        )
        receptacle = context.phrase(goal.receptacle_id)
        if support is None or phrase is None or receptacle is None or children(context.view.scene, target.id):
            continue
        if surface_evidence(support, target.surface) and distractor_of(context, target.id) is None:
            bare = goal.model_copy(update={"chain": ()})
            yield ProposedChore(
                kind="impossible",
                form="absent",
                sentence=_sentence(context, bare, phrase, receptacle),
                chore=Chore(parts=(bare,)),
                meant=frozenset({goal.receptacle_id}),
                changes={target.id: ObjectSetup(is_absent=True)},
                roles={"place": support.id},
                reason="absent",
                removed=target.id,
                phrase=phrase,
            )


def no_room(context: HouseContext) -> Proposals:
    """Yield chores that put an object on a stand that has only one surface, most of which a machine visibly takes."""
    stands = context.things(
        lambda thing: thing.category in STANDS and len(list(level_surfaces(thing))) == 1 and thing.parent is None
    )
    for stand in stands[:TRIED_STANDS]:
        for occupant in context.things(lambda thing, stand=stand: may_occupy(context, thing, stand))[:TRIED_OCCUPANTS]:
            at = next(placements_on(stand, occupant, inside=False), None)
            if at is None or not takes_enough_room(stand, occupant):
                continue
            found = _without_room(context, stand, occupant, Setup(objects={occupant.id: ObjectSetup(placement=at)}))
            if found is not None:
                yield found
                break


def _looks_too_large(context: HouseContext, target: Thing, stand: Thing) -> bool:
    """Return whether a target is clearly larger than each strip that the things on a stand leave free."""
    whole = _outline(stand)
    for child in children(context.view.scene, stand.id):
        strips = [float(abs(a - b)) for a, b in zip(whole, _outline(child), strict=True)]
        if not child.is_pickupable and CLEARLY_LARGER * max(strips) <= min(target.asset.size.x, target.asset.size.z):
            return True
    return False


def _outline(thing: Thing) -> list[float]:
    """Return the least and greatest x, and the least and greatest z, of a thing (m)."""
    corners = body_box(thing).corners()
    return [end(values) for values in ([p.x for p in corners], [p.z for p in corners]) for end in (min, max)]


def _without_room(context: HouseContext, stand: Thing, occupant: Thing, full: Setup) -> ProposedChore | None:
    """Return the chore of putting something on a stand that the setup `full` fills; None if every tried object fits."""
    room_at = context.view.room_at
    targets = context.things(
        lambda thing: (
            can_be_put(thing, stand)
            and not children(context.view.scene, thing.id)
            and room_at(thing.position) == room_at(stand.position)
        )
    )
    for target in targets[:TRIED_TARGETS]:
        if not context.can_begin(full):
            return None
        has_room = fits_on(context.view.scene, target.id, stand.id) or not _looks_too_large(context, target, stand)
        context.begin(Setup())
        if has_room or not fits_on(context.view.scene, target.id, stand.id, may_clear=False):
            continue
        goal = ObjectAtReceptacle(object_id=target.id, receptacle_id=stand.id)
        found = putting(context, goal, full)
        if found is not None:
            return replace(
                found,
                kind="impossible",
                form="no_fit",
                roles={"blocker": occupant.id},
                reason="no_fit",
                removed=occupant.id,
                distractor=None,
            )
    return None
