"""A run against a server that fails in every way, one after the other, ends with the records of a calm run."""

from pathlib import Path

import pytest

from sweeps.flaky_server import FailurePlan, compare, flaky, play
from sweeps.support.flaky_modes import MODES
from tests.support.inspect_marks import INSPECT
from tests.support.tiny_pack import tiny_pack

pytestmark = [*INSPECT, pytest.mark.filterwarnings("ignore:Pydantic serializer warnings:UserWarning")]
SLOW = {"stall_before", "stall_in_headers"}
"""These take as long as the client waits; `stall_mid_body` stands for them."""


def test_no_failure_of_a_server_changes_a_record(tmp_path: Path) -> None:
    modes = tuple(mode for mode in MODES if mode not in SLOW)
    assert len(modes) >= 30
    pack = tiny_pack(tmp_path / "tiny", 24).folder
    with flaky(FailurePlan(0.0, ())) as server:
        reference = play(pack, tmp_path / "calm", server)
    done = compare(pack, reference, FailurePlan(0.6, modes), tmp_path / "rough")
    assert done.faults == ()
    assert set(done.mode_counts) == set(modes)
