"""Rows of a data set for verl: each row names an episode, and does not contain its goal."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from vigil.integrations.options import VerlOptions
from vigil.integrations.sources import EpisodeSource, bounded_rows, row_source

AGENT = "vigil"
"""Name of the agent loop in rows and in verl's configuration."""


def source_of_options(options: VerlOptions) -> EpisodeSource:
    """Return the source of the episodes. Raises SettingError or PackMismatch."""
    return row_source(options, options.stream_workers, by="reveal_private_pack: true")


def write_rows(out: str | Path, **options: Any) -> int:
    """Write one row for each episode to the Parquet file `out`; return the number of rows.

    `options` are the fields of `VerlOptions`. Raises SettingError if one is invalid or the stream is endless.
    """
    source = source_of_options(VerlOptions.of(options))
    try:
        rows = list(_rows(source))
    finally:
        source.close()
    pq.write_table(pa.Table.from_pylist(rows), out)
    return len(rows)


def _rows(source: EpisodeSource) -> Iterator[dict[str, Any]]:
    for index, (episode, house) in enumerate(bounded_rows(source)):
        yield {
            "data_source": AGENT,
            "agent_name": AGENT,
            # verl measures its length; the agent loop sends the model the full prompt.
            "prompt": [{"role": "user", "content": episode.instruction}],
            "extra_info": {"index": index, "episode_id": episode.id, "house": house, "source": source.name},
        }
