"""`vigil models`, `vigil calibrate` and `vigil prompt`: providers, pointing calibration, and prompts."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated

import typer

from vigil.base.settings import Setting
from vigil.cli.arguments import AsJson
from vigil.cli.text import print_facts, print_notes
from vigil.errors import SettingError
from vigil.protocol.profile import COORDINATES_BY_MODEL
from vigil.runner.models.providers import PROVIDERS
from vigil.runner.shared_settings import (
    ApiKeyEnv,
    BaseUrl,
    CoordinatesOption,
    PackName,
    ProfileOption,
    PromptFileOption,
    PromptVariantOption,
    SystemRoleOption,
    ThinkingOption,
)

if TYPE_CHECKING:
    from vigil.agents.conversation import Message
    from vigil.runner.models.completion import PointingCalibration
    from vigil.runner.models.providers import Provider

OneEpisode = Annotated[
    str | None,
    Setting(
        "Id of the episode whose instruction the prompt shows. If unset, the prompt shows a placeholder instead.",
        metavar="ID",
    ),
]
LikeModel = Annotated[
    str | None,
    Setting("Model, as provider/model: the prompt asks for clicks in this model's coordinate system.", metavar="MODEL"),
]
OneModel = Annotated[
    str | None,
    Setting(
        "Model to describe, as provider/model. Only the settings of calls to this model are printed: address, "
        "variable with the key, and the switch for thinking.",
        metavar="MODEL",
    ),
]
_COORDINATES = [
    {"in the name, case ignored": one.pattern, "coordinates": one.coordinates, "source": one.source}
    for one in COORDINATES_BY_MODEL
]
LISTED = tuple(name for name in PROVIDERS if name != "mockllm")
"""Providers that `vigil models` lists: all except Inspect's mock, which answers without a server."""


def models(
    model: OneModel = None, base_url: BaseUrl = None, api_key_env: ApiKeyEnv = None, as_json: AsJson = False
) -> None:
    """Examples:
    vigil models
    vigil models --model qwen/qwen3-vl-plus
    """
    if model is not None:
        print_facts(model_facts(model, base_url, api_key_env), as_json, width=14)
    elif base_url is not None or api_key_env is not None:
        raise SettingError("--base-url and --api-key-env are for one model: add --model.")
    elif as_json:
        print(json.dumps({name: _facts(name) for name in LISTED}))
    else:
        print("\n".join([*_lines([_facts(name) for name in LISTED]), "", *_lines(_COORDINATES)]))
        print_notes(
            (
                "A model whose name contains none of these is asked for pixels; `vigil calibrate --model NAME` finds "
                "out in what coordinates the model points.",
            )
        )


def calibrate(
    model: Annotated[
        str,
        Setting(
            "Model to test, as provider/model: does it give points in pixels or in a 0-1000 grid?", metavar="MODEL"
        ),
    ],
    base_url: BaseUrl = None,
    api_key_env: ApiKeyEnv = None,
    thinking: ThinkingOption = "default",
    system_role: SystemRoleOption = "system",
) -> None:
    """Example: vigil calibrate --model vllm/moonshotai/Kimi-VL-A3B-Instruct"""
    from vigil.runner.models.completion import SPOTS, calibrate_model
    from vigil.runner.plan import endpoint_of
    from vigil.runner.settings import RunSettings

    asked = RunSettings(model=model, base_url=base_url, api_key_env=api_key_env, thinking=thinking)
    found = calibrate_model(endpoint_of(asked), system_role)
    for number, (spot, answer) in enumerate(zip(SPOTS, found.answers, strict=True), 1):
        said = "no point" if answer is None else f"({answer.x:g}, {answer.y:g})"
        print(f"picture {number}  spot at ({spot.x:g}, {spot.y:g})  answered {said}")
    for name, error in found.medians.items():
        print(f"median error read as {name}: {error:.1f} px")
    print(_verdict(model, found))
    if found.coordinates is None:
        raise typer.Exit(1)


def _verdict(model: str, found: PointingCalibration) -> str:
    from vigil.protocol.profile import known_coordinates
    from vigil.runner.models.completion import SPOTS

    if found.coordinates is None:
        return (
            f"{found.answered} of {len(SPOTS)} answers had a point, and they fit neither pixel nor normalized_1000: "
            f"{found.best or 'the model does not point well enough to tell'}."
        )
    known = known_coordinates(model)
    table = "does not name this model" if known is None else f"says {known}"
    return (
        f"The model points in {found.coordinates}, with a median error of {found.medians[found.coordinates]:.1f} px "
        f"over {found.answered} of {len(SPOTS)} pictures. Run it with --coordinates {found.coordinates} (the table "
        f"{table})."
    )


