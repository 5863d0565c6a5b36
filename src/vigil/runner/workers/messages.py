"""What crosses between the main process and a simulator worker.

A worker either plays episodes or draws for the pages; the plan that it is sent first says which. To an agent in the
main process only a `EncodedObservation` crosses: the encoded frame and the feedback. Records, which hold hidden state,
go from the worker straight to the run folder. A worker that plays draws for nobody else.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from vigil.agents.agent import FRAME_INTERVAL_SECONDS, REPLY_SECONDS, Agent
from vigil.agents.frame_encoding import EncodedFrame
from vigil.assets.database import AssetDatabase
from vigil.base.geometry import Pose
from vigil.protocol.actions import PhysicalAction, Reply
from vigil.protocol.episode import Episode
from vigil.protocol.house import House
from vigil.protocol.observation import Feedback, Quality
from vigil.protocol.profile import Profile
from vigil.protocol.world import Effect, Setup
from vigil.records.record import Boundary, EpisodeRecord
from vigil.sim.privileged import PrivilegedSimulator
from vigil.sim.protocol import Simulator

PrivilegedFactory = Callable[[str, Episode, PrivilegedSimulator], Agent]
"""Makes a privileged agent for one episode: (name, episode, simulator). Must be picklable."""
SimulatorFactory = Callable[[AssetDatabase, Quality], Simulator]
"""Makes a simulator of one's own, as those in `vigil.sim.BACKENDS`. Must be picklable."""


@dataclass(frozen=True, slots=True)
class WorkerPlan:
    """What a worker that plays episodes is told once, when it starts."""

    pack: Path | None
    """None where every assignment brings its house."""
    run_id: str
    profile: Profile
    backend: str = "mujoco"
    simulator_factory: SimulatorFactory | None = None
    """Makes the simulator in place of the backend of that name."""
    quality: Quality = "default"
    asset_database: Path | None = None
    frames: Path | None = None
    """Folder to keep frames in; None keeps none."""
    agent: str = ""
    """Name of the agent that plays inside the worker; empty when agents play outside."""
    agent_factory: PrivilegedFactory | None = None
    reply_seconds: float = REPLY_SECONDS
    """How long the agent may take for a reply when it is a program."""
    beat_seconds: float = FRAME_INTERVAL_SECONDS
    """And when it is handed the next frame."""
    keep_program: bool = False
    """Whether it goes on from one episode to the next, instead of being started for each."""
    seed: int = 0
    pack_sha256: str | None = None
    """Of the very pack that is played, wherever it lies."""


@dataclass(frozen=True, slots=True)
class DrawingPlan:
    """A worker that draws for the pages; each request names its simulator."""


Plan = WorkerPlan | DrawingPlan


@dataclass(frozen=True, slots=True)
class Assignment:
    """One attempt at one episode."""

    episode: Episode
    epoch: int = 1
    attempt: int = 1
    house: House | None = None
    """Of an episode that is in no pack."""


@dataclass(frozen=True, slots=True)
class EncodedObservation:
    """All that an agent may see of a step, as it crosses."""

    picture: EncodedFrame
    feedback: Feedback | None


@dataclass(frozen=True, slots=True)
class SimulatorFacts:
    """What a backend says about itself, for the run header."""

    simulator: str
    renderer: str


@dataclass(frozen=True, slots=True)
class RenderSettings:
    """Which backend draws, at which quality, with which assets."""

    backend: str = "mujoco"
    quality: Quality = "default"
    asset_database: Path | None = None


@dataclass(frozen=True, slots=True)
class EpisodeMoment:
    """A house at the start of an episode, and what has been done since."""

    render_settings: RenderSettings
    house: Path
    house_sha256: str
    start: Pose
    setup: Setup
    actions: tuple[PhysicalAction, ...] = ()

    @property
    def name(self) -> str:
        """A string that differs between moments that look different."""
        setup = "".join(f"{key}={value!r};" for key, value in sorted(self.setup.objects.items()))
        held = self.setup.held or ""
        return f"{self.render_settings!r}|{self.house_sha256}|{self.start!r}|{setup}|{held}|{self.actions!r}"


@dataclass(frozen=True, slots=True)
class WalkResult:
    """Where one action led, and what is seen from there."""

    pose: Pose
    effect: Effect
    picture: bytes


# --- requests: each is answered with one `Done` or `Failed` -----------------------------------------------------------


@dataclass(frozen=True, slots=True)
class GetSimulatorFacts:
    """-> SimulatorFacts."""

    drawn: Assignment | None = None
    """An episode whose first frame is drawn, to find out before anything is played whether the machine can draw."""


@dataclass(frozen=True, slots=True)
class PlayEpisode:
    """Play one episode with the agent in the worker -> EpisodeRecord."""

    assignment: Assignment
    earlier: tuple[Reply, ...] | None = None
    """The replies given before in a worker that was lost, to go on from; None to begin."""


@dataclass(frozen=True, slots=True)
class BeginEpisode:
    """Start a live episode -> EncodedObservation, or EpisodeRecord when the reset failed."""

    session: int
    assignment: Assignment


@dataclass(frozen=True, slots=True)
class AdvanceEpisode:
    """Carry out one reply -> EncodedObservation, or EpisodeRecord when that ended the episode."""

    session: int
    reply: Reply


@dataclass(frozen=True, slots=True)
class FailEpisode:
    """End a live episode as an error -> EpisodeRecord."""

    session: int
    boundary: Boundary
    message: str


@dataclass(frozen=True, slots=True)
class DropEpisode:
    """Forget a live episode -> None."""

    session: int


@dataclass(frozen=True, slots=True)
class Resimulate:
    """Carry out a record's actions again -> list of `resimulation.FactDifference`."""

    assignment: Assignment
    record: EpisodeRecord
    frames: bool
    exact: bool


@dataclass(frozen=True, slots=True)
class DrawFrame:
    """Draw what is seen at a moment -> the frame (bytes of a PNG)."""

    moment: EpisodeMoment


@dataclass(frozen=True, slots=True)
class TryAction:
    """Carry out one action, or none, at a moment -> WalkResult."""

    moment: EpisodeMoment
    action: PhysicalAction | None


@dataclass(frozen=True, slots=True)
class IdentifyPixel:
    """Tell what is under a pixel at a moment -> the object's id; None for structure and sky."""

    moment: EpisodeMoment
    x: int
    y: int


EpisodeRequest = (
    GetSimulatorFacts | PlayEpisode | BeginEpisode | AdvanceEpisode | FailEpisode | DropEpisode | Resimulate
)
DrawingRequest = DrawFrame | TryAction | IdentifyPixel
Request = EpisodeRequest | DrawingRequest


# --- answers ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Heartbeat:
    """The worker is alive and at work on the request."""

    reply: Reply | None = None
    """What the agent in the worker has just replied."""


@dataclass(frozen=True, slots=True)
class AboutToShowFrame:
    """The agent in the worker is about to be shown the first frame; the worker waits for `Proceed`."""


@dataclass(frozen=True, slots=True)
class Proceed:
    """That this is the beginning of an attempt is on disk."""


@dataclass(frozen=True, slots=True)
class Done:
    """The request's value."""

    value: object


@dataclass(frozen=True, slots=True)
class Failed:
    """The request raised."""

    error: Exception
