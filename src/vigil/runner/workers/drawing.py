"""Drawing in a worker: views at moments of episodes. If possible, the simulator continues from its current moment."""

from dataclasses import replace

from vigil.agents.frame_encoding import encode_frame
from vigil.assets.database import AssetDatabase
from vigil.protocol.actions import PhysicalAction
from vigil.protocol.house import House
from vigil.protocol.world import Effect
from vigil.runner.workers.messages import EpisodeMoment, RenderSettings, WalkResult
from vigil.sim import make_simulator
from vigil.sim.protocol import Simulator


class MomentRenderer:
    """Simulator for drawing, with the moment of an episode that it currently shows."""

    def __init__(self) -> None:
        self._simulator: Simulator | None = None
        self._settings: RenderSettings | None = None
        """Settings with which the simulator was made."""
        self._loaded_house: str | None = None
        """Hash of the house that is loaded; None if no house is loaded."""
        self._moment: EpisodeMoment | None = None

    def draw(self, moment: EpisodeMoment) -> bytes:
        """Return the view at a moment, as the bytes of a PNG. Like the other methods, it raises VigilError."""
        return encode_frame(self._go_to(moment).frame()).data

    def walk(self, moment: EpisodeMoment, action: PhysicalAction | None) -> WalkResult:
        """Return the result of `action` at a moment (None: no action). The next request then begins with a reset."""
        simulator = self._go_to(moment)
        effect = Effect()
        if action is not None:
            self._moment = None
            effect = simulator.step(action)
        return WalkResult(simulator.world(()).agent, effect, encode_frame(simulator.frame()).data)

    def name_at(self, moment: EpisodeMoment, x: int, y: int) -> str | None:
        """Return the id of the object at a pixel of the view at a moment; None for structure and sky."""
        return self._go_to(moment).object_at(x, y)

    def close(self) -> None:
        """Release the simulator."""
        if self._simulator is not None:
            self._simulator.close()
        self._simulator = self._moment = self._loaded_house = None

    def _go_to(self, moment: EpisodeMoment) -> Simulator:
        """Bring the simulator to a moment and return it."""
        settings, simulator = moment.render_settings, self._simulator
        if simulator is None or self._settings != settings:
            self.close()
            assets = AssetDatabase.from_file(settings.asset_database)
            simulator = make_simulator(settings.backend, assets=assets, quality=settings.quality)
            self._simulator, self._settings = simulator, settings
        if self._loaded_house != moment.house_sha256:
            self._moment = self._loaded_house = None
            simulator.load(House.load(moment.house, moment.house_sha256))
            self._loaded_house = moment.house_sha256
        done = self._count_done(moment)
        if done is None:
            self._moment = None
            simulator.reset(moment.start, moment.setup)
            done = 0
        for action in moment.actions[done:]:
            simulator.step(action)
        self._moment = moment
        return simulator

    def _count_done(self, moment: EpisodeMoment) -> int | None:
        """Return how many of the moment's actions the simulator has carried out; None when a reset is needed."""
        current = self._moment
        if current is None or replace(current, actions=()) != replace(moment, actions=()):
            return None
        done = len(current.actions)
        return done if moment.actions[:done] == current.actions else None
