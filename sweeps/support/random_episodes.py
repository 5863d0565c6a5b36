"""Random episodes: those of the packaged packs, and ones made up in generated houses, of every family."""

import random
from collections.abc import Callable
from functools import lru_cache
from typing import Any

from vigil.base.geometry import Pose, Vec3, rotate_floor, yaw_towards
from vigil.errors import SettingError
from vigil.housegen.base.spec import spec_for
from vigil.housegen.generate import generate
from vigil.packs.pack import Pack
from vigil.protocol.episode import Episode, HouseRef
from vigil.protocol.families import FAMILIES, Family
from vigil.protocol.goals import Constraint
from vigil.protocol.house import House
from vigil.protocol.world import ObjectSetup, Setup
from vigil.scene.things import Thing
from vigil.sim.privileged import PrivilegedSimulator

PACKS = ("starter", "vigil_balanced_1000")
ROOMS = (1, 1, 2, 2, 3, 4)
TRIES = 200

EpisodeSampler = Callable[[random.Random, PrivilegedSimulator], Episode]
"""Return an episode in a house that the simulator has loaded."""


def draw_house(rng: random.Random) -> tuple[House, EpisodeSampler]:
    """Return a house and a way to draw episodes in it: packaged ones, or made up ones in a generated house."""
    if rng.random() < 0.6:
        pack = _pack(rng.choice(PACKS))
        house = pack.house_of(rng.choice(pack.episodes))
        there = [episode for episode in pack.episodes if episode.house.name == house.name]
        return house, lambda rng, _: rng.choice(there)
    house = random_house(rng)
    return house, lambda rng, simulator: random_episode(rng, simulator, house)


def random_house(rng: random.Random) -> House:
    """Return a generated house; seeds that do not give one are skipped."""
    while True:
        try:
            return generate(rng.randrange(10**6), spec_for(str(rng.choice(ROOMS))))
        except SettingError:
            continue


@lru_cache(maxsize=4)
def _pack(name: str) -> Pack:
    return Pack.load(name)


def random_episode(rng: random.Random, simulator: PrivilegedSimulator, house: House) -> Episode:
    """Return a random episode in a loaded house: any family, goal, setup and start; few can be solved."""
    start = free_start(rng, simulator, house)
    things = list(simulator.scene().things.values())
    family: Family = rng.choice(list(FAMILIES))
    goal = _goal(rng, family, things)
    return Episode.model_validate(
        {
            "id": f"{house.name}-{rng.randrange(10**9)}",
            "family": family,
            "house": HouseRef(name=house.name, sha256=house.sha256),
            "start": start,
            "setup": random_setup(rng, things),
            "instruction": "Do as you like.",
            "goal": goal,
            "bindings": {"target": goal["object_id"], "other": rng.choice(things).id},
            "max_steps": rng.choice([1, 5, 20, 40, 60]),
            "max_invalid": rng.choice([0, 3, 12, 60]),
        }
    )


def free_start(rng: random.Random, simulator: PrivilegedSimulator, house: House) -> Pose:
    """Return a pose near some thing, facing it, at which the body fits; otherwise one that the house proposes."""
    things = list(simulator.scene().things.values())
    for _ in range(TRIES):
        thing, bearing, away_m = rng.choice(things), rng.uniform(0.0, 360.0), rng.uniform(0.3, 2.0)
        x, z = rotate_floor(0.0, away_m, bearing)
        place = Vec3(thing.position.x + x, 0.0, thing.position.z + z)
        if simulator.can_stand(place):
            yaw = yaw_towards(place, thing.position) if rng.random() < 0.8 else bearing
            return Pose(position=place, rotation=yaw, horizon=rng.choice([0.0, 30.0, -30.0, 60.0]))
    assert house.start is not None
    return house.start


def random_setup(rng: random.Random, things: list[Thing]) -> Setup:
    """Return some open, some switched and some absent things, and sometimes something in the hand."""
    objects: dict[str, ObjectSetup] = {}
    for thing in things:
        if thing.is_openable and rng.random() < 0.2:
            objects[thing.id] = ObjectSetup(openness=rng.choice([0.0, 1.0, 0.05, 0.5, 0.8, rng.random()]))
        elif thing.is_toggleable and rng.random() < 0.2:
            objects[thing.id] = ObjectSetup(is_toggled=rng.random() < 0.5)
        elif not thing.is_structure and rng.random() < 0.01:
            objects[thing.id] = ObjectSetup(is_absent=True)
    small = [thing.id for thing in things if thing.is_pickupable and thing.id not in objects]
    return Setup(objects=objects, held=rng.choice(small) if small and rng.random() < 0.3 else None)


def _goal(rng: random.Random, family: Family, things: list[Thing]) -> dict[str, Any]:
    goal = _of_kind(rng, rng.choice(FAMILIES[family].goal_kinds), things)
    if family == "VS":
        goal = {"kind": "object_state", "object_id": goal["object_id"], "state": "is_visible"}
    if family == "CR":
        goal["constraint"] = _constraint(rng, rng.choice(things).id)
    if family == "SM":
        links = [_of_kind(rng, rng.choice(["object_held", "object_state"]), things) for _ in range(rng.randrange(1, 3))]
        goal["chain"] = links
    return goal


def _of_kind(rng: random.Random, kind: str, things: list[Thing]) -> dict[str, Any]:
    goal: dict[str, Any] = {"kind": kind, "object_id": _target(rng, kind, things).id}
    if kind == "object_state":
        goal |= {"state": rng.choice(["is_open", "is_toggled", "is_visible"])}
        goal |= {"value": goal["state"] == "is_visible" or rng.random() < 0.5}
    if kind == "report_status":
        goal |= {"state": rng.choice(["is_open", "is_toggled"])}
    if kind == "object_at_receptacle":
        goal |= {"receptacle_id": rng.choice([thing for thing in things if thing.is_receptacle] or things).id}
    return goal


def _target(rng: random.Random, kind: str, things: list[Thing]) -> Thing:
    fitting = {
        "object_held": [thing for thing in things if thing.is_pickupable],
        "object_at_receptacle": [thing for thing in things if thing.is_pickupable],
        "object_state": [thing for thing in things if thing.is_openable or thing.is_toggleable],
        "report_status": [thing for thing in things if thing.is_openable or thing.is_toggleable],
    }.get(kind, things)
    return rng.choice(fitting or things)


def _constraint(rng: random.Random, object_id: str) -> Constraint:
    kinds = ("object_open", "object_closed", "object_on", "object_off", "object_moved", "object_released")
    kind = rng.choice(kinds)
    distance_m = rng.choice([0.01, 0.5]) if kind == "object_moved" else None
    return Constraint(kind=kind, object_id=object_id, latched=rng.random() < 0.5, distance_m=distance_m)
