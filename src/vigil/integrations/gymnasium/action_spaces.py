"""Actions of the Gymnasium environment: the two spaces, and what an action of each says as a reply.

Both end as a reply's text, which `vigil.env` reads as it reads a model's.
"""

import json
import string
from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium.spaces import Box, Dict, Discrete, Space, Text

from vigil.errors import SettingError
from vigil.protocol.actions import INTENTS, MAX_TURN_DEG, SKILLS, Argument, Coordinates, Reply
from vigil.protocol.observation import FRAME_HEIGHT, FRAME_WIDTH
from vigil.protocol.replies import MAX_REPLY_BYTES

MIN_MAGNITUDE = 0.01
"""Of a structured action: the protocol's magnitudes are greater than 0, and a space's bound belongs to it."""


class TextActions:
    """An action is the text of a reply: any string, judged by the protocol's grammar."""

    def __init__(self) -> None:
        self.space = Text(MAX_REPLY_BYTES, min_length=0, charset=string.printable)

    def reply(self, action: Any) -> Reply:
        """Return an action as a reply. Raises SettingError on what is no string."""
        if not isinstance(action, str):
            raise SettingError(
                f"A text action is a string, not {type(action).__name__}. For numbers make the environment with "
                "actions='structured'."
            )
        return Reply(text=action)


class StructuredActions:
    """An action is a dict of numbers with a skill and every argument; what the skill does not take is ignored.

    Words are numbered in the order of `vigil.protocol.actions`. A report's summary stays empty.
    """

    def __init__(self, coordinates: Coordinates) -> None:
        arguments = {argument.name: argument for skill in SKILLS.values() for argument in skill}
        spaces: dict[str, Space[Any]] = {"skill_name": Discrete(len(SKILLS))}
        spaces |= {
            name: _space(argument, coordinates) for name, argument in arguments.items() if argument.type != "string"
        }
        self.space = Dict(spaces)

    def reply(self, action: Any) -> Reply:
        """Return an action as a reply. Raises SettingError on one that is not in the space."""
        if not isinstance(action, Mapping) or action.keys() != self.space.keys():
            raise SettingError(f"A structured action is a dict with the keys {', '.join(self.space)}.")
        numbers = {name: _number(name, action[name], space) for name, space in self.space.items()}
        skill = list(SKILLS)[int(numbers["skill_name"])]
        arguments = {argument.name: _value(argument, numbers) for argument in SKILLS[skill]}
        if skill == "interact_pixel" and not INTENTS[arguments["intent"]].needs_pixel:
            del arguments["x"], arguments["y"]
        return Reply(text=json.dumps({"skill_name": skill, "arguments": arguments}))


def _space(argument: Argument, coordinates: Coordinates) -> Space[Any]:
    match argument.type:
        case "enum":
            return Discrete(len(argument.values))
        case "int":
            width = {"x": FRAME_WIDTH, "y": FRAME_HEIGHT}[argument.name]
            return Discrete(width if coordinates == "pixel" else 1001)
        case _:
            return Box(MIN_MAGNITUDE, MAX_TURN_DEG, shape=(), dtype=np.float32)


def _number(name: str, value: Any, space: Space[Any]) -> float:
    """Return one number of an action; vectors give numpy's scalars, policies arrays that hold one."""
    array = np.asarray(value)
    number = array.item() if array.size == 1 and array.dtype.kind in "iuf" else None
    if number is not None:
        if isinstance(space, Discrete) and 0 <= number < space.n and number == int(number):
            return number
        if isinstance(space, Box) and space.low <= number <= space.high:
            return number
    raise SettingError(f"Action: {name} is {value!r}, which is not in {space}.")


def _value(argument: Argument, numbers: Mapping[str, float]) -> Any:
    match argument.type:
        case "enum":
            return argument.values[int(numbers[argument.name])]
        case "int":
            return int(numbers[argument.name])
        case "number":
            return numbers[argument.name]
        case _:
            return ""
