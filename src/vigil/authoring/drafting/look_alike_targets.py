"""Proposals about one of several look-alikes (PG, DA, VS, AI, SI), identified by colour, by place or by a relation.

Where the target is in view at the start, so is another object that its bare name could mean.
"""

from collections.abc import Callable

from vigil.authoring.drafting.constraints import acts_for
from vigil.authoring.drafting.house_context import HouseContext, TaskSpec
from vigil.authoring.drafting.proposals import (
    LEVEL_DEG,
    Drafts,
    can_be_searched_for,
    goal_for,
    is_approachable,
    is_in_view,
    is_in_view_to_point,
    is_searchable,
    is_target,
    setup_for,
    size_of_thing,
    start_not_seeing,
)
from vigil.authoring.language.disambiguation import anchor_of, disambiguating_phrases, look_alikes
from vigil.authoring.language.referring import Phrase
from vigil.authoring.language.sentences import APPROACH, ORDERS, POINT, SEARCH, SEARCH_ORDERS, Sentences
from vigil.authoring.language.wording import order_slots, pronoun_slots
from vigil.authoring.review.rules import LOOK_ALIKE_TEMPLATE, place_blind_to
from vigil.authoring.solving.look_targets import surface_points
from vigil.base.geometry import Pose, floor_distance, wrap_deg, yaw_towards
from vigil.protocol.families import FAMILIES, Family
from vigil.protocol.family import DEFAULT_HORIZON_DEG
from vigil.protocol.goals import (
    NEAR_M,
    OBSERVABLE_M,
    AgentNearTarget,
    Goal,
    ObjectInState,
    TargetGrounded,
    is_observable,
)
from vigil.protocol.world import Setup
from vigil.scene.things import Thing

STARTS = 3
"""Number of starts without sight of the target that are tried for one that sees a look-alike."""
GLANCE_POINTS = 16
"""Number of a look-alike's points that are tested for visibility before its pixels are counted."""
HALF_VIEW_DEG = 53.0
"""Angle (deg) from the middle of the frame to its side, rounded."""
WALK_TEMPLATE = "walk"
PoseTest = Callable[[Pose], bool]


def pointing_among_look_alikes(context: HouseContext) -> Drafts:
    """Yield PG drafts about one of several look-alikes."""

    def start(thing: Thing, also: PoseTest) -> Pose | None:
        is_clear = is_in_view_to_point(context, size_of_thing(thing))
        return context.start_seeing(thing, FAMILIES["PG"].start_distance_m, DEFAULT_HORIZON_DEG, is_clear, also)

    yield from _drafts(context, ("PG", POINT), start, lambda thing: TargetGrounded(object_id=thing.id))


def approaching_among_look_alikes(context: HouseContext) -> Drafts:
    """Yield DA drafts about one of several look-alikes."""

    def start(thing: Thing, also: PoseTest) -> Pose | None:
        if not is_approachable(thing) or place_blind_to(context.view, thing, NEAR_M) is not None:
            return None
        return context.start_seeing(
            thing, FAMILIES["DA"].start_distance_m, DEFAULT_HORIZON_DEG, is_in_view(context), also
        )

    yield from _drafts(
        context, ("DA", APPROACH), start, lambda thing: AgentNearTarget(object_id=thing.id, threshold_m=NEAR_M)
    )


def searching_among_look_alikes(context: HouseContext) -> Drafts:
    """Yield VS drafts about one of several look-alikes; the target is visible from other places only."""

    def start(thing: Thing, also: PoseTest) -> Pose | None:
        if not is_searchable(thing):
            return None
        return _start_out_of_view(context, thing, also, by_turning=False, horizon=LEVEL_DEG)

    yield from _drafts(
        context, ("VS", SEARCH), start, lambda thing: ObjectInState(object_id=thing.id, state="is_visible")
    )


def acting_among_look_alikes(context: HouseContext) -> Drafts:
    """Yield AI drafts about one of several look-alikes."""

    def start(thing: Thing, also: PoseTest) -> Pose | None:
        return context.start_seeing(
            thing, FAMILIES["AI"].start_distance_m, DEFAULT_HORIZON_DEG, is_in_view(context), also
        )

    yield from _drafts(context, ("AI", ORDERS), start, None)


def seeking_among_look_alikes(context: HouseContext) -> Drafts:
    """Yield SI drafts about one of several look-alikes."""
    yield from _drafts(
        context,
        ("SI", SEARCH_ORDERS),
        lambda thing, also: _start_out_of_view(context, thing, also, by_turning=None, horizon=DEFAULT_HORIZON_DEG / 2),
        None,
    )


