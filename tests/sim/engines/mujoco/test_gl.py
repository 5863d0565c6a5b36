import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.waiting import HANGS_AFTER_S
from vigil.errors import SimulatorError
from vigil.sim.engines.mujoco.compiled import gl


@pytest.fixture
def libraries(monkeypatch: pytest.MonkeyPatch) -> set[str]:
    """The libraries that can be loaded; the test fills it."""
    present: set[str] = set()
    monkeypatch.setattr(gl, "_loads", lambda name: name in present)
    monkeypatch.setattr(gl, "_egl_devices", lambda: 1)
    monkeypatch.setattr(gl.sys, "platform", "linux")
    monkeypatch.setenv("MUJOCO_GL", "")
    for name in [name for name in os.environ if name.startswith(gl._READ_BY_OPENGL) and name != "MUJOCO_GL"]:
        monkeypatch.delenv(name)
    return present


def test_egl_comes_first(libraries: set[str]) -> None:
    libraries |= {"libEGL.so.1", "libGL.so.1", "libOSMesa.so.8"}
    assert gl.choose_backend() == gl.GLBackend("egl")
    assert os.environ["MUJOCO_GL"] == "egl"


def test_osmesa_stands_in_when_egl_is_incomplete(libraries: set[str]) -> None:
    libraries |= {"libEGL.so.1", "libOSMesa.so.8"}
    assert gl.choose_backend().name == "osmesa"
    assert os.environ["MUJOCO_GL"] == "osmesa"


def test_egl_without_a_device_does_not_count(libraries: set[str], monkeypatch: pytest.MonkeyPatch) -> None:
    libraries |= {"libEGL.so.1", "libGL.so.1", "libOSMesa.so.8"}
    monkeypatch.setattr(gl, "_egl_devices", lambda: 0)
    assert gl.choose_backend().name == "osmesa"


def test_without_a_library_mujoco_still_loads_and_the_packages_are_named(libraries: set[str]) -> None:
    assert not libraries
    backend = gl.choose_backend()
    assert os.environ["MUJOCO_GL"] == "disable"
    with pytest.raises(SimulatorError, match=r"libegl1 and libgl1.*libosmesa6"):
        gl.demand(backend)


def test_a_users_choice_is_kept(libraries: set[str], monkeypatch: pytest.MonkeyPatch) -> None:
    libraries |= {"libEGL.so.1", "libGL.so.1", "libOSMesa.so.8"}
    monkeypatch.setenv("MUJOCO_GL", "osmesa")
    assert gl.choose_backend() == gl.GLBackend("osmesa", is_chosen_by_user=True)
    assert os.environ["MUJOCO_GL"] == "osmesa"


def test_a_users_choice_that_cannot_work_is_explained(libraries: set[str], monkeypatch: pytest.MonkeyPatch) -> None:
    libraries |= {"libEGL.so.1", "libGL.so.1"}
    monkeypatch.setenv("MUJOCO_GL", "osmesa")
    with pytest.raises(SimulatorError, match=r"MUJOCO_GL is set to 'osmesa', but .*libOSMesa"):
        gl.demand(gl.choose_backend())


def test_drawing_switched_off_is_said(libraries: set[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MUJOCO_GL", "off")
    with pytest.raises(SimulatorError, match="unset it"):
        gl.demand(gl.choose_backend())


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"MUJOCO_GL": "wgl"}, "MUJOCO_GL is set to 'wgl', .* egl or osmesa, or unset it"),
        ({"PYOPENGL_PLATFORM": "glx"}, "PYOPENGL_PLATFORM is set to 'glx', .* egl or osmesa, or unset it"),
        ({"MUJOCO_GL": "EGL", "PYOPENGL_PLATFORM": "osmesa"}, "PYOPENGL_PLATFORM is set to 'osmesa', .* unset one"),
        ({"PYOPENGL_PLATFORM": "osmesa"}, "PYOPENGL_PLATFORM is set to 'osmesa', but .*libOSMesa.*unset it"),
        ({"MUJOCO_EGL_DEVICE_ID": "abc"}, "MUJOCO_EGL_DEVICE_ID is set to 'abc', .* unset it"),
        ({"MUJOCO_EGL_DEVICE_ID": ""}, "MUJOCO_EGL_DEVICE_ID is set to '', .* unset it"),
        ({"MUJOCO_GL": "egl", "MUJOCO_EGL_DEVICE_ID": "-1"}, "MUJOCO_EGL_DEVICE_ID is set to '-1', .* unset it"),
    ],
)
def test_a_setting_that_cannot_be_is_named(
    libraries: set[str], monkeypatch: pytest.MonkeyPatch, settings: dict[str, str], message: str
) -> None:
    libraries |= {"libEGL.so.1", "libGL.so.1"}
    for name, value in settings.items():
        monkeypatch.setenv(name, value)
    with pytest.raises(SimulatorError, match=message):
        gl.demand(gl.choose_backend())
    assert os.environ["MUJOCO_GL"] == "disable"


