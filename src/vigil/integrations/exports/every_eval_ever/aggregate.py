"""Aggregate file: the rates of a run, overall and by family, with their intervals and the conditions of the run."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from vigil.integrations.exports.every_eval_ever.identity import Identity, model_info
from vigil.integrations.exports.every_eval_ever.publisher import Publisher
from vigil.integrations.exports.every_eval_ever.samples import SCHEMA_VERSION, Heading, has_exact_prompt
from vigil.packs.pack import manifest_of
from vigil.protocol.actions import SKILLS
from vigil.protocol.families import FAMILIES
from vigil.protocol.prompt import policy_text
from vigil.records.record import RunHeader
from vigil.scoring.saved_run import SavedRun
from vigil.scoring.summary import LIBRARY_REPLIES, RunScores, summarise

_Json = dict[str, Any]
_GENERATION_ARGS = ("temperature", "top_p", "top_k", "max_tokens")
"""Sampling settings that the schema has fields for; other settings are exported as additional details."""


@dataclass(frozen=True, slots=True)
class Metric:
    """Description of a rate, in the fields of the schema."""

    name: str
    description: str
    lower_is_better: bool
    kind: str = "rate"


METRICS: Mapping[str, Metric] = {
    "W": Metric("World completion", "the goal holds in the simulator's hidden state at the end", False, "pass_rate"),
    "B": Metric(
        "Benchmark success",
        "the goal holds, and the agent closed with a matching report",
        False,
        "pass_rate",
    ),
    "FR": Metric("False report", "the agent closed with a report that does not match", True),
    "NR": Metric("No report", "the agent never reported; the step budget ran out", True),
    "IL": Metric("Invalid limit", "the episode ended by too many invalid replies", True),
    "Delta": Metric("W - B", "the goal holds, but the agent did not close with a matching report", True),
}


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


def aggregate(run: SavedRun, heading: Heading, identity: Identity, publisher: Publisher, scores: RunScores) -> _Json:
    """Return the content of the aggregate file, except its date and the location of its samples."""
    header = run.header
    return {
        "schema_version": SCHEMA_VERSION,
        "evaluation_id": heading.evaluation_id,
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


def _results(run: SavedRun, heading: Heading, scores: RunScores) -> Iterator[_Json]:
    summary = summarise(scores)
    scopes = {"overall": summary["overall"], **summary["families"]}
    same = {"source_data": _source_data(run), "generation_config": _generation_config(run.header)}
    for scope, rates in scopes.items():
        family = FAMILIES[scope].name if scope in FAMILIES else ""
        name = f"{heading.evaluation_name} {scope}" if family else heading.evaluation_name
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
    return {
        "generation_args": {**known, "agentic_eval_config": {"available_tools": _tools()}},
        "additional_details": _as_texts(
            profile=profile.name,
            prompt_variant=profile.prompt_variant,
            prompt_sha256=spec.prompt_policy_sha256,
            coordinates=profile.coordinates,
            reply_policy=profile.reply_policy,
            history_turns=profile.history_turns,
            image_format=profile.image_format,
            system_role=profile.system_role,
            thinking=spec.thinking,
            **others,
            epochs=spec.epochs,
            simulator=spec.simulator,
            render_quality=spec.render_quality,
        ),
    }


def _tools() -> list[_Json]:
    return [
        {"name": skill, "parameters": {argument.name: argument.description for argument in arguments}}
        for skill, arguments in SKILLS.items()
    ]


def _has_reasoned(header: RunHeader) -> bool | None:
    """Return whether the model reasoned, according to its answers and settings; None if they do not show it."""
    sessions = (header.answered, *(session.answered for session in header.resumed))
    said = {answered.thinking for answered in sessions if answered is not None} - {"unknown"}
    return said == {"on"} if len(said) == 1 else None


def _as_texts(**facts: object) -> dict[str, str]:
    """Return those facts that are not None, as strings: the schema allows no other type for details."""
    return {name: str(fact) for name, fact in facts.items() if fact is not None}
