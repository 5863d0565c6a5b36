"""A new back end: the embedded simulator with a noisy camera, checked like every back end.

    python examples/new_backend.py

Only what the agent sees changes. The noise is a function of the frame, so that the same actions give the same pixels.
"""

import argparse
from collections import Counter

import numpy as np

import vigil
from vigil.assets.database import AssetDatabase
from vigil.env import Env
from vigil.sim.conformance.checks import CHECKS
from vigil.sim.conformance.harness import Harness
from vigil.sim.core.embedded import EmbeddedSimulator
from vigil.sim.core.engine import Engine
from vigil.sim.engines.fake import FakeEngine
from vigil.sim.engines.mujoco.engine import MujocoEngine


class NoisyCamera(EmbeddedSimulator):
    """The embedded simulator with Gaussian noise in every frame."""

    def __init__(self, engine: Engine, spread: float = 12.0) -> None:
        super().__init__(engine, AssetDatabase.default())
        self.name = f"{self.name}, noise {spread:g}"
        self.spread = spread

    def frame(self) -> np.ndarray:
        """Return the current egocentric frame, (480, 640, 3) uint8."""
        clean = super().frame()
        noise = np.random.default_rng(int(clean.sum())).normal(0.0, self.spread, clean.shape)
        return np.clip(clean + noise, 0, 255).astype(np.uint8)


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--engine", choices=("mujoco", "fake"), default="mujoco")
    engine = FakeEngine() if options.parse_args().engine == "fake" else MujocoEngine("fast")
    simulator = NoisyCamera(engine)
    harness = Harness(simulator)
    held = Counter(check(harness) is None for check in CHECKS)  # a check that does not hold raises
    print(f"{simulator.name}: {held[True]} of {len(CHECKS)} checks hold")
    pack = vigil.load_pack("vigil_smoke")
    with Env(simulator, pack.house_of, vigil.Profile()) as env:
        observation = env.reset(pack.episodes[0])
        assert observation is not None
        print(f"{pack.episodes[0].instruction} First frame: {observation.rgb.shape}, mean {observation.rgb.mean():.0f}")


if __name__ == "__main__":
    main()
