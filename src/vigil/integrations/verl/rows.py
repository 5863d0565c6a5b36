"""Rows of a data set for verl: each row names an episode, and does not contain its goal."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar

import pyarrow as pa
import pyarrow.parquet as pq
from pydantic import ConfigDict, Field

from vigil.integrations.options import EpisodeOptions
from vigil.integrations.rewards import Shaping
from vigil.integrations.sources import EpisodeSource, bounded_rows, source_of
from vigil.packs.private import REVEAL_HELP, check_revealed

AGENT = "vigil"
"""Name of the agent loop in rows and in verl's configuration."""


class VerlOptions(Shaping, EpisodeOptions):
    """Options that select the episodes, and determine their observations, replies and rewards."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    OWNER: ClassVar[str] = "The agent loop"

    limit: int | None = Field(
        None, ge=1, description="number of rows: drawn evenly from a pack's families, or the first ones of a stream"
    )
    stream_workers: int = Field(1, ge=0, description="number of background processes that make a stream's houses")
    workers: int = Field(1, ge=1, description="number of simulator processes of each agent-loop worker")
    reveal_private_pack: bool = Field(False, description=REVEAL_HELP.removesuffix(".").lower())

    def source(self) -> EpisodeSource:
        """Return the source of the episodes. Raises SettingError or PackMismatch."""
        source = source_of(self, self.stream_workers, self.limit)
        check_revealed(
            source.public_name,
            source.is_private,
            "The data set and the logs of a trainer",
            reveals=self.reveal_private_pack,
            by="reveal_private_pack: true",
        )
        return source


def write_rows(out: str | Path, **options: Any) -> int:
    """Write one row for each episode to the Parquet file `out`; return the number of rows.

    `options` are the fields of `VerlOptions`. Raises SettingError if one is invalid or the stream is endless.
    """
    source = VerlOptions.of(options).source()
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
