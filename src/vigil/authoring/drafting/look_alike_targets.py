"""Drafts, for several families, about one of several look-alikes: colour, place or a relation identifies the target.

If the target is in view at the start, another object that its name could also mean is in view, too.
"""

from collections.abc import Callable
from dataclasses import replace

from vigil.authoring.drafting.house_context import HouseContext
from vigil.authoring.drafting.proposals import (
    Ask,
    Drafts,
    PoseTest,
    acts_for,
    can_be_searched_for,
    draft_about,
    setup_for,
    start_not_seeing,
)
from vigil.authoring.language.disambiguation import anchor_of, disambiguating_phrases, look_alikes
from vigil.authoring.language.referring import Phrase
from vigil.authoring.review.rules import LOOK_ALIKE_TEMPLATE
from vigil.authoring.solving.look_targets import surface_points
from vigil.base.geometry import Pose, floor_distance, wrap_deg, yaw_towards
from vigil.protocol.families import FAMILIES, Family
from vigil.protocol.goals import OBSERVABLE_M, is_observable
from vigil.protocol.world import Setup
from vigil.scene.things import Thing

STARTS = 3
"""Number of starts with the target out of view that are tried, to find a start with a look-alike in view."""
GLANCE_POINTS = 16
"""Number of points of a look-alike that are tested for visibility before its pixels are counted."""
HALF_VIEW_DEG = 53.0
"""Angle (deg), rounded, from the middle of the frame to its left or right edge."""


def drafts_among_look_alikes(context: HouseContext, asking: Callable[[HouseContext], Ask]) -> Drafts:
    """Yield a draft for each object that has a start and that a phrase distinguishes from its look-alikes.

    `asking` returns how the family asks for a thing. If the family's goal follows from an act, the act is drawn at
    random from those that the object allows; objects that allow no act are left out.
    """
    ask = asking(context)
    for thing in context.shuffled(_wanted(context, in_view=FAMILIES[ask.family].visible_at_start)):
        options = acts_for(thing) if ask.goal_of is None else []
        if ask.goal_of is None and not options:
            continue
        act = options[int(context.rng.integers(len(options)))] if options else None
        phrase = _phrase(context, thing, setup_for(thing, act))
        is_placed = _sees_look_alike(context, thing, phrase, ask.family) if phrase is not None else None
        start = ask.find_start(thing, is_placed) if is_placed is not None else None
        context.begin(Setup())
        if start is not None:
            asked = replace(ask, act=act, template=ask.template or LOOK_ALIKE_TEMPLATE)
            yield draft_about(context, asked, thing, start, phrase)


def start_out_of_view(
    context: HouseContext, thing: Thing, also: PoseTest, *, by_turning: bool | None, horizon: float
) -> Pose | None:
    """Return a start from which a thing is not visible (if possible, one that passes `also`); None if none is found."""
    start: Pose | None = None
    for _ in range(STARTS):
        start = start_not_seeing(context, thing, by_turning=by_turning, horizon=horizon) or start
        if start is None or also(start):
            break
    return start


def _wanted(context: HouseContext, *, in_view: bool) -> list[Thing]:
    """Return the possible targets that have a look-alike (if `in_view` is True, a look-alike in the same room)."""
    items = context.items
    found: list[Thing] = []
    for item in items.values():
        thing = context.thing(item.id)
        is_open_to_all = context.allowed_ids is None or thing.id in context.allowed_ids
        alike = look_alikes(item, items.values())
        is_alike = any(other.room_id == item.room_id for other in alike) if in_view else bool(alike)
        if is_alike and is_open_to_all and can_be_searched_for(context, thing):
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


def _sees_look_alike(context: HouseContext, thing: Thing, phrase: Phrase, family: Family) -> PoseTest:
    """Return the test of whether a look-alike of a thing is visible from a pose.

    In families whose target is visible at the start, an object to which the phrase relates the target must also be
    visible.
    """
    items = context.items
    others = [context.thing(other.id) for other in look_alikes(items[thing.id], items.values())]
    anchor = None
    if FAMILIES[family].visible_at_start:  # few starts see look-alikes in another room
        others = [other for other in others if items[other.id].room_id == items[thing.id].room_id]
        anchor = anchor_of(phrase, items.values())

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
    """Return whether a thing's direction and distance from a pose allow it to be observable in the frame."""
    aside_deg = abs(wrap_deg(yaw_towards(pose.position, thing.position) - pose.rotation))
    return aside_deg <= HALF_VIEW_DEG and floor_distance(pose.position, thing.position) <= OBSERVABLE_M
