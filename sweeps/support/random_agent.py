"""An agent that knows the hidden world and does interesting nonsense: for fuzzing, never for evaluation."""

import json
import math
import random
from typing import Any, cast

from sweeps.support.reply_forms import any_form
from vigil.assets.catalog import CATALOG
from vigil.base.geometry import Vec3, floor_distance, turn_between, yaw_towards
from vigil.protocol.actions import INTENTS, REACH_M, STATUSES, Intent
from vigil.scene.geometry import body_box
from vigil.scene.things import Thing
from vigil.sim.core.sight import HEIGHT, WIDTH, pixel_of
from vigil.sim.privileged import PrivilegedSimulator

EDGE_MAGNITUDES = (
    5e-324, 1e-300, 1e-12, 1e-9, 2e-9, 1e-6, 0.001, 0.2499999, 0.25, 0.999999999, 1.0, 1.000000001, 1.5, 3, 39.999999,
    40, 40.000001, 41, 89.999999, 90, 180, 359.9999999999, 360, 360.0000001, 720, 1e6, 1e16, 1e308, 10**299,
)  # fmt: skip
NEAR_M = 2.5
REFOCUS = 0.15


class RandomAgent:
    """Turns to things, walks up to them, clicks on them as fits their kind; now and then it talks nonsense."""

    def __init__(self, rng: random.Random, simulator: PrivilegedSimulator, bound: list[str], nonsense: float) -> None:
        """Create an agent.

        `bound` are the things that it acts on most; `nonsense` is the share of replies of any kind at all.
        """
        self._rng = rng
        self._simulator = simulator
        self._bound = bound
        self._nonsense = nonsense
        self._focus: Thing | None = None

    def reply(self) -> str | bytes:
        """Return the next reply."""
        rng = self._rng
        if rng.random() < self._nonsense:
            return any_form(rng).text
        if self._focus is None or not self._focus.is_present or rng.random() < REFOCUS:
            self._focus = self._interesting()
        kinds = (self._click, self._face, self._walk, self._tilt, self._wander, self._click_anywhere, self._report)
        weights = (60, 4, 4, 8, 6, 6, 1) if self._is_in_reach(self._focus) else (8, 34, 34, 8, 8, 6, 1)
        return rng.choices(kinds, weights)[0](self._focus)

    def _is_in_reach(self, thing: Thing) -> bool:
        return body_box(thing).floor_distance(self._simulator.world(()).agent.position) < REACH_M

    def _interesting(self) -> Thing:
        things, rng = self._simulator.scene().things, self._rng
        here = self._simulator.world(()).agent.position
        near = [
            thing for thing in things.values() if thing.is_present and floor_distance(thing.position, here) < NEAR_M
        ]
        active = [thing for thing in near if thing.is_openable or thing.is_pickupable or thing.is_toggleable]
        if self._is_holding():
            active += [thing for thing in near if thing.is_receptacle] * 3
        if rng.random() < 0.2 or not active:
            return things[rng.choice(self._bound)]
        return rng.choice(active)

    def _is_holding(self) -> bool:
        return self._simulator.world(()).held is not None

    def _click(self, thing: Thing) -> str:
        pixel = self._pixel_on(thing)
        if pixel is None:
            return self._rng.choice([self._face, self._tilt])(thing)
        return _interact(self._intent(thing), *pixel)

    def _intent(self, thing: Thing) -> Intent:
        fitting: list[str] = ["ground"]
        if thing.is_openable:
            fitting += ["open_access" if thing.openness < 0.5 else "close_access"] * 4 + ["open_access", "close_access"]
        if thing.is_toggleable:
            fitting += ["deactivate" if thing.is_toggled else "activate"] * 2 + ["activate", "deactivate"]
        if self._is_holding():
            fitting += ["place", "place", "drop"]
        elif thing.is_pickupable or CATALOG[thing.category].is_pickupable:
            fitting += ["pick"] * 3
        return cast(Intent, self._rng.choice(fitting))

    def _pixel_on(self, thing: Thing) -> tuple[int, int] | None:
        if self._rng.random() < 0.7:
            pixels = self._simulator.pixels_of(thing.id)
            if not len(pixels):
                return None
            x, y = pixels[self._rng.randrange(len(pixels))]
            return int(x), int(y)
        half = [size / 2 for size in thing.asset.size]
        point = Vec3(
            *(value + self._rng.uniform(-size, size) for value, size in zip(thing.position, half, strict=True))
        )
        return pixel_of(self._simulator.world(()).agent, point)

    def _face(self, thing: Thing) -> str:
        agent = self._simulator.world(()).agent
        turn = turn_between(agent.rotation, yaw_towards(agent.position, thing.position)) + self._rng.gauss(0.0, 5.0)
        return _navigate("turn_right" if turn > 0 else "turn_left", abs(turn) or 1.0)

    def _walk(self, thing: Thing) -> str:
        here = self._simulator.world(()).agent.position
        steps = floor_distance(here, thing.position) / 0.25 - self._rng.uniform(0.0, 5.0)
        return _navigate(self._rng.choice(["forward", "forward", "forward", "backward"]), max(steps, 0.3))

    def _tilt(self, thing: Thing) -> str:
        agent = self._simulator.world(()).agent
        away = max(floor_distance(agent.position, thing.position), 0.1)
        wanted = math.degrees(math.atan2(agent.eye.y - thing.position.y, away)) - agent.horizon
        return _look("down" if wanted > 0 else "up", abs(wanted) or 1.0)

    def _wander(self, _: Thing) -> str:
        magnitude = self._rng.choice(EDGE_MAGNITUDES)
        if self._rng.random() < 0.3:
            return _look(self._rng.choice(["up", "down"]), magnitude)
        return _navigate(self._rng.choice(["forward", "backward", "turn_left", "turn_right"]), magnitude)

    def _click_anywhere(self, _: Thing) -> str:
        x = self._rng.choice([0, WIDTH - 1, self._rng.randrange(WIDTH)])
        y = self._rng.choice([0, HEIGHT - 1, self._rng.randrange(HEIGHT)])
        return _interact(self._rng.choice(list(INTENTS)), x, y)

    def _report(self, _: Thing) -> str:
        status = self._rng.choice([*STATUSES, "done"])
        return _reply("report", status=status, summary="")


def _navigate(mode: str, magnitude: float) -> str:
    return _reply("navigate", mode=mode, magnitude=magnitude)


def _look(direction: str, magnitude: float) -> str:
    return _reply("look", direction=direction, magnitude=magnitude)


def _interact(intent: str, x: int, y: int) -> str:
    return _reply("interact_pixel", intent=intent, x=x, y=y)


def _reply(skill: str, **arguments: Any) -> str:
    return json.dumps({"skill_name": skill, "arguments": arguments})
