"""Solvers: scripts that solve episodes with the same four skills and pixel clicks as any agent.

They plan with the hidden world (`vigil.authoring.solving.privileged_view`). `privileged_agent` makes a script into an
agent that the runner can play. The analysis marks these agents as privileged.
"""

import zlib
from collections.abc import Callable, Iterable
from itertools import islice

import numpy as np

from vigil.authoring.solving import primitive_actions
from vigil.authoring.solving.chores import solve_chores
from vigil.authoring.solving.flawed.ablated_solvers import ABLATIONS, ablated_solver
from vigil.authoring.solving.flawed.chore_faults import CHORE_FAULTS
from vigil.authoring.solving.goal_actions import (
    Steps,
    achieve_goal,
    expected_status,
    perform_regardless,
    reach_goal,
    resolve_constraint,
)
from vigil.authoring.solving.macro_actions import MacroActions, Unsolvable
from vigil.authoring.solving.noisy_actions import NoisyMacroActions
from vigil.authoring.solving.privileged_view import PrivilegedView
from vigil.errors import SettingError
from vigil.protocol.actions import Action, InteractPixel, Reply, Report
from vigil.protocol.episode import Episode
from vigil.protocol.families import FAMILIES
from vigil.protocol.goals import Chores
from vigil.protocol.observation import FRAME_HEIGHT, FRAME_WIDTH, Observation
from vigil.sim.privileged import PrivilegedSimulator


def solve(episode: Episode, view: PrivilegedView) -> Steps:
    """Yield the actions that solve an episode. Each action must be carried out before the next is taken.

    Only skills that the family expects are used. Raises Unsolvable if there is no way.
    """
    return solve_with(episode, MacroActions(view, may_tilt="look" in FAMILIES[episode.family].skills))


def solve_noisily(episode: Episode, view: PrivilegedView, seed: int = 0) -> Steps:
    """Yield the actions of a solver with motor noise. Each action must be carried out before the next is taken.

    The solver knows what to do and from where it can be done, but it knows only those obstacles that frames have shown.
    It may tilt the camera even if the family does not expect this. The same episode and seed give the same errors.
    Raises Unsolvable if there is no way.
    """
    rng = np.random.default_rng([zlib.crc32(episode.id.encode()), seed])
    return solve_with(episode, NoisyMacroActions(view, rng))


def solve_with(episode: Episode, macro_actions: MacroActions) -> Steps:
    """Yield the actions that solve an episode, made by `macro_actions`. Raises Unsolvable if there is no way."""
    goal, view = episode.goal, macro_actions.view
    if isinstance(goal, Chores):
        yield from solve_chores(episode, macro_actions)
        return
    for link in goal.chain:
        yield from achieve_goal(link, macro_actions)
    if goal.constraint is not None:
        yield from resolve_constraint(goal.constraint, goal, macro_actions)
    yield from reach_goal(goal, macro_actions)
    yield Report(status=expected_status(goal, view), summary="Done.")


def solution(episode: Episode, view: PrivilegedView) -> tuple[Action, ...]:
    """Return the solution from the simulator's current state, with its report. The state is not changed.

    Raises Unsolvable if there is no way or the solution exceeds the step budget.
    """
    actions = carry_out(islice(solve(episode, view), episode.max_steps + 1), view)
    if len(actions) > episode.max_steps:
        raise Unsolvable(
            f"Episode {episode.id!r}: its solution takes more than the {episode.max_steps} steps of its budget."
        )
    return actions


def carry_out(steps: Iterable[Action], view: PrivilegedView) -> tuple[Action, ...]:
    """Carry out each action before the next is taken; return all actions. At the end, restore the simulator's state.

    Raises Unsolvable if `steps` does.
    """
    actions: list[Action] = []
    with view.rollback():
        for action in steps:
            actions.append(action)
            if not isinstance(action, Report):
                view.step(action)
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
    **CHORE_FAULTS,
}
"""Name of a privileged agent -> its script."""


class PrivilegedAgent:
    """An agent that plays one episode with access to the hidden world. It runs in the process of its simulator."""

    def __init__(self, name: str, episode: Episode, simulator: PrivilegedSimulator) -> None:
        self.name = name
        self._script = PRIVILEGED[name]
        self._episode = episode
        self._simulator = simulator
        self._actions: Steps = iter(())

    def start(self, instruction: str) -> None:
        """Start the script from the beginning. The instruction is not used."""
        del instruction
        self._actions = self._script(self._episode, PrivilegedView(self._simulator))

    def act(self, observation: Observation) -> Reply:
        """Return the script's next reply; if the solver finds no way, a report of failure."""
        del observation
        try:
            action = next(self._actions)
        except Unsolvable as error:
            action = Report(status="fail", summary=str(error))
        return primitive_actions.reply_of(action)


def privileged_agent(name: str, episode: Episode, simulator: PrivilegedSimulator) -> PrivilegedAgent:
    """Return the privileged agent called `name` for one episode.

    Raises SettingError if the name is unknown, or if the agent plays lists of chores and the episode is not a list.
    """
    if name not in PRIVILEGED:
        raise SettingError(f"Privileged agent {name!r} does not exist. Choose one of: {', '.join(PRIVILEGED)}.")
    if name in CHORE_FAULTS and not isinstance(episode.goal, Chores):
        raise SettingError(
            f"Agent {name!r} plays lists of chores, and episode {episode.id!r} is not one. Give a pack of the suite "
            "`chores`."
        )
    return PrivilegedAgent(name, episode, simulator)
