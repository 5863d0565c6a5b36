"""Columns of `rows.csv` and `rows.parquet`: their descriptions, and the values that come from a run's header."""

import tomllib
from collections.abc import Iterable
from pathlib import Path

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


COLUMNS: dict[str, str] = tomllib.loads((Path(__file__).parent / "columns.toml").read_text(encoding="utf-8"))
"""Column name -> description, in order. A name with KIND or POLICY stands for several columns."""
ANSWER_KEY = ("target", "distance_m", "expected", "first_goal_step", "lag", "lag_from_reset", "actions_after_goal.KIND")
"""Columns with hidden facts, other than the verdict itself."""


def without_answer_key(names: Iterable[str]) -> list[str]:
    """Return the names of columns that are not part of the answer key; KIND in the answer key matches any kind."""
    key = {name.partition(".")[0] for name in ANSWER_KEY}
    return [name for name in names if name.partition(".")[0] not in key]
