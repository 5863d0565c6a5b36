"""Demonstrations as a LeRobot dataset v3.0: frames in `data/`; tasks, episodes and statistics in `meta/`.

Source: https://huggingface.co/docs/lerobot/lerobot-dataset-v3, and the files that `lerobot` 0.4.4 reads and writes.
"""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from vigil.agents.frame_encoding import decode_frame
from vigil.authoring.demonstrations.columns import CAMERA, FPS, Feature, columns_of, features_of, schema_of
from vigil.authoring.demonstrations.play import Example

VERSION = "v3.0"
FILE_MB = 100
"""Maximum size (MB) of a data file. When it is reached, a new file is begun."""
FILES_A_CHUNK = 1000
"""Number of files in one folder (a chunk)."""
_PLACE = "chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
DATA, EPISODES = f"data/{_PLACE}", f"meta/episodes/{_PLACE}"
DATA_FILES = "data/*/*.parquet"
INFO, STATS, TASKS = "meta/info.json", "meta/stats.json", "meta/tasks.parquet"
QUANTILES = {"q01": 0.01, "q10": 0.1, "q50": 0.5, "q90": 0.9, "q99": 0.99}
LEVELS = 256
Statistics = dict[str, Any]
"""Name of a statistic -> its values: one for each number of a column, or shape (3, 1, 1) for a frame's channels."""


class LeRobotWriter:
    """Writer of Parquet files with the pictures inside. Each episode is a row group.

    A new file is begun if a file would become too large. Corrections must not be added, because policies imitate every
    row and must not imitate false reports.
    """

    table: ClassVar = DATA_FILES
    has_corrections: ClassVar = False

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._features: dict[str, Feature] = {}
        self._writer: pq.ParquetWriter | None = None
        self._file, self._file_bytes = -1, 0
        self._tasks: dict[str, int] = {}
        self._episodes: list[dict[str, Any]] = []
        self._numbers: list[dict[str, np.ndarray]] = []
        self._pixels = np.zeros((3, LEVELS), np.int64)
        self._frames = 0

    def add(self, examples: Sequence[Example]) -> None:
        """Write the frames of one episode."""
        first = examples[0]
        self._features = self._features or features_of(has_feedback=first.feedback is not None)
        task = self._tasks.setdefault(first.instruction, len(self._tasks))
        rows = [
            {
                **columns_of(example),
                "next.reward": float(example is examples[-1]),
                "next.done": example is examples[-1],
                "timestamp": index / FPS,
                "frame_index": index,
                "episode_index": len(self._episodes),
                "index": self._frames + index,
                "task_index": task,
            }
            for index, example in enumerate(examples)
        ]
        self._write(rows, sum(len(example.picture.data) for example in examples))
        numbers = {
            name: np.array([row[name] for row in rows], feature["dtype"]).reshape(len(rows), -1)
            for name, feature in self._features.items()
            if feature["dtype"] not in ("image", "string")
        }
        pixels = np.sum([pixel_counts(decode_frame(example.picture.data)) for example in examples], axis=0)
        self._episodes.append(self._episode(examples, of_columns(numbers, CAMERA, pixels)))
        self._numbers.append(numbers)
        self._pixels += pixels
        self._frames += len(rows)

    def _write(self, rows: list[dict[str, Any]], size: int) -> None:
        """Write rows as a row group. If `size` bytes of pictures do not fit into the last file, begin a new file."""
        if self._writer is None or self._file_bytes + size > FILE_MB * 2**20:
            self._close_file()
            self._file, self._file_bytes = self._file + 1, 0
            path = self._folder / DATA.format(**_place(self._file))
            path.parent.mkdir(parents=True, exist_ok=True)
            self._writer = pq.ParquetWriter(path, schema_of(self._features))
        self._writer.write_table(pa.Table.from_pylist(rows, self._writer.schema))
        self._file_bytes += size

    def _close_file(self) -> None:
        if self._writer is not None:
            self._writer.close()

    def _episode(self, examples: Sequence[Example], statistics: dict[str, Statistics]) -> dict[str, Any]:
        """Return an episode's row in `meta/episodes`: LeRobot's columns, and also the family and the difficulty."""
        place = _place(self._file)
        return {
            "episode_index": len(self._episodes),
            "tasks": [examples[0].instruction],
            "length": len(examples),
            "family": examples[0].family,
            "difficulty": examples[0].difficulty,
            "dataset_from_index": self._frames,
            "dataset_to_index": self._frames + len(examples),
            **{f"data/{name}": index for name, index in place.items()},
            **{f"meta/episodes/{name}": index for name, index in _place(0).items()},
            **{f"stats/{column}/{name}": value for column, of in statistics.items() for name, value in of.items()},
        }

    def close(self) -> None:
        """Complete the data files and write `meta/`. Without episodes, write nothing."""
        self._close_file()
        if not self._episodes:
            return
        path = self._folder / EPISODES.format(**_place(0))
        path.parent.mkdir(parents=True)
        pq.write_table(pa.Table.from_pylist(self._episodes), path)
        tasks = pd.Index(list(self._tasks), dtype=object, name="task")
        pd.DataFrame({"task_index": range(len(tasks))}, index=tasks).to_parquet(self._folder / TASKS)
        numbers = {name: np.concatenate([each[name] for each in self._numbers]) for name in self._numbers[0]}
        for name, content in ((STATS, of_columns(numbers, CAMERA, self._pixels)), (INFO, self._info())):
            (self._folder / name).write_text(json.dumps(content, indent=4) + "\n", encoding="utf-8")

    def _info(self) -> dict[str, Any]:
        return {
            "codebase_version": VERSION,
            "robot_type": "vigil",
            "total_episodes": len(self._episodes),
            "total_frames": self._frames,
            "total_tasks": len(self._tasks),
            "chunks_size": FILES_A_CHUNK,
            "data_files_size_in_mb": FILE_MB,
            "video_files_size_in_mb": FILE_MB,
            "fps": FPS,
            "splits": {"train": f"0:{len(self._episodes)}"},
            "data_path": DATA,
            "video_path": None,
            "features": self._features,
        }


