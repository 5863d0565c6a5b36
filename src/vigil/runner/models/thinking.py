"""Thinking: the settings that turn a model's reasoning on or off at its provider."""

from collections.abc import Mapping
from typing import Any

from vigil.base.json_files import is_object
from vigil.errors import SettingError
from vigil.protocol.reasoning import Thinking
from vigil.runner.models.providers import ModelName


def with_thinking(sampling: Mapping[str, Any], thinking: Thinking, model: ModelName) -> dict[str, Any]:
    """Return `sampling` with the settings that turn thinking on or off at a model's provider.

    Raises SettingError when the provider's switch is unknown, or when other settings contradict it.
    """
    if thinking == "default":
        return dict(sampling)
    effort = sampling.get("reasoning_effort")
    if effort is not None and (effort == "none") == (thinking == "on"):
        raise SettingError(
            f"--thinking {thinking} contradicts --reasoning-effort {effort}: leave one of them out, or make them agree."
        )
    switch = model.provider.thinking
    if switch is None:
        raise SettingError(
            f"--thinking {thinking}: how to set this for {model.provider.title} is unknown. Find the setting in "
            "the provider's documentation, and give it with --reasoning-effort, --model-arg or --extra-body."
        )
    wanted = dict(switch.on if thinking == "on" else switch.off)
    if effort is not None:
        wanted.pop("reasoning_effort", None)
    return _merge(sampling, wanted, thinking)


def describe_switch(thinking: Thinking, model: ModelName) -> str:
    """Return a text with the fields that --thinking sends, e.g. `extra_body.enable_thinking=True`; may be empty."""
    switch = model.provider.thinking
    if thinking == "default" or switch is None:
        return ""
    return ", ".join(flatten_fields(switch.on if thinking == "on" else switch.off))


def flatten_fields(fields: Mapping[str, Any], place: str = "") -> list[str]:
    """Return each value in nested fields with the path to it, e.g. `extra_body.thinking.type=enabled`."""
    found: list[str] = []
    for name, value in fields.items():
        where = f"{place}.{name}".lstrip(".")
        found += flatten_fields(value, where) if is_object(value) else [f"{where}={value}"]
    return found


def _merge(there: Mapping[str, Any], wanted: Mapping[str, Any], thinking: Thinking) -> dict[str, Any]:
    merged = dict(there)
    for name, value in wanted.items():
        given = merged.get(name)
        if is_object(value) and (given is None or is_object(given)):
            merged[name] = _merge(given or {}, value, thinking)
        elif given is not None and given != value:
            raise SettingError(
                f"--thinking {thinking} sends {name}={value!r}, but --extra-body says {given!r}: leave one of them out."
            )
        else:
            merged[name] = value
    return merged
