"""Functions for families whose tasks are about one object: which things may be targets, their starts, setups and goals.

The functions that draft a family's kinds are in the family's folder in `vigil.authoring.families`. They are written so
that drafts satisfy most rules; `vigil.authoring.review.validate` checks all rules.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

from vigil.authoring.drafting.house_context import MARGIN_PX, HouseContext, TaskSpec, VisibilityTest
from vigil.authoring.language.referring import Phrase
from vigil.authoring.language.sentences import Sentences
from vigil.authoring.language.wording import Act
from vigil.authoring.review.rules import START_PX, WIDE_OPEN
from vigil.base.geometry import Pose
from vigil.protocol.episode import Episode
from vigil.protocol.families import FAMILIES, Family
from vigil.protocol.family import DEFAULT_HORIZON_DEG, TargetSize
from vigil.protocol.goals import Goal, ObjectHeld, ObjectInState, is_observable
from vigil.protocol.world import ObjectSetup, Setup
from vigil.scene.supports import surface_named
from vigil.scene.things import Thing
from vigil.scoring.target_strata import size_of

CLEAR_PX, HARD_PX = 400, START_PX
"""Minimum visible pixels of the object to act on: at a clear start, and at a hard start (the minimum of the rules)."""
LEVEL_DEG = 0.0
NEVER_TARGETS = (
    *("Window", "Doorframe", "Doorway", "Rug", "CeilingLamp", "LightSwitch", "StoveKnob", "Mirror"),
    *("Blinds", "Curtains", "TowelHolder", "HandTowelHolder"),
)
"""Categories that are poor targets: parts of the building, and things that are numerous, plain or often covered."""
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
"""Categories of machines and lamps whose state (on or off) is visible from across a room."""
POSES_PER_PLACE = 3
"""Number of poses tried at each place, to find one from which the target is not visible."""
SPREAD_DEG = {True: 60.0, False: 180.0}
"""Whether the target would be visible after turning -> maximum angle (deg) between a start's heading and the direction
straight away from the target."""
ACTS: tuple[Act, ...] = ("turn_on", "turn_off", "open", "close", "pick")

Drafts = Iterator[Episode]
PoseTest = Callable[[Pose], bool]


@dataclass(frozen=True, slots=True)
class Ask:
    """How a family asks for one thing. If there is an act, the words and the goal follow from the act."""

    family: Family
    sentences: Sentences
    find_start: Callable[[Thing, PoseTest], Pose | None]
    """Function that takes a thing and a further test, and returns a start that passes the test; None if there is none.
    It is called while the house has the setup."""
    goal_of: Callable[[Thing], Goal] | None = None
    """Function that takes a thing and returns the goal; None if the goal follows from the act."""
    act: Act | None = None
    template: str = ""
    """Template of the drafts; empty if the name of the act is the template."""


def drafts_about(context: HouseContext, ask: Ask, things: Iterable[Thing]) -> Drafts:
    """Yield a draft for each of the things for which a start is found."""
    for thing in things:
        setup = setup_for(thing, ask.act)
        if not context.can_begin(setup):
            continue
        start = ask.find_start(thing, lambda _: True)
        phrase = context.phrase(thing.id)
        context.begin(Setup())
        if start is not None:
            yield draft_about(context, ask, thing, start, phrase)


def draft_about(context: HouseContext, ask: Ask, thing: Thing, start: Pose, phrase: Phrase | None) -> Episode:
    """Return the draft of an episode about a thing; `phrase` means the thing."""
    task = TaskSpec(
        start=start,
        setup=setup_for(thing, ask.act),
        instruction=context.order(ask.sentences, ask.act, thing, phrase),
        goal=goal_for(thing, ask.act or "pick") if ask.goal_of is None else ask.goal_of(thing),
        bindings={"target": thing.id},
        template=ask.template or ask.act or "",
        target_size=size_of_thing(thing) if FAMILIES[ask.family].stratum == "target_size" else None,
    )
    return context.draft(ask.family, task)


def finder_of_starts_in_view(
    context: HouseContext, family: Family, test_for: Callable[[Thing], VisibilityTest] | None = None
) -> Callable[[Thing, PoseTest], Pose | None]:
    """Return the function `Ask.find_start` for a family whose target is in view at the start.

    `test_for` takes a thing and returns the test of whether it is seen well enough (default: the test `is_in_view`).
    """

    def find_start(thing: Thing, also: PoseTest) -> Pose | None:
        is_clear = is_in_view(context) if test_for is None else test_for(thing)
        return context.start_seeing(thing, FAMILIES[family].start_distance_m, DEFAULT_HORIZON_DEG, is_clear, also)

    return find_start


def is_target(thing: Thing) -> bool:
    """Return whether a thing may be a target."""
    return thing.category not in NEVER_TARGETS and not thing.is_structure


def shows_px(min_px: int) -> VisibilityTest:
    """Return the test that an object is observable and has at least `min_px` pixels and a margin in the frame."""
    needed = min_px + MARGIN_PX
    return VisibilityTest(needed, lambda state: state.visible and state.visible_px >= needed and is_observable(state))


def is_in_view(context: HouseContext) -> VisibilityTest:
    """Return the test that the start clearly shows the object to act on; a hard start needs only the rules' minimum."""
    return shows_px(HARD_PX if context.prefers_hard_starts else CLEAR_PX)


