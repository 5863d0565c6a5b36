"""`vigil thor`: the engine instead of AI2-THOR's own build, and programs that are run with it."""

import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest
from typer.testing import CliRunner

from tests.support.waiting import HANGS_AFTER_S
from vigil.cli import app
from vigil.sim.conformance.reference_house import reference_house
from vigil.sim.thor.requirements import release_folder
from vigil.sim.thor.start import ENGINE_VARIABLE, chosen_engine
from vigil.thor.install import install, run_program, uninstall

FAKE = ["--backend=fake"]


@pytest.fixture(autouse=True)
def home(monkeypatch, tmp_path) -> Path:
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.setenv(ENGINE_VARIABLE, "")
    return tmp_path / "home"


def test_what_is_installed_starts_the_engine_and_is_removed_without_a_trace(home):
    folder = install(FAKE)[0]
    assert folder == release_folder("CloudRendering")
    found = subprocess.run(
        [folder / folder.name, "-screen-width", "9"], capture_output=True, text=True, timeout=HANGS_AFTER_S, check=False
    )
    assert found.returncode == 2
    assert "started by AI2-THOR's client" in found.stderr
    assert chosen_engine().name == "vigil-mujoco"
    folder.with_name(f"{folder.name}.lock").touch()  # as the client does
    uninstall()
    assert list((home / ".ai2thor" / "releases").iterdir()) == []
    assert chosen_engine().name.startswith("unity-")
    assert uninstall() == []


def test_unitys_own_build_stays(home):
    release_folder("Linux64").mkdir(parents=True)
    found = CliRunner().invoke(app, ["thor", "install"])
    assert found.exit_code != 0
    assert "own build" in str(found.exception)
    assert uninstall() == []
    assert release_folder("Linux64").is_dir()
    assert not release_folder("CloudRendering").exists()


def test_a_program_gets_the_engine_whatever_platform_it_names(monkeypatch, tmp_path, capsys):
    class Controller:
        def __init__(self, **named: object) -> None:
            print(sorted(named), named["local_executable_path"], sys.argv)

    client = ModuleType("ai2thor.controller")
    client.Controller = Controller  # pyright: ignore[reportAttributeAccessIssue]
    monkeypatch.setitem(sys.modules, "ai2thor", ModuleType("ai2thor"))
    monkeypatch.setitem(sys.modules, "ai2thor.controller", client)
    program = tmp_path / "program.py"
    program.write_text("from ai2thor.controller import Controller\nController(platform='CloudRendering', scene='x')\n")
    start, argv = Controller.__init__, sys.argv
    run_program(program, ["--size", "3"], FAKE)
    said = capsys.readouterr().out
    assert said.startswith("['local_executable_path', 'scene'] ")
    assert "vigil.thor --backend=fake" in said
    assert "'--size', '3']" in said
    assert (Controller.__init__, sys.argv) == (start, argv)


def test_a_program_that_is_not_there_is_said():
    found = CliRunner().invoke(app, ["thor", "run", "nothing.py"])
    assert found.exit_code != 0
    assert "nothing.py is not a file" in str(found.exception)


@pytest.mark.filterwarnings("ignore")
def test_the_real_client_starts_what_is_installed(monkeypatch):
    pytest.importorskip("ai2thor", reason="ai2thor is not installed: pip install vigil-bench[thor]")
    from ai2thor.controller import Controller  # noqa: PLC0415  # pyright: ignore[reportMissingImports] - may be absent
    from ai2thor.platform import CloudRendering  # noqa: PLC0415  # pyright: ignore[reportMissingImports]

    monkeypatch.setattr(CloudRendering, "validate", lambda *_: [])  # libvulkan may be absent
    install(FAKE)
    controller = Controller(platform=CloudRendering, scene=reference_house().data)
    try:
        assert controller.step("Pass").metadata["sceneName"] == "Procedural"
    finally:
        controller.stop()
    uninstall()
