"""Functions that propose tasks about one of several things of a category, and that check these tasks."""

from collections.abc import Iterator

from vigil.authoring.closure.asking import PLACED_ORDERS, phrase_by_support, start_near
from vigil.authoring.closure.everything import ALL_ACTS
from vigil.authoring.closure.kinds.look_alike import FORMS_READ_BACK
from vigil.authoring.closure.kinds.look_alike.phrases import (
    by_bearing,
    by_size,
    by_state,
    is_clearly_larger,
    is_inside_of,
    referents_in,
)
from vigil.authoring.closure.tasks import FLAMES, ClosureTask, Tasks, interleave
from vigil.authoring.drafting.filling import can_hold
from vigil.authoring.drafting.house_context import HouseContext, TaskSpec
from vigil.authoring.drafting.proposals import allows, goal_for, is_target, setup_for
from vigil.authoring.families.si.drafts import seeking
from vigil.authoring.language.disambiguation import confusable
from vigil.authoring.language.referring import DescribedThing, items_of
from vigil.authoring.language.sentences import SEARCH_ORDERS
from vigil.authoring.language.wording import Act
from vigil.authoring.review.placements import placements_on
from vigil.authoring.review.synthetic_records import changed_setup
from vigil.authoring.solving.privileged_view import PrivilegedView
from vigil.protocol.actions import Action
from vigil.protocol.episode import Episode
from vigil.protocol.world import ObjectSetup, Setup
from vigil.scene.supports import children
from vigil.scene.things import Thing
from vigil.scoring.closure import DISTRACTOR

ACTS: tuple[Act, ...] = ("pick", *ALL_ACTS)
OPEN_OR_CLOSED_ITEMS = ("Box", "Laptop")
"""Categories that can be carried, and that are visibly either open or closed."""
FOOD = ("Apple", "Tomato", "Egg", "Potato")
"""Categories that may be put on or in a dish, so that the phrase can distinguish this dish from others."""
ON_FURNITURE = ("Book", "Vase", "Statue", "AlarmClock", "TissueBox", "Candle")
"""Categories that may be put on a piece of furniture, so that a phrase can distinguish this piece from others."""
MAX_BORNE_TRIED = 4
_BEARING_ACTS: tuple[Act, ...] = ("pick", "open")
"""Acts on a thing that is distinguished by what lies on it. The first act that the thing allows is used."""


def look_alike(context: HouseContext) -> Tasks:
    """Yield tasks about one of several things of a category. The things differ in one visible attribute."""
    of_colour = interleave(context, *(_of_colour(context, act) for act in ACTS))
    forms = of_colour, _of_place(context), _of_state(context), _of_bearing(context), _of_size(context)
    yield from interleave(context, *forms)


def _of_colour(context: HouseContext, act: Act) -> Tasks:
    for episode in seeking(context, act):
        target = context.items[episode.goal.object_id]
        phrase = context.phrase(target.id)
        distractor = next((item for item in context.items.values() if _is_other_colour(target, item)), None)
        if distractor is None or phrase is None or phrase.colour is None or phrase != phrase.without_place:
            continue
        objects = {**episode.setup.objects, **setup_for(context.thing(distractor.id), act).objects}
        both = {
            "bindings": {"target": target.id, DISTRACTOR: distractor.id},
            "setup": episode.setup.model_copy(update={"objects": objects}),
        }
        yield ClosureTask("look_alike", (episode.model_copy(update=both),), form="colour")


def _is_other_colour(target: DescribedThing, item: DescribedThing) -> bool:
    is_alike = item.category == target.category and item.room_id == target.room_id
    return is_alike and bool(item.colours) and not set(item.colours) & set(target.colours)


def _of_place(context: HouseContext) -> Tasks:
    for episode in seeking(context, "pick"):
        target = context.items[episode.goal.object_id]
        phrase = phrase_by_support(context, target, may_colour=False)
        distractor = next((context.items[thing.id] for thing in _same_name_objects(context, target.id)), None)
        if phrase is None or distractor is None:
            continue
        facts = {
            "instruction": context.order(PLACED_ORDERS, "pick", context.thing(target.id), phrase),
            "bindings": {"target": target.id, DISTRACTOR: distractor.id},
        }
        yield ClosureTask("look_alike", (episode.model_copy(update=facts),), form="place")


def _same_name_objects(context: HouseContext, thing_id: str) -> list[Thing]:
    """Return the other things that a thing's name, without adjectives, could also mean, in the scene's order.

    If one of these things has another category, the list is empty.
    """
    items = context.items
    others = confusable(items[thing_id], items.values())
    if any(each.category != items[thing_id].category for each in others):
        return []
    return [context.thing(each.id) for each in others]


def _candidates(context: HouseContext) -> Iterator[tuple[Thing, list[Thing]]]:
    """Yield, in a random order, possible targets, each with the other things that its bare name also means."""
    wanted = [each for each in context.view.scene.things.values() if each.is_present and is_target(each)]
    for thing in context.shuffled(wanted):
        others = _same_name_objects(context, thing.id)
        if others:
            yield thing, others


