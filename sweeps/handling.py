"""Fuzzes the handling of things: random picking, placing, dropping, opening, closing and switching, with real clicks.

    python -m sweeps.handling                        1,000 pieces: a house each, 60 interactions in it
    python -m sweeps.handling --piece 3              one house again

The agent is stood before one thing after another, faces it and clicks on a pixel of it. After every interaction: what
was refused left all as it was, to the last bit; what was put down or moved is no deeper in other solids than it ever
was, beyond the simulator's own tolerance; it lies in one room, and on the floor or its surface; what lies on or in a
thing moved along with it and kept its place relative to it; what is shut in can neither be clicked on nor picked; a
thing picked and placed at the same point again and again comes to rest at the same place; and all interactions carried
out again in a simulator loaded afresh give the same world, to the last bit.
"""

import math
import random
import sys
import traceback
from collections import Counter
from dataclasses import dataclass, field
from functools import partial
from typing import cast

import numpy as np

from sweeps.simulators import loaded, parser, sweep
from sweeps.support import pieces
from sweeps.support.pieces import Failure, PieceResult
from sweeps.support.random_episodes import draw_house, random_setup
from sweeps.support.snapshots import SanityCheck, Snapshot, changed, difference, snapshot
from sweeps.support.solids import Solids
from vigil.base.geometry import Pose, Vec3, floor_distance, rotate_floor, yaw_towards
from vigil.errors import EpisodeError
from vigil.protocol.actions import Intent, InteractPixel
from vigil.protocol.house import House
from vigil.protocol.world import Effect, Setup
from vigil.scene.geometry import place_of
from vigil.scene.supports import ancestors, children, contents, is_inside_closed
from vigil.scene.things import Thing
from vigil.sim.core.embedded import EmbeddedSimulator

INTERACTIONS = 60
POSES_TRIED = 12
RELATIVE_M = 5e-9
"""Largest shift (m) of contents relative to their carrier that rounding may cause."""


def main() -> int:
    """Run the sweep."""
    options = parser(__doc__ or "", 1000).parse_args()
    work = partial(fuzz, options.seed, options.backend, INTERACTIONS)
    return pieces.run(sweep("handling", work, options), options)


@dataclass(frozen=True, slots=True)
class Interaction:
    """The agent's pose, and the pixel that it clicked on there."""

    pose: Pose
    action: InteractPixel


@dataclass(slots=True)
class InteractionLog:
    """The interactions in a house, and the state of the house after each."""

    house: House
    setup: Setup
    start: Pose
    interactions: list[Interaction] = field(default_factory=list)
    moments: list[Snapshot] = field(default_factory=list)


def fuzz(seed: int, backend: str, count: int, piece: int) -> PieceResult:
    """Return the result of a piece: `count` interactions in one house."""
    result = PieceResult()
    rng = random.Random(f"{seed}/{piece}")
    house, _ = draw_house(rng)
    again = f"--piece {piece}"
    try:
        interactions = RandomInteractions(rng, house, loaded(backend, house), result.counts)
        for kind, detail in interactions.run(count):
            result.failures.append(Failure(kind, f"{house.name}: {detail}", again))
        result.failures += [
            Failure(kind, detail, again) for kind, detail in replay_faults(interactions.log, loaded(backend, house))
        ]
    except Exception:  # noqa: BLE001 - any exception at all is what is looked for
        result.failures.append(Failure("an exception", traceback.format_exc(limit=-4), again))
    result.counts["houses"] += 1
    return result


