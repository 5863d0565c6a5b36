"""Aggregate file: the rates of a run, overall and by family, with their intervals and the conditions of the run.

The conditions name the run's model in the schema's terms: its developer, and how it was served. Both may be unknown.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

from vigil.analysis.measures.models import GROUPS, known_group
from vigil.errors import SettingError
from vigil.integrations.exports.every_eval_ever.samples import SCHEMA_VERSION, has_exact_prompt
from vigil.integrations.exports.options import Publisher
from vigil.packs.pack import manifest_of
from vigil.protocol.actions import SKILLS
from vigil.protocol.families import FAMILIES
from vigil.protocol.prompt import policy_text
from vigil.records.record import AgentKind, RunHeader
from vigil.runner.models.access import is_own_address
from vigil.runner.models.providers import ModelName, parse_model_name
from vigil.scoring.saved_run import SavedRun
from vigil.scoring.summary import LIBRARY_REPLIES, RunScores, summarise

_Json = dict[str, Any]
_GENERATION_ARGS = ("temperature", "top_p", "top_k", "max_tokens")
"""Sampling settings that the schema has fields for; other settings are exported as additional details."""
_OF_PROFILE = ("coordinates", "reply_policy", "history_turns", "image_format", "system_role")


class Metric(NamedTuple):
    """Description of a rate, in the fields of the schema."""

    name: str
    description: str
    lower_is_better: bool = True
    kind: str = "rate"


METRICS: Mapping[str, Metric] = {
    "W": Metric("World completion", "the goal holds in the simulator's hidden state at the end", False, "pass_rate"),
    "B": Metric("Benchmark success", "the goal holds, and the agent closed with a matching report", False, "pass_rate"),
    "FR": Metric("False report", "the agent closed with a report that does not match"),
    "NR": Metric("No report", "the agent never reported; the step budget ran out"),
    "IL": Metric("Invalid limit", "the episode ended by too many invalid replies"),
    "Delta": Metric("W - B", "the goal holds, but the agent did not close with a matching report"),
}
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
    def folders(self) -> list[str]:
        """The folder names of the developer and of the model, derived from the id as in the database."""
        return [name.replace("/", "_").replace(":", "_") for name in (self.developer, self.name)]


def remarks(run: SavedRun, scores: RunScores) -> list[str]:
    """Return the caveats about a run that must be read before its numbers."""
    planned, all_of_pack = sum(scores.planned.values()), manifest_of(run.pack_folder).episodes
    spec, scored = run.header.spec, len(scores.outcomes)
    said = [*run.header.version_notes]
    if spec.shard is not None:
        said.append(f"INCOMPLETE: shard {spec.shard} of a run.")
    elif not scores.is_complete:
        said.append(f"INCOMPLETE: {scored} of {planned} episodes are scored.")
    if len(run.table.episodes) < all_of_pack:
        said.append(f"A selection: {len(run.table.episodes)} of the {all_of_pack} episodes of the pack.")
    if scores.errors:
        said.append(f"{len(scores.errors)} episodes ended as errors of the infrastructure and are not scored.")
    if scores.repeats:
        said.append(f"{scores.repeats}.")
    if scores.library_replies:
        said.append(f"{scores.library_replies} {LIBRARY_REPLIES}.")
    return said


def aggregate(
    run: SavedRun, heading: Mapping[str, str], identity: Identity, publisher: Publisher, scores: RunScores
) -> _Json:
    """Return the content of the aggregate file, except its date and the location of its samples."""
    header = run.header
    return {
        "schema_version": SCHEMA_VERSION,
        "evaluation_id": heading["evaluation_id"],
        "evaluation_timestamp": str(header.started.timestamp()),
        "source_metadata": {
            "source_name": "VIGIL",
            "source_type": "evaluation_run",
            "source_organization_name": publisher.organization,
            "evaluator_relationship": publisher.relationship,
            "additional_details": {"remarks": " ".join(remarks(run, scores))},
        },
        "eval_library": {
            "name": "vigil-bench",
            "version": header.package_version,
            "additional_details": _as_texts(
                commit=header.commit, simulator=header.simulator_version, **header.spec.versions.model_dump()
            ),
        },
        "model_info": model_info(header, identity),
        "evaluation_results": list(_results(run, heading, scores)),
    }


def _results(run: SavedRun, heading: Mapping[str, str], scores: RunScores) -> Iterator[_Json]:
    summary = summarise(scores)
    scopes = {"overall": summary["overall"], **summary["families"]}
    same = {"source_data": _source_data(run), "generation_config": _generation_config(run.header)}
    title = heading["evaluation_name"]
    for scope, rates in scopes.items():
        family = FAMILIES[scope].name if scope in FAMILIES else ""
        name = f"{title} {scope}" if family else title
        for key, metric in METRICS.items() if rates["episodes"] else ():
            yield {
                "evaluation_result_id": f"{scope}/{key}",
                "evaluation_name": name,
                "metric_config": _metric_config(key, metric, family),
                "score_details": _score_details(key, rates, run.header.spec.epochs),
                **same,
            }


def _metric_config(key: str, metric: Metric, family: str) -> _Json:
    among = f"the episodes of the family {family}" if family else "all episodes"
    return {
        "evaluation_description": f"Share of {among} in which {metric.description}.",
        "metric_id": f"vigil.{key}",
        "metric_name": metric.name,
        "metric_kind": metric.kind,
        "metric_unit": "proportion",
        "lower_is_better": metric.lower_is_better,
        "score_type": "continuous",
        "min_score": 0,
        "max_score": 1,
    }


def _score_details(key: str, rates: _Json, epochs: int) -> _Json:
    low, high = rates["intervals"][key]
    method = "wilson" if epochs == 1 else "wilson, with the effective number of independent trials of the epochs"
    return {
        "score": rates[key],
        "uncertainty": {
            "confidence_interval": {"lower": low, "upper": high, "confidence_level": 0.95, "method": method},
            "num_samples": rates["episodes"],
        },
    }


def _source_data(run: SavedRun) -> _Json:
    spec = run.header.spec
    return {
        "dataset_name": spec.pack,
        "source_type": "other",
        "additional_details": {
            "sha256": spec.pack_sha256,
            "episodes": str(len(run.table.episodes)),
            "episodes_in_pack": str(manifest_of(run.pack_folder).episodes),
        },
    }


def _generation_config(header: RunHeader) -> _Json:
    spec, profile = header.spec, header.spec.profile
    known = {name: value for name, value in spec.sampling.items() if name in _GENERATION_ARGS}
    others = {name: value for name, value in spec.sampling.items() if name not in {*_GENERATION_ARGS, "extra_body"}}
    if has_exact_prompt(spec):
        known["prompt_template"] = policy_text(profile)
    if (reasons := _has_reasoned(header)) is not None:
        known["reasoning"] = reasons
    tools = [
        {"name": skill, "parameters": {argument.name: argument.description for argument in arguments}}
        for skill, arguments in SKILLS.items()
    ]
    return {
        "generation_args": {**known, "agentic_eval_config": {"available_tools": tools}},
        "additional_details": _as_texts(
            profile=profile.name,
            prompt_variant=profile.prompt_variant,
            prompt_sha256=spec.prompt_policy_sha256,
            **{name: getattr(profile, name) for name in _OF_PROFILE},
            thinking=spec.thinking,
            **others,
            **{name: getattr(spec, name) for name in ("epochs", "simulator", "render_quality")},
        ),
    }


def _has_reasoned(header: RunHeader) -> bool | None:
    """Return whether the model reasoned, according to its answers and settings; None if they do not show it."""
    sessions = (header.answered, *(session.answered for session in header.resumed))
    said = {answered.thinking for answered in sessions if answered is not None} - {"unknown"}
    return said == {"on"} if len(said) == 1 else None


def _as_texts(**facts: object) -> dict[str, str]:
    """Return those facts that are not None, as strings: the schema allows no other type for details."""
    return {name: str(fact) for name, fact in facts.items() if fact is not None}


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
    is_valid = all(_COMPONENT.fullmatch(each) and each.casefold() not in _RESERVED for each in found.folders)
    if "/" in found.developer or not is_valid:
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