def model_facts(model: str, base_url: str | None = None, api_key_env: str | None = None) -> dict[str, str]:
    """Return the settings of calls to a model as {name: text}. Raises SettingError if the model's name is invalid."""
    from vigil.protocol.profile import coordinates_for
    from vigil.runner.models.access import model_access
    from vigil.runner.models.providers import describe_switch, parse_model_name

    found = model_access(model, base_url, {}, api_key_env)
    return {
        "model": model,
        "asked": found.description,
        "coordinates": f"{coordinates_for(model)} ({source_of_coordinates(model)})",
        "thinking on": describe_switch("on", parse_model_name(model)) or "no way known",
        "thinking off": describe_switch("off", parse_model_name(model)) or "no way known",
        "missing": found.missing or "nothing",
    }


def source_of_coordinates(model: str) -> str:
    """Return a text that says where the default coordinates of a model come from."""
    from vigil.protocol.profile import known_coordinates

    if known_coordinates(model) is not None:
        return "published table; --coordinates overrides"
    return f"the table does not name this model; find out with: vigil calibrate --model {model}"


def switch_of(provider: Provider) -> str:
    """Return the field of a request that turns thinking on and off, with both of its values; empty if the field is
    unknown."""
    from vigil.runner.models.providers import flatten_fields

    if provider.thinking is None:
        return ""
    on, off = (flatten_fields(fields)[0] for fields in (provider.thinking.on, provider.thinking.off))
    return f"{on.removeprefix('extra_body.').replace('=', ' ')} / {off.partition('=')[2]}"


def _facts(name: str) -> dict[str, str]:
    from vigil.runner.models.providers import parse_model_name

    provider = parse_model_name(f"{name}/m").provider
    key = "the machine's account" if provider.signs_in else ""
    if provider.hosts and provider.key_variable and (not key or os.environ.get(provider.key_variable)):
        key = f"{provider.key_variable} ({'set' if os.environ.get(provider.key_variable) else 'not set'})"
    installed = "installed" if provider.is_installed else "not installed"
    return {
        "name": f"{name}/...",
        "key": key,
        "extra": f"{provider.extra} ({installed})" if provider.extra else "",
        "address": provider.default_address,
        "thinking on / off": switch_of(provider),
    }


def _lines(facts: Sequence[Mapping[str, str]]) -> list[str]:
    """Return facts as lines with columns. Lines are not wrapped, so that users can copy addresses."""
    rows = [tuple(facts[0]), *(tuple(one.values()) for one in facts)]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return ["  ".join(map(str.ljust, row, widths)).rstrip() for row in rows]


def prompt(
    pack: PackName = "starter",
    episode: OneEpisode = None,
    profile: ProfileOption = "baseline",
    prompt_variant: PromptVariantOption = "default",
    prompt_template: PromptFileOption = None,
    coordinates: CoordinatesOption = None,
    model: LikeModel = None,
    system_role: SystemRoleOption = "system",
) -> None:
    """Examples:
    vigil prompt
    vigil prompt --episode procthor_fridge_seed116 --model qwen/qwen3-vl-plus
    """
    from vigil.agents.conversation import Conversation
    from vigil.agents.frame_encoding import EncodedFrame
    from vigil.packs.pack import Pack
    from vigil.protocol.profile import known_coordinates
    from vigil.protocol.prompt import policy_sha256, policy_version, rendered_sha256
    from vigil.protocol.prompt_file import INSTRUCTION_SLOT
    from vigil.runner.plan import profile_of
    from vigil.runner.settings import RunSettings

    asked = RunSettings(
        profile=profile,
        prompt_variant=prompt_variant,
        prompt_template=prompt_template,
        coordinates=coordinates,
        system_role=system_role,
        model=model,
    )
    condition = profile_of(asked)
    instruction = INSTRUCTION_SLOT if episode is None else Pack.load(pack).episode(episode).instruction
    sha256 = policy_sha256(condition) if episode is None else rendered_sha256(instruction, condition)
    picture = EncodedFrame(b"", condition.image_format)
    for message in Conversation(condition, instruction).messages(picture, None):
        print(f"--- {message.role} ---")
        print(_text(message))
    feedback = " with the feedback on the action before" if condition.has_feedback else ""
    guessed = model is not None and coordinates is None and known_coordinates(model) is None
    print_notes(
        (
            *([f"Coordinates: pixel ({source_of_coordinates(model or '')})."] if guessed else ()),
            f"{policy_version(condition)}; SHA-256 of the system message {sha256}",
            f"Later requests have up to {condition.history_turns} past turns as text between the two, and the current "
            f"frame{feedback}.",
        )
    )


def _text(message: Message) -> str:
    from vigil.protocol.observation import FRAME_HEIGHT, FRAME_WIDTH

    if message.picture is None:
        return message.text
    return f"{message.text}\n[picture: {FRAME_WIDTH} x {FRAME_HEIGHT}, {message.picture.media_type}]"
