"""The columns of a LeRobot dataset: a policy's input, the action as numbers, and the position of the row.

LeRobot's policies get the columns whose names begin with `observation.`, and learn the columns whose names begin with
`action`. So these columns must not contain hidden facts or texts; columns with texts have other names.
"""

import json
from typing import Any, Literal

import pyarrow as pa

from vigil.authoring.demonstrations.play import Example
from vigil.protocol.actions import SKILLS, Action
from vigil.protocol.observation import FRAME_HEIGHT, FRAME_WIDTH, Feedback

CAMERA = "observation.images.ego"
STATE = "observation.state"
FPS = 1
"""Frames per second, which the format requires. A step counts as one second, because episodes do not have a clock."""

Dtype = Literal["image", "string", "bool", "int64", "float32"]
Feature = dict[str, Any]
"""Description of a column in `meta/info.json`: dtype, shape, and names of its values."""

_ARGUMENTS = {argument.name: argument for skill in SKILLS.values() for argument in skill if argument.type != "string"}
ACTION_NAMES = ("skill_name", *_ARGUMENTS)
"""Names of the numbers that represent an action, in order."""
WORDS: dict[str, tuple[str, ...]] = {
    "skill_name": tuple(SKILLS),
    **{name: argument.values for name, argument in _ARGUMENTS.items() if argument.values},
}
"""Name of a number that stands for a word -> the possible words. The number is the word's index, counted from 0."""
_SIZES = {"x": FRAME_WIDTH, "y": FRAME_HEIGHT}


def features_of(*, has_feedback: bool) -> dict[str, Feature]:
    """Return the columns in order. If `has_feedback` is True, they include the feedback as the policy's state."""
    state = {STATE: _feature("float32", tuple(Feedback.model_fields))} if has_feedback else {}
    picture: Feature = {
        "dtype": "image",
        "shape": [FRAME_HEIGHT, FRAME_WIDTH, 3],
        "names": ["height", "width", "channels"],
    }
    return {
        CAMERA: picture,
        **state,
        "action": _feature("float32", ACTION_NAMES),
        "thought": _feature("string"),
        "is_privileged": _feature("bool"),
        "next.reward": _feature("float32"),
        "next.done": _feature("bool"),
        "timestamp": _feature("float32"),
        **dict.fromkeys(("frame_index", "episode_index", "index", "task_index"), _feature("int64")),
    }


def _feature(dtype: Dtype, names: tuple[str, ...] = ()) -> Feature:
    return {"dtype": dtype, "shape": [len(names) or 1], "names": list(names) or None}


def schema_of(features: dict[str, Feature]) -> pa.Schema:
    """Return the Arrow schema of the columns, with metadata by which Hugging Face `datasets` recognises the picture."""
    fields = [(name, _arrow_type(feature)) for name, feature in features.items()]
    pictures = {"info": {"features": {CAMERA: {"_type": "Image"}}}}
    return pa.schema(fields, metadata={"huggingface": json.dumps(pictures)})


def _arrow_type(feature: Feature) -> pa.DataType:
    if feature["dtype"] == "image":
        return pa.struct({"bytes": pa.binary(), "path": pa.string()}.items())
    scalar = pa.type_for_alias(feature["dtype"])
    return scalar if feature["names"] is None else pa.list_(scalar, *feature["shape"])


def columns_of(example: Example) -> dict[str, Any]:
    """Return the columns of an example, except its reward and its position in the dataset."""
    name = f"frame-{example.step - 1:06d}.{example.picture.format}"
    feedback = example.feedback
    state = {} if feedback is None else {STATE: [float(said) for said in feedback.model_dump().values()]}
    return {
        CAMERA: {"bytes": example.picture.data, "path": name},
        **state,
        "action": numbers_of(example.action),
        "thought": example.thought,
        "is_privileged": example.is_privileged,
    }


def numbers_of(action: Action) -> list[float]:
    """Return an action as numbers, in the order of `ACTION_NAMES`. Arguments that its skill does not have are 0."""
    said = action.model_dump(exclude_none=True)
    return [_number(name, said[name]) if name in said else 0.0 for name in ACTION_NAMES]


def _number(name: str, value: Any) -> float:
    """Return an argument as a number: a word's index, the middle of a pixel as a share of the frame, or a magnitude."""
    if name in WORDS:
        return float(WORDS[name].index(value))
    return (value + 0.5) / _SIZES[name] if name in _SIZES else float(value)
