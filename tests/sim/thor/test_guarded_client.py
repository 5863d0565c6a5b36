"""The guards: engines that end, are late or talk nonsense are errors within seconds, and leave nothing behind."""

import os
from pathlib import Path

import pytest

from tests.support.waiting import HANGS_AFTER_S
from vigil.errors import SimulatorError
from vigil.sim.conformance.reference_house import reference_house
from vigil.sim.thor.guarded_client import GuardedClient

pytest.importorskip("ai2thor", reason="ai2thor is not installed: pip install vigil-bench[thor]")
pytestmark = pytest.mark.filterwarnings("ignore")
PIPE = '"$AI2THOR_FIFO_SERVER_PIPE_PATH"'
ENGINES = {
    "ends before it connects": ("exit 7", "ended with status 7"),
    "never connects": ("exec sleep 300", "did not connect in time"),
    "connects and says nothing": (f"exec 3> {PIPE}; exec sleep 300", "did not connect in time|TimeoutError"),
    "ends in a header": (f"printf '\\001\\000' > {PIPE}", "ended with status 0"),
    "ends in an answer": (f"printf '\\001\\000\\020\\000\\000half' > {PIPE}", "ended with status 0"),
    "talks nonsense": (f"exec 3> {PIPE}; printf 'good morning' >&3; exec sleep 300", "KeyError"),
    "sends no metadata": (f"exec 3> {PIPE}; printf '\\377\\0\\0\\0\\0' >&3; exec sleep 300", "no metadata received"),
}
SHORT_S = 2.0


@pytest.fixture
def folders(monkeypatch, tmp_path) -> Path:
    """The home folder and the folder of temporary files of the client."""
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    return tmp_path


def left_in(folders: Path) -> list[str]:
    return sorted(each.name for each in folders.iterdir() if each.name not in (".ai2thor", "engine.sh"))


def children() -> set[str]:
    return {name for name in os.listdir("/proc") if name.isdigit() and _parent_of(name) == os.getpid()}


def _parent_of(process: str) -> int:
    try:
        return int(Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[1])
    except OSError:
        return -1


@pytest.mark.parametrize("case", ENGINES)
def test_a_bad_engine_is_an_error(case: str, folders: Path):
    script, message = ENGINES[case]
    engine = folders / "engine.sh"
    engine.write_text(script)
    before = children()
    patience_s = SHORT_S if "in time" in message else HANGS_AFTER_S
    with pytest.raises(SimulatorError, match=message):
        GuardedClient(reference_house().data, f"sh {engine}", start_s=patience_s, answer_s=patience_s)
    assert left_in(folders) == []
    assert children() == before


def test_an_engine_that_is_killed_is_an_error_and_another_can_be_started(folders: Path):
    from vigil.thor.launch import thor_engine  # noqa: PLC0415

    before = children()
    for _ in range(2):
        connection = GuardedClient(reference_house().data, thor_engine(backend="fake"), start_s=500.0, answer_s=500.0)
        assert connection.step("Pass")
        connection._controller.server.unity_proc.kill()
        with pytest.raises(SimulatorError, match=r"status -9|BrokenPipe"):
            connection.step("Pass")
        with pytest.raises(SimulatorError, match="has ended"):
            connection.step("Pass")
        connection.close()
    assert left_in(folders) == []
    assert children() == before


def test_a_house_that_the_engine_cannot_build_says_why(folders: Path):
    from vigil.thor.launch import thor_engine  # noqa: PLC0415

    with pytest.raises(SimulatorError, match="did not open the house: Exception creating house"):
        GuardedClient({"rooms": []}, thor_engine(backend="fake"), start_s=500.0, answer_s=500.0)
    assert left_in(folders) == []
