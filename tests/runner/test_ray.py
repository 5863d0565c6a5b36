"""Runs whose simulators are actors of a real Ray cluster: two nodes on this machine, some of which are lost."""

import http.server
import itertools
import os
import re
import shutil
import signal
import threading
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import psutil
import pytest
from tenacity import retry, stop_after_attempt

from tests.support.chat_server import LOOK, REPORT, ChatAnswer, ChatRequest, serving
from tests.support.inspect_marks import INSPECT
from tests.support.quick_runs import quick, without_times
from tests.support.tiny_pack import tiny_pack
from vigil.errors import SettingError
from vigil.records.record import EPISODES_FILE, EpisodeRecord
from vigil.records.record_file import read_records
from vigil.runner import run as run_module
from vigil.runner.attempts import ATTEMPTS_FILE
from vigil.runner.progress import OnProgress
from vigil.runner.run import RunResult, run_pack
from vigil.runner.settings import RunSettings

pytestmark = INSPECT
NODE = {"num_cpus": 1, "object_store_memory": 80_000_000}
HEAD = {**NODE, "include_dashboard": False, "include_log_monitor": False, "no_monitor": True}
SAME = {"epochs": 2, "save_frames": True}


@pytest.fixture(scope="module")
def pack(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A pack of eight episodes."""
    folder = tmp_path_factory.mktemp("packs") / "tiny"
    tiny_pack(folder, 8)
    return folder


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    """A cluster of two nodes with one CPU each."""
    from ray.cluster_utils import Cluster  # noqa: PLC0415 - takes long to import

    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RAY_worker_niceness", "0")  # actors would else wait for all other tests
        patch.setenv("RAY_enable_worker_prestart", "0")
        patch.setenv("RAY_prestart_worker_first_driver", "0")
        found = patient(Cluster)(initialize_head=True, head_node_args=HEAD)
        patient(found.add_node)(**NODE)
        yield found
        found.shutdown()


@pytest.fixture(scope="module")
def local(pack: Path, tmp_path_factory: pytest.TempPathFactory) -> RunResult:
    """The result of a run on this machine, with frames and several epochs."""
    return run_pack(quick(pack, tmp_path_factory.mktemp("runs") / "local", agent="random", **SAME))


def patient(start: Any) -> Any:
    """A busy machine may not start a node within the 30 s that Ray gives it."""
    return retry(stop=stop_after_attempt(3), reraise=True)(start)


def on_ray(pack: Path, folder: Path, cluster: Any, **changes: Any) -> RunSettings:
    fields = {"agent": "random", "executor": "ray", "ray_address": cluster.address, "workers": None}
    return quick(pack, folder, **{**fields, **changes})


def actors() -> list[psutil.Process]:
    """Return the processes of the simulators that this process started, on all nodes."""
    return [
        process
        for process in psutil.Process().children(recursive=True)
        if process.status() != psutil.STATUS_ZOMBIE and process.name().startswith("ray::WorkerAct")
    ]


def alike(records: Sequence[EpisodeRecord]) -> list[dict[str, Any]]:
    """Return records without times and attempts."""
    return [without_times(record) | {"attempt": 1} for record in records]


def frames_of(folder: Path) -> set[str]:
    """Return the names of the frames; a worker that is killed while it writes a frame may leave an unfinished file."""
    return {file.name for file in (folder / "frames").rglob("*.png")}


def test_killed_actors_and_a_lost_node_cost_attempts_and_no_episode(
    cluster: Any, pack: Path, local: RunResult, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The run is begun on this machine, grows on the cluster while that is harmed, and is finished on this machine."""
    from vigil.runner import ray_cluster  # noqa: PLC0415 - imports Ray

    monkeypatch.setattr(ray_cluster, "PLACEMENT_TIMEOUT_S", 2.0)
    folder = tmp_path / "run"
    run_pack(quick(pack, folder, agent="random", limit=1, **SAME))
    harm = {3: kill_actors, 7: partial(lose_node, cluster)}
    on_it = run_pack(on_ray(pack, folder, cluster, limit=7, workers=3, **SAME), on_progress=at_rows(harm))
    result = run_pack(quick(pack, folder, agent="random", **SAME))
    patient(cluster.add_node)(**NODE)
    assert [(run.resumed, run.is_complete) for run in (on_it, result)] == [(2, True), (14, True)]
    assert len(read_records(folder / EPISODES_FILE)) == len(result.records) == 16
    assert result.header.spec == local.header.spec
    assert alike(result.records) == alike(local.records)
    assert frames_of(folder) == frames_of(local.folder)
    attempts = [record.attempt for record in result.records]
    assert max(attempts) > 1
    assert (folder / ATTEMPTS_FILE).read_text().count("\n") == sum(attempts)
    assert "Ray: " in "".join(file.read_text() for file in (folder / "logs").iterdir())
    assert not actors()


def at_rows(harm: dict[int, Any]) -> OnProgress:
    """Return a function whose call with that number does harm in a separate thread while the run goes on."""
    calls = itertools.count(1)

    def on_progress(_: Any) -> None:
        found = harm.get(next(calls))
        if found is not None:
            threading.Thread(target=found).start()

    return on_progress


def kill_actors() -> None:
    for process in actors():
        os.kill(process.pid, signal.SIGKILL)


def lose_node(cluster: Any) -> None:
    cluster.remove_node(list(cluster.worker_nodes)[-1], allow_graceful=False)


def test_a_node_that_is_lost_while_it_is_asked_is_left_out(
    cluster: Any, pack: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from vigil.runner import ray_cluster  # noqa: PLC0415 - imports Ray

    there = ray_cluster._nodes
    lost = {"NodeID": "ab" * 28, "NodeManagerAddress": "10.0.0.9", "Resources": {"CPU": 1.0}}
    monkeypatch.setattr(ray_cluster, "_nodes", lambda: [*there(), lost])
    assert run_pack(on_ray(pack, tmp_path / "run", cluster, limit=1)).is_complete


def test_actors_import_the_modules_that_a_run_names(
    cluster: Any, pack: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    marks = tmp_path / "marks.txt"
    (tmp_path / "leaves_a_mark.py").write_text(f"import os\nopen({str(marks)!r}, 'a').write(f'{{os.getpid()}}\\n')\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("VIGIL_IMPORT", "leaves_a_mark")
    run_pack(on_ray(pack, tmp_path / "run", cluster, limit=1))
    assert marks.read_text().split()
    assert str(os.getpid()) not in marks.read_text().split()


def test_a_model_sees_no_difference_though_a_simulator_is_killed(cluster: Any, pack: Path, tmp_path: Path) -> None:
    killed: list[int] = []
    one_at_a_time = threading.Lock()

    def brain(asked: ChatRequest) -> ChatAnswer:
        with one_at_a_time:  # two episodes may reach their third turn together
            if asked.turn == 3 and not killed:
                killed.extend(process.pid for process in actors())
                kill_actors()
        return ChatAnswer(REPORT if asked.turn == 4 else LOOK, delay_s=0.01)

    with serving(brain) as server:
        model = {"agent": None, "model": "openai/loopback", "base_url": server.url, "preflight": False, "limit": 2}
        here = run_pack(quick(pack, tmp_path / "here", **model))
        asked = len(server.asked)
        there = run_pack(on_ray(pack, tmp_path / "there", cluster, workers=1, max_connections=2, **model))
    assert len(killed) == 1
    assert len(server.asked) == 2 * asked
    assert [without_times(row) for row in there.records] == [without_times(row) for row in here.records]


def test_nodes_that_differ_stop_a_run_before_any_episode(
    cluster: Any, pack: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from vigil.runner import ray_cluster  # noqa: PLC0415 - imports Ray

    there = shutil.copytree(pack, tmp_path / "pack")
    original = ray_cluster.node_facts

    def facts(*arguments: Any) -> dict[str, str]:
        found = original(*arguments) | {"vigil": "9.9"}
        shutil.rmtree(there)
        return found

    monkeypatch.setattr(ray_cluster, "node_facts", facts)
    with pytest.raises(SettingError) as raised:
        run_pack(on_ray(there, tmp_path / "run", cluster))
    lines = str(raised.value).splitlines()
    assert len(lines) == 2
    for line in lines:
        assert re.match(r"Node \S+ \(\w{8}\) of the Ray cluster cannot play this run: vigil is \S+ there, 9\.9 ", line)
        assert f"pack {str(there)!r} is missing there" in line
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    ("address", "said"),
    [
        ("127.0.0.1:9", r"Nothing answers at Ray address '127\.0\.0\.1:9'"),
        ("127.0.0.1:99999", "Nothing answers"),
        ("127.0.0.1", "is neither HOST:PORT"),
        ("ray://127.0.0.1:10001", r"Ray Client \(ray://\) is not supported"),
    ],
)
def test_a_wrong_address_is_refused(pack: Path, tmp_path: Path, address: str, said: str) -> None:
    with pytest.raises(SettingError, match=said):
        run_pack(quick(pack, tmp_path / "run", agent="random", executor="ray", ray_address=address))
    assert not (tmp_path / "run").exists()


def test_the_address_of_something_else_is_refused(pack: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with http.server.HTTPServer(("127.0.0.1", 0), http.server.BaseHTTPRequestHandler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        monkeypatch.setenv("RAY_ADDRESS", f"127.0.0.1:{server.server_port}")
        with pytest.raises(SettingError, match="is not Ray"):
            run_pack(quick(pack, tmp_path / "run", agent="random", executor="ray"))
        server.shutdown()


def test_a_missing_ray_is_told(pack: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run_module, "find_spec", lambda _: None)
    with pytest.raises(SettingError, match=r'pip install "vigil-bench\[ray\]"'):
        run_pack(quick(pack, tmp_path / "run", agent="random", executor="ray"))
    assert not (tmp_path / "run").exists()


def test_an_address_without_the_executor_is_refused() -> None:
    with pytest.raises(SettingError, match="--ray-address needs --executor ray"):
        RunSettings(ray_address="127.0.0.1:1")
