"""Samples: one line per episode of a run, with its messages as text and its score B."""

import hashlib
import json
from collections.abc import Iterator, Mapping
from typing import Any

from vigil.integrations.exports.options import NO_DISCLOSURE, Disclosure
from vigil.integrations.exports.steps import arguments_of, steps_with_feedback
from vigil.protocol.actions import Report
from vigil.protocol.episode import Episode
from vigil.protocol.prompt import frame_stub, policy_sha256, system_prompt
from vigil.protocol.reasoning import split_reasoning
from vigil.records.record import EpisodeRecord, RunSpec, StepRecord
from vigil.scoring.outcomes import Outcome
from vigil.scoring.saved_run import SavedRun

SCHEMA_VERSION = "0.3.0"
JOINED_METRIC = "overall/B"
"""Name of the aggregate file's result whose value is the mean of the samples' scores."""
_METADATA = (
    *("family", "tier", "house", "template", "target_size", "goal_kind", "epoch", "attempt", "end", "label"),
    *("subtype", "W", "W_strict", "reported"),
)
_Json = dict[str, Any]


def sample_lines(run: SavedRun, heading: Mapping[str, str], disclosure: Disclosure = NO_DISCLOSURE) -> Iterator[str]:
    """Yield a line of JSON for each scored episode, sorted by episode and epoch.

    `heading` has the fields that all samples of a run share, named as in the schema. Non-ASCII characters are escaped,
    because some readers also end a line at other characters than the newline.
    """
    for key in sorted(run.table.rows):
        outcome = run.table.rows[key].outcome
        if outcome is not None:
            has_key = disclosure.answer_key
            sample = _sample(run.table.episodes[key[0]], run.table.record(key), outcome, run.header.spec, has_key)
            yield json.dumps({**heading, **sample}, allow_nan=False, separators=(",", ":"))


def _sample(episode: Episode, record: EpisodeRecord, outcome: Outcome, spec: RunSpec, has_key: bool) -> _Json:
    messages, house = _messages(episode, record, spec), episode.house
    # Several episodes may share one instruction, so the task names the episode and the house.
    task = f"{episode.instruction}\n\n(episode {episode.id}, in house {house.name} with SHA-256 {house.sha256})"
    # The report that matches a reached goal; that of a queried state is part of the answer key.
    reference = ["success"] if outcome.expected is None else [outcome.expected] if has_key else []
    calls = sum(step.action is not None for step in record.steps)
    used, made = outcome.input_tokens, outcome.output_tokens
    usage = {"input_tokens": used, "output_tokens": made, "total_tokens": used + made}
    return {
        "sample_id": episode.id,
        "sample_hash": hashlib.sha256("".join([task, *reference]).encode()).hexdigest(),
        "interaction_type": "agentic",
        "input": {"raw": task, "reference": reference},
        "output": None,
        "messages": messages,
        "answer_attribution": _attribution(record, len(messages) - 1),
        "evaluation": {
            "score": float(outcome.B),
            "is_correct": outcome.B,
            "num_turns": outcome.steps,
            "tool_calls_count": calls,
        },
        "token_usage": usage if any(step.reply.usage for step in record.steps) else None,
        "performance": {"generation_time_ms": round(1000 * sum(step.reply.seconds for step in record.steps), 3)},
        "metadata": {name: str(value) for name in _METADATA if (value := getattr(outcome, name)) is not None},
    }


def _messages(episode: Episode, record: EpisodeRecord, spec: RunSpec) -> list[_Json]:
    """Return the dialogue as text. The frames in the user's messages are left out."""
    messages: list[_Json] = []
    if has_exact_prompt(spec):
        messages.append({"role": spec.profile.system_role, "content": system_prompt(episode.instruction, spec.profile)})
    for shown, step in steps_with_feedback(record, spec.profile):
        messages += [{"role": "user", "content": frame_stub("current", shown)}, _answer(step)]
    return [{"turn_idx": index, **message} for index, message in enumerate(messages)]


def has_exact_prompt(spec: RunSpec) -> bool:
    """Return whether this version of VIGIL has exactly the prompt that was used in the run."""
    return policy_sha256(spec.profile) == spec.prompt_policy_sha256


def _answer(step: StepRecord) -> _Json:
    text = step.reply.text
    answer, _ = split_reasoning(text)
    message: _Json = {"role": "assistant", "content": answer}
    if len(answer) < len(text):
        message["reasoning_trace"] = text[: len(text) - len(answer)]
    if step.action is not None:
        arguments = {name: str(value) for name, value in arguments_of(step.action).items()}
        message["tool_calls"] = [{"id": f"step-{step.index}", "name": step.action.skill_name, "arguments": arguments}]
    return message


def _attribution(record: EpisodeRecord, last: int) -> list[_Json]:
    """Return the place of the report: the dialogue's last message, which has the number `last`. Empty if there was no
    report."""
    action = record.steps[-1].action if record.steps else None
    if not isinstance(action, Report):
        return []
    return [
        {
            "turn_idx": last,
            "source": f"messages[{last}].content",
            "extracted_value": action.raw_status or action.status,
            "extraction_method": "the status of the JSON object that the reply is",
            "is_terminal": True,
        }
    ]
