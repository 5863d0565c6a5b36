"""Harness of the conformance checks: a simulator in the reference house, with short calls to face and click objects."""

from collections.abc import Callable

import numpy as np

from vigil.base.geometry import Pose, Vec3, floor_distance, yaw_towards
from vigil.protocol.actions import HORIZON_DOWN_DEG, HORIZON_UP_DEG, Intent, InteractPixel, Look, Navigate, NavigateMode
from vigil.protocol.world import Effect, ObjectSetup, ObjectState, Placement, Setup
from vigil.sim.conformance.reference_house import reference_house
from vigil.sim.core.sight import pixel_of
from vigil.sim.privileged import PrivilegedSimulator

NOTHING = Setup()
"""The setup that changes nothing."""


class Harness:
    """A backend with the reference house loaded."""

    def __init__(self, simulator: PrivilegedSimulator) -> None:
        self.simulator = simulator
        self.house = reference_house()
        simulator.load(self.house)

    def stand(self, x: float, z: float, yaw: float = 0.0, horizon: float = 0.0, setup: Setup = NOTHING) -> None:
        """Reset with the agent at (x, z) in metres, with yaw and horizon in degrees."""
        pose = Pose(position=Vec3(x, 0.0, z), rotation=yaw, horizon=horizon)
        self.simulator.reset(pose, setup)

    def face(self, x: float, z: float, object_id: str, setup: Setup = NOTHING) -> None:
        """Reset with the agent at (x, z), looking at the middle of an object."""
        self.stand(x, z, setup=setup)
        self.look_at(x, z, self.state(object_id).position, setup)

    def look_at(self, x: float, z: float, point: Vec3, setup: Setup = NOTHING) -> None:
        """Reset with the agent at (x, z), looking at a point."""
        eye = Pose(position=Vec3(x, 0.0, z), rotation=0.0).eye
        down = float(np.degrees(np.arctan2(eye.y - point.y, max(floor_distance(eye, point), 1e-6))))
        self.stand(x, z, yaw_towards(eye, point), min(HORIZON_DOWN_DEG, max(HORIZON_UP_DEG, down)), setup)

    def go(self, mode: NavigateMode, magnitude: float) -> Effect:
        """Walk `magnitude` steps, or turn by `magnitude` degrees; return the effect."""
        return self.simulator.step(Navigate(mode=mode, magnitude=magnitude))

    def pitch(self, degrees: float) -> Effect:
        """Look down by `degrees`, or up if they are negative; return the effect."""
        return self.simulator.step(Look(direction="down" if degrees > 0 else "up", magnitude=abs(degrees)))

    def click(self, intent: Intent, object_id: str) -> Effect:
        """Click on that pixel of the object that is nearest to the mean of the object's pixels; return the effect."""
        pixels = self.simulator.pixels_of(object_id)
        expect(len(pixels) > 0, f"{object_id} has no clickable pixel to {intent}")
        x, y = pixels[np.argmin(((pixels - pixels.mean(axis=0)) ** 2).sum(axis=1))]
        return self.simulator.step(InteractPixel(intent=intent, x=int(x), y=int(y)))

    def click_at(self, intent: Intent, point: Vec3) -> Effect:
        """Click on the pixel that shows a point; return the effect."""
        pixel = pixel_of(self.agent, point)
        expect(pixel is not None, f"{point} is outside the frame")
        assert pixel is not None
        return self.simulator.step(InteractPixel(intent=intent, x=pixel[0], y=pixel[1]))

    def drop(self) -> Effect:
        """Drop the held object; return the effect."""
        return self.simulator.step(InteractPixel(intent="drop"))

    def state(self, object_id: str) -> ObjectState:
        """Return an object's hidden state."""
        return self.simulator.world([object_id]).objects[object_id]

    @property
    def agent(self) -> Pose:
        """Present pose of the agent."""
        return self.simulator.world([]).agent

    @property
    def held(self) -> str | None:
        """Id of the object in the hand; None when the hand is empty."""
        return self.simulator.world([]).held


def expect(condition: bool, message: str) -> None:
    """Raise AssertionError with `message` unless the condition holds."""
    if not condition:
        raise AssertionError(message)


def expect_near(found: float, wanted: float, within: float, what: str) -> None:
    """Raise AssertionError unless two numbers differ by at most `within`."""
    expect(abs(found - wanted) <= within, f"{what}: expected {wanted} +- {within}, found {found}")


def expect_refused(effect: Effect, refusal: str | None) -> None:
    """Raise AssertionError unless an effect has this refusal; None means that the action must have been carried out."""
    expect(effect.refusal == refusal, f"expected refusal {refusal}, found {effect}")


def expect_error(kind: type[Exception], act: Callable[[], object], words: str = "") -> None:
    """Raise AssertionError unless `act` raises an error of a kind, with `words` in its message."""
    try:
        found = act()
    except kind as error:
        expect(words in str(error), f"expected {words!r} in {str(error)!r}")
        return
    raise AssertionError(f"expected a {kind.__name__} {words!r}, found {found!r}")


def opened(*object_ids: str, openness: float = 1.0) -> Setup:
    """Return a setup in which each of the objects has this openness."""
    return Setup(objects={object_id: ObjectSetup(openness=openness) for object_id in object_ids})


def holding(object_id: str) -> Setup:
    """Return a setup in which the agent holds an object."""
    return Setup(held=object_id)


def placed(object_id: str, x: float, y: float, z: float) -> Setup:
    """Return a setup that puts the centre of an object's box at (x, y, z) and gives the object no parent."""
    return Setup(objects={object_id: ObjectSetup(placement=Placement(position=Vec3(x, y, z)))})