def _of_state(context: HouseContext) -> Tasks:
    for target, others in _candidates(context):
        if not target.is_pickupable:
            continue
        if target.category in OPEN_OR_CLOSED_ITEMS:
            labels = ("open", "closed")
        elif target.category in FLAMES:
            labels = ("burning", "not burning")
        else:
            continue
        label, other_label = labels if context.rng.integers(2) else labels[::-1]
        changes = {target.id: _state(label), **{each.id: _state(other_label) for each in others}}
        words = by_state(context.items[target.id].name, label)
        yield from _distractor_task(context, "pick", target, others[0], words, Setup(objects=changes), "state")


def _state(label: str) -> ObjectSetup:
    if label in ("open", "closed"):
        return ObjectSetup(openness=float(label == "open"))
    return ObjectSetup(is_toggled=label == "burning")


def _of_size(context: HouseContext) -> Tasks:
    for target, others in _candidates(context):
        acts: list[Act] = [act for act in ACTS if allows(target, act)]
        if len(others) != 1 or not acts or target.is_drawer:  # people do not compare drawers of different furniture
            continue
        if context.items[target.id].room_id != context.items[others[0].id].room_id:
            continue
        is_larger = is_clearly_larger(target, others[0])
        if not is_larger and not is_clearly_larger(others[0], target):
            continue
        act = acts[int(context.rng.integers(len(acts)))]
        setup = Setup(objects={**setup_for(target, act).objects, **setup_for(others[0], act).objects})
        words = by_size(context.items[target.id].name, is_larger=is_larger)
        yield from _distractor_task(context, act, target, others[0], words, setup, "size")


def _of_bearing(context: HouseContext) -> Tasks:
    for target, others in _candidates(context):
        acts: list[Act] = [act for act in _BEARING_ACTS if allows(target, act)]
        if not acts or not target.is_receptacle or children(context.view.scene, target.id):
            continue
        act = acts[0]
        for borne in _supported_candidates(context, target, others)[:MAX_BORNE_TRIED]:
            insides = (False, True) if target.is_pickupable else (False,)
            place = next((spot for inside in insides for spot in placements_on(target, borne, inside=inside)), None)
            if place is None:
                continue
            setup = Setup(objects={**setup_for(target, act).objects, **setup_for(others[0], act).objects})
            setup = changed_setup(setup, borne.id, placement=place)
            if not context.can_begin(setup):
                continue
            is_inside = is_inside_of(context.thing(borne.id), context.thing(target.id))
            context.begin(Setup())
            name, other = context.items[target.id].name, context.items[borne.id].name
            words = by_bearing(name, other, is_inside=is_inside)
            made = list(_distractor_task(context, act, target, others[0], words, setup, "bearing"))
            yield from made
            if made:
                break


def _supported_candidates(context: HouseContext, target: Thing, others: list[Thing]) -> list[Thing]:
    """Return, in a random order, things with a unique name that could lie on a target to identify it."""
    items = list(context.items.values())
    ids = {target.id, *(each.id for each in others)}
    suits = FOOD if target.is_pickupable else ON_FURNITURE

    def is_wanted(thing: Thing) -> bool:
        fits = max(thing.asset.size.x, thing.asset.size.z) <= min(target.asset.size.x, target.asset.size.z)
        is_free = thing.id not in ids and thing.parent not in ids and not children(context.view.scene, thing.id)
        return thing.category in suits and fits and can_hold(target, thing) and is_free

    wanted = context.things(is_wanted)
    return [thing for thing in wanted if not confusable(context.items[thing.id], items)]


def _distractor_task(
    context: HouseContext, act: Act, target: Thing, distractor: Thing, words: str, setup: Setup, form: str
) -> Tasks:
    """Yield the task about a target; `words` distinguish the target from a look-alike.

    Nothing is yielded if the setup is impossible, or if no start shows the look-alike without the target.
    """
    if not context.can_begin(setup):
        return
    start = start_near(context, distractor, target.id)
    context.begin(Setup())
    if start is not None:
        sentence = context.order(SEARCH_ORDERS, act, target, words)
        bindings = {"target": target.id, DISTRACTOR: distractor.id}
        task = TaskSpec(start, sentence, goal_for(target, act), bindings, setup=setup, template=act)
        yield ClosureTask("look_alike", (context.draft("SI", task),), form=form)


def faults(
    view: PrivilegedView, task: ClosureTask, episode: Episode, _: tuple[Action, ...]
) -> Iterator[tuple[str, str]]:
    """Yield (rule, message) if there is no look-alike, or the words do not distinguish the target from it."""
    distractor, target, things = episode.bindings[DISTRACTOR], episode.goal.object_id, view.scene.things
    if things[distractor].category != things[target].category or not things[distractor].is_present:
        yield "distinguished", f"{distractor!r} does not have the category of {target!r}"
    if task.form in FORMS_READ_BACK:
        read = referents_in(episode.instruction, items_of(view.scene).values(), view)
        if read != task.meant:
            yield "distinguished", f"the instruction means {', '.join(sorted(read)) or 'nothing'}"
