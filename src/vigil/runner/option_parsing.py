"""Settings of a run, read from the texts of a command line. Messages name the option but do not reveal secrets."""

from collections.abc import Callable, Sequence
from typing import Any

from vigil.base.json_files import is_object, read_json
from vigil.errors import SettingError
from vigil.runner.models.redaction import Secrets, without_option_secrets


def public_name(agent: str) -> str:
    """Return an agent's name without the secrets in a program's command line."""
    from vigil.agents.registry import is_exec  # noqa: PLC0415 - loads the agents

    return Secrets.of().redact(without_option_secrets(agent)) if is_exec(agent) else agent


def single_value(option: str) -> Callable[[Sequence[str]], str]:
    """Return a function that reads an option that may be given only once; it raises SettingError on more values."""

    def read(texts: Sequence[str]) -> str:
        if len(texts) == 1:
            return texts[0]
        given = ", ".join(map(public_name, texts))
        raise SettingError(
            f"{option} is given {len(texts)} times ({given}), but a run takes only one. Run each with a separate "
            "--log-dir, then compare them: vigil score RUN RUN."
        )

    return read


def read_model_args(pairs: Sequence[str]) -> dict[str, Any]:
    """Return the pairs `K=V` as {K: V}; a value that is not JSON is a string. Raises SettingError."""
    found: dict[str, Any] = {}
    for pair in pairs:
        name, sign, value = pair.partition("=")
        if not sign or not name:
            shown = without_option_secrets(pair)
            raise SettingError(f"--model-arg {shown!r} is not K=V, e.g. --model-arg api_version=2024-10-21.")
        try:
            found[name] = read_json(value)
        except ValueError:
            found[name] = value
    return found


def read_extra_body(text: str) -> dict[str, Any]:
    """Return the JSON object in `text`. Raises SettingError."""
    try:
        found = read_json(text)
    except ValueError as error:
        raise SettingError(f"--extra-body is not JSON: {error}.") from None
    if not is_object(found):
        raise SettingError("--extra-body must be a JSON object, e.g. '{\"top_k\": 20}'.")
    return found
