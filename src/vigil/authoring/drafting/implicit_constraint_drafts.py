"""Proposals of implicit constraints (CR): the instruction gives the order only, and agents must find what prevents it.

The tasks are those of the explicit kinds, with their setups, bindings and goals; only the instructions differ.
"""

from collections.abc import Callable

from vigil.authoring.drafting.house_context import HouseContext
from vigil.authoring.drafting.proposals import Drafts
from vigil.authoring.language.implicit_constraints import implicit_kind
from vigil.authoring.language.referring import without_repeats
from vigil.authoring.language.sentences import ORDERS
from vigil.authoring.language.wording import Act, order_slots, pronoun_slots
from vigil.protocol.episode import Episode
from vigil.protocol.goals import Goal, ObjectHeld, ObjectInState
from vigil.protocol.world import Setup


def without_constraint(context: HouseContext, drafts: Callable[[HouseContext], Drafts]) -> Drafts:
    """Yield the drafts of an explicit kind without the constraint in their instructions."""
    for episode in drafts(context):
        yield _without_constraint(context, episode)


def _without_constraint(context: HouseContext, episode: Episode) -> Episode:
    target = episode.goal.object_id
    context.begin(episode.setup)
    phrase, names = str(context.phrase(target)), [item.name for item in context.items.values()]
    category = context.thing(target).category
    context.begin(Setup())
    words = order_slots(act_of(episode.goal), category, phrase, context.rng) | pronoun_slots(category)
    sentence = without_repeats(context.say(ORDERS, target=phrase, **words), names)
    kind = episode.provenance.model_copy(update={"template": implicit_kind(episode.provenance.template)})
    return episode.model_copy(update={"instruction": sentence, "provenance": kind})


def act_of(goal: Goal) -> Act:
    """Return the act that reaches a goal of opening, closing, switching on or off, or picking up."""
    if isinstance(goal, ObjectInState):
        acts: tuple[Act, Act] = ("open", "close") if goal.state == "is_open" else ("turn_on", "turn_off")
        return acts[0] if goal.value else acts[1]
    assert isinstance(goal, ObjectHeld)
    return "pick"
