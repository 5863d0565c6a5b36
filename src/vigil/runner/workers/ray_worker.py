"""Simulator workers as actors of a Ray cluster: the same worker, messages and watchdog, in a process that Ray starts.

Ray chooses the node and starts the process. Messages then use a direct connection between the main process and the
actor, as for a worker on this machine. Ray does not restart or retry anything: if an actor is lost with its node, its
worker counts as lost, and the run restores its live episodes.
"""

# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false
# Ray's functions are typed in part only.

import os
import secrets
import socket
import subprocess
from collections.abc import Callable, Mapping
from multiprocessing.connection import Client, Connection, Listener
from multiprocessing.reduction import ForkingPickler
from pathlib import Path
from typing import Any

import ray
from ray.exceptions import RayError

from vigil.base.imports import ENVIRONMENT_VARIABLE, import_modules_from_environment
from vigil.base.processes.child import MakeState, serve
from vigil.base.processes.worker import NoCapacity, shut_down
from vigil.errors import SettingError

PLACEMENT_TIMEOUT_S = 10.0
"""Time, in seconds, that a request waits for an actor to start; then another worker is asked."""
CPUS = 1
"""Number of the cluster's CPUs that each actor takes."""
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
