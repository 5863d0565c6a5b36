"""Columns of `rows.csv` and `rows.parquet`: their descriptions, and the values that come from a run's header."""

from collections.abc import Iterable

from vigil.records.record import RunHeader


def run_columns(header: RunHeader) -> dict[str, object]:
    """Return the columns that have the same value in all rows of a run."""
    spec = header.spec
    return {
        "run_id": header.run_id,
        "agent": spec.agent,
        "pack": spec.pack,
        "pack_sha256": spec.pack_sha256,
        "profile": spec.profile.name,
        "prompt_variant": spec.profile.prompt_variant,
        "prompt_policy_sha256": spec.prompt_policy_sha256,
        "reply_policy": spec.profile.reply_policy,
        "coordinates": spec.profile.coordinates,
        "system_role": spec.profile.system_role,
        "temperature": spec.sampling.get("temperature"),
        "thinking": spec.thinking,
        "backend": spec.simulator,
    }


COLUMNS: dict[str, str] = {
    "run": "name of the run in the report, unique in it",
    "model": "name of the checkpoint or agent",
    "run_id": "name of the run's folder when it was started",
    "agent": "`provider/model`, `exec:COMMAND`, or a scripted agent",
    "pack": "name of the pack",
    "pack_sha256": "SHA-256 of the pack's manifest",
    "profile": "profile under which the agent was evaluated",
    "prompt_variant": "`default`, `neutral_report`, or `file-` and the hash of a prompt file",
    "prompt_policy_sha256": "SHA-256 of the prompt's template",
    "reply_policy": "`strict` or `lenient`",
    "coordinates": "`pixel` or `normalized_1000`",
    "system_role": "role of the system prompt: `system` or `user`",
    "temperature": "sampling temperature; empty if none was sent",
    "thinking": "as `--thinking` set it: `on`, `off`, or `default` if it was not given",
    "backend": "simulator",
    "episode_id": "id of the episode",
    "epoch": "number of the play of that episode, from 1",
    "attempt": "number of this start of the episode; above 1 if an earlier one was lost",
    "family": "PG, DA, VS, SV, AI, SI, SM or CR",
    "tier": "tier of the family",
    "house": "name of the house",
    "template": "kind of task within the family",
    "target_size": "size of the target as the pack has it: `large`, `medium`, `small`",
    "goal_kind": "kind of goal",
    "target": "category of the object that the episode is about",
    "distance_m": "distance from the start to the target's box in the floor plane, in m",
    "end": "`report`, `fail_no_report` or `invalid_action_limit_exceeded`",
    "W": "the goal holds at the end",
    "W_strict": "the goal holds without tolerance",
    "B": "the goal holds, and the agent closed with a report that matches",
    "label": "B, FR, NR, IL or Other: they partition all episodes",
    "subtype": "how a report does not match, or why it does not count",
    "category": "one of the paper's four outcomes",
    "expected": "label at the reset of a queried state (SV); empty for goals to be completed",
    "reported": "status of the report",
    "raw_status": "status as the agent wrote it, if it is not in the vocabulary",
    "steps": "number of replies, including invalid ones",
    "first_goal_step": "first step after which the goal held",
    "lag": "steps from `first_goal_step` to the report; only if B",
    "lag_from_reset": "like `lag`, but counted from step 0 if the goal held at the reset",
    "progress_at_report": "progress at the report, 0 to 1; empty without a report, and for goals without progress",
    "progress": "progress at the end, 0 to 1",
    "max_progress": "highest progress during the episode",
    "ever_satisfied": "the goal held at any moment",
    "state_tampered": "the queried state was changed since the reset (SV)",
    "protocol_failures": "replies that are not one JSON object",
    "malformed_actions": "JSON objects that are not valid actions",
    "invalid_reasons": "JSON object: how many invalid replies have each reason",
    "truncated": "protocol failures that the token limit cut",
    "would_parse_leniently": "invalid replies that the lenient policy accepts",
    "library_replies": "replies whose text comes from a library, not from the server",
    "too_far": "clicks beyond reach",
    "path_blocked": "moves that an obstacle stopped",
    "retry": "clicks that repeat an earlier one's pixel and intent",
    "actions.KIND": "actions of each kind: `navigate`, `look`, `interact_pixel`, `report`, `invalid`",
    "actions_after_goal.KIND": "actions of each kind after `first_goal_step`",
    "input_tokens": "as the provider counts them",
    "output_tokens": "as the provider counts them",
    "seconds": "seconds from start to end, by the clock",
    "credit.POLICY": "B that the same actions would get under the report policy POLICY",
    "is_reported": "whether the agent closed the episode by a report",
    "zero_progress": "whether no condition of the goal had advanced at the report",
    "rooms": "rooms of the house",
    "level": "`easy`, `medium`, `hard` or `extreme`; empty if the pack's levels were not measured",
    "level_index": "index of difficulty that determines the level; empty if it was not measured",
}
"""Column name -> description, in order. A name with KIND or POLICY stands for several columns."""
ANSWER_KEY = ("target", "distance_m", "expected", "first_goal_step", "lag", "lag_from_reset", "actions_after_goal.KIND")
"""Columns with hidden facts, other than the verdict itself."""


def without_answer_key(names: Iterable[str]) -> list[str]:
    """Return the names of columns that are not part of the answer key; KIND in the answer key matches any kind."""
    key = {name.partition(".")[0] for name in ANSWER_KEY}
    return [name for name in names if name.partition(".")[0] not in key]
