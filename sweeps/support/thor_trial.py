"""What the cases of `sweeps.thor_suite` share: a client, a house with what they need, and short ways to ask."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np

SCENE = "FloorPlan1"
"""A kitchen of this project's generator: fridge, stove, pot, soap bottle, tomato, potato and counters."""
LOOK = {"horizon": 0.0, "standing": True}
NEAR = 1e-3


class DoesNotApplyError(Exception):
    """The reason why a function of AI2-THOR's suite says nothing about this engine."""


@dataclass
class Trial:
    """A controller over one protocol, reset before each case."""

    controller: Any
    settings: dict[str, Any] = field(default_factory=dict)
    """The settings with which the controller was made."""

    @property
    def data(self) -> dict[str, Any]:
        """The metadata of the last event."""
        return self.controller.last_event.metadata

    def reset(self, scene: str = SCENE, **settings: Any) -> Any:
        """Open a scene again with the settings of the start, and with `settings`."""
        self.controller.initialization_parameters = dict(self.settings)
        return self.controller.reset(
            scene, width=settings.pop("width", 300), height=settings.pop("height", 300), **settings
        )

    def step(self, action: str, **arguments: Any) -> Any:
        """Take an action, whether or not it succeeds."""
        return self.controller.step(action=action, **arguments)

    def do(self, action: str, **arguments: Any) -> Any:
        """Take an action that must succeed."""
        event = self.step(action, **arguments)
        assert event, f"{action}: {event.metadata['errorMessage']}"
        return event

    def fail(self, action: str, **arguments: Any) -> str:
        """Take an action that must fail without an exception; return its message, which must not be empty."""
        event = self.step(action, **arguments)
        assert not event, f"{action} with {arguments} succeeded"
        assert event.metadata["errorMessage"]
        return event.metadata["errorMessage"]

    def first(self, kind: str) -> dict[str, Any]:
        """Return the first object of a type."""
        return next(each for each in self.data["objects"] if each["objectType"] == kind)

    def get(self, object_id: str) -> dict[str, Any]:
        """Return an object of the last event."""
        return next(each for each in self.data["objects"] if each["objectId"] == object_id)

    def go_to(self, object_id: str) -> None:
        """Stand where the agent can interact with an object."""
        self.do(
            "TeleportFull",
            **self.do("GetInteractablePoses", objectId=object_id, maxPoses=1).metadata["actionReturn"][0],
        )

    def base(self) -> dict[str, float]:
        """Stand at a place with half a metre free on all sides, and look along z; return the place."""
        places = self.do("GetReachablePositions").metadata["actionReturn"]
        known = {(round(each["x"], 3), round(each["z"], 3)) for each in places}
        sides = [(0.25, 0.0), (-0.25, 0.0), (0.0, 0.25), (0.0, -0.25), (0.0, 0.5)]
        place = next(
            each
            for each in places
            if all((round(each["x"] + x, 3), round(each["z"] + z, 3)) in known for x, z in sides)
        )
        self.do("TeleportFull", **place, rotation={"x": 0.0, "y": 0.0, "z": 0.0}, **LOOK)
        return place


def near(found: dict[str, float], wanted: dict[str, float], within: float = NEAR) -> None:
    """Check that two points or rotations agree."""
    assert set(found) == set(wanted)
    assert all(abs(found[axis] - wanted[axis]) < within for axis in wanted), f"{found} is not {wanted}"


def apart(one: np.ndarray, other: np.ndarray) -> float:
    """Return the mean difference of two images' bytes."""
    return float(np.abs(one.astype(int) - other.astype(int)).mean())


@contextmanager
def raises(text: str = "") -> Iterator[None]:
    """Check that the client raises ValueError with a text in it."""
    found = None
    try:
        yield
    except ValueError as error:
        found = str(error)
    assert found is not None, "no ValueError was raised"
    assert text in found, f"the message is {found}"


Case = Callable[[Trial], None]
