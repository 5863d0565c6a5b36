"""Rows of demonstrations as chat messages, and two formats of files for these rows.

The format `sft` writes the rows to `train.jsonl` and each picture to a separate file; the rows have the paths of the
pictures. The format `parquet` is one file with the same columns and with the pictures inside; Hugging Face `datasets`
reads them as images. In both, a message has a part `{"type": "image"}` in place of a picture, and the column `images`
has the pictures in this order, as trainers of vision-language models expect.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import pyarrow as pa
import pyarrow.parquet as pq

from vigil.agents.conversation import Message
from vigil.agents.frame_encoding import EncodedFrame
from vigil.authoring.demonstrations.play import Example

TRAIN_JSONL, TRAIN_PARQUET, IMAGES = "train.jsonl", "train.parquet", "images"
_TEXTS = ("id", "episode_id", "family", "difficulty", "kind", "fault", "rejected")
_TEXT = {"dtype": "string", "_type": "Value"}
COLUMNS: dict[str, tuple[pa.DataType, Any]] = {
    **dict.fromkeys(_TEXTS, (pa.string(), _TEXT)),
    "step": (pa.int64(), {"dtype": "int64", "_type": "Value"}),
    "is_privileged": (pa.bool_(), {"dtype": "bool", "_type": "Value"}),
    "messages": (
        pa.list_(
            pa.struct(
                [
                    ("role", pa.string()),
                    ("content", pa.list_(pa.struct([("type", pa.string()), ("text", pa.string())]))),
                ]
            )
        ),
        [{"role": _TEXT, "content": [{"type": _TEXT, "text": _TEXT}]}],
    ),
    "images": (pa.list_(pa.struct([("bytes", pa.binary()), ("path", pa.string())])), [{"_type": "Image"}]),
}
"""Column -> its Arrow type, and its type in the form that Hugging Face `datasets` stores in a file."""
_FEATURES = {name: feature for name, (_, feature) in COLUMNS.items()}
SCHEMA = pa.schema(
    [(name, kind) for name, (kind, _) in COLUMNS.items()],
    metadata={"huggingface": json.dumps({"info": {"features": _FEATURES}})},
)


@dataclass(frozen=True, slots=True)
class ChatRow:
    """One example as a row, with its pictures."""

    columns: dict[str, Any]
    pictures: dict[str, EncodedFrame]
    """Path of a picture -> the picture, in the order of the messages."""


def row_of(example: Example) -> ChatRow:
    """Return an example as a row. The correct answer is in `messages`; a false report is in the column `rejected`."""
    frame, shown = f"{example.episode_id}_{example.step:02d}", example.pictures
    steps = range(example.step - len(shown) + 1, example.step + 1)
    columns = {
        "id": frame if example.fault is None else f"{frame}_{example.fault}",
        "episode_id": example.episode_id,
        "family": example.family,
        "difficulty": example.difficulty,
        "kind": "demonstration" if example.fault is None else "correction",
        "fault": example.fault,
        "rejected": example.rejected,
        "step": example.step,
        "is_privileged": example.is_privileged,
        "messages": [*map(_message, example.messages), _message(Message("assistant", example.answer))],
    }
    pictures = {
        f"{IMAGES}/{example.episode_id}_{step:02d}.{picture.format}": picture
        for step, picture in zip(steps, shown, strict=True)
    }
    return ChatRow(columns, pictures)


def _message(message: Message) -> dict[str, Any]:
    content: list[dict[str, str | None]] = [{"type": "text", "text": message.text}]
    if message.picture is not None:
        content.append({"type": "image", "text": None})
    return {"role": message.role, "content": content}


class SftWriter:
    """Writer of the format `sft`: one file of JSON lines, and one file for each picture."""

    table: ClassVar = TRAIN_JSONL
    has_corrections: ClassVar = True

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        (folder / IMAGES).mkdir()
        self._lines = (folder / TRAIN_JSONL).open("wb")

    def add(self, examples: Sequence[Example]) -> None:
        """Write the rows of one episode. Rows with the same picture share one picture file."""
        for row in map(row_of, examples):
            path = list(row.pictures)[-1]
            (self._folder / path).write_bytes(row.pictures[path].data)
            line = json.dumps({**row.columns, "images": list(row.pictures)}, ensure_ascii=False)
            self._lines.write(line.encode() + b"\n")

    def close(self) -> None:
        """Close the file."""
        self._lines.close()


class ParquetRowWriter:
    """Writer of the format `parquet`: one file with a row group for each episode."""

    table: ClassVar = TRAIN_PARQUET
    has_corrections: ClassVar = True

    def __init__(self, folder: Path) -> None:
        self._writer = pq.ParquetWriter(folder / TRAIN_PARQUET, SCHEMA)

    def add(self, examples: Sequence[Example]) -> None:
        """Write the rows of one episode."""
        table = [
            {
                **row.columns,
                "images": [{"bytes": one.data, "path": Path(path).name} for path, one in row.pictures.items()],
            }
            for row in map(row_of, examples)
        ]
        self._writer.write_table(pa.Table.from_pylist(table, SCHEMA))

    def close(self) -> None:
        """Complete and close the file."""
        self._writer.close()
