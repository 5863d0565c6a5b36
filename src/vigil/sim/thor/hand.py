"""What a click does: the protocol's rules are asked before THOR is, and what THOR refuses is a refusal by the protocol.

Source: protocol.md section 2.2.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from vigil.base.geometry import Vec3, floor_distance
from vigil.protocol.actions import Intent
from vigil.scene.supports import around
from vigil.scene.things import Thing
from vigil.sim.core.click_target import kind_meant
from vigil.sim.core.handling import Result
from vigil.sim.core.handling_rules import gets_to, refusal_by_rule
from vigil.sim.core.placing import SPOT_WITHIN_M
from vigil.sim.core.sight import HEIGHT, WIDTH
from vigil.sim.thor.driver import Driver, Outcome
from vigil.sim.thor.refusals import is_out_of_sight, refusal_of

SPOT_SLACK_M = 0.02
MOVED_M = 1e-6
"""What moved less has not changed."""


@dataclass(frozen=True, slots=True)
class Click:
    """A click on an object: its pixel, and the point that the ray through that meets."""

    thing: Thing
    point: Vec3
    x: int
    y: int

    @property
    def place(self) -> dict[str, float]:
        """The pixel's middle as THOR writes it: 0..1 from the top left corner."""
        return place_of_pixel(self.x, self.y)


def place_of_pixel(x: int, y: int) -> dict[str, float]:
    """Returns the middle of a pixel as THOR writes it."""
    return {"x": (x + 0.5) / WIDTH, "y": (y + 0.5) / HEIGHT}


def interact(driver: Driver, intent: Intent, click: Click) -> Result:
    """Carries out one intent, or refuses it."""
    if intent == "ground":
        return Result()
    mirror = driver.mirror
    if not gets_to(mirror.agent.position, intent, mirror.box(click.thing), click.point):
        return Result("too_far")
    refusal = refusal_by_rule(mirror.scene, mirror.held, intent, click.thing, click.point)
    if refusal is not None:
        return Result(refusal)
    if intent == "place":
        return _place(driver, click)
    return _tried(driver, lambda: _on(driver, click, _ACTIONS[intent]))


def drop(driver: Driver) -> Result:
    """Lets go of what is held, or refuses."""
    if driver.mirror.held is None:
        return Result("hand_empty")
    return _tried(driver, lambda: driver.do("DropHandObject"))


def _place(driver: Driver, click: Click) -> Result:
    held = driver.mirror.scene.things[driver.mirror.held or ""]
    meant = kind_meant(click.thing, click.point)  # before THOR changes anything
    result = _tried(
        driver, lambda: driver.do("PutObject", **click.place, putNearXY=True, placeStationary=True, forceAction=False)
    )
    if result.refusal is not None or _is_as_meant(driver, held, click, meant):
        return result
    driver.do("PickupObject", objectId=held.id, forceAction=True)  # THOR put it elsewhere than it may be
    return Result("no_room")


def _is_as_meant(driver: Driver, held: Thing, click: Click, meant: str) -> bool:
    """Whether THOR put a thing near to the click, and inside or on top as was meant."""
    is_inside = any(each is click.thing for each in around(driver.mirror.scene, held))
    is_near = floor_distance(held.position, click.point) <= SPOT_WITHIN_M + SPOT_SLACK_M
    return is_near and held.parent == click.thing.id and is_inside == (meant == "inside")


def _on(driver: Driver, click: Click, action: str) -> Outcome:
    """Acts on the object that was clicked; by its pixel where THOR finds no point of it in view."""
    outcome = driver.do(action, objectId=click.thing.id)
    if outcome.is_done or not is_out_of_sight(outcome.message):
        return outcome
    under = driver.ask("GetObjectInFrame", **click.place, checkVisible=False)
    if under.returned != click.thing.id:
        return outcome
    return driver.do(action, **click.place)


def _tried(driver: Driver, act: Callable[[], Outcome]) -> Result:
    before = _facts(driver)
    outcome = act()
    if not outcome.is_done:
        refusal = refusal_of(outcome.message)
        return Result(refusal.code, refusal.blocked_by)
    driver.settle()
    after = _facts(driver)
    return Result(changed=tuple(sorted(name for name in after if _differs(before[name], after[name]))))


def _facts(driver: Driver) -> dict[str, tuple[Any, ...]]:
    things = driver.mirror.scene.things.values()
    return {
        thing.id: ((*thing.position, *thing.rotation, thing.openness), (thing.is_toggled, thing.is_held, thing.parent))
        for thing in things
    }


def _differs(before: tuple[Any, ...], after: tuple[Any, ...]) -> bool:
    (numbers, marks), (others, other_marks) = before, after
    return marks != other_marks or any(abs(a - b) > MOVED_M for a, b in zip(numbers, others, strict=True))


_ACTIONS: dict[Intent, str] = {
    "open_access": "OpenObject",
    "close_access": "CloseObject",
    "activate": "ToggleObjectOn",
    "deactivate": "ToggleObjectOff",
    "pick": "PickupObject",
}
"""THOR's actions on an object by its id or its pixel."""
