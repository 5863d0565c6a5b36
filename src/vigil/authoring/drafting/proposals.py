"""Proposals of the families with one object (PG, DA, VS, SV, AI, SI), with varied instructions.

Drafts satisfy most rules by construction; `vigil.authoring.review.validate` decides. `sequences` and `chains` propose
SM, `constraints` and `leaves` CR.
"""

from collections.abc import Callable, Iterable, Iterator
from typing import Literal

from vigil.authoring.drafting.house_context import MARGIN_PX, HouseContext, TaskSpec, VisibilityTest
from vigil.authoring.language.sentences import APPROACH, ORDERS, POINT, SEARCH, SEARCH_ORDERS, Sentences
from vigil.authoring.language.wording import Act, order_slots, pronoun_slots, question
from vigil.authoring.review.rules import SMALL_START_PX, START_PX, STATE_START_PX, WIDE_OPEN, place_blind_to
from vigil.base.geometry import EYE_HEIGHT_M, Pose
from vigil.protocol.episode import Episode
from vigil.protocol.families import FAMILIES, Family
from vigil.protocol.family import DEFAULT_HORIZON_DEG, TargetSize
from vigil.protocol.goals import (
    NEAR_M,
    AgentNearTarget,
    Goal,
    ObjectHeld,
    ObjectInState,
    ReportStatus,
    StateLabel,
    TargetGrounded,
    is_observable,
    is_state_observable,
)
from vigil.protocol.world import ObjectSetup, Setup
from vigil.scene.supports import surface_named
from vigil.scene.things import Thing
from vigil.scoring.target_strata import size_of

CLEAR_PX, HARD_PX = 400, START_PX
"""Visible pixels of the object to act on at a start that is clear to a person, and at a hard start (the rules' least).
"""
CLEAR_PX_BY_SIZE: dict[TargetSize, int] = {"large": 4000, "medium": 800, "small": 180}
HARD_PX_BY_SIZE: dict[TargetSize, int] = {"large": 1000, "medium": 200, "small": SMALL_START_PX}
STATE_PX, HARD_STATE_PX = 350, STATE_START_PX
LEVEL_DEG = 0.0
NEVER_TARGETS = frozenset(
    {
        *("Window", "Doorframe", "Doorway", "Rug", "CeilingLamp", "LightSwitch", "StoveKnob", "Mirror"),
        *("Blinds", "Curtains", "TowelHolder", "HandTowelHolder"),
    }
)
"""Categories that are poor targets: parts of the building, numerous, plain, or hidden by what they hold."""
UNCLEAR_WHEN_OPEN = frozenset(
    {"Book", "Blinds", "Curtains", "ShowerCurtain", "Kettle", "TVStand", "Desk", "SideTable", "CoffeeTable"}
)
"""Categories that people would not simply call open or closed."""
SV_TOGGLES = frozenset(
    {
        *("Television", "FloorLamp", "DeskLamp", "Faucet", "Desktop", "Candle", "StoveBurner", "ShowerHead"),
        *("Microwave", "CoffeeMachine", "Laptop"),
    }
)
"""Categories that show from across a room whether they are on."""
APPROACHED_M = (0.15, 1.9)
"""Longest sides (m) between which an object is approached; smaller ones are hard to see, larger ones always near."""
MIN_SEARCHED_SIZE_M = 0.1
"""Longest side (m) above which an object is searched for."""
ABOVE_EYES_M = 0.3
"""Height (m) below the eyes above which a state is judged with the camera level."""
POSES_PER_PLACE = 3
"""Number of poses tried at one place for one that does not see the target."""
SPREAD_DEG = {True: 60.0, False: 180.0}
"""Whether turning would show the target -> greatest angle (deg) of a start's heading to straight away from it."""

LABELS: dict[StateLabel, tuple[Literal["is_toggled", "is_open"], ObjectSetup]] = {
    "on": ("is_toggled", ObjectSetup(is_toggled=True)),
    "off": ("is_toggled", ObjectSetup(is_toggled=False)),
    "open": ("is_open", ObjectSetup(openness=1.0)),
    "closed": ("is_open", ObjectSetup(openness=0.0)),
}
"""Label -> the state that is asked about, and the change that sets it."""

Drafts = Iterator[Episode]


def is_target(thing: Thing) -> bool:
    """Return whether a thing may be a target."""
    return thing.category not in NEVER_TARGETS and not thing.is_structure


def is_seen(min_px: int) -> VisibilityTest:
    """Return the test that an object is observable with at least `min_px` pixels and a margin."""
    needed = min_px + MARGIN_PX
    return VisibilityTest(needed, lambda state: state.visible and state.visible_px >= needed and is_observable(state))


def is_in_view(context: HouseContext) -> VisibilityTest:
    """Return the test that a start shows the object to act on: clearly, or as the rules ask if starts are hard."""
    return is_seen(HARD_PX if context.prefers_hard_starts else CLEAR_PX)


