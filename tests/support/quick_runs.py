"""Settings of runs that take little time, and their records without what differs from run to run."""

from pathlib import Path
from typing import Any

from vigil.record import EpisodeRecord
from vigil.runner.settings import RunSettings


def quick(pack: Path, log_dir: Path | None, **changes: Any) -> RunSettings:
    """Returns the settings of a run on the fake backend, with one worker, no waits between retries and no beat."""
    fields: dict[str, Any] = {"backend": "fake", "workers": 1, "first_wait_s": 0.0, "beat_seconds": 0.0}
    return RunSettings(pack=pack, log_dir=log_dir, **{**fields, **changes})


def without_times(record: EpisodeRecord) -> dict[str, Any]:
    """Returns a record without its run, its times, and the seconds that replies took."""
    fields = record.model_dump(mode="json")
    for name in ("run_id", "started", "ended"):
        fields.pop(name)
    for step in fields["steps"]:
        step["reply"].pop("seconds")
    return fields
