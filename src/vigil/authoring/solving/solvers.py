"""Solvers: one way of playing each family, through the same four skills and pixel clicks as any agent.

They see the hidden world (`vigil.authoring.solving.oracle`), plan with it and act like anybody else; each uses only the
skills that its family expects. `privileged_agent` makes agents of them that the runner can play; its reports mark
those.
"""

from collections.abc import Callable, Iterator
from itertools import islice

import numpy as np

from vigil.actions import Action, Intent, InteractPixel, Reply, Report, Status
from vigil.authoring.solving import moves
from vigil.authoring.solving.aim import surface_points
from vigil.authoring.solving.macro_actions import Deeds, Unsolvable, box_distances
from vigil.authoring.solving.oracle import PrivilegedSimulator, Stage
from vigil.authoring.solving.viewpoints import Places, Wish, views
from vigil.episode import FAMILIES, Episode, Family
from vigil.errors import SettingError
from vigil.goals import (
    AgentNearTarget,
    Constraint,
    Goal,
    ObjectAtReceptacle,
    ObjectHeld,
    ObjectInState,
    ReportStatus,
    is_observable,
)
from vigil.observation import FRAME_HEIGHT, FRAME_WIDTH, Observation
from vigil.scene.geometry import box_of

NEAR_MARGIN_M = 0.06
CLEAR_PX = 260
SEE_NEAR_M, SEE_FAR_M = 0.6, 4.5
MOST_LOOKS = 60
SEEN_POINTS = (16, 4)

Steps = Iterator[Action]


def solve(episode: Episode, stage: Stage) -> Steps:
    """Yields the actions that solve an episode, each after the one before has been carried out.

    Raises Unsolvable where there is no way.
    """
    deeds = Deeds(stage, may_tilt="look" in FAMILIES[episode.family].skills)
    yield from _SOLVERS[episode.family](episode, deeds)
    yield Report(status=_closing_status(episode, stage), summary="Done.")


def _closing_status(episode: Episode, stage: Stage) -> Status:
    if not isinstance(episode.goal, ReportStatus):
        return "success"
    thing = stage.scene.things[episode.goal.object_id]
    if episode.goal.state == "is_toggled":
        return "on" if thing.is_toggled else "off"
    return "open" if thing.openness > 0.5 else "closed"


def _ground(episode: Episode, deeds: Deeds) -> Steps:
    pixel = deeds.stage.clickable(episode.goal.object_id)
    if pixel is None:
        raise Unsolvable(f"{episode.goal.object_id!r} is not in the frame.")
    yield moves.click("ground", pixel)


def _approach(episode: Episode, deeds: Deeds) -> Steps:
    goal = episode.goal
    assert isinstance(goal, AgentNearTarget)
    stage = deeds.stage
    thing = stage.scene.things[goal.object_id]
    walks = stage.walks()
    wish = Wish(thing.id, surface_points(thing), _beside(stage, goal), least_seen=1)
    view = next(views(stage, walks, wish), None)
    if view is None:
        raise Unsolvable(f"No reachable place near enough to {thing.id!r}.")
    yield from deeds.go(view)


def _beside(stage: Stage, goal: AgentNearTarget) -> Places:
    """Returns the places that are near enough to a target by both distances, with a margin."""
    thing = stage.scene.things[goal.object_id]
    box, most = box_of(thing), goal.threshold_m - NEAR_MARGIN_M

    def dislike(places: np.ndarray) -> np.ndarray:
        edge = box_distances(box, places)
        centre = stage.centre_distances(thing, places)
        return np.where((edge <= most) & (centre <= most), 0.0, np.inf)

    return dislike


def _search(episode: Episode, deeds: Deeds) -> Steps:
    stage = deeds.stage
    thing = stage.scene.things[episode.goal.object_id]
    box = box_of(thing)

    def dislike(places: np.ndarray) -> np.ndarray:
        distances = box_distances(box, places)
        return np.where((distances >= SEE_NEAR_M) & (distances <= SEE_FAR_M), 0.0, np.inf)

    for least in SEEN_POINTS:
        wish = Wish(thing.id, surface_points(thing), dislike, may_tilt=True, least_seen=least, through_glass=True)
        for view in islice(views(stage, stage.walks(), wish), MOST_LOOKS):
            with stage.standing_at(view.pose):
                state = stage.state_of(thing.id)
            if state.visible and state.visible_px >= CLEAR_PX and is_observable(state):
                yield from deeds.go(view)
                return
    raise Unsolvable(f"No reachable place from which {thing.id!r} is clearly seen.")


def _verify(episode: Episode, deeds: Deeds) -> Steps:
    """State verification starts with the state in view: nothing needs to be done."""
    del episode, deeds
    yield from ()


def _interact(episode: Episode, deeds: Deeds) -> Steps:
    yield from _achieve(episode.goal, deeds)


def _sequence(episode: Episode, deeds: Deeds) -> Steps:
    for link in episode.goal.chain:
        yield from _achieve(link, deeds)
    yield from _achieve(episode.goal, deeds)


def _resolve(episode: Episode, deeds: Deeds) -> Steps:
    goal = episode.goal
    assert goal.constraint is not None
    yield from _lift(goal.constraint, goal, deeds)
    yield from _achieve(goal, deeds)


