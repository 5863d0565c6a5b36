"""Table of steps: one row per reply of a run, with the feedback, the reply, and the frame if the run saved it."""

import json
from collections.abc import Collection, Iterator, Mapping
from itertools import islice
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from vigil.protocol.actions import AnyAction
from vigil.protocol.observation import Feedback
from vigil.protocol.profile import Profile
from vigil.protocol.world import Effect
from vigil.records.reasoning_file import reasoning_by_step
from vigil.records.record import FRAMES_FOLDER, EpisodeRecord, Key, StepRecord
from vigil.runner.workers.frames import FrameStore
from vigil.scoring.saved_run import SavedRun

IMAGE = pa.struct({"bytes": pa.binary(), "path": pa.string()})
STEP_COLUMNS: Mapping[str, tuple[pa.DataType, str]] = {
    "run": (pa.string(), "as in `episodes`"),
    "episode_id": (pa.string(), "as in `episodes`"),
    "epoch": (pa.int64(), "as in `episodes`"),
    "family": (pa.string(), "as in `episodes`"),
    "label": (pa.string(), "the verdict on the whole episode, as in `episodes`"),
    "instruction": (pa.string(), "the task as the agent got it"),
    "step": (pa.int64(), "number of the reply, from 1"),
    "shown_too_far": (pa.bool_(), "feedback shown with the frame; empty if the profile does not have feedback"),
    "shown_path_blocked": (pa.bool_(), "feedback shown with the frame; empty if the profile does not have feedback"),
    "reply": (pa.string(), "text of the reply, reasoning included"),
    "skill_name": (pa.string(), "skill of the reply's action; empty if the reply is not an action"),
    "arguments": (pa.string(), "JSON object of the action's arguments; clicks in pixels of the frame"),
    "invalid_kind": (pa.string(), "`protocol_failure` or `malformed_action`; empty for an action"),
    "invalid_reason": (pa.string(), "why the reply is not an action"),
    "finish_reason": (pa.string(), "the provider's word for why the reply ended"),
    "input_tokens": (pa.int64(), "as the provider counts them"),
    "output_tokens": (pa.int64(), "as the provider counts them"),
    "seconds": (pa.float64(), "time that the reply took, in seconds"),
    "frame_sha256": (
        pa.string(),
        "SHA-256 of the RGB bytes of the frame that was answered; empty if the agent did not look",
    ),
    "reasoning": (
        pa.string(),
        "reasoning that came separately from the reply and was saved; the column exists only on request",
    ),
    "image": (IMAGE, "that frame, if the run saved it; the column exists only if a run saved frames"),
}
"""Columns of the table `steps`: name -> (type, description). The verdict is the only column that uses hidden state."""
EXTRA_COLUMNS = frozenset({"reasoning", "image"})
"""Columns that the table has only if a run saved their content."""
ROWS_PER_BATCH = 10_000
FRAMES_PER_BATCH = 100
_Row = dict[str, Any]


def has_frames(run: SavedRun) -> bool:
    """Return whether a run saved any frame."""
    return next((run.folder / FRAMES_FOLDER).glob("*/*.png"), None) is not None


def write_steps(run: SavedRun, name: str, out: Path, extra: Collection[str]) -> None:
    """Write the steps of a run's scored episodes, sorted by episode, epoch and step.

    `name` is the run's name in the table; `extra` lists those EXTRA_COLUMNS that are included.
    """
    schema = _schema(extra)
    rows = (row for key in sorted(run.table.rows) for row in _rows_of(run, name, key, extra))
    with pq.ParquetWriter(out, schema) as writer:
        size = FRAMES_PER_BATCH if "image" in extra else ROWS_PER_BATCH
        while some := list(islice(rows, size)):
            writer.write_table(pa.Table.from_pylist(some, schema=schema))


def columns_with(extra: Collection[str]) -> dict[str, tuple[pa.DataType, str]]:
    """Return the columns of the table; of the EXTRA_COLUMNS, only those in `extra`."""
    return {name: column for name, column in STEP_COLUMNS.items() if name not in EXTRA_COLUMNS or name in extra}


def _schema(extra: Collection[str]) -> pa.Schema:
    """Return the schema, with the metadata by which the library `datasets` recognises the column of images."""
    kinds = {name: kind for name, (kind, _) in columns_with(extra).items()}
    dtypes = {name: "float64" if kind == pa.float64() else str(kind) for name, kind in kinds.items()}
    features = {
        name: {"_type": "Image"} if kind == IMAGE else {"dtype": dtypes[name], "_type": "Value"}
        for name, kind in kinds.items()
    }
    return pa.schema(kinds, metadata={"huggingface": json.dumps({"info": {"features": features}})})


def _rows_of(run: SavedRun, name: str, key: Key, extra: Collection[str]) -> Iterator[_Row]:
    outcome = run.table.rows[key].outcome
    if outcome is None:
        return
    record, episode, spec = run.table.record(key), run.table.episodes[key[0]], run.header.spec
    whole = {
        "run": name,
        "episode_id": episode.id,
        "epoch": record.epoch,
        "family": episode.family,
        "label": outcome.label,
        "instruction": episode.instruction,
    }
    store = FrameStore(run.folder / FRAMES_FOLDER)
    reasoning = reasoning_by_step(run.folder, record) if "reasoning" in extra else {}
    for shown, step in steps_with_feedback(record, spec.profile):
        row: _Row = {**whole, **_reply_cells(step)}
        if step.invalid is not None:
            row |= {"invalid_kind": step.invalid.kind, "invalid_reason": step.invalid.reason}
        row["shown_too_far"] = shown and shown.too_far
        row["shown_path_blocked"] = shown and shown.path_blocked
        if "reasoning" in extra:
            row["reasoning"] = reasoning.get(step.index)
        if "image" in extra:
            saved = store.frame(step.frame_sha256)
            row["image"] = None if saved is None else {"bytes": saved[0], "path": f"{step.frame_sha256}.png"}
        yield row


def _reply_cells(step: StepRecord) -> _Row:
    reply, usage = step.reply, step.reply.usage
    return {
        "step": step.index,
        "reply": reply.text,
        "skill_name": None if step.action is None else step.action.skill_name,
        "arguments": None if step.action is None else json.dumps(arguments_of(step.action), ensure_ascii=False),
        "finish_reason": reply.finish_reason,
        "input_tokens": None if usage is None else usage.input_tokens,
        "output_tokens": None if usage is None else usage.output_tokens,
        "seconds": reply.seconds,
        "frame_sha256": step.frame_sha256,
    }


def steps_with_feedback(record: EpisodeRecord, profile: Profile) -> Iterator[tuple[Feedback | None, StepRecord]]:
    """Yield each step with the feedback that was shown with its frame; the feedback is None if the profile has none."""
    for before, step in zip([None, *record.steps], record.steps, strict=False):
        shown = None
        if before is not None and profile.has_feedback:
            effect = before.effect or Effect()
            shown = Feedback(too_far=effect.too_far, path_blocked=effect.path_blocked)
        yield shown, step


def arguments_of(action: AnyAction) -> dict[str, object]:
    """Return the arguments of a parsed action. The coordinates of clicks are in pixels of the frame."""
    return action.model_dump(exclude={"skill_name"}, exclude_none=True)
