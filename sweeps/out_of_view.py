"""Sweep: what is out of view changes no pixel. Things of which a frame shows nothing are switched on or off in it.

    python -m sweeps.out_of_view                     160 packaged houses, 600 switches
    python -m sweeps.out_of_view --piece 3           one house again

The agent stands at a random place of a house and looks a random way. One thing that can be switched, of which no pixel
is seen there whether it is on or off, is switched; the two frames must be equal to the last byte. One case is counted
apart, because the thing is in the frame: a mirror shows it, i.e. every pixel that changes is of a mirror or next to one
that is (edges are blended), and one of them shows the thing.
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
PARTS_OF_A_PIXEL = np.stack(np.meshgrid((0.0, -0.45, 0.45), (0.0, -0.45, 0.45)), axis=-1).reshape(-1, 2)
"""Places (9, 2) in a pixel, as offsets from its centre: drawing blends what several of them show."""


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
        if not any(_is_seen(simulator, thing, is_toggled) for is_toggled in (not thing.is_toggled, thing.is_toggled)):
            return thing


def _is_seen(simulator: EmbeddedSimulator, thing: Thing, is_toggled: bool) -> bool:
    """Return whether a thing is in the frame while it is on or off."""
    simulator.apply_changes(Setup(objects={thing.id: ObjectSetup(is_toggled=is_toggled)}))
    return simulator.is_in_frame(thing.id)


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
    if _is_mirrored(simulator, thing, changed):
        result.counts["seen in a mirror"] += 1
        return
    is_plain = int((change > VISIBLE_LEVELS).sum()) > VISIBLE_PX
    result.counts["changed"] += 1
    result.counts["changed to be seen at a glance"] += is_plain
    detail = f"{where}: {len(changed)} pixels, by {change.max()} levels at most"
    result.failures.append(Failure(f"{thing.category} out of view changed pixels", detail, f"--piece {piece}"))


def _is_mirrored(simulator: EmbeddedSimulator, thing: Thing, pixels: np.ndarray) -> bool:
    """Return whether all pixels (n, 2) belong to mirrors or adjoin one that does, and one of them shows a thing."""
    agent = simulator.world(()).agent
    things = list(simulator.scene().things.values())
    met, _ = simulator.meets(agent.eye, directions(agent, pixels))
    own = pixels[[number >= 0 and things[number].category == "Mirror" for number in met]]
    if not len(own) or any(np.abs(own - pixel).max(axis=1).min() > 1 for pixel in pixels):
        return False
    rays = directions(agent, (own[:, None] + PARTS_OF_A_PIXEL).reshape(-1, 2))
    for ray, number, far_m in zip(rays, *simulator.meets(agent.eye, rays), strict=True):
        if number < 0 or things[number].category != "Mirror":
            continue
        x, z = heading(things[number].rotation.y)
        turned = ray - 2.0 * (ray @ (x, 0.0, z)) * np.array((x, 0.0, z))
        behind = Vec3(*(np.array(agent.eye) + far_m * ray + OFF_MIRROR_M * turned).tolist())
        shown, _ = simulator.meets(behind, turned[None], through_glass=True)
        if shown[0] >= 0 and things[shown[0]] is thing:
            return True
    return False


if __name__ == "__main__":
    sys.exit(main())
