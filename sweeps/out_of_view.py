"""Sweep: what is out of view changes no pixel. Things of which a frame shows nothing are switched on or off in it.

    python -m sweeps.out_of_view                     160 packaged houses, 600 switches
    python -m sweeps.out_of_view --piece 3           one house again

The agent stands at a random place of a house and looks a random way. One thing that can be switched, of which no pixel
is seen there whether it is on or off, is switched; the two frames must be equal to the last byte. Two cases are counted
apart, because the thing is in the frame. A mirror shows it: every pixel that changes is of a mirror, and one of them
shows the thing. Or a sliver of it is in the frame, too thin for the count of its pixels, which samples: every pixel
that changes is the thing's, or next to one that is.
"""

import random
import sys
from functools import partial

import numpy as np

from sweeps.simulators import loaded
from sweeps.support import pieces
from sweeps.support.pieces import Failure, PieceResult, Sweep
from vigil.base.geometry import Pose, Vec3, heading
from vigil.packs.pack import PACKAGED
from vigil.protocol.house import House
from vigil.protocol.world import ObjectSetup, Setup
from vigil.scene.things import Thing
from vigil.sim.core.embedded import EmbeddedSimulator
from vigil.sim.core.sight import directions

HOUSES, SWITCHES = 160, 600
GRID_M = 0.25
TURN_DEG = 15
HORIZONS = (0.0, 30.0)
VISIBLE_LEVELS, VISIBLE_PX = 8, 200
"""Numbers of levels and pixels above which a change is visible at a glance."""
OFF_MIRROR_M = 0.001


def main() -> int:
    """Run the sweep."""
    options = pieces.parser(__doc__ or "", HOUSES).parse_args()
    work = partial(switched, options.seed)
    return pieces.run(Sweep("out_of_view", {"seed": options.seed}, work), options)


def switched(seed: int, piece: int) -> PieceResult:
    """Return the result of a piece: some switches in one house, `SWITCHES` in `HOUSES` of them."""
    files = sorted(PACKAGED.glob("*/houses/*.json"))
    rng = random.Random(f"{seed}/{piece}")
    house = House.load(files[piece * len(files) // HOUSES % len(files)])
    simulator, result = loaded("mujoco", house), PieceResult()
    assert house.start is not None
    simulator.reset(house.start, Setup())
    places = simulator.reachable(house.start.position, GRID_M)
    things = [thing for thing in simulator.scene().things.values() if thing.is_toggleable and thing.is_present]
    for _ in range((piece + 1) * SWITCHES // HOUSES - piece * SWITCHES // HOUSES):
        thing = _out_of_view(rng, simulator, places, things)
        _compare(simulator, thing, result, piece)
    result.counts["houses"] += 1
    simulator.close()
    return result


def _out_of_view(rng: random.Random, simulator: EmbeddedSimulator, places: np.ndarray, things: list[Thing]) -> Thing:
    """Place the agent where some thing is out of view, on or off. Return the thing."""
    while True:
        x, z = places[rng.randrange(len(places))].tolist()
        simulator.stand(
            Pose(position=Vec3(x, 0.0, z), rotation=rng.randrange(0, 360, TURN_DEG), horizon=rng.choice(HORIZONS))
        )
        thing = rng.choice(things)
        if not any(_pixels(simulator, thing, is_toggled) for is_toggled in (not thing.is_toggled, thing.is_toggled)):
            return thing


def _pixels(simulator: EmbeddedSimulator, thing: Thing, is_toggled: bool) -> int:
    """Return how many pixels of a thing are visible while it is on or off."""
    simulator.apply_changes(Setup(objects={thing.id: ObjectSetup(is_toggled=is_toggled)}))
    return simulator.world([thing.id]).objects[thing.id].visible_px


def _compare(simulator: EmbeddedSimulator, thing: Thing, result: PieceResult, piece: int) -> None:
    """Switch a thing and compare the frames."""
    where = f"{thing.id} from {simulator.world(()).agent}"
    before = simulator.frame().astype(int)
    simulator.apply_changes(Setup(objects={thing.id: ObjectSetup(is_toggled=not thing.is_toggled)}))
    change = np.abs(simulator.frame() - before).max(axis=2)
    result.counts["switches"] += 1
    if not change.any():
        return
    changed = np.argwhere(change)[:, ::-1]
    for name, is_in_frame in (("seen in a mirror", _is_mirrored), ("seen as a sliver", _is_sliver)):
        if is_in_frame(simulator, thing, changed):
            result.counts[name] += 1
            return
    is_plain = int((change > VISIBLE_LEVELS).sum()) > VISIBLE_PX
    result.counts["changed"] += 1
    result.counts["changed to be seen at a glance"] += is_plain
    detail = f"{where}: {len(changed)} pixels, by {change.max()} levels at most"
    result.failures.append(Failure(f"{thing.category} out of view changed pixels", detail, f"--piece {piece}"))


def _is_sliver(simulator: EmbeddedSimulator, thing: Thing, pixels: np.ndarray) -> bool:
    """Return whether all pixels (n, 2) belong to a thing or adjoin a pixel that does."""
    agent, things = simulator.world(()).agent, list(simulator.scene().things.values())
    met, _ = simulator.meets(agent.eye, directions(agent, pixels))
    own = pixels[[number >= 0 and things[number] is thing for number in met]]
    return bool(len(own)) and all(np.abs(own - pixel).max(axis=1).min() <= 1 for pixel in pixels)


def _is_mirrored(simulator: EmbeddedSimulator, thing: Thing, pixels: np.ndarray) -> bool:
    """Return whether all pixels (n, 2) belong to mirrors, and one of them shows a thing."""
    agent = simulator.world(()).agent
    rays, things = directions(agent, pixels), list(simulator.scene().things.values())
    met, away_m = simulator.meets(agent.eye, rays)
    if any(number < 0 or things[number].category != "Mirror" for number in met):
        return False
    for ray, number, far_m in zip(rays, met, away_m, strict=True):
        x, z = heading(things[number].rotation.y)
        turned = ray - 2.0 * (ray @ (x, 0.0, z)) * np.array((x, 0.0, z))
        behind = Vec3(*(np.array(agent.eye) + far_m * ray + OFF_MIRROR_M * turned).tolist())
        shown, _ = simulator.meets(behind, turned[None], through_glass=True)
        if shown[0] >= 0 and things[shown[0]] is thing:
            return True
    return False


if __name__ == "__main__":
    sys.exit(main())