def is_in_view_to_point(context: HouseContext, size: TargetSize) -> VisibilityTest:
    """Return the test that a start shows a target of a size to point at: clearly, or as the rules ask if hard."""
    return is_seen((HARD_PX_BY_SIZE if context.prefers_hard_starts else CLEAR_PX_BY_SIZE)[size])


def size_of_thing(thing: Thing) -> TargetSize:
    """Return the size class of a thing as a target."""
    return size_of(thing.category, max(thing.asset.size))


def pointing(context: HouseContext, size: TargetSize) -> Drafts:
    """Yield PG drafts with targets of a size class."""
    for thing in context.things(lambda thing: is_target(thing) and size_of_thing(thing) == size):
        start = context.start_seeing(
            thing, FAMILIES["PG"].start_distance_m, DEFAULT_HORIZON_DEG, is_in_view_to_point(context, size)
        )
        if start is not None:
            yield context.draft(
                "PG",
                TaskSpec(
                    start=start,
                    instruction=context.sentence_about(thing, POINT),
                    goal=TargetGrounded(object_id=thing.id),
                    bindings={"target": thing.id},
                    target_size=size,
                ),
            )


def approaching(context: HouseContext) -> Drafts:
    """Yield DA drafts."""
    for thing in context.things(lambda thing: is_approachable(thing)):
        if place_blind_to(context.view, thing, NEAR_M) is not None:
            continue
        start = context.start_seeing(thing, FAMILIES["DA"].start_distance_m, DEFAULT_HORIZON_DEG, is_in_view(context))
        if start is not None:
            yield context.draft(
                "DA",
                TaskSpec(
                    start=start,
                    instruction=context.sentence_about(thing, APPROACH),
                    goal=AgentNearTarget(object_id=thing.id, threshold_m=NEAR_M),
                    bindings={"target": thing.id},
                ),
            )


def is_approachable(thing: Thing) -> bool:
    """Return whether a thing may be a target of DA: it has a suitable size and is not a drawer."""
    low, high = APPROACHED_M
    return is_target(thing) and low < max(thing.asset.size) < high and not thing.is_drawer


def searching(context: HouseContext, *, by_turning: bool) -> Drafts:
    """Yield VS drafts; `by_turning` says whether turning at the start position must or must not show the target."""
    for thing in context.things(lambda thing: is_searchable(thing) and can_be_searched_for(context, thing)):
        start = start_not_seeing(context, thing, by_turning=by_turning, horizon=LEVEL_DEG)
        if start is not None:
            yield context.draft(
                "VS",
                TaskSpec(
                    start=start,
                    instruction=context.sentence_about(thing, SEARCH),
                    goal=ObjectInState(object_id=thing.id, state="is_visible"),
                    bindings={"target": thing.id},
                    template="turn" if by_turning else "walk",
                ),
            )


def is_searchable(thing: Thing) -> bool:
    """Return whether a thing may be searched for: it is not too small, and not a drawer, which is in its furniture."""
    return max(thing.asset.size) > MIN_SEARCHED_SIZE_M and not thing.is_drawer


def can_be_searched_for(context: HouseContext, thing: Thing) -> bool:
    """Return whether a thing may be a target and does not lie in a closed container, where looking does not find it."""
    parent = context.view.scene.things.get(thing.parent or "")
    surface = surface_named(parent, thing.surface) if parent is not None else None
    is_shut_away = surface is not None and surface.needs_opening and parent is not None and parent.openness < WIDE_OPEN
    return is_target(thing) and not is_shut_away


def start_not_seeing(context: HouseContext, thing: Thing, *, by_turning: bool | None, horizon: float) -> Pose | None:
    """Return a start pose that does not see a thing; None if none is found.

    `by_turning` says whether turning must or must not show the thing (None: either); `horizon` is the pitch (deg).
    """
    return context.hardest(_starts_not_seeing(context, thing, by_turning, horizon), thing)


def _starts_not_seeing(context: HouseContext, thing: Thing, by_turning: bool | None, horizon: float) -> Iterator[Pose]:
    for place in context.starts(context.away_from(thing, *FAMILIES["VS"].start_distance_m)):
        can_turn = context.is_visible_from(place, thing)
        if by_turning is not None and can_turn != by_turning:
            continue
        if by_turning and not context.sees_clearly(
            context.facing(place, thing, horizon, 0.0), [thing.id], is_seen(CLEAR_PX)
        ):
            continue
        for _ in range(POSES_PER_PLACE):
            pose = context.facing(place, thing, horizon, SPREAD_DEG[can_turn], aside_deg=180.0)
            if context.has_room_to_move(pose) and context.seen_from(pose, thing.id).visible_px == 0:
                yield pose
                break