def size_of_thing(thing: Thing) -> TargetSize:
    """Return the size class that a thing has as a target."""
    return size_of(thing.category, max(thing.asset.size))


def can_be_searched_for(context: HouseContext, thing: Thing) -> bool:
    """Return whether a thing may be a target and can be found by looking, i.e. is not in a closed container."""
    parent = context.view.scene.things.get(thing.parent or "")
    surface = surface_named(parent, thing.surface) if parent is not None else None
    is_shut_away = surface is not None and surface.needs_opening and parent is not None and parent.openness < WIDE_OPEN
    return is_target(thing) and not is_shut_away


def start_not_seeing(context: HouseContext, thing: Thing, *, by_turning: bool | None, horizon: float) -> Pose | None:
    """Return a start pose from which a thing is not visible; None if none is found. `horizon` is the pitch (deg).

    `by_turning` says whether the thing must (True) or must not (False) become visible by turning; None: either.
    """
    return context.hardest(_starts_not_seeing(context, thing, by_turning, horizon), thing)


def _starts_not_seeing(context: HouseContext, thing: Thing, by_turning: bool | None, horizon: float) -> Iterator[Pose]:
    for place in context.starts(context.away_from(thing, *FAMILIES["VS"].start_distance_m)):
        can_turn = context.is_visible_from(place, thing)
        if by_turning is not None and can_turn != by_turning:
            continue
        if by_turning and not context.sees_clearly(
            context.facing(place, thing, horizon, 0.0), [thing.id], shows_px(CLEAR_PX)
        ):
            continue
        for _ in range(POSES_PER_PLACE):
            pose = context.facing(place, thing, horizon, SPREAD_DEG[can_turn], aside_deg=180.0)
            if context.has_room_to_move(pose) and context.is_out_of_view_from(pose, thing.id):
                yield pose
                break


def allows(thing: Thing, act: Act) -> bool:
    """Return whether an act can be done to a thing."""
    if act == "pick":
        return thing.is_pickupable
    if act in ("open", "close"):
        return thing.is_openable and thing.category not in UNCLEAR_WHEN_OPEN
    return thing.is_toggleable


def acts_for(thing: Thing) -> list[Act]:
    """Return the acts on a thing that an instruction can ask for."""
    return [act for act in ACTS if allows(thing, act)]


def setup_for(thing: Thing, act: Act | None) -> Setup:
    """Return the setup in which an act on a thing is still needed, e.g. closed for "open"; empty if `act` is None."""
    changes: dict[Act | None, ObjectSetup] = {
        "open": ObjectSetup(openness=0.0),
        "close": ObjectSetup(openness=1.0),
        "turn_on": with_laptop_open(thing, ObjectSetup(is_toggled=False, openness=0.0 if thing.is_openable else None)),
        "turn_off": with_laptop_open(thing, ObjectSetup(is_toggled=True)),
    }
    change = changes.get(act)
    return Setup(objects={thing.id: change}) if change else Setup()


def with_laptop_open(thing: Thing, change: ObjectSetup) -> ObjectSetup:
    """Return `change`; a laptop is also opened by it, because a closed laptop does not show whether it is on."""
    return change.model_copy(update={"openness": 1.0}) if thing.category == "Laptop" else change


def goal_for(thing: Thing, act: Act) -> Goal:
    """Return the goal that an act on a thing reaches."""
    if act == "pick":
        return ObjectHeld(object_id=thing.id)
    state = "is_open" if act in ("open", "close") else "is_toggled"
    return ObjectInState(object_id=thing.id, state=state, value=act in ("open", "turn_on"))


def act_of(goal: Goal) -> Act:
    """Return the act that reaches a goal: opening, closing, turning on, turning off, or picking up."""
    if isinstance(goal, ObjectInState):
        acts: tuple[Act, Act] = ("open", "close") if goal.state == "is_open" else ("turn_on", "turn_off")
        return acts[0] if goal.value else acts[1]
    assert isinstance(goal, ObjectHeld)
    return "pick"
