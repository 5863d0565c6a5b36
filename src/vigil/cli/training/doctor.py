"""`vigil train doctor`: checks, before a training, that the trainer gets exactly what is played."""

from collections.abc import Callable, Iterator
from importlib import import_module
from typing import Annotated, Any, Literal

import typer

from vigil.base.settings import Setting
from vigil.errors import InputError, SettingError
from vigil.runner.shared_settings import Families


def doctor(
    integration: Annotated[
        Literal["trl", "gymnasium", "verifiers"], Setting("Training library whose integration is checked.", name="with")
    ],
    pack: Annotated[str, Setting("Pack or stream with the episode to play, e.g. stream:7.")] = "starter",
    families: Families = (),
    group: Annotated[int, Setting("Number of environments in the group that plays the episode.", minimum=2)] = 2,
    processor: Annotated[
        str | None, Setting("Processor of the model to train: a folder, or a name on Hugging Face. Only with trl.")
    ] = None,
    backend: Annotated[str, Setting("Simulator in which the episode is played.")] = "mujoco",
) -> None:
    """Example: vigil train doctor --with trl --pack stream:7 --processor Qwen/Qwen2.5-VL-3B-Instruct

    A group of environments plays one episode with fixed replies, one of which is invalid. Then the texts, frames and
    rewards that the trainer would get are compared with the record. Exits with 2 if anything differs.
    """
    if processor is not None and integration != "trl":
        raise SettingError(f"--processor is for --with trl only: {integration} does not use a processor. Leave it out.")
    options: dict[str, Any] = {"pack": pack, "family": list(families), "backend": backend}
    if integration == "verifiers":
        found = _verifiers_check()(options, group)
    elif integration == "trl":
        checks = import_module("vigil.integrations.doctor")
        found = checks.examine_trl(options, group, None if processor is None else _processor(processor))
    else:
        found = import_module("vigil.integrations.doctor").examine_gymnasium(options, group)
    wrong = 0
    for finding in found:
        wrong += not finding.is_right
        print(f"{'ok   ' if finding.is_right else 'WRONG'}  {finding.check:36}  {finding.detail}".rstrip(), flush=True)
    if wrong:
        raise typer.Exit(2)


def _verifiers_check() -> Callable[[dict[str, Any], int], Iterator[Any]]:
    try:
        return import_module("vigil.integrations.verifiers.examine").examine_verifiers
    except ModuleNotFoundError as error:
        if error.name != "verifiers":
            raise
        raise SettingError("--with verifiers needs verifiers: docs/verifiers.md says how to install it.") from None


def _processor(name: str) -> Any:
    try:
        return import_module("transformers").AutoProcessor.from_pretrained(name)
    except ModuleNotFoundError:
        raise SettingError("--processor needs transformers: pip install transformers torchvision") from None
    except (OSError, ValueError) as error:
        raise InputError(f"Processor {name!r} could not be loaded: {str(error).splitlines()[0]}") from None
