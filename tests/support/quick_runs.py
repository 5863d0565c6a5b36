"""Settings of quick runs, and their records without the fields that differ from run to run."""

import json
from pathlib import Path
from typing import Any

from vigil.records.record import EpisodeRecord, read_header
from vigil.runner.settings import RunSettings


def quick(pack: Path, log_dir: Path | None, **changes: Any) -> RunSettings:
    """Return settings of a run on the fake backend: one worker, no waits between retries, no heartbeat."""
    fields: dict[str, Any] = {"backend": "fake", "workers": 1, "first_wait_s": 0.0, "frame_interval_seconds": 0.0}
    return RunSettings(pack=pack, log_dir=log_dir, **{**fields, **changes})


def without_times(record: EpisodeRecord) -> dict[str, Any]:
    """Return a record without its run, its times, and the durations of replies."""
    fields = record.model_dump(mode="json")
    for name in ("run_id", "run_sha256", "started", "ended"):
        fields.pop(name)
    for step in fields["steps"]:
        step["reply"].pop("seconds")
    return fields


def claim(run: Path) -> None:
    """Make the rows in a run's folder belong to the run again after its header was changed."""
    file, sha256 = run / "episodes.jsonl", read_header(run).sha256
    rows = [json.loads(line) | {"run_sha256": sha256} for line in file.read_text().splitlines()]
    file.write_text("".join(json.dumps(row) + "\n" for row in rows))
