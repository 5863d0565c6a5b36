"""Shared parts of the simulator sweeps: the choice of what casts the rays, and a simulator with its house."""

import argparse

from sweeps.support import pieces
from sweeps.support.pieces import Sweep, Work
from vigil.assets.database import AssetDatabase
from vigil.protocol.house import House
from vigil.sim import make_simulator
from vigil.sim.core.embedded import EmbeddedSimulator


def parser(doc: str, count: int) -> argparse.ArgumentParser:
    """Return a parser with the options of all sweeps and the backend."""
    made = pieces.parser(doc, count)
    made.add_argument("--backend", choices=("mujoco", "fake"), default="mujoco", help="what casts the rays")
    return made


def sweep(name: str, work: Work, options: argparse.Namespace) -> Sweep:
    """Return a sweep whose pieces depend on the seed and the backend."""
    return Sweep(name, {"seed": options.seed, "backend": options.backend}, work)


def embedded(backend: str) -> EmbeddedSimulator:
    """Return a simulator whose internals are accessible."""
    simulator = make_simulator(backend, assets=AssetDatabase.default())
    assert isinstance(simulator, EmbeddedSimulator), f"{backend!r} is no engine of the embedded simulator"
    return simulator


def loaded(backend: str, house: House) -> EmbeddedSimulator:
    """Return a new simulator with a house."""
    simulator = embedded(backend)
    simulator.load(house)
    return simulator
