"""`vigil verify --records-only`: what can be said of a run where its simulator is not there."""

import json
from pathlib import Path

import pytest

from tests.support.commands import Vigil
from tests.support.quick_runs import claim
from tests.support.tiny_pack import tiny_pack
from vigil.records.record import EPISODES_FILE, HEADER_FILE
from vigil.sim.thor import start


@pytest.fixture
def run(vigil: Vigil, tmp_path: Path) -> Path:
    """A run of two episodes."""
    pack = tiny_pack(tmp_path / "tiny", 2)
    folder = tmp_path / "run"
    played = vigil(
        *("run", "--pack", pack.folder, "--backend", "fake", "--workers", "1", "--agent", "random"), "--log-dir", folder
    )
    assert played.code == 0, played.err
    return folder


def of_thor(run: Path, version: str) -> None:
    """Makes a header say that AI2-THOR played."""
    header = json.loads((run / HEADER_FILE).read_text())
    header["spec"]["simulator"], header["simulator_version"] = "thor", version
    (run / HEADER_FILE).write_text(json.dumps(header))
    claim(run)


def test_records_are_checked_without_a_simulator(vigil: Vigil, run: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vigil.runner.verify_run.SimulatorPool", None)  # a call would raise
    said = vigil("verify", run, "--records-only")
    assert said.code == 0, said.err
    assert (
        "2 records checked (identities, prompts, budgets, ends; replies were parsed again): 0 differences"
    ) in said.out
    assert "Not checked, because this needs the simulator (fake/1): poses, states" in said.out


def test_an_action_that_its_reply_does_not_say_is_a_difference(vigil: Vigil, run: Path) -> None:
    rows = [json.loads(line) for line in (run / EPISODES_FILE).read_text().splitlines()]
    step = next(step for step in rows[0]["steps"] if (step["action"] or {}).get("skill_name") == "navigate")
    step["action"]["magnitude"] += 1
    (run / EPISODES_FILE).write_text("".join(json.dumps(row) + "\n" for row in rows))
    said = vigil("verify", run, "--records-only")
    assert said.code == 1
    assert f"step {step['index']}: action: recorded Navigate(" in said.out
    assert "replies were parsed again): 1 differences" in said.out


def test_frames_need_a_simulator(vigil: Vigil, run: Path) -> None:
    said = vigil("verify", run, "--records-only", "--frames")
    assert said.code == 2
    assert "Give either --frames or --records-only" in said.err


def test_a_run_of_another_engine_is_not_played_again(vigil: Vigil, run: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(start.ENGINE_VARIABLE, "vigil:fake")
    of_thor(run, "thor/5.0.0 unity-f0825767 masks")
    said = vigil("verify", run)
    assert said.code == 2
    assert "the run was played. That engine is 'thor/5.0.0 unity-f0825767 masks'" in said.err
    assert "chooses 'thor/5.0.0 vigil-fake masks' here. --records-only checks what needs no simulator" in said.err
    assert vigil("verify", run, "--records-only").code == 0


def test_a_run_of_unity_says_what_is_missing_and_what_can_be_done(
    vigil: Vigil, run: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv(start.ENGINE_VARIABLE, raising=False)
    of_thor(run, start.simulator_name(start.chosen_engine()))
    monkeypatch.setattr(start, "examine", _Nothing)
    said = vigil("verify", run)
    assert said.code == 2
    assert "AI2-THOR's own engine cannot run here, because this is missing: a display. " in said.err
    assert "--records-only checks what needs no simulator" in said.err


class _Nothing:
    platform, missing = "", ("a display",)
