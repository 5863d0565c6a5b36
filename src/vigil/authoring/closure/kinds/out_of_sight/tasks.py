"""Function that proposes tasks to put an object into a container and then close the container."""

from itertools import islice

from vigil.authoring.closure.asking import start_near
from vigil.authoring.closure.tasks import ClosureTask, Tasks
from vigil.authoring.drafting.filling import can_be_put
from vigil.authoring.drafting.house_context import HouseContext, TaskSpec
from vigil.authoring.language.wording import opening_phrase, say
from vigil.authoring.review.containers import BELONGS_IN
from vigil.protocol.goals import AllOf, ObjectAtReceptacle, ObjectInState
from vigil.protocol.world import ObjectSetup, Setup
from vigil.scene.supports import children
from vigil.scene.things import Thing

PUT_AWAY = (
    "Put {target} into {receptacle} and close {shut}.",
    "Please put {target} into {receptacle}, then close {shut}.",
    "Put {target} away: it goes into {receptacle}. Close {shut} afterwards.",
    "Take {target}, put it into {receptacle} and shut {shut} again.",
    "I would like {target} to be inside {receptacle}, with {whole} closed.",
)
TRIED_TARGETS = 3


def out_of_sight(context: HouseContext) -> Tasks:
    """Yield tasks to put an object into a container that is closed at the end, so that the result cannot be seen."""
    for container in context.things(lambda thing: thing.category in BELONGS_IN and thing.is_openable):
        targets = context.things(lambda thing, container=container: may_go_in(context, thing, container))
        found = (task for target in targets[:TRIED_TARGETS] for task in _put_away(context, target, container))
        yield from islice(found, 1)


def may_go_in(context: HouseContext, thing: Thing, container: Thing) -> bool:
    """Return whether people would put a thing into a container, and nothing is on the thing."""
    suits = thing.category in BELONGS_IN[container.category] and can_be_put(thing, container)
    return suits and not children(context.view.scene, thing.id)


def _put_away(context: HouseContext, target: Thing, container: Thing) -> Tasks:
    is_open = bool(context.rng.integers(2))
    is_toggled = False if container.is_toggleable else None
    setup = Setup(objects={container.id: ObjectSetup(openness=float(is_open), is_toggled=is_toggled)})
    things = {"target": target, "receptacle": container}
    found = context.start_and_phrases(setup, things, lambda _: start_near(context, target))
    if found is None:
        return
    start, phrases = found
    words = {role: str(phrase) for role, phrase in phrases.items()}
    parts = opening_phrase(container.category, words["receptacle"])
    shut = parts.whole if parts.piece == "it" else parts.piece  # "it" would mean the object that is put away
    sentence = say(PUT_AWAY, context.rng, shut=shut, whole=parts.whole, **words)
    is_in = ObjectAtReceptacle(object_id=target.id, receptacle_id=container.id, inside=True)
    is_shut = ObjectInState(object_id=container.id, state="is_open", value=False)
    goal = AllOf(object_id=target.id, parts=(is_in, is_shut))
    bindings = {role: thing.id for role, thing in things.items()}
    draft = context.draft("SI", TaskSpec(start, sentence, goal, bindings, setup=setup, template="put_away"))
    yield ClosureTask("out_of_sight", (draft,), form="open" if is_open else "shut")
