"""Models: the group, serving mode and name of a run's row, from published tables of patterns.

Models are grouped as in the paper's panels; agents that are not models form separate groups.
"""

import re
from dataclasses import dataclass
from typing import Literal, get_args

from vigil.protocol.reasoning import declared_thinking
from vigil.records.record import RunSpec

ModelGroup = Literal[
    "Embodied / robotics-tuned",
    "Open general and reasoning VLMs",
    "Closed-source frontier",
    "Scripted agents",
    "People",
    "Privileged agents (they see hidden state)",
]
GROUPS: tuple[ModelGroup, ...] = get_args(ModelGroup)
_GROUP_PATTERNS: tuple[tuple[str, ModelGroup], ...] = (
    (r"embodied|robo|rynn|cosmos-reason|embodi|vebrain|openvla|pelican", "Embodied / robotics-tuned"),
    (r"gemma|gpt-oss", "Open general and reasoning VLMs"),
    (r"gemini|gpt-?\d|\bo[134]\b|claude|doubao|seed-?\d|grok|qwen.*-(max|plus)", "Closed-source frontier"),
)
"""Published patterns and groups. The first pattern that matches a model's name in lower case decides its group; the
default is `open`."""
_CLOSED_PROVIDERS = frozenset({"anthropic", "google", "vertex", "azureai", "grok", "bedrock"})
_SERVING = re.compile(r"[-_ ](?:instruct|thinking)(?![a-z])| \(T\)$", re.IGNORECASE)
_ACTIVATED = re.compile(r"(?<![a-z0-9])a(\d+(?:\.\d+)?)b(?![a-z0-9])")


@dataclass(frozen=True, slots=True)
class ModelInfo:
    """Name and group of an evaluated agent in the tables."""

    name: str
    """The printed name, with `(T)` for the thinking serving mode."""
    group: str
    """Group in tables: a group of the paper's panels, a group of non-models, or a group named by a study."""
    is_thinking: bool | None
    """Whether the model thinks; None if neither its name nor its settings nor its answers show this."""
    activated: str | None
    """Activated parameters of a mixture of experts, e.g. `A3B`; None if the name does not say."""
    is_privileged: bool = False

    @property
    def checkpoint(self) -> str:
        """The model's name without its serving mode (thinking or instruct)."""
        return checkpoint_of(self.name)


def agent_of(spec: RunSpec, *, has_reasoning: bool = False) -> ModelInfo:
    """Return the name and group of a run's agent.

    If its answers have reasoning, the model counts as thinking, whatever its name and settings say.
    """
    if spec.agent_kind == "privileged":
        return ModelInfo(spec.agent + spec.name_suffix, GROUPS[5], None, None, is_privileged=True)
    if spec.agent_kind in ("scripted", "human"):
        return ModelInfo(spec.agent, GROUPS[3 if spec.agent_kind == "scripted" else 4], None, None)
    provider, _, short = spec.agent.rpartition("/")
    thinking = has_reasoning or declared_thinking(spec.agent, spec.thinking, spec.sampling)
    name = f"{short} (T)" if thinking and not declared_thinking(short, "default", {}) else short
    return ModelInfo(name + spec.name_suffix, group_of(short, provider.split("/")[0]), thinking, activated_of(short))


def group_of(name: str, provider: str = "") -> ModelGroup:
    """Return the panel group of a model by the first pattern in its name; `open` if none matches."""
    return known_group(name, provider) or GROUPS[1]


def known_group(name: str, provider: str = "") -> ModelGroup | None:
    """Return the panel group that a model's name or provider implies; None if neither does."""
    folded = name.casefold()
    for pattern, group in _GROUP_PATTERNS:
        if re.search(pattern, folded):
            return group
    return GROUPS[2] if provider in _CLOSED_PROVIDERS else None


def checkpoint_of(name: str) -> str:
    """Return a model's name without the part that marks its thinking or instruct serving mode."""
    return _SERVING.sub("", name)


def activated_of(name: str) -> str | None:
    """Return the part of a model's name with the number of activated parameters, e.g. `A3B`; None if absent."""
    found = _ACTIVATED.search(name.casefold())
    return found[0].upper() if found else None
