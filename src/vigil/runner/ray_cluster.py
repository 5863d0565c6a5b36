"""Ray clusters: the connection, the check of each node before any episode starts, and workers as actors.

A worker is the same as on this machine, with the same messages and watchdog, in a process that Ray starts on a node of
its choice. Messages use a direct connection between the main process and the actor. Ray does not restart or retry
anything: if an actor is lost with its node, its worker counts as lost, and the run restores its live episodes.
"""

# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false
# Ray's functions are typed in part only.

import hashlib
import logging
import os
import secrets
import socket
import subprocess
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from importlib.metadata import version
from multiprocessing.connection import Client, Connection, Listener
from multiprocessing.reduction import ForkingPickler
from pathlib import Path
from typing import Any

import ray
from ray.exceptions import RayError
from ray.util.scheduling_strategies import NodeAffinitySchedulingStrategy

import vigil
from vigil import __version__
from vigil.agents.exec_agent import file_hashes
from vigil.agents.registry import is_exec
from vigil.base.files import file_sha256
from vigil.base.imports import ENVIRONMENT_VARIABLE, import_modules_from_environment
from vigil.base.processes.child import MakeState, serve
from vigil.base.processes.worker import NoCapacity, StartProcess, shut_down
from vigil.errors import MAX_FAULT_CHARS, InputError, SettingError, shorten
from vigil.packs.pack import PACKAGED, find_pack, manifest_sha256
from vigil.records.record import read_header
from vigil.runner.workers.messages import WorkerPlan

CONNECT_TIMEOUT_S = 10.0
"""Time, in seconds, that a cluster's address may take to answer."""
PLACEMENT_TIMEOUT_S = 10.0
"""Time, in seconds, that a request waits for an actor to start; then another worker is asked."""
CPUS = 1
"""Number of the cluster's CPUs that each actor takes."""
NODE_TIMEOUT_S = 120.0
"""Time, in seconds, that a node may take to report its facts."""
HTTP2_PREFACE = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"
"""First bytes that a Ray client sends; Ray answers them in binary, other servers in text."""
MAX_LISTED = 5
"""Maximum number of unfit nodes that a message names."""
MISSING = "missing"
"""Value of a fact about a file that a node does not have."""
_HASH_DIGITS = 12