def test_what_the_environment_says_stands_beside_a_missing_library(
    libraries: set[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    libraries |= {"libEGL.so.1", "libGL.so.1"}
    monkeypatch.setattr(gl, "_egl_devices", lambda: 0)
    monkeypatch.setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/none.json")
    with pytest.raises(SimulatorError, match=r"='/none.json'. Unset what you did not intend"):
        gl.demand(gl.choose_backend())


def vigil_in(settings: dict[str, str], *arguments: str) -> subprocess.CompletedProcess[str]:
    """Runs a command in an environment that says nothing to OpenGL but `settings`."""
    plain = {name: value for name, value in os.environ.items() if not name.startswith(gl._READ_BY_OPENGL)}
    plain.pop("DISPLAY", None)
    command = [sys.executable, "-c", "from vigil.cli import main; main()", *arguments]
    return subprocess.run(
        command, env=plain | settings, capture_output=True, text=True, check=False, timeout=HANGS_AFTER_S
    )


@pytest.mark.usefixtures("drawing")
@pytest.mark.parametrize(
    "settings",
    [
        {"GALLIUM_DRIVER": "softpipe"},  # has no multisampling
        {"GALLIUM_DRIVER": "nosuch"},
        {"LIBGL_DRIVERS_PATH": "/nonexistent"},
        {"MUJOCO_EGL_DEVICE_ID": "99"},
        {"MUJOCO_GL": "glfw"},
        {"MUJOCO_GL": "wgl"},
        {"PYOPENGL_PLATFORM": "glx"},
    ],
)
def test_the_doctor_draws_or_names_the_setting(settings: dict[str, str]) -> None:
    """On another machine a driver may do without a variable: then it draws."""
    found = vigil_in(settings, "doctor")
    assert "Traceback" not in found.stderr
    fault = next(line for line in found.stdout.splitlines() if line.startswith("fault "))
    if found.returncode == 0:
        assert fault.split() == ["fault", "none"]
    else:
        assert found.returncode == 1
        for name, value in settings.items():
            assert name in fault
            assert repr(value) in fault


def test_processes_that_are_started_inherit_the_users_own_setting() -> None:
    program = (
        "import os, vigil.sim.engines.mujoco.compiled.binding as binding;"
        "print(binding.BACKEND.fault is None, os.environ.get('MUJOCO_GL'))"
    )
    environment = {name: value for name, value in os.environ.items() if name != "MUJOCO_GL"}
    for given, expected in ((None, "None"), ("off", "off")):
        env = environment if given is None else environment | {"MUJOCO_GL": given}
        said = subprocess.check_output([sys.executable, "-c", program], env=env, text=True, timeout=HANGS_AFTER_S)
        assert said.split()[1] == expected


@pytest.mark.usefixtures("drawing")
def test_a_run_that_cannot_draw_stops_before_it_plays(tmp_path: Path) -> None:
    """Agents that see frames need OpenGL; the first frame is drawn before anything is recorded."""
    folder = tmp_path / "run"
    plays = ["run", "--pack", "vigil_smoke_v6", "--limit", "2", "--workers", "1", "--log-dir", str(folder)]
    found = vigil_in({"MUJOCO_GL": "wgl"}, *plays, "--agent", f"exec:{sys.executable} -c pass")
    assert found.returncode == 1
    assert "MUJOCO_GL is set to 'wgl'" in found.stderr
    assert not (folder / "episodes.jsonl").exists() or not (folder / "episodes.jsonl").read_text()