def verifying(context: HouseContext, label: StateLabel) -> Drafts:
    """Yield SV drafts whose state at the start is `label`."""
    state, change = LABELS[label]
    for thing in context.things(lambda thing: is_target(thing) and _has_state(thing, state)):
        setup = Setup(objects={thing.id: _with_laptop_open(thing, change) if state == "is_toggled" else change})
        if not context.can_begin(setup):
            continue
        start = context.start_seeing(
            thing,
            FAMILIES["SV"].start_distance_m,
            LEVEL_DEG if thing.position.y > EYE_HEIGHT_M - ABOVE_EYES_M else DEFAULT_HORIZON_DEG / 2,
            _shows_state(state, HARD_STATE_PX if context.prefers_hard_starts else STATE_PX),
        )
        phrase = context.phrase(thing.id)
        context.begin(Setup())
        if start is not None:
            yield context.draft(
                "SV",
                TaskSpec(
                    start=start,
                    setup=setup,
                    instruction=question(state, thing.category, str(phrase), context.forms, context.rng),
                    goal=ReportStatus(object_id=thing.id, state=state),
                    bindings={"target": thing.id},
                    template=label,
                ),
            )


def _shows_state(state: Literal["is_toggled", "is_open"], min_px: int) -> VisibilityTest:
    """Return the test that the parts that show an object's state are in view with `min_px` pixels and a margin."""
    needed = min_px + 2 * MARGIN_PX
    return VisibilityTest(
        needed, lambda seen: seen.state_px(state) >= needed and seen.visible and is_state_observable(seen, state)
    )


def _has_state(thing: Thing, state: str) -> bool:
    if state == "is_toggled":
        return thing.is_toggleable and thing.category in SV_TOGGLES
    return thing.is_openable and thing.category not in UNCLEAR_WHEN_OPEN


def acting(context: HouseContext, act: Act) -> Drafts:
    """Yield AI drafts of an act: the target is in view but out of reach."""
    yield from _drafts_of_act(
        context,
        ("AI", ORDERS, act),
        context.things(lambda thing: is_target(thing) and allows(thing, act)),
        lambda thing: context.start_seeing(
            thing, FAMILIES["AI"].start_distance_m, DEFAULT_HORIZON_DEG, is_in_view(context)
        ),
    )


def seeking(context: HouseContext, act: Act, *, by_turning: bool | None = None) -> Drafts:
    """Yield SI drafts of an act: the target is out of view.

    `by_turning` says whether turning must or must not show the target (None: either).
    """
    yield from _drafts_of_act(
        context,
        ("SI", SEARCH_ORDERS, act),
        context.things(lambda thing: allows(thing, act) and can_be_searched_for(context, thing)),
        lambda thing: start_not_seeing(context, thing, by_turning=by_turning, horizon=DEFAULT_HORIZON_DEG / 2),
    )


def _drafts_of_act(
    context: HouseContext,
    kind: tuple[Family, Sentences, Act],
    things: Iterable[Thing],
    start_for: Callable[[Thing], Pose | None],
) -> Drafts:
    """Yield a draft of a family and an act for each thing that has a start."""
    family, sentences, act = kind
    for thing in things:
        setup = setup_for(thing, act)
        if not context.can_begin(setup):
            continue
        start = start_for(thing)
        phrase = str(context.phrase(thing.id))
        context.begin(Setup())
        if start is not None:
            words = order_slots(act, thing.category, phrase, context.rng) | pronoun_slots(thing.category)
            task = TaskSpec(
                start=start,
                setup=setup,
                instruction=context.say(sentences, target=phrase, **words),
                goal=goal_for(thing, act),
                bindings={"target": thing.id},
                template=act,
            )
            yield context.draft(family, task)


def allows(thing: Thing, act: Act) -> bool:
    """Return whether a thing allows an act."""
    if act == "pick":
        return thing.is_pickupable
    if act in ("open", "close"):
        return thing.is_openable and thing.category not in UNCLEAR_WHEN_OPEN
    return thing.is_toggleable


def setup_for(thing: Thing, act: Act) -> Setup:
    """Return the setup in which a thing is in the state before an act."""
    changes: dict[Act, ObjectSetup] = {
        "open": ObjectSetup(openness=0.0),
        "close": ObjectSetup(openness=1.0),
        "turn_on": _with_laptop_open(thing, ObjectSetup(is_toggled=False, openness=0.0 if thing.is_openable else None)),
        "turn_off": _with_laptop_open(thing, ObjectSetup(is_toggled=True)),
    }
    change = changes.get(act)
    return Setup(objects={thing.id: change}) if change else Setup()


def _with_laptop_open(thing: Thing, change: ObjectSetup) -> ObjectSetup:
    """Return a change, with openness 1 added for a laptop, since a closed one does not show whether it is on."""
    return change.model_copy(update={"openness": 1.0}) if thing.category == "Laptop" else change


def goal_for(thing: Thing, act: Act) -> Goal:
    """Return the goal that an act on a thing reaches."""
    if act == "pick":
        return ObjectHeld(object_id=thing.id)
    state = "is_open" if act in ("open", "close") else "is_toggled"
    return ObjectInState(object_id=thing.id, state=state, value=act in ("open", "turn_on"))
