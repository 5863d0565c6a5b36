"""Solvers: one way of solving each episode, through the same four skills and pixel clicks as any agent.

They see the hidden world (`vigil.authoring.solving.oracle`), plan with it and act like anybody else; each uses only the
skills that its family expects. `privileged_agent` makes agents of them that the runner can play; its reports mark
those.
"""

import zlib
from collections.abc import Callable

import numpy as np

from vigil.authoring.solving import moves
from vigil.authoring.solving.macro_actions import MacroActions, Unsolvable
from vigil.authoring.solving.noisy_actions import NoisyMacroActions
from vigil.authoring.solving.oracle import Oracle
from vigil.authoring.ways.constraints import lift
from vigil.authoring.ways.goal_kinds import Steps, achieve, closing_status, do_anyway, reach
from vigil.authoring.ways.limited import LIMITED, play_limited
from vigil.errors import SettingError
from vigil.protocol.actions import Action, InteractPixel, Reply, Report
from vigil.protocol.episode import FAMILIES, Episode
from vigil.protocol.observation import FRAME_HEIGHT, FRAME_WIDTH, Observation
from vigil.sim.privileged import PrivilegedSimulator


def solve(episode: Episode, oracle: Oracle) -> Steps:
    """Yields the actions that solve an episode, each after the one before has been carried out.

    Raises Unsolvable where there is no way.
    """
    return solve_with(episode, MacroActions(oracle, may_tilt="look" in FAMILIES[episode.family].skills))


def solve_noisily(episode: Episode, oracle: Oracle, seed: int = 0) -> Steps:
    """Yields what a body that errs does to solve an episode, each after the one before has been carried out.

    It knows what to do and where that can be done, sees on its way no more than the frames show, and looks up and down
    whatever its family expects. The same episode and seed: the same errors. Raises Unsolvable where there is no way.
    """
    rng = np.random.default_rng([zlib.crc32(episode.id.encode()), seed])
    return solve_with(episode, NoisyMacroActions(oracle, rng))


def solve_with(episode: Episode, macro_actions: MacroActions) -> Steps:
    """Yields the actions that solve an episode with some macro actions. Raises Unsolvable where there is no way."""
    goal, oracle = episode.goal, macro_actions.oracle
    for link in goal.chain:
        yield from achieve(link, macro_actions)
    if goal.constraint is not None:
        yield from lift(goal.constraint, goal, macro_actions)
    yield from reach(goal, macro_actions)
    yield Report(status=closing_status(goal, oracle), summary="Done.")


def solution(episode: Episode, oracle: Oracle) -> tuple[Action, ...]:
    """Returns the whole solution from the stage's present state, which it leaves as it was. Raises Unsolvable."""
    actions: list[Action] = []
    with oracle.rehearsal():
        for action in solve(episode, oracle):
            actions.append(action)
            if not isinstance(action, Report):
                oracle.step(action)
            if len(actions) > episode.max_steps:
                raise Unsolvable(f"Episode {episode.id!r}: more than the {episode.max_steps} steps of its budget.")
    return tuple(actions)


PrivilegedScript = Callable[[Episode, Oracle], Steps]


def _premature(episode: Episode, oracle: Oracle) -> Steps:
    actions = solution(episode, oracle)[:-1]
    yield from actions[: len(actions) // 2]
    yield Report(status="success", summary="Done.")


def _acts_anyway(episode: Episode, oracle: Oracle) -> Steps:
    macro_actions = MacroActions(oracle, may_tilt="look" in FAMILIES[episode.family].skills)
    yield from do_anyway(episode.goal, macro_actions)
    yield Report(status=closing_status(episode.goal, oracle), summary="Done.")


def _never_report(episode: Episode, oracle: Oracle) -> Steps:
    last: InteractPixel | None = None
    for action in solve(episode, oracle):
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
    **{name: play_limited(limits) for name, limits in LIMITED.items()},
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
        self._actions = self._script(self._episode, Oracle(self._simulator))

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