def _place(file: int) -> dict[str, int]:
    """Return the index of the chunk of file number `file`, and the index of the file within the chunk."""
    chunk, index = divmod(file, FILES_A_CHUNK)
    return {"chunk_index": chunk, "file_index": index}


def of_numbers(rows: np.ndarray) -> Statistics:
    """Return the statistics of each column of `rows` (n, numbers), computed over the n rows."""
    values = rows.astype(np.float64)
    found = {
        "min": values.min(axis=0),
        "max": values.max(axis=0),
        "mean": values.mean(axis=0),
        "std": values.std(axis=0),
        **{name: np.quantile(values, share, axis=0, method="inverted_cdf") for name, share in QUANTILES.items()},
    }
    return {name: value.tolist() for name, value in found.items()} | {"count": [len(rows)]}


def pixel_counts(rgb: np.ndarray) -> np.ndarray:
    """Return for each channel of a frame (h, w, 3) how many pixels have each level 0..255; shape (3, 256)."""
    return np.stack([np.bincount(channel.ravel(), minlength=LEVELS) for channel in np.moveaxis(rgb, -1, 0)])


def of_pixels(counts: np.ndarray, frames: int) -> Statistics:
    """Return statistics of pixel levels, scaled to 0..1. `counts` (3, 256) has the pixels by level, of all frames."""
    levels = np.arange(LEVELS) / (LEVELS - 1)
    until, total = counts.cumsum(axis=1), counts.sum(axis=1)
    mean = counts @ levels / total
    deviations = (levels - mean[:, None]) ** 2
    found = {
        "min": levels[(until > 0).argmax(axis=1)],
        "max": levels[(until == total[:, None]).argmax(axis=1)],
        "mean": mean,
        "std": np.sqrt((counts * deviations).sum(axis=1) / total),
        **{name: levels[(until >= share * total[:, None]).argmax(axis=1)] for name, share in QUANTILES.items()},
    }
    return {name: value.reshape(3, 1, 1).tolist() for name, value in found.items()} | {"count": [frames]}


def of_columns(numbers: Mapping[str, np.ndarray], camera: str, counts: np.ndarray) -> dict[str, Statistics]:
    """Return column -> statistics. `numbers` has columns of numbers (n, numbers); `counts` is for column `camera`."""
    frames = len(next(iter(numbers.values())))
    return {camera: of_pixels(counts, frames), **{name: of_numbers(rows) for name, rows in numbers.items()}}
