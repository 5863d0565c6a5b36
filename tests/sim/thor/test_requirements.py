"""What is missing for AI2-THOR's own engine is said before anything is downloaded."""

from importlib.metadata import PackageNotFoundError

import pytest

from vigil.sim.protocol import WORKER_NUMBER
from vigil.sim.thor import requirements
from vigil.sim.thor.requirements import BUILD, examine
from vigil.sim.thor.start import own_gpu


@pytest.fixture
def machine(monkeypatch, tmp_path):
    """A Linux machine with the client, and neither Vulkan nor a display."""
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.setattr(requirements, "version", lambda name: "5.0.0")
    monkeypatch.setattr(requirements.platform, "system", lambda: "Linux")
    monkeypatch.setattr(requirements.platform, "machine", lambda: "x86_64")
    monkeypatch.setattr(requirements.ctypes.util, "find_library", lambda name: None)
    return monkeypatch


def test_neither_vulkan_nor_a_display(machine):
    found = examine()
    assert len(found.missing) == 1
    assert "libvulkan1" in found.missing[0]
    assert found.client == "5.0.0"
    assert found.build == f"absent; the client would download {requirements.SOURCE}/thor-Linux64-{BUILD}.zip"


def test_a_build_that_is_there_is_named(machine, tmp_path):
    machine.setattr(requirements.ctypes.util, "find_library", lambda name: "libvulkan.so.1")
    folder = tmp_path / ".ai2thor" / "releases" / f"thor-CloudRendering-{BUILD}"
    folder.mkdir(parents=True)
    assert examine() == requirements.Findings("5.0.0", str(folder), "CloudRendering", ())


def test_no_client_another_client_another_system(machine):
    machine.setenv("DISPLAY", ":0")

    def absent(name: str) -> str:
        raise PackageNotFoundError(name)

    machine.setattr(requirements, "version", absent)
    assert examine().missing == ('the client: pip install "vigil-bench[thor]"',)
    machine.setattr(requirements, "version", lambda name: "4.3.0")
    assert "there is 4.3.0" in examine().missing[0]
    machine.setattr(requirements.platform, "machine", lambda: "arm64")
    assert "Linux on arm64" in examine().missing[1]


@pytest.mark.parametrize(("named", "expected"), [("", [None] * 3), ("1", [None] * 3), ("0,1", [0, 1, 0])])
def test_workers_take_the_gpus_in_turn(monkeypatch: pytest.MonkeyPatch, named: str, expected: list[int | None]) -> None:
    monkeypatch.setenv("CUDA_VISIBLE_DEVICES", named)
    chosen = []
    for number in range(3):
        monkeypatch.setenv(WORKER_NUMBER, str(number))
        chosen.append(own_gpu())
    assert chosen == expected
