"""Spaces of the Gymnasium environment: of instructions, and of actions with their conversion to replies.

An action of either space becomes the text of a reply, which `vigil.env` parses like the reply of a model.
"""

import json
import string
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, overload

import numpy as np
from gymnasium.spaces import Box, Dict, Discrete, Space, Text
from gymnasium.vector.utils import read_from_shared_memory

from vigil.errors import SettingError
from vigil.protocol.actions import INTENTS, MAX_TURN_DEG, SKILLS, Argument, Coordinates, Reply
from vigil.protocol.observation import FRAME_HEIGHT, FRAME_WIDTH
from vigil.protocol.replies import MAX_REPLY_BYTES

MIN_MAGNITUDE = 0.01
"""Smallest magnitude of a structured action. The protocol requires a magnitude above 0, but the bounds of a
Gymnasium space are inclusive."""


class TextActions:
    """Action space of reply texts: any string, parsed by the protocol's grammar."""

    def __init__(self) -> None:
        self.space = Text(MAX_REPLY_BYTES, min_length=0, charset=string.printable)

    def reply(self, action: Any) -> Reply:
        """Return an action as a reply. Raises SettingError if it is not a string."""
        if not isinstance(action, str):
            raise SettingError(
                f"A text action must be a string, not {type(action).__name__}. To send numbers, make the environment "
                "with "
                "actions='structured'."
            )
        return Reply(text=action)


class StructuredActions:
    """Action space of dicts with a number for the skill and for every argument; arguments that the skill does not take
    are ignored.

    Skills and other words are numbered in the order of `vigil.protocol.actions`. The summary of a report is empty.
    """

    def __init__(self, coordinates: Coordinates) -> None:
        arguments = {argument.name: argument for skill in SKILLS.values() for argument in skill}
        spaces: dict[str, Space[Any]] = {"skill_name": Discrete(len(SKILLS))}
        spaces |= {
            name: _space(argument, coordinates) for name, argument in arguments.items() if argument.type != "string"
        }
        self.space = Dict(spaces)

    def reply(self, action: Any) -> Reply:
        """Return an action as a reply. Raises SettingError if it is not in the space."""
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
    """Return one number of an action as a Python number.

    The action may have it as a numpy scalar or as an array with one element.
    """
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


class InstructionText(Text):
    """Space of instructions: a text space for instructions that change, also in asynchronous vectors.

    Gymnasium 1.4 reads the value of a `Text` space from shared memory only once, when the vector is made, and would
    return this first value forever. For this space, Gymnasium uses a function that reads the value again for every
    observation.
    """


class _Current(Sequence[str]):
    """View of the texts that are currently in shared memory; its deep copy is a tuple of the texts at that moment."""

    def __init__(self, read: Callable[[], Any]) -> None:
        self._read = read

    @overload
    def __getitem__(self, index: int) -> str: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[str]: ...
    def __getitem__(self, index: int | slice) -> str | Sequence[str]:
        return self._read()[index]

    def __len__(self) -> int:
        return len(self._read())

    def __deepcopy__(self, memo: dict[int, Any]) -> tuple[str, ...]:
        return self._read()


@read_from_shared_memory.register(InstructionText)
def _read(space: InstructionText, shared_memory: Any, n: int = 1) -> Any:
    return _Current(partial(read_from_shared_memory.dispatch(Text), space, shared_memory, n))