class RandomInteractions:
    """A random series of interactions in one house."""

    def __init__(self, rng: random.Random, house: House, simulator: EmbeddedSimulator, counts: Counter[str]) -> None:
        self._rng, self._simulator, self._counts = rng, simulator, counts
        self._things = simulator.scene().things
        self.log = _begin_log(rng, house, simulator)
        self._solids, self._sanity = Solids(simulator), SanityCheck(simulator)
        self._solids.remember(self._things)
        self._faults: list[tuple[str, str]] = []

    def run(self, count: int) -> list[tuple[str, str]]:
        """Do a number of interactions. Return what did not hold."""
        for _ in range(count):
            thing = self._choose_thing()
            if self._stand_before(thing):
                self._interact(thing, self._intent(thing))
        return self._faults

    def _choose_thing(self) -> Thing:
        present = [thing for thing in self._things.values() if thing.is_present and not thing.is_held]
        if self._held() is not None and self._rng.random() < 0.8:
            present = [thing for thing in present if thing.is_receptacle] or present
        else:
            present = [t for t in present if t.is_pickupable or t.is_openable or t.is_toggleable] or present
        return self._rng.choice(present)

    def _held(self) -> Thing | None:
        held = self._simulator.world(()).held
        return None if held is None else self._things[held]

    def _intent(self, thing: Thing) -> Intent:
        options: list[str] = ["ground"]
        if thing.is_openable:
            options += ["open_access" if thing.openness < 0.5 else "close_access"] * 6
        if thing.is_toggleable:
            options += ["deactivate" if thing.is_toggled else "activate"] * 2
        if self._held() is not None:
            options += [*["place"] * (12 if thing.is_receptacle else 1), "drop"]
        elif thing.is_pickupable:
            options += ["pick"] * 8
        return cast(Intent, self._rng.choice(options))

    def _stand_before(self, thing: Thing) -> bool:
        """Stand the agent within reach of a thing, facing it. Return whether a pixel of it can be clicked on."""
        for _ in range(POSES_TRIED):
            bearing, away_m = self._rng.uniform(0.0, 360.0), self._rng.uniform(0.3, 1.6)
            x, z = rotate_floor(0.0, away_m + min(thing.asset.size.x, thing.asset.size.z) / 2, bearing)
            place = Vec3(thing.position.x + x, 0.0, thing.position.z + z)
            if not self._simulator.can_stand(place):
                continue
            down = math.degrees(math.atan2(1.576 - thing.position.y, max(floor_distance(place, thing.position), 0.1)))
            pose = Pose(
                position=place, rotation=yaw_towards(place, thing.position), horizon=max(-30.0, min(60.0, down))
            )
            _set_pose(self._simulator, pose)
            if len(self._simulator.pixels_of(thing.id)):
                return True
        self._counts["things that could not be clicked on"] += 1
        if is_inside_closed(self._simulator.scene(), thing):
            self._counts["shut in, and out of reach of clicks"] += 1
        return False

    def _interact(self, thing: Thing, intent: Intent) -> None:
        pixels = self._simulator.pixels_of(thing.id)
        if self._is_hidden(thing):
            self._faults.append(("what is shut in can be clicked on", f"{thing.id} in {thing.parent}"))
        x, y = pixels[self._rng.randrange(len(pixels))]
        self._click(thing, InteractPixel(intent=intent, x=int(x), y=int(y)))
        if intent == "place" and thing.is_receptacle and self._rng.random() < 0.3:
            self._place_again(thing, InteractPixel(intent="place", x=int(x), y=int(y)))

    def _is_hidden(self, thing: Thing) -> bool:
        """Return whether a thing is behind something fully closed; through a gap it may be seen."""
        scene = self._simulator.scene()
        return is_inside_closed(scene, thing) and all(each.openness == 0.0 for each in ancestors(scene, thing))

    def _click(self, thing: Thing, action: InteractPixel) -> Effect:
        """Carry out an interaction and check everything that must hold of it."""
        agent = self._simulator.world(()).agent
        before, places = snapshot(self._simulator), self._relative_places()
        effect = self._simulator.step(action)
        after = snapshot(self._simulator)
        what = f"interaction {len(self.log.interactions)}, {action.intent} {thing.id} at {agent.position}: {effect!r}"
        names = changed(before, after) - {"agent"}
        self.log.interactions.append(Interaction(agent, action))
        self.log.moments.append(after)
        self._counts["interactions"] += 1
        self._counts[f"{action.intent}: {effect.refusal or 'done'}"] += 1
        faults = self._sanity.faults(0.0, names) + self._shifted_contents(places)
        if effect.refusal is not None and before != after:
            faults.append(("what was refused changed something", difference(before, after)))
        if effect.refusal is None and set(effect.changed) != names:
            faults.append(("changed is not what is said", f"{sorted(set(effect.changed) ^ names)}"))
        faults += self._solid_faults(action.intent, names)
        self._faults += [(kind, f"{detail}; {what}") for kind, detail in faults]
        return effect

    def _solid_faults(self, intent: Intent, names: set[str]) -> list[tuple[str, str]]:
        if not names or intent not in ("place", "drop", "open_access", "close_access"):
            return []
        is_leaf = intent in ("open_access", "close_access")
        faults = self._solids.overlap_faults(names, is_leaf)
        if not is_leaf:
            top = [name for name in names if self._things[name].parent not in names]
            faults += self._solids.room_faults(names) + self._solids.float_faults(top)
        self._solids.remember(names)
        return faults

    def _relative_places(self) -> dict[str, tuple[str, np.ndarray]]:
        """Return, for everything that lies on or in something else, its carrier and its place on the carrier."""
        held = self._held()
        carriers = [thing for thing in self._things.values() if contents(self._simulator.scene(), thing.id)]
        found: dict[str, tuple[str, np.ndarray]] = {}
        for carrier in carriers:
            inverse = place_of(carrier).inverse()
            for child in children(self._simulator.scene(), carrier.id):
                if child.parent_joint is None or held is carrier:
                    found[child.id] = carrier.id, inverse(np.array(child.position)[None])[0]
        return found

    def _shifted_contents(self, before: dict[str, tuple[str, np.ndarray]]) -> list[tuple[str, str]]:
        """Return the things that are on the same thing as before, but at another place on it."""
        faults: list[tuple[str, str]] = []
        for name, (carrier, place) in self._relative_places().items():
            old_carrier, old = before.get(name, (carrier, place))
            if old_carrier == carrier and float(np.abs(old - place).max()) > RELATIVE_M:
                faults.append(("shifted on what carries it", f"{name} on {carrier}: {old} became {place}"))
        return faults

    def _place_again(self, receptacle: Thing, action: InteractPixel) -> None:
        """Pick up what was placed and places it at the same point, twice: the two places must be equal."""
        scene = self._simulator.scene()
        placed = [t for t in children(scene, receptacle.id) if self.log.interactions and t.is_pickupable]
        last = self.log.moments[-1]
        earlier = self.log.moments[-2] if len(self.log.moments) > 1 else last
        moved = [thing for thing in placed if last[thing.id] != earlier[thing.id]]
        if len(moved) != 1 or self._held() is not None:
            return
        found: list[str] = []
        for _ in range(2):
            pixels = self._simulator.pixels_of(moved[0].id)
            if not len(pixels):
                return
            x, y = pixels[len(pixels) // 2]
            if self._click(moved[0], InteractPixel(intent="pick", x=int(x), y=int(y))).refusal is not None:
                return
            if self._click(receptacle, action).refusal is not None:
                what = f"{moved[0].id} on {receptacle.id}, clicked at {action.x}, {action.y}"
                self._faults.append(("picked up, and finds no room where it was", what))
                return
            found.append(snapshot(self._simulator)[moved[0].id])
        self._counts["placed again"] += 1
        if found[0] != found[1]:
            self._faults.append(("placed again it lies elsewhere", f"{moved[0].id}: {found[0]} and {found[1]}"))


def _begin_log(rng: random.Random, house: House, simulator: EmbeddedSimulator) -> InteractionLog:
    """Return an episode that has begun, with a random setup where that leaves the house's start free."""
    assert house.start is not None
    setup = random_setup(rng, list(simulator.scene().things.values()))
    try:
        simulator.reset(house.start, setup)
    except EpisodeError:
        setup = Setup()
        simulator.reset(house.start, setup)
    return InteractionLog(house, setup, house.start)


def _set_pose(simulator: EmbeddedSimulator, pose: Pose) -> None:
    """Place the agent somewhere, with what it holds."""
    state = simulator._require_loaded().state
    state.agent = pose
    state.move_held()
    simulator._flush()


def replay_faults(log: InteractionLog, simulator: EmbeddedSimulator) -> list[tuple[str, str]]:
    """Return the differences when the same interactions are repeated in a freshly loaded simulator."""
    simulator.reset(log.start, log.setup)
    for number, (interaction, moment) in enumerate(zip(log.interactions, log.moments, strict=True)):
        _set_pose(simulator, interaction.pose)
        simulator.step(interaction.action)
        found = snapshot(simulator)
        if found != moment:
            return [("done again the world differs", f"after interaction {number}: {difference(moment, found)}")]
    return []


if __name__ == "__main__":
    sys.exit(main())
