"""Fixtures for tests of readers of runs: a small pack of two episodes per family, and runs of `usual_agent`."""

from pathlib import Path
from typing import Any

import pytest

from tests.support.published_runs import SMALL, Write, make_episodes, small_records, write_pack, write_run
from vigil.records.record import EpisodeRecord


@pytest.fixture(scope="session")
def small_pack(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("pack")
    write_pack(folder, make_episodes(SMALL))
    return folder


def writer(folder: Path, small_pack: Path, usual_agent: str) -> Write:
    """Return a function that writes a run on the small pack: `write(name, records, agent=..., **spec)`."""

    def run(name: str, records: dict[str, EpisodeRecord] | None = None, **facts: Any) -> Path:
        agent = facts.pop("agent", usual_agent)
        planned = facts.pop("planned", sorted(small_records()))
        found = small_records() if records is None else records
        return write_run(folder / name, small_pack, agent, found, planned=planned, **facts)

    return run


@pytest.fixture
def write(tmp_path: Path, small_pack: Path, usual_agent: str) -> Write:
    """Write a run on the small pack."""
    return writer(tmp_path, small_pack, usual_agent)
