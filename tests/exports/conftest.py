"""A small pack of two episodes a family, and runs of models on it."""

from pathlib import Path
from typing import Any

import pytest
from published import SMALL, Write, small_records, thousand, write_pack, write_run

from vigil.record import EpisodeRecord

MODEL = "vllm/Qwen/Qwen3-VL-8B-Instruct"


@pytest.fixture(scope="session")
def small_pack(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("pack")
    write_pack(folder, thousand(SMALL))
    return folder


@pytest.fixture
def write(tmp_path: Path, small_pack: Path) -> Write:
    """Writes a run on the small pack: `write(name, records, agent=..., **spec)`."""

    def run(name: str, records: dict[str, EpisodeRecord] | None = None, **facts: Any) -> Path:
        agent = facts.pop("agent", MODEL)
        planned = facts.pop("planned", sorted(small_records()))
        found = small_records() if records is None else records
        return write_run(tmp_path / name, small_pack, agent, found, planned=planned, **facts)

    return run
