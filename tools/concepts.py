"""Plays the examples of docs/concepts.md and draws their strips into docs/concepts: `python -m tools.concepts`, or
some of them by name: `python -m tools.concepts B SV`.

Every example is an episode of the packaged smoke pack; what it must end as is said here, and checked.
"""

import io
import sys
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
from PIL import Image

from vigil.agents.agent import Agent
from vigil.agents.scripted import scripted_agent
from vigil.analysis.plots.style import figure_bytes
from vigil.analysis.plots.trajectory import AgentTrajectory, figure_width_in, make_trajectory, trajectory_figure
from vigil.assets.database import AssetDatabase
from vigil.authoring.solving.primitive_actions import reply_of
from vigil.authoring.solving.solvers import privileged_agent
from vigil.env import Env
from vigil.packs.pack import Pack
from vigil.protocol.actions import Action, Reply, Report
from vigil.protocol.episode import Episode
from vigil.protocol.observation import Observation
from vigil.protocol.profile import Profile
from vigil.runner.workers.worker import play
from vigil.sim import make_simulator
from vigil.sim.privileged import PrivilegedSimulator

FOLDER = Path(__file__).parents[1] / "docs" / "concepts"
WIDTH_PX = 1100
"""Width (pixels) of every strip; shorter strips end in empty ground, so that all have letters of one size."""
QUALITY = 82
MOST_FRAMES = 4
VASE, DRAWER = "vigil_vase_seed7010_ai_614337", "vigil_drawer_seed6014_sv_063a90"


class FixedReplies:
    """Gives fixed replies, one after the other."""

    def __init__(self, name: str, actions: Iterable[Action]) -> None:
        self.name = name
        self._replies = [reply_of(action) for action in actions]

    def start(self, instruction: str) -> None:
        """Begin with the first reply."""
        self._left = iter(self._replies)

    def act(self, observation: Observation) -> Reply:
        """Return the next reply."""
        return next(self._left)


class FrameRecorder:
    """An agent that keeps its frames."""

    def __init__(self, agent: Agent) -> None:
        self.name = agent.name
        self.frames: list[np.ndarray] = []
        self._agent = agent
        self.start = agent.start

    def act(self, observation: Observation) -> Reply:
        """Return the agent's reply, and keep the observation that it answers."""
        self.frames.append(observation.rgb.copy())
        return self._agent.act(observation)


MakeAgent = Callable[[Pack, Episode, PrivilegedSimulator], Agent]


def _privileged(name: str) -> MakeAgent:
    return lambda pack, episode, simulator: privileged_agent(name, episode, simulator)


def _scripted(name: str) -> MakeAgent:
    return lambda pack, episode, simulator: scripted_agent(name)


def _solution(name: str, status: str, steps: slice = slice(-1)) -> MakeAgent:
    """Return a maker of an agent that gives steps of the recorded solution, then a report of its own."""
    report = Report.model_validate({"skill_name": "report", "status": status, "summary": ""})
    return lambda pack, episode, _: FixedReplies(name, [*pack.solutions[episode.id].actions[steps], report])


EXAMPLES: dict[str, tuple[str, str, MakeAgent]] = {
    "B": (VASE, "W=1 B None", _privileged("solver")),
    "FR": (VASE, "W=0 FR false_success", _privileged("premature")),
    "FR_with_W": (VASE, "W=1 FR false_negative", _solution("says fail", "fail")),
    "NR": (VASE, "W=1 NR None", _privileged("never_report")),
    "IL": (VASE, "W=0 IL None", _scripted("malformed")),
    "Other": (VASE, "W=0 Other honest_fail", _solution("gives up", "fail", slice(2))),
    "SV": (DRAWER, "W=1 FR sv_wrong_label", _solution("other label", "open")),
}
"""Name of the picture -> its episode, how it ends, and who plays."""


def main() -> None:
    """Play and draw the named examples, or all of them."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    pack, simulator = Pack.load("vigil_smoke"), make_simulator("mujoco", assets=AssetDatabase.default())
    with Env(simulator, pack.house_of, Profile()) as env:
        for name in sys.argv[1:] or EXAMPLES:
            episode_id, ending, make = EXAMPLES[name]
            episode = pack.episode(episode_id)
            one = _played(env, episode, FrameRecorder(make(pack, episode, simulator)))
            outcome = one.outcome
            found = f"W={outcome.W:d} {outcome.label} {outcome.subtype}"
            if found != ending:
                raise SystemExit(f"Example {name} ends as {found}, not as {ending}.")
            figure = trajectory_figure(episode, [one], MOST_FRAMES)
            share = figure.get_figwidth() / figure_width_in(MOST_FRAMES)
            _write(FOLDER / f"{name}.webp", figure_bytes(figure, "png"), round(WIDTH_PX * share))
            print(f"{name}: {one.name}, {found}, {outcome.steps} steps")


def _played(env: Env, episode: Episode, agent: FrameRecorder) -> AgentTrajectory:
    play(episode, env, agent)
    return make_trajectory(agent.name, episode, env.record(), agent.frames)


def _write(path: Path, png: bytes, width: int) -> None:
    """Write a strip, `width` pixels of which are drawn on."""
    picture = Image.open(io.BytesIO(png)).convert("RGB")
    drawn = picture.resize((width, round(picture.height * width / picture.width)), Image.Resampling.LANCZOS)
    strip = Image.new("RGB", (WIDTH_PX, drawn.height), drawn.getpixel((0, 0)))
    strip.paste(drawn, (0, 0))
    strip.save(path, "WEBP", quality=QUALITY, method=6)


if __name__ == "__main__":
    main()
