"""Drawing in a worker: moments of episodes, each reached from the simulator's current state if possible."""

from vigil.agents.frame_encoding import encode_frame
from vigil.assets.database import AssetDatabase
from vigil.base.geometry import Pose
from vigil.protocol.actions import PhysicalAction
from vigil.protocol.house import House
from vigil.protocol.world import Effect, Setup
from vigil.runner.workers.messages import (
    DrawFrame,
    DrawingRequest,
    EpisodeMoment,
    IdentifyPixel,
    RenderSettings,
    TryAction,
    WalkResult,
)
from vigil.sim import make_simulator
from vigil.sim.protocol import Simulator


class DrawingHandler:
    """Handler of drawing requests; it has the simulator of the latest request."""

    def __init__(self) -> None:
        self._renderer: _MomentRenderer | None = None

    def answer(self, request: DrawingRequest) -> object:
        """Return the answer to `request`. Raises VigilError."""
        renderer = self._renderer_of(request.moment.render_settings)
        simulator = renderer.go_to(request.moment)
        match request:
            case DrawFrame():
                return encode_frame(simulator.frame()).data
            case TryAction(_, action):
                effect = Effect() if action is None else renderer.try_action(action)
                return WalkResult(simulator.world(()).agent, effect, encode_frame(simulator.frame()).data)
            case IdentifyPixel(_, x, y):
                return simulator.object_at(x, y)

    def close(self) -> None:
        """Release the simulator."""
        if self._renderer is not None:
            self._renderer.simulator.close()
            self._renderer = None

    def _renderer_of(self, settings: RenderSettings) -> "_MomentRenderer":
        if self._renderer is None or self._renderer.settings != settings:
            self.close()
            self._renderer = _MomentRenderer(settings)
        return self._renderer


class _MomentRenderer:
    """Simulator with the moment of an episode that it shows."""

    def __init__(self, settings: RenderSettings) -> None:
        self.settings = settings
        assets = AssetDatabase.from_file(settings.asset_database)
        self.simulator: Simulator = make_simulator(settings.backend, assets=assets, quality=settings.quality)
        self._loaded_house: str | None = None
        """Hash of the loaded house."""
        self._moment: EpisodeMoment | None = None

    def go_to(self, moment: EpisodeMoment) -> Simulator:
        """Return the simulator at that moment."""
        if self._loaded_house != moment.house_sha256:
            self._moment = self._loaded_house = None
            self.simulator.load(House.load(moment.house, moment.house_sha256))
            self._loaded_house = moment.house_sha256
        done = self._count_done(moment)
        if done is None:
            self._moment = None
            self.simulator.reset(moment.start, moment.setup)
            done = 0
        for action in moment.actions[done:]:
            self.simulator.step(action)
        self._moment = moment
        return self.simulator

    def try_action(self, action: PhysicalAction) -> Effect:
        """Carry out an action that is not part of a moment; the next request starts from a reset."""
        self._moment = None
        return self.simulator.step(action)

    def _count_done(self, moment: EpisodeMoment) -> int | None:
        """Return the number of the moment's actions that are already done; None when a reset is needed."""
        current = self._moment
        if current is None or _start_of(current) != _start_of(moment):
            return None
        done = len(current.actions)
        return done if moment.actions[:done] == current.actions else None


def _start_of(moment: EpisodeMoment) -> tuple[str, Pose, Setup]:
    return moment.house_sha256, moment.start, moment.setup
