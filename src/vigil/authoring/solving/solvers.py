"""Solvers: one way of solving each episode, through the same four skills and pixel clicks as any agent.

They see the hidden world (`vigil.authoring.solving.privileged_view`), plan with it and act like any agent; each uses
only the skills that its family expects. `privileged_agent` makes agents of them that the runner can play; reports
mark those agents.
"""

import zlib
from collections.abc import Callable

import numpy as np

from vigil.authoring.solving import primitive_actions
from vigil.authoring.solving.ablated_solvers import ABLATIONS, ablated_solver
from vigil.authoring.solving.constraint_actions import resolve_constraint
from vigil.authoring.solving.goal_actions import Steps, achieve_goal, expected_status, perform_regardless, reach_goal
from vigil.authoring.solving.macro_actions import MacroActions, Unsolvable
from vigil.authoring.solving.noisy_actions import NoisyMacroActions
from vigil.authoring.solving.privileged_view import PrivilegedView
from vigil.errors import SettingError
from vigil.protocol.actions import Action, InteractPixel, Reply, Report
from vigil.protocol.episode import Episode
from vigil.protocol.families import FAMILIES
from vigil.protocol.observation import FRAME_HEIGHT, FRAME_WIDTH, Observation
from vigil.sim.privileged import PrivilegedSimulator


def solve(episode: Episode, view: PrivilegedView) -> Steps:
    """Yield the actions that solve an episode, each after the one before has been carried out.

    Raises Unsolvable where there is no way.
    """
    return solve_with(episode, MacroActions(view, may_tilt="look" in FAMILIES[episode.family].skills))


def solve_noisily(episode: Episode, view: PrivilegedView, seed: int = 0) -> Steps:
    """Yield what a body that errs does to solve an episode, each after the one before has been carried out.

    It knows what to do and where that can be done, sees on its way no more than the frames show, and looks up and down
    whatever its family expects. The same episode and seed: the same errors. Raises Unsolvable where there is no way.
    """
    rng = np.random.default_rng([zlib.crc32(episode.id.encode()), seed])
    return solve_with(episode, NoisyMacroActions(view, rng))


def solve_with(episode: Episode, macro_actions: MacroActions) -> Steps:
    """Yield the actions that solve an episode with some macro actions. Raises Unsolvable where there is no way."""
    goal, view = episode.goal, macro_actions.view
    for link in goal.chain:
        yield from achieve_goal(link, macro_actions)
    if goal.constraint is not None:
        yield from resolve_constraint(goal.constraint, goal, macro_actions)
    yield from reach_goal(goal, macro_actions)
    yield Report(status=expected_status(goal, view), summary="Done.")


def solution(episode: Episode, view: PrivilegedView) -> tuple[Action, ...]:
    """Return the whole solution from the stage's present state, which it leaves as it was. Raises Unsolvable."""
    actions: list[Action] = []
    with view.rollback():
        for action in solve(episode, view):
            actions.append(action)
            if not isinstance(action, Report):
                view.step(action)
            if len(actions) > episode.max_steps:
                raise Unsolvable(f"Episode {episode.id!r}: more than the {episode.max_steps} steps of its budget.")
    return tuple(actions)


PrivilegedScript = Callable[[Episode, PrivilegedView], Steps]


def _premature(episode: Episode, view: PrivilegedView) -> Steps:
    actions = solution(episode, view)[:-1]
    yield from actions[: len(actions) // 2]
    yield Report(status="success", summary="Done.")


def _acts_anyway(episode: Episode, view: PrivilegedView) -> Steps:
    macro_actions = MacroActions(view, may_tilt="look" in FAMILIES[episode.family].skills)
    yield from perform_regardless(episode.goal, macro_actions)
    yield Report(status=expected_status(episode.goal, view), summary="Done.")


def _never_report(episode: Episode, view: PrivilegedView) -> Steps:
    last: InteractPixel | None = None
    for action in solve(episode, view):
        if not isinstance(action, Report):
            last = action if isinstance(action, InteractPixel) and action.intent == "ground" else last
            yield action
    while True:
        yield last or InteractPixel(intent="ground", x=FRAME_WIDTH // 2, y=FRAME_HEIGHT // 2)


PRIVILEGED: dict[str, PrivilegedScript] = {
    "solver": solve,
    "noisy_solver": solve_noisily,
    "never_report": _never_report,
    "premature": _premature,
    "acts_anyway": _acts_anyway,
    **{name: ablated_solver(ablation) for name, ablation in ABLATIONS.items()},
}
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
        self._actions = self._script(self._episode, PrivilegedView(self._simulator))

    def act(self, observation: Observation) -> Reply:
        """Return the script's next reply; where the solver finds no way, an honest failure."""
        del observation
        try:
            action = next(self._actions)
        except Unsolvable as error:
            action = Report(status="fail", summary=str(error))
        return primitive_actions.reply_of(action)


def privileged_agent(name: str, episode: Episode, simulator: PrivilegedSimulator) -> PrivilegedAgent:
    """Return an agent with privileged sight. Raises SettingError on an unknown name."""
    if name not in PRIVILEGED:
        raise SettingError(f"Privileged agent {name!r} does not exist. Choose one of: {', '.join(PRIVILEGED)}.")
    return PrivilegedAgent(name, episode, simulator)