@contextmanager
def connect_cluster(
    address: str | None, plan: WorkerPlan
) -> Generator[tuple[WorkerPlan, int, StartProcess], None, None]:
    """Connect to the cluster at `address`, or else at RAY_ADDRESS, or else on this machine; if there is none, start a
    cluster.

    Yields the plan for workers on its nodes, the number of workers for which it has CPUs, and the function that starts
    a worker's process. Raises SettingError when no cluster answers, or when one of its nodes cannot play the run.
    """
    was_connected = ray.is_initialized()
    if not was_connected:
        _connect(address or os.environ.get("RAY_ADDRESS"))
    try:
        plan = replace(
            plan,
            pack=plan.pack and (Path(plan.pack.name) if plan.pack.parent == PACKAGED else plan.pack.absolute()),
            asset_database=plan.asset_database and plan.asset_database.absolute(),
            frames=plan.frames and plan.frames.absolute(),
        )
        check = partial(node_objection, plan, Path.cwd(), node_facts(plan, Path.cwd()))
        _check_nodes(_nodes(), check)
        cpus = sum(int(node["Resources"]["CPU"]) // CPUS for node in _nodes())
        yield plan, cpus, partial(RayProcess, check)
    finally:
        if not was_connected:
            ray.shutdown()


def node_facts(plan: WorkerPlan, folder: Path) -> dict[str, str]:
    """Return the facts that must be the same on each node; `folder` is where the run was started."""
    facts = {"vigil": __version__, "vigil's code": _code_sha256()[:_HASH_DIGITS]}
    facts |= {name: version(name) for name in ("numpy", "mujoco")}
    if pack := plan.pack:
        facts[f"pack {str(pack)!r}"] = _or_missing(lambda: manifest_sha256(find_pack(pack))[:_HASH_DIGITS])
    if assets := plan.asset_database:
        name = repr(str(assets))
        facts[f"asset database {name}"] = _or_missing(lambda: file_sha256(assets, name)[:_HASH_DIGITS])
    if is_exec(plan.agent):
        facts |= {
            f"program file {name!r}": sha256[:_HASH_DIGITS] for name, sha256 in file_hashes(plan.agent, folder).items()
        }
    if plan.frames is not None:
        run = plan.frames.parent  # the same text identifies the run on all machines that share the folder
        begun = _or_missing(lambda: f"of the run begun {read_header(run).started.isoformat()}")
        facts[f"folder {str(run)!r}, for --save-frames"] = begun
    return facts


def node_objection(plan: WorkerPlan, folder: Path, wanted: Mapping[str, str]) -> str:
    """Return a sentence that says how this node differs from the facts in `wanted`; empty when it does not differ."""
    found = node_facts(plan, folder)
    wrong = [
        f"{name} is {found.get(name, MISSING)} there, {value} here"
        for name, value in wanted.items()
        if found.get(name) != value
    ]
    if not wrong:
        return ""
    name = f"{ray.util.get_node_ip_address()} ({ray.get_runtime_context().get_node_id()[:8]})"
    return f"Node {name} of the Ray cluster cannot play this run: {'; '.join(wrong)}. Make both the same."


def _connect(address: str | None) -> None:
    """Connect Ray to `address`; with None, to any cluster. Raises SettingError when no cluster answers."""
    where = "A local Ray" if address is None else f"Ray at {address!r}"
    if address not in (None, "auto", "local"):
        _check_answers(address)
    try:
        ray.init(address, include_dashboard=False, log_to_driver=False, logging_level=logging.ERROR)
    except SystemExit:
        raise SettingError(f"{where} does not answer like a Ray cluster. `ray start` prints the right port.") from None
    except (OSError, ValueError, RuntimeError, RayError) as error:
        raise SettingError(f"{where} cannot be used: {shorten(str(error), MAX_FAULT_CHARS)}") from None


def _check_answers(address: str) -> None:
    """Raise SettingError unless Ray answers at `address`. This is quick; Ray itself would try for two minutes."""
    host, _, port = address.rpartition(":")
    if not host or not port.isdecimal() or "/" in host:
        raise SettingError(
            f"Ray address {address!r} is neither HOST:PORT, e.g. 10.0.0.1:6379, as `ray start` prints it, nor auto. "
            "Ray Client (ray://) is not supported: give the command on a node of the cluster."
        )
    try:
        with socket.create_connection((host, int(port)), timeout=CONNECT_TIMEOUT_S) as line:
            line.sendall(HTTP2_PREFACE)
            answer = line.recv(1)
    except (OSError, OverflowError) as error:
        raise SettingError(f"Nothing answers at Ray address {address!r} ({error}). Is `ray start` running?") from None
    if answer >= b" ":
        raise SettingError(f"The server at Ray address {address!r} is not Ray. `ray start` prints the right port.")


def _nodes() -> list[dict[str, Any]]:
    """Return the nodes that can hold a simulator. Raises SettingError when there are none."""
    nodes: list[dict[str, Any]] = ray.nodes()
    found = [node for node in nodes if node["Alive"] and node["Resources"].get("CPU", 0) >= CPUS]
    if not found:
        raise SettingError("No node of the Ray cluster has a CPU for a simulator. Add one with `ray start`.")
    return found


def _check_nodes(nodes: list[dict[str, Any]], check: partial[str]) -> None:
    """Raise SettingError when a node cannot play the run. All nodes are asked at once; a lost node is left out."""
    asked = ray.remote(num_cpus=0, max_retries=0)(node_objection)
    coming: list[tuple[dict[str, Any], Any]] = []
    for node in nodes:
        on_it = NodeAffinitySchedulingStrategy(node["NodeID"], soft=False)
        coming.append((node, asked.options(scheduling_strategy=on_it).remote(*check.args)))
    wrong: list[str] = []
    for node, answer in coming:
        try:
            wrong.append(ray.get(answer, timeout=NODE_TIMEOUT_S))
        except RayError as error:
            if all(other["NodeID"] != node["NodeID"] for other in ray.nodes() if other["Alive"]):
                continue
            why = shorten(str(error).strip().splitlines()[-1], MAX_FAULT_CHARS)
            name = f"{node['NodeManagerAddress']} ({node['NodeID'][:8]})"
            wrong.append(f"Node {name} of the Ray cluster cannot run vigil {__version__}: {why}")
    wrong = [each for each in wrong if each]
    if wrong:
        more = [f"There are {len(wrong) - MAX_LISTED} more such nodes."] if len(wrong) > MAX_LISTED else []
        raise SettingError("\n".join((*wrong[:MAX_LISTED], *more)))


def _code_sha256() -> str:
    """Return a hash of all Python files of the package. It must be equal on all nodes."""
    root = Path(vigil.__file__).parent
    digest = hashlib.sha256()
    for file in sorted(root.rglob("*.py")):
        digest.update(f"{file.relative_to(root)}\n{hashlib.sha256(file.read_bytes()).hexdigest()}\n".encode())
    return digest.hexdigest()


def _or_missing(read: Callable[[], str]) -> str:
    """Return a fact about a file; MISSING when the file cannot be read."""
    try:
        return read()
    except InputError:
        return MISSING


NodeCheck = Callable[[], str]
"""Function that runs on a node and returns why the node cannot play the run; empty if it can. It must be picklable."""


class WorkerActor:
    """Ray actor with a worker in its process."""

    def __init__(self, environment: dict[str, str], folder: str) -> None:
        """The node's own environment overrides `environment`; `folder` is where the run was started."""
        os.environ.update({**environment, **os.environ})
        if os.path.isdir(folder):
            os.chdir(folder)

    def listen(self, key: bytes, node_check: NodeCheck) -> tuple[str, tuple[str, int], int]:
        """Return the fault of this node (empty if there is none), the address to connect to, and the process id."""
        self._listener = Listener((ray.util.get_node_ip_address(), 0), authkey=key)
        host, port = self._listener.address
        try:
            import_modules_from_environment()
        except SettingError as error:
            return f"Node {host} of the Ray cluster: {error}", (str(host), int(port)), os.getpid()
        return node_check(), (str(host), int(port)), os.getpid()

    def serve(self) -> None:
        """Answer requests until the main process closes the connection."""
        with self._listener:
            connection = self._listener.accept()
        _send_at_once(connection)
        serve(connection, connection.recv_bytes())


class RayProcess:
    """Worker in an actor; implements `vigil.base.processes.worker.WorkerProcess`."""

    def __init__(
        self, node_check: NodeCheck, make_state: MakeState, log: Path | None, environment: Mapping[str, str]
    ) -> None:
        """Ask Ray for an actor. `log` gets Ray's message about the actor's end; standard error goes to Ray's logs."""
        variables = {**environment, "LP_NUM_THREADS": str(CPUS), "OPENBLAS_NUM_THREADS": str(CPUS)}
        if ENVIRONMENT_VARIABLE in os.environ:  # the node has a different environment
            variables[ENVIRONMENT_VARIABLE] = os.environ[ENVIRONMENT_VARIABLE]
        actor = ray.remote(WorkerActor).options(
            num_cpus=CPUS, max_restarts=0, max_task_retries=0, scheduling_strategy="SPREAD"
        )
        self.pid: int | None = None
        self._log = log
        self._make_state = ForkingPickler.dumps(make_state)
        self._key = secrets.token_bytes(32)
        self._actor: Any = actor.remote(variables, str(Path.cwd()))
        self._listen_ref = self._actor.listen.remote(self._key, node_check)
        self._serve_ref = self._actor.serve.remote()
        self._connection: Connection | None = None
        self._is_ended = False

    @property
    def has_started(self) -> bool:
        """Whether the actor has started or failed to start."""
        return _is_ready(self._listen_ref, 0.0)

    def connect(self) -> Connection:
        """Return the connection to the actor. Raises NoCapacity, OSError, or SettingError if its node is unfit."""
        if not _is_ready(self._listen_ref, PLACEMENT_TIMEOUT_S):
            raise NoCapacity("The Ray cluster has no free CPU for a simulator; `ray status` shows what uses its CPUs.")
        try:
            wrong, address, self.pid = ray.get(self._listen_ref)
            if wrong:
                raise SettingError(wrong)
            connection = Client(address, authkey=self._key)
            connection.send_bytes(self._make_state)
        except (RayError, OSError) as error:
            self._note(f"The actor cannot be reached: {error}")
            raise ConnectionError from None
        _send_at_once(connection)
        self._connection = connection
        return connection

    def wait(self, timeout: float | None = None) -> None:
        """Wait until the worker has exited, and free its CPU. Raises subprocess.TimeoutExpired."""
        if self._is_ended:
            return
        if self._connection is not None and not _is_ready(self._serve_ref, timeout):
            raise subprocess.TimeoutExpired("Ray actor", timeout or 0.0)
        if self._connection is not None:
            try:
                ray.get(self._serve_ref)
            except RayError as error:
                self._note(str(error))
        self.kill()

    def terminate(self) -> None:
        """Ask the worker to exit and to end its agents' programs. If the actor has not started yet, it is cancelled."""
        if self._connection is None:
            self.kill()
        else:
            shut_down(self._connection)

    def kill(self) -> None:
        """Kill the actor."""
        if not self._is_ended:
            self._is_ended = True
            ray.kill(self._actor)

    def _note(self, text: str) -> None:
        if self._log is not None:
            with self._log.open("ab") as file:
                file.write(f"Ray: {text.strip()}\n".encode())


def _is_ready(coming: Any, timeout: float | None) -> bool:
    return bool(ray.wait([coming], timeout=timeout)[0])


def _send_at_once(connection: Connection) -> None:
    """Make a TCP connection send a small message at once, instead of waiting for more data."""
    with socket.socket(fileno=os.dup(connection.fileno())) as line:
        line.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
