"""Actions: the name, parameters and handler of each action, and the check of the arguments that the client sent."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from vigil.base.geometry import Vec3
from vigil.thor.base.errors import ActionFailed

ALWAYS_ALLOWED = frozenset(
    {
        *("action", "sequenceId", "agentId", "renderImage", "renderObjectImage", "renderClassImage"),
        *("renderNormalsImage", "renderInstanceSegmentation", "renderSemanticSegmentation", "renderDepthImage"),
        *("actionSimulationSeconds", "fixedDeltaTime", "physicsSimulationParams"),
    }
)
"""Names of parameters that the client may send with any action. The action's handler does not get these parameters.

The last row says how long AI2-THOR's physics runs after an action; here nothing moves by itself.
"""


@dataclass(frozen=True, slots=True)
class Action:
    """One of AI2-THOR's actions."""

    name: str
    handler: Callable[..., Any]
    """Function that carries out the action on a world and returns `actionReturn`. Raises ActionFailed."""
    signature: str = ""
    """Kinds and names of the parameters in THOR's form, e.g. "string objectId, float openness"."""
    needs: str = ""
    """Alternative sets of required arguments, e.g. "objectId | x y"; the client must send all arguments of one set."""
    takes_anything: bool = False
    """Whether unknown arguments are accepted. AI2-THOR accepts them for actions that take a whole `ServerAction`."""
    only_reads: bool = False
    """Whether the action leaves the world unchanged. If so, the client may use its last images again."""
    lacks: str = ""
    """Differences from AI2-THOR's action, for the table in the docs; empty if there are none."""

    @property
    def parameters(self) -> dict[str, str]:
        """Name of a parameter -> its kind (a key of `_CONVERT`)."""
        parts = (part.split() for part in self.signature.split(", ") if part)
        return {name: kind for kind, name in parts}

    @property
    def required(self) -> list[list[str]]:
        """Alternative sets of required arguments, each as a list of names."""
        return [names.split() for names in self.needs.split("|")]

    def arguments(self, sent: Mapping[str, Any]) -> dict[str, Any]:
        """Return the arguments in `sent`, converted to the kinds of the action's parameters.

        Raises ActionFailed on an unknown argument, a missing argument or an argument of the wrong type.
        """
        kinds = self.parameters
        given = {name: value for name, value in sent.items() if name in kinds and value is not None}
        unknown = [name for name in sent if name not in kinds and name not in ALWAYS_ALLOWED]
        if unknown and not self.takes_anything:
            raise ActionFailed(self._unknown(unknown, sent), code="InvalidArgument")
        if not any(all(name in given for name in names) for names in self.required):
            missing = min(([name for name in names if name not in given] for names in self.required), key=len)
            text = f"action: {self.name} is missing the following arguments: {','.join(missing)}"
            raise ActionFailed(text, code="MissingArguments")
        return {name: self._converted(name, kinds[name], value) for name, value in given.items()}

    def _unknown(self, unknown: list[str], sent: Mapping[str, Any]) -> str:
        yours = ", ".join(f"'{name}'" for name in sent if name not in ALWAYS_ALLOWED)
        quoted = ", ".join(f"'{name}'" for name in unknown)
        return (
            f'\n\tAction: "{self.name}" called with invalid argument{"s" if len(unknown) > 1 else ""}: {quoted}'
            f"\n\tExpected arguments: {', '.join(f'{kind} {name}' for name, kind in self.parameters.items())}"
            f"\n\tYour arguments: {yours}"
        )

    def _converted(self, name: str, kind: str, value: Any) -> Any:
        convert = _CONVERT[kind]
        try:
            return convert(value)
        except (TypeError, ValueError, KeyError, AttributeError):
            text = f"action: {self.name} has an invalid argument: {name} (=={value})."
            text += f" Cannot convert to: {kind}"
            # Unity finds out too late that a number is not a vector, so the client does not raise on it
            raise ActionFailed(text, code=None if kind == "Vector3" else "InvalidArgument") from None


def _number(value: Any) -> float:
    if isinstance(value, bool):
        raise TypeError
    return float(value)


def _integer(value: Any) -> int:
    if _number(value) != int(value):
        raise ValueError
    return int(value)


def _exactly(kind: type) -> Callable[[Any], Any]:
    def convert(value: Any) -> Any:
        if not isinstance(value, kind):
            raise TypeError
        return value

    return convert


def _vector(value: Any) -> Vec3:
    return Vec3(*(_number(value.get(axis, 0.0)) for axis in "xyz"))


def _some_of_a_vector(value: Any) -> dict[str, float]:
    return {axis: _number(value[axis]) for axis in "xyz" if value.get(axis) is not None}


_CONVERT: dict[str, Callable[[Any], Any]] = {
    "float": _number,
    "int": _integer,
    "bool": _exactly(bool),
    "string": _exactly(str),
    "Vector3": _vector,
    "OptionalVector3": _some_of_a_vector,
    "object": _exactly(dict),
    "list": _exactly(list),
    "any": lambda value: value,
}
