"""Messages between the main process and a simulator worker.

A worker either plays episodes or draws for the pages. An agent in the main process gets only an `EncodedObservation`:
the encoded frame and the feedback. Records, which have hidden state, go from the worker to the run folder without
passing the agent.
"""

from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from vigil.agents.agent import FRAME_INTERVAL_SECONDS, REPLY_SECONDS, Agent
from vigil.agents.frame_encoding import EncodedFrame
from vigil.assets.database import AssetDatabase
from vigil.base.geometry import Pose
from vigil.protocol.actions import PhysicalAction
from vigil.protocol.episode import Episode
from vigil.protocol.house import House
from vigil.protocol.observation import Cues, Feedback, Quality
from vigil.protocol.profile import Profile
from vigil.protocol.world import Effect, Setup
from vigil.records.record import ForkPoint, StepRecord
from vigil.sim.privileged import PrivilegedSimulator
from vigil.sim.protocol import Simulator

FIRST_FRAME = "first frame"
"""Event that a worker sends before its agent sees the first frame; the worker waits until the attempt is on disk."""
PrivilegedFactory = Callable[[str, Episode, PrivilegedSimulator], Agent]
"""Function that makes a privileged agent for one episode from (name, episode, simulator). It must be picklable."""
SimulatorFactory = Callable[[AssetDatabase, Quality], Simulator]
"""Function that makes a custom simulator, like those in `vigil.sim.BACKENDS`. It must be picklable."""


@dataclass(frozen=True, slots=True)
class WorkerPlan:
    """Settings that a worker gets once, when it starts to play episodes."""

    pack: Path | None
    """Folder of the pack; None when every assignment includes its house."""
    run_id: str
    profile: Profile
    backend: str = "mujoco"
    simulator_factory: SimulatorFactory | None = None
    """Function that makes a custom simulator; None for the backend's simulator."""
    quality: Quality = "default"
    asset_database: Path | None = None
    frames: Path | None = None
    """Folder for saved frames; None when frames are not saved."""
    agent: str = ""
    """Name of the agent that plays inside the worker; empty when the agent plays in the main process."""
    agent_factory: PrivilegedFactory | None = None
    reply_seconds: float = REPLY_SECONDS
    frame_interval_seconds: float = FRAME_INTERVAL_SECONDS
    hidden: tuple[Path, ...] | None = None
    """Folders that a program in a sandbox must not see; None for a program without a sandbox."""
    keep_program: bool = False
    """Whether one program plays all episodes of the worker, instead of being started for each episode."""
    seed: int = 0
    pack_sha256: str | None = None
    recorded_profile: Profile | None = None
    """Profile of the plays that episodes continue; None if every episode begins at its start."""


@dataclass(frozen=True, slots=True)
class Fork:
    """The play that an episode continues, up to the step from which the episode's own agent plays."""

    point: ForkPoint
    steps: tuple[StepRecord, ...]
    """Steps that are carried out again. The agent may see the replies of these steps, and their feedback if its profile
    has feedback."""


@dataclass(frozen=True, slots=True)
class Assignment:
    """One attempt at one episode, given to a worker."""

    episode: Episode
    epoch: int = 1
    attempt: int = 1
    fork: Fork | None = None
    """Play that the episode continues; None to begin at its start."""
    house: House | None = None
    """House of an episode that does not belong to a pack."""
    started: datetime | None = None
    """When the agent saw the first frame in a process that was lost; None if the episode has not begun before."""


@dataclass(frozen=True, slots=True)
class EncodedObservation:
    """Everything that an agent may see of a step."""

    picture: EncodedFrame
    feedback: Feedback | None
    cues: Cues | None = None
    past: tuple[EncodedFrame, ...] = ()
    """On the first step of an episode that continues a play: the frames of the play, if the profile keeps past frames.
    Otherwise empty."""


@dataclass(frozen=True, slots=True)
class SimulatorFacts:
    """Facts about a backend for the run header: the name and version of the simulator, and the renderer."""

    simulator: str
    renderer: str


@dataclass(frozen=True, slots=True)
class RenderSettings:
    """Backend, quality and assets for drawing."""

    backend: str = "mujoco"
    quality: Quality = "default"
    asset_database: Path | None = None


@dataclass(frozen=True, slots=True)
class EpisodeMoment:
    """A moment of an episode: its house, its start and setup, and the actions since the start."""

    render_settings: RenderSettings
    house: Path
    house_sha256: str
    start: Pose
    setup: Setup
    actions: tuple[PhysicalAction, ...] = ()

    @property
    def name(self) -> str:
        """A string that distinguishes the moment from every moment that looks different."""
        setup = "".join(f"{key}={value!r};" for key, value in sorted(self.setup.objects.items()))
        held = self.setup.held or ""
        return f"{self.render_settings!r}|{self.house_sha256}|{self.start!r}|{setup}|{held}|{self.actions!r}"


@dataclass(frozen=True, slots=True)
class WalkResult:
    """Pose of the agent, effect and frame after one action."""

    pose: Pose
    effect: Effect
    picture: bytes
