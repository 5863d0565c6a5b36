"""Identity of a run's model, in the schema's terms: its developer, and how it was served. Both may be unknown."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from vigil.analysis.measures.models import GROUPS, known_group
from vigil.errors import SettingError
from vigil.records.record import AgentKind, RunHeader
from vigil.runner.models.access import is_own_address
from vigil.runner.models.providers import ModelName, parse_model_name

MAKERS: Mapping[str, str] = {
    "openai": "openai",
    "anthropic": "anthropic",
    "google": "google",
    "doubao": "bytedance",
    "qwen": "Qwen",
    "zhipu": "zai-org",
    "minimax": "MiniMaxAI",
    "moonshot": "moonshotai",
    "deepseek": "deepseek-ai",
    "mistral": "mistralai",
    "grok": "xai",
}
"""Provider that serves only models of one developer -> the developer's name in the Every Eval Ever database."""
ENGINES = frozenset({"vllm", "sglang", "ollama", "lmstudio", "llama-cpp"})
"""Names of those providers that are inference engines, which users run themselves."""
NO_MODELS: Mapping[AgentKind, str] = {
    "privileged": "an agent that sees hidden state",
    "scripted": "a scripted agent",
    "human": "a person",
    "exec": "a program, which may be anything",
    "remote": "a player at the other end of a connection, which may be anything",
}
_COMPONENT = re.compile(r'[^\s<>"\\|?*\x00-\x1f/]([^<>"\\|?*\x00-\x1f/]*[^\s<>"\\|?*\x00-\x1f/.])?(?<!\.)')
"""Pattern of a folder name that is valid on any operating system."""
_RESERVED = frozenset({"data", "unknown"})


@dataclass(frozen=True, slots=True)
class Identity:
    """The developer and name under which the database lists a model."""

    developer: str
    name: str
    """The model's name without the developer."""
    served_name: ModelName

    @property
    def id(self) -> str:
        """The model's id, written as on a model hub: developer/name."""
        return f"{self.developer}/{self.name}"

    @property
    def folders(self) -> tuple[str, str]:
        """The folder names of the developer and of the model, derived from the id as in the database."""
        return _folder(self.developer), _folder(self.name)


def identity_of(header: RunHeader, developer: str | None = None) -> Identity:
    """Return the identity of a run's model. `developer` replaces the developer that the model's name states, if any.

    Raises SettingError.
    """
    spec = header.spec
    if spec.agent_kind != "model":
        raise SettingError(
            f"Run {header.run_id!r} was played by {NO_MODELS[spec.agent_kind]} ({spec.agent}), but Every Eval Ever "
            "has only results of models. Leave this run out, or export it with --format parquet or hf."
        )
    served_name = parse_model_name(spec.agent)
    maker, _, rest = served_name.name.rpartition("/")
    if developer is None and maker.strip("/"):
        developer, rest = served_name.name.split("/", 1)
    if developer is None and _deployment(header, served_name) == "externally_managed":
        developer = MAKERS.get(served_name.prefix.partition("/")[0])
    found = Identity(developer or "", rest, served_name)
    if "/" in found.developer or not all(map(_is_component, found.folders)):
        raise SettingError(
            f"Run {header.run_id!r}: Every Eval Ever sorts results by developer and model, and {spec.agent!r} does "
            "not name both. Name the developer of the model, e.g. --developer Qwen."
        )
    return found


def model_info(header: RunHeader, identity: Identity) -> dict[str, Any]:
    """Return the description of a run's model, in the fields of the schema."""
    provider, deployment = identity.served_name.provider, _deployment(header, identity.served_name)
    info: dict[str, Any] = {"name": header.spec.agent, "id": identity.id, "developer": identity.developer}
    if deployment == "externally_managed":
        info["inference_platform"] = provider.title
    if identity.served_name.prefix in ENGINES:
        info["inference_engine"] = {"name": provider.title}
    weights = {GROUPS[1]: "open_weights", GROUPS[2]: "closed_weights"}
    group = known_group(identity.name)
    details = {
        "deployment_type": deployment,
        "model_availability": weights.get(group, "unknown") if group else "unknown",
    }
    if header.answering_models:
        details["answered_as"] = ", ".join(header.answering_models)
    return {**info, "additional_details": details}


def _deployment(header: RunHeader, served_name: ModelName) -> Literal["self_deployed", "externally_managed", "unknown"]:
    """Return who ran the server, inferred from the provider and the base URL."""
    if served_name.prefix in ENGINES:
        return "self_deployed"
    address = header.spec.base_url
    is_home = served_name.is_known and (address is None or is_own_address(address, served_name.provider))
    return "externally_managed" if served_name.provider.hosts and is_home else "unknown"


def _folder(name: str) -> str:
    return name.replace("/", "_").replace(":", "_")


def _is_component(folder: str) -> bool:
    return _COMPONENT.fullmatch(folder) is not None and folder.casefold() not in _RESERVED
