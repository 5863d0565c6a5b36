"""A new category of object, made in code: a desk globe, which can be picked up.

    python examples/new_asset.py --out globe.png

The script registers the category with its maker, finds a generated house that has a globe, drafts an episode about
it, and plays the episode with the solver. `--out` draws the globe.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image

import vigil
from vigil.assets.catalog import Category
from vigil.assets.database import AssetDatabase
from vigil.assets.kernel import shapes
from vigil.assets.kernel.asset import Asset
from vigil.assets.kernel.builder import Builder
from vigil.assets.kernel.palette import colour
from vigil.assets.making import make, register
from vigil.authoring.drafting.house_context import HouseContext
from vigil.authoring.families.ai.drafts import acting
from vigil.authoring.solving.solvers import privileged_agent
from vigil.base.geometry import Vec3
from vigil.env import Env
from vigil.scene.fidelity import mismatches_of
from vigil.sim import make_simulator
from vigil.sim.pictures.renders import render_asset

GLOBE = Category(
    name="DeskGlobe",
    display_name="globe",
    typical_size=Vec3(0.26, 0.31, 0.24),
    size_spread=0.1,
    rooms=("LivingRoom", "Bedroom"),
    rests_on=("Desk", "DiningTable", "ShelvingUnit", "Dresser", "SideTable"),
    is_pickupable=True,
)


def globe(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a globe in a half ring on a foot; `build` stretches it to fill the box that a house asks for."""
    builder = Builder("DeskGlobe", size)
    name, sea = colour(rng, "blue", "teal", "green")
    foot = [(0.0, 0.0), (0.3, 0.0), (0.3, 0.03), (0.06, 0.07), (0.04, 0.16), (0.0, 0.16)]
    builder.add("wood/walnut", shapes.lathe(foot, segments=20))
    angles = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 13)
    ring = np.c_[0.46 * np.cos(angles), 0.6 + 0.44 * np.sin(angles), np.zeros(13)]
    builder.add("metal/gold", shapes.tube(ring, 0.025, 8))
    builder.add(f"plastic/{sea}", shapes.ellipsoid((0.8, 0.8, 0.8), (0.0, 0.6, 0.0), 20, 12))
    return builder.build([name])


register(GLOBE, globe)


def house_with_a_globe() -> vigil.House:
    """Return the first generated house that has a globe; the generator uses the catalogue."""
    houses = (vigil.generate_house(seed, "bedroom") for seed in range(40))
    return next(house for house in houses if "DeskGlobe|" in str(house.data["objects"]))


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--out", type=Path, help="picture of the globe, as PNG")
    given = options.parse_args()
    house, assets = house_with_a_globe(), AssetDatabase.default()
    simulator = make_simulator("fake", assets=assets)  # only rays: the solver does not need pictures
    context = HouseContext(simulator, house, np.random.default_rng(0))
    print(f"{house.name}: {len(mismatches_of(simulator.scene(), house, assets))} things are not as the house asks")
    episode = next(draft for draft in acting(context, "pick") if "globe" in draft.instruction)
    with Env(simulator, lambda episode: house, vigil.Profile()) as env:
        outcome = vigil.score(episode, vigil.play(episode, env, privileged_agent("solver", episode, simulator)))
    print(f"{episode.instruction} {outcome.label} after {outcome.steps} steps")
    if given.out is not None:
        Image.fromarray(render_asset(make("DeskGlobe", GLOBE.typical_size, 1))).save(given.out)


if __name__ == "__main__":
    main()
