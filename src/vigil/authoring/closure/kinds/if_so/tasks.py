"""Functions that propose twins that ask for one act if a state holds, and otherwise for another act."""

from vigil.authoring.closure.states import drafts_of_state, phrase_for_state, setup_with_goal_met, unfinished_setup
from vigil.authoring.closure.tasks import FLAMES, ClosureTask, Tasks, interleave
from vigil.authoring.drafting.house_context import HouseContext
from vigil.authoring.drafting.proposals import allows, is_target, setup_for
from vigil.authoring.language.wording import VERBS, Act, order_slots, say
from vigil.protocol.episode import Episode
from vigil.protocol.goals import AllOf, ObjectInState
from vigil.protocol.world import Setup
from vigil.scene.things import Thing
from vigil.scoring.closure import OTHERWISE

IF_SO = (
    "If {whole} is {label}, {order_it}; otherwise {other}.",
    "Check {whole}: if it is {label}, {order_it}; if not, {other}.",
    "Look whether {whole} is {label}. If so, {order_it}. If not, {other}.",
    "Should {whole} be {label}, {order_it}. Otherwise, {other}.",
)
CONDITION_LABELS: dict[Act, str] = {"close": "open, even a little", "turn_off": "on"}
"""Act that is asked for if a condition holds -> words for the condition."""
MAX_ALTERNATIVES_TRIED = 3


def if_so(context: HouseContext) -> Tasks:
    """Yield twins that ask for one act if a state holds, and otherwise for another act on another thing."""
    yield from interleave(context, *(_tasks(context, act) for act in CONDITION_LABELS))


def _tasks(context: HouseContext, act: Act) -> Tasks:
    for episode, goal, target in drafts_of_state(context, act):
        others = context.things(lambda thing, target=target: may_be_alternative(context, thing, target))
        for other in others[:MAX_ALTERNATIVES_TRIED]:
            task = _task(context, episode, goal, other, act)
            if task is not None:
                yield task
                break


def may_be_alternative(context: HouseContext, thing: Thing, target: Thing) -> bool:
    """Return whether a machine in the target's room may be acted on instead of the target."""
    is_machine = is_target(thing) and (allows(thing, "turn_on") or allows(thing, "open"))
    is_plain = thing.category not in FLAMES and not thing.is_pickupable
    is_apart = target.id not in (thing.id, thing.parent) and thing.id != target.parent
    room_at = context.view.room_at
    return is_machine and is_plain and is_apart and room_at(thing.position) == room_at(target.position)


def _task(context: HouseContext, episode: Episode, goal: ObjectInState, other: Thing, act: Act) -> ClosureTask | None:
    """Return twins: on the first side the condition holds; on the second it does not, and `other` must be acted on.

    None if the setup is impossible or one of the things cannot be named.
    """
    target = context.thing(goal.object_id)
    instead: Act = "turn_on" if allows(other, "turn_on") else "open"
    both = Setup(objects={**setup_for(other, instead).objects, **episode.setup.objects})
    setup, evidence = unfinished_setup(context, both, target, act)
    if not context.can_begin(setup):
        return None
    phrase, other_phrase = context.phrase(target.id), context.phrase(other.id)
    whole = "" if phrase is None else phrase_for_state(context, target, act)
    context.begin(Setup())
    if phrase is None or other_phrase is None:
        return None
    sentence = say(
        IF_SO,
        context.rng,
        whole=whole,
        label=CONDITION_LABELS[act],
        order_it=order_it_again(context, target, act),
        other=order_slots(instead, other.category, str(other_phrase), context.rng)["order"],
    )
    state = "is_toggled" if instead == "turn_on" else "is_open"
    left, asked = (ObjectInState(object_id=other.id, state=state, value=value) for value in (False, True))
    facts = {"instruction": sentence, "setup": setup, "bindings": {"target": target.id, OTHERWISE: other.id}}
    first = episode.model_copy(update={**facts, "goal": AllOf(object_id=target.id, parts=(goal, left))})
    otherwise = AllOf(object_id=other.id, parts=(asked, goal))
    second = first.model_copy(update={"setup": setup_with_goal_met(first, goal), "goal": otherwise})
    return ClosureTask("if_so", (first, second), target.id, evidence, f"{act} {instead}")


def order_it_again(context: HouseContext, target: Thing, act: Act) -> str:
    """Return an order, such as "close it", to act on the thing that the sentence has just named."""
    if act in ("open", "close"):
        return VERBS[act][int(context.rng.integers(len(VERBS[act])))].format("it")
    return order_slots(act, target.category, "", context.rng)["order_it"]