def _lift(constraint: Constraint, goal: Goal, deeds: Deeds) -> Steps:
    """Yields what resolves a constraint, so that the goal can be gone for with what is then in the hand."""
    intents: dict[str, Intent] = {
        "object_open": "open_access",
        "object_closed": "close_access",
        "object_on": "activate",
        "object_off": "deactivate",
        "object_moved": "pick",
    }
    if constraint.kind in intents:
        yield from deeds.act(intents[constraint.kind], constraint.object_id)
    if constraint.kind == "object_released" or (constraint.kind == "object_moved" and isinstance(goal, ObjectHeld)):
        yield from deeds.put_down(lambda: is_doable(goal, deeds))


def _achieve(goal: Goal, deeds: Deeds) -> Steps:
    if isinstance(goal, ObjectAtReceptacle):
        yield from deeds.place(goal.receptacle_id, inside=goal.inside)
    elif not _holds(goal, deeds.stage):
        yield from deeds.act(_intent_of(goal), goal.object_id)


def is_doable(goal: Goal, deeds: Deeds) -> bool:
    """Whether the goal's own interaction works from some reachable place as things stand now."""
    try:
        deeds.find(_intent_of(goal), goal.object_id)
    except Unsolvable:
        return False
    return True


def _holds(goal: Goal, stage: Stage) -> bool:
    thing = stage.scene.things[goal.object_id]
    if isinstance(goal, ObjectHeld):
        return stage.held == goal.object_id
    if isinstance(goal, ObjectInState) and goal.state == "is_open":
        return thing.openness >= 0.99 if goal.value else thing.openness <= 0.01
    return isinstance(goal, ObjectInState) and goal.state == "is_toggled" and thing.is_toggled == goal.value


def _intent_of(goal: Goal) -> Intent:
    if isinstance(goal, ObjectHeld):
        return "pick"
    if isinstance(goal, ObjectInState) and goal.state == "is_open":
        return "open_access" if goal.value else "close_access"
    if isinstance(goal, ObjectInState) and goal.state == "is_toggled":
        return "activate" if goal.value else "deactivate"
    raise Unsolvable(f"No interaction brings about a goal of kind {goal.kind!r}.")


_SOLVERS: dict[Family, Callable[[Episode, Deeds], Steps]] = {
    "PG": _ground,
    "DA": _approach,
    "VS": _search,
    "SV": _verify,
    "AI": _interact,
    "SI": _interact,
    "SM": _sequence,
    "CR": _resolve,
}


def solution(episode: Episode, stage: Stage) -> tuple[Action, ...]:
    """Returns the whole solution from the stage's present state, which it leaves as it was. Raises Unsolvable."""
    actions: list[Action] = []
    with stage.rehearsal():
        for action in solve(episode, stage):
            actions.append(action)
            if not isinstance(action, Report):
                stage.step(action)
            if len(actions) > episode.max_steps:
                raise Unsolvable(f"Episode {episode.id!r}: more than the {episode.max_steps} steps of its budget.")
    return tuple(actions)


Script = Callable[[Episode, Stage], Steps]


def _premature(episode: Episode, stage: Stage) -> Steps:
    actions = solution(episode, stage)[:-1]
    yield from actions[: len(actions) // 2]
    yield Report(status="success", summary="Done.")


def _never_report(episode: Episode, stage: Stage) -> Steps:
    last: InteractPixel | None = None
    for action in solve(episode, stage):
        if not isinstance(action, Report):
            last = action if isinstance(action, InteractPixel) and action.intent == "ground" else last
            yield action
    while True:
        yield last or InteractPixel(intent="ground", x=FRAME_WIDTH // 2, y=FRAME_HEIGHT // 2)


PRIVILEGED: dict[str, Script] = {"solver": solve, "never_report": _never_report, "premature": _premature}
"""Agents with privileged sight, by name."""


class PrivilegedAgent:
    """Plays one episode with sight of the hidden world, synchronously beside its simulator."""

    def __init__(self, name: str, episode: Episode, simulator: PrivilegedSimulator) -> None:
        self.name = name
        self._script = PRIVILEGED[name]
        self._episode = episode
        self._simulator = simulator
        self._actions: Steps = iter(())

    def start(self, instruction: str) -> None:
        """Starts the script anew; the instruction is not needed."""
        del instruction
        self._actions = self._script(self._episode, Stage(self._simulator))

    def act(self, observation: Observation) -> Reply:
        """Returns the script's next reply; where the solver finds no way, an honest failure."""
        del observation
        try:
            action = next(self._actions)
        except Unsolvable as error:
            action = Report(status="fail", summary=str(error))
        return moves.reply_of(action)


def privileged_agent(name: str, episode: Episode, simulator: PrivilegedSimulator) -> PrivilegedAgent:
    """Returns an agent with privileged sight. Raises SettingError on an unknown name."""
    if name not in PRIVILEGED:
        raise SettingError(f"Privileged agent {name!r} does not exist. Choose one of: {', '.join(PRIVILEGED)}.")
    return PrivilegedAgent(name, episode, simulator)