def _drafts(
    context: HouseContext,
    kind: tuple[Family, Sentences],
    start_for: Callable[[Thing, PoseTest], Pose | None],
    goal_of: Callable[[Thing], Goal] | None,
) -> Drafts:
    """Yield a draft for each object that a phrase distinguishes from its look-alikes and that has a start.

    Without `goal_of`, a random act that the object allows is asked for.
    """
    family, sentences = kind
    for thing in context.shuffled(_wanted(context, in_view=FAMILIES[family].visible_at_start)):
        options = acts_for(thing) if goal_of is None else []
        if goal_of is None and not options:
            continue
        act = options[int(context.rng.integers(len(options)))] if options else None
        setup = setup_for(thing, act) if act is not None else Setup()
        phrase = _phrase(context, thing, setup)
        start = start_for(thing, _sees_look_alike(context, thing, phrase, family)) if phrase is not None else None
        context.begin(Setup())
        if start is None or phrase is None:
            continue
        words = order_slots(act, thing.category, str(phrase), context.rng) if act is not None else {}
        words |= pronoun_slots(thing.category)
        task = TaskSpec(
            start=start,
            setup=setup,
            instruction=context.say(sentences, target=str(phrase), **words),
            goal=goal_of(thing) if goal_of is not None else goal_for(thing, act or "pick"),
            bindings={"target": thing.id},
            template=WALK_TEMPLATE if family == "VS" else LOOK_ALIKE_TEMPLATE,
            target_size=size_of_thing(thing) if family == "PG" else None,
        )
        yield context.draft(family, task)


def _wanted(context: HouseContext, *, in_view: bool) -> list[Thing]:
    """Return the possible targets that have a look-alike; with `in_view`, one in the same room."""
    items = context.items
    found: list[Thing] = []
    for item in items.values():
        thing = context.thing(item.id)
        is_open_to_all = context.allowed_ids is None or thing.id in context.allowed_ids
        alike = look_alikes(item, items.values())
        is_alike = any(other.room_id == item.room_id for other in alike) if in_view else bool(alike)
        if is_alike and is_open_to_all and is_target(thing) and can_be_searched_for(context, thing):
            found.append(thing)
    return found


def _phrase(context: HouseContext, thing: Thing, setup: Setup) -> Phrase | None:
    """Reset the house with a setup, and return a random phrase that distinguishes a thing from its look-alikes.

    None if the setup is impossible or there is no such phrase.
    """
    if not context.can_begin(setup):
        return None
    items = context.items
    found = disambiguating_phrases(items[thing.id], items.values())
    return found[int(context.rng.integers(len(found)))] if found else None


def _start_out_of_view(
    context: HouseContext, thing: Thing, also: PoseTest, *, by_turning: bool | None, horizon: float
) -> Pose | None:
    """Return a start that does not see a thing, preferably one for which `also` is true; None if none is found."""
    start: Pose | None = None
    for _ in range(STARTS):
        start = start_not_seeing(context, thing, by_turning=by_turning, horizon=horizon) or start
        if start is None or also(start):
            break
    return start


def _sees_look_alike(context: HouseContext, thing: Thing, phrase: Phrase, family: Family) -> PoseTest:
    """Return the test of whether a pose sees a look-alike of a thing.

    In families whose target is visible at the start, the pose must also see the object that the phrase relates it to.
    """
    items = context.items
    others = [context.thing(other.id) for other in look_alikes(items[thing.id], items.values())]
    if FAMILIES[family].visible_at_start:  # few starts see look-alikes in another room
        others = [other for other in others if items[other.id].room_id == items[thing.id].room_id]
    anchor = anchor_of(phrase, items.values()) if FAMILIES[family].visible_at_start else None

    def sees(pose: Pose) -> bool:
        is_placed = anchor is None or _sees_any(context, pose, [context.thing(anchor.id)])
        return is_placed and _sees_any(context, pose, others)

    return sees


def _sees_any(context: HouseContext, pose: Pose, things: list[Thing]) -> bool:
    view = context.view
    ahead = [thing for thing in things if _is_ahead(pose, thing)]
    likely = [thing for thing in ahead if view.sees(pose.eye, surface_points(thing, GLANCE_POINTS), thing.id).any()]
    with view.at_pose(pose):
        return any(is_observable(view.state_of(thing.id)) for thing in likely)


def _is_ahead(pose: Pose, thing: Thing) -> bool:
    """Return whether direction and distance allow a thing to be in the frame and observable from a pose."""
    aside_deg = abs(wrap_deg(yaw_towards(pose.position, thing.position) - pose.rotation))
    return aside_deg <= HALF_VIEW_DEG and floor_distance(pose.position, thing.position) <= OBSERVABLE_M
