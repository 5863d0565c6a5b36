import os

import pytest

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
    return present


def test_egl_comes_first(libraries: set[str]) -> None:
    libraries |= {"libEGL.so.1", "libGL.so.1", "libOSMesa.so.8"}
    assert gl.prepare() == gl.GLBackend("egl")
    assert os.environ["MUJOCO_GL"] == "egl"


def test_osmesa_stands_in_when_egl_is_incomplete(libraries: set[str]) -> None:
    libraries |= {"libEGL.so.1", "libOSMesa.so.8"}
    assert gl.prepare().name == "osmesa"
    assert os.environ["MUJOCO_GL"] == "osmesa"


def test_egl_without_a_device_does_not_count(libraries: set[str], monkeypatch: pytest.MonkeyPatch) -> None:
    libraries |= {"libEGL.so.1", "libGL.so.1", "libOSMesa.so.8"}
    monkeypatch.setattr(gl, "_egl_devices", lambda: 0)
    assert gl.prepare().name == "osmesa"


def test_without_a_library_mujoco_still_loads_and_the_packages_are_named(libraries: set[str]) -> None:
    assert not libraries
    backend = gl.prepare()
    assert os.environ["MUJOCO_GL"] == "disable"
    with pytest.raises(SimulatorError, match=r"libegl1 and libgl1.*libosmesa6"):
        gl.demand(backend)


def test_a_users_choice_is_kept(libraries: set[str], monkeypatch: pytest.MonkeyPatch) -> None:
    libraries |= {"libEGL.so.1", "libGL.so.1", "libOSMesa.so.8"}
    monkeypatch.setenv("MUJOCO_GL", "osmesa")
    assert gl.prepare() == gl.GLBackend("osmesa", is_chosen_by_user=True)
    assert os.environ["MUJOCO_GL"] == "osmesa"


def test_a_users_choice_that_cannot_work_is_explained(libraries: set[str], monkeypatch: pytest.MonkeyPatch) -> None:
    libraries |= {"libEGL.so.1", "libGL.so.1"}
    monkeypatch.setenv("MUJOCO_GL", "osmesa")
    with pytest.raises(SimulatorError, match=r"MUJOCO_GL is set to 'osmesa', but .*libOSMesa"):
        gl.demand(gl.prepare())


def test_drawing_switched_off_is_said(libraries: set[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MUJOCO_GL", "off")
    with pytest.raises(SimulatorError, match="unset it"):
        gl.demand(gl.prepare())
