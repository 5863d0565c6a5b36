"""A run against a server that fails in every way, one after the other, ends with the records of a calm run."""

import gc
from collections.abc import Iterator
from pathlib import Path

import pytest
from tiny_pack import tiny_pack

from sweeps.flaky_modes import MODES
from sweeps.flaky_server import Chance, compare, flaky, play

pytestmark = [
    pytest.mark.filterwarnings("ignore:The 'initial' parameter is deprecated:DeprecationWarning"),
    pytest.mark.filterwarnings("ignore:Unclosed <MemoryObject:ResourceWarning"),
    pytest.mark.filterwarnings("ignore:Pydantic serializer warnings:UserWarning"),
]
SLOW = {"stall_before", "stall_in_headers"}
"""These take as long as the client waits; `stall_mid_body` stands for them."""


@pytest.fixture(autouse=True)
def _collect() -> Iterator[None]:
    """Streams that Inspect leaves open are collected while their warnings are filtered."""
    yield
    gc.collect()


def test_no_failure_of_a_server_changes_a_record(tmp_path: Path) -> None:
    modes = tuple(mode for mode in MODES if mode not in SLOW)
    assert len(modes) >= 30
    pack = tiny_pack(tmp_path / "tiny", 16).folder
    with flaky(Chance(0.0, ())) as server:
        calm = play(pack, tmp_path / "calm", server)
    done = compare(pack, calm, Chance(0.6, modes), tmp_path / "rough")
    assert done.faults == ()
    assert set(done.met) == set(modes)
