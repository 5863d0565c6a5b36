"""`vigil doctor --backend thor`: which engine is chosen, and which conformance checks hold with it."""

import json
from importlib.metadata import PackageNotFoundError

import pytest
from typer.testing import CliRunner

from tests.support.thor_client import in_process
from vigil.cli import app
from vigil.errors import SettingError
from vigil.sim.conformance import moving, seeing
from vigil.sim.thor import requirements
from vigil.sim.thor.start import ENGINE_VARIABLE


def said(*options: str) -> tuple[int, dict[str, str]]:
    found = CliRunner().invoke(app, ["doctor", "--backend", "thor", "--json", *options])
    return found.exit_code, json.loads(found.stdout)


@pytest.mark.parametrize(("wanted", "name"), [("", "unity-f0825767"), ("vigil", "vigil-mujoco")])
def test_the_chosen_engine_is_named_and_what_is_missing(monkeypatch, wanted: str, name: str):
    def absent(package: str) -> str:
        raise PackageNotFoundError(package)

    def without_client(*_: object) -> None:
        raise SettingError("AI2-THOR's client is not installed.")

    monkeypatch.setenv(ENGINE_VARIABLE, wanted)
    monkeypatch.setattr(requirements, "version", absent)
    monkeypatch.setattr("vigil.sim.thor.guarded_client.GuardedClient", without_client)
    code, facts = said()
    assert code == 0
    assert facts["chosen engine"] == name
    assert "vigil-bench[thor]" in facts["missing for it"]
    tried = facts[f"client, {name} engine" if wanted else "client, our engine"]
    assert tried == "not tried: AI2-THOR's client is not installed."


def test_the_conformance_checks_are_played_on_demand(monkeypatch):
    def fails(_: object) -> None:
        raise AssertionError("as it must not be")

    monkeypatch.setattr("vigil.sim.make_simulator", lambda *_, **__: in_process())
    checks = (moving.clamps_the_pitch, seeing.sees_through_glass_but_clicks_it)
    monkeypatch.setattr("vigil.sim.conformance.checks.CHECKS", checks)
    code, facts = said("--full")
    assert code == 0
    assert facts["simulator"] == "thor/in-process"
    assert facts["clamps_the_pitch"] == "holds"
    assert facts["sees_through_glass_but_clicks_it"].startswith("fails, as expected: What is behind a pane")
    monkeypatch.setattr("vigil.sim.conformance.checks.CHECKS", (fails,))
    code, facts = said("--full")
    assert code == 1
    assert facts["fails"] == "failed: as it must not be"
