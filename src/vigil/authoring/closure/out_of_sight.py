"""Tasks whose last act hides the result: to put an object into a container and close the container."""

from vigil.assets.catalog import CATALOG
from vigil.authoring.closure.tasks import LEVEL_DEG, NEAR_M, ClosureTask, Tasks
from vigil.authoring.drafting.house_context import HouseContext, TaskSpec
from vigil.authoring.drafting.proposals import CLEAR_PX, is_seen, is_target
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
        targets = context.things(lambda thing, container=container: _may_go_in(context, thing, container))
        for target in targets[:TRIED_TARGETS]:
            task = _put_away(context, target, container)
            if task is not None:
                yield task
                break


def _may_go_in(context: HouseContext, thing: Thing, container: Thing) -> bool:
    takes = CATALOG[container.category].can_hold(CATALOG[thing.category])
    suits = thing.category in BELONGS_IN[container.category] and takes
    is_free = thing.is_pickupable and is_target(thing) and thing.parent != container.id
    return suits and is_free and not children(context.view.scene, thing.id)


def _put_away(context: HouseContext, target: Thing, container: Thing) -> ClosureTask | None:
    is_open = bool(context.rng.integers(2))
    objects = {container.id: ObjectSetup(openness=float(is_open))}
    if container.is_toggleable:
        objects[container.id] = ObjectSetup(openness=float(is_open), is_toggled=False)
    setup = Setup(objects=objects)
    if not context.can_begin(setup):
        return None
    phrases = context.phrase(target.id), context.phrase(container.id)
    start = context.start_seeing(target, NEAR_M, LEVEL_DEG, is_seen(CLEAR_PX))
    context.begin(Setup())
    if start is None or None in phrases:
        return None
    parts = opening_phrase(container.category, str(phrases[1]))
    shut = parts.whole if parts.piece == "it" else parts.piece  # "it" would mean the object that is put away
    is_in = ObjectAtReceptacle(object_id=target.id, receptacle_id=container.id, inside=True)
    is_shut = ObjectInState(object_id=container.id, state="is_open", value=False)
    task = TaskSpec(
        start=start,
        setup=setup,
        instruction=say(
            PUT_AWAY, context.rng, target=str(phrases[0]), receptacle=str(phrases[1]), shut=shut, whole=parts.whole
        ),
        goal=AllOf(object_id=target.id, parts=(is_in, is_shut)),
        bindings={"target": target.id, "receptacle": container.id},
        template="put_away",
    )
    form = "open" if is_open else "shut"
    return ClosureTask("out_of_sight", (context.draft("SI", task),), form=form)
