"""Thinking: what turns a model's reasoning on or off at its provider, and what is known of it afterwards."""

from collections.abc import Mapping
from typing import Any

from vigil.errors import SettingError
from vigil.protocol.reasoning import Thinking
from vigil.runner.models.providers import ModelName


def with_thinking(sampling: Mapping[str, Any], thinking: Thinking, model: ModelName) -> dict[str, Any]:
    """Return the settings of sampling with those that turn thinking on or off at a model's provider.

    Raises SettingError where no way is known, or where the settings say otherwise already.
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
            f"--thinking {thinking}: no way is known to tell {model.provider.title} so. Give what its documentation "
            "names with --reasoning-effort, --model-arg or --extra-body."
        )
    wanted = dict(switch.on if thinking == "on" else switch.off)
    if effort is not None:
        wanted.pop("reasoning_effort", None)
    return _merge(sampling, wanted, thinking)


def may_think(thinking: Thinking, effort: str | None, model: str) -> bool:
    """Whether a model is told to reason, or has it in its name and is not told otherwise."""
    if thinking != "default":
        return thinking == "on"
    return effort != "none" if effort is not None else "thinking" in model.casefold()


def describe_switch(thinking: Thinking, model: ModelName) -> str:
    """Return in a few words what is sent for --thinking, e.g. `extra_body.enable_thinking=True`."""
    switch = model.provider.thinking
    if thinking == "default" or switch is None:
        return ""
    return ", ".join(flatten_fields(switch.on if thinking == "on" else switch.off))


def flatten_fields(fields: Mapping[str, Any], place: str = "") -> list[str]:
    """Return each value in nested fields with the path to it, e.g. `extra_body.thinking.type=enabled`."""
    found: list[str] = []
    for name, value in fields.items():
        where = f"{place}.{name}".lstrip(".")
        found += flatten_fields(value, where) if isinstance(value, Mapping) else [f"{where}={value}"]
    return found


def _merge(there: Mapping[str, Any], wanted: Mapping[str, Any], thinking: Thinking) -> dict[str, Any]:
    merged = dict(there)
    for name, value in wanted.items():
        given = merged.get(name)
        if isinstance(value, Mapping) and isinstance(given, Mapping | None):
            merged[name] = _merge(given or {}, value, thinking)
        elif given is not None and given != value:
            raise SettingError(
                f"--thinking {thinking} sends {name}={value!r}, but --extra-body says {given!r}: leave one of them out."
            )
        else:
            merged[name] = value
    return merged
