"""A server of a pack (`vigil serve`) on loopback, in a thread, and plain requests to it."""

import asyncio
import itertools
import json
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from unittest import mock

import uvicorn

from tests.support.waiting import HANGS_AFTER_S, wait_until
from tests.support.web_server import Site, WebAnswer
from vigil.integrations.serve.app import make_app
from vigil.integrations.serve.host import Host, open_host, plan_serving
from vigil.integrations.serve.messages import SESSION_HEADER
from vigil.integrations.serve.patience import server_config
from vigil.integrations.serve.settings import ServeSettings
from vigil.packs.pack import Pack
from vigil.runner.workers.messages import WorkerPlan
from vigil.runner.workers.pool import SimulatorPool
from vigil.runner.workers.worker import EpisodeWorker
from vigil.web import live_play
from vigil.web.site import Address

TURN = '{"skill_name": "navigate", "arguments": {"mode": "turn_left", "magnitude": 90}}'
REPORT = '{"skill_name": "report", "arguments": {"status": "success", "summary": "I am there."}}'
KEY = "a long secret"


class ThreadWorker:
    """Worker in a thread instead of a process, which takes seconds to start."""

    is_waiting_for_capacity = False

    def __init__(self, plan: WorkerPlan) -> None:
        self._thread = ThreadPoolExecutor(1)
        self._worker = self._thread.submit(EpisodeWorker, plan)

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        return self._thread.submit(lambda: function(self._worker.result(), *arguments))

    def close(self) -> None:
        self._thread.submit(lambda: self._worker.result().close())

    def join(self) -> None:
        self._thread.shutdown()


class ThreadPool(SimulatorPool):
    """Pool with one worker, in a thread."""

    def __init__(self, plan: WorkerPlan, workers: int, **_: Any) -> None:
        self.workers: list[Any] = [ThreadWorker(plan)]
        self._load = dict.fromkeys(self.workers, 0)
        self._sessions = itertools.count(workers)


@dataclass
class Client:
    """Plain requests to a server; `traffic` has every byte that came back."""

    host: Host
    site: Site
    server: uvicorn.Server
    thread: threading.Thread
    token: str = ""
    traffic: list[bytes] = field(default_factory=list)

    def ask(self, method: str, path: str, body: Any = None, session: str = "", **headers: str) -> WebAnswer:
        own = {"Content-Type": "application/json", **({SESSION_HEADER: session} if session else {}), **headers}
        if self.token:
            own.setdefault("Authorization", f"Bearer {self.token}")
        data = body if isinstance(body, bytes) else None if body is None else json.dumps(body).encode()
        answer = self.site.ask(method, path, data, own)
        self.traffic += [answer.body, json.dumps(answer.headers).encode()]
        return answer

    def reset(self, **body: Any) -> dict[str, Any]:
        answer = self.ask("POST", "/reset", body)
        assert answer.status == 200, answer.text
        return json.loads(answer.body)

    def step(self, session: str, text: str, **more: Any) -> dict[str, Any]:
        answer = self.ask("POST", "/step", {"action": {"text": text}, **more}, session)
        assert answer.status == 200, answer.text
        return json.loads(answer.body)

    @property
    def open_sessions(self) -> int:
        return len(self.host._sessions)

    def stop(self) -> None:
        """End the server as a signal does."""
        self.server.should_exit = True
        self.thread.join(HANGS_AFTER_S)


def open_served(pack: Pack, folder: Path, **changes: Any) -> Host:
    settings = ServeSettings(
        **{"name": "ada", "log_dir": folder, "backend": "fake", "workers": 1, "frame_interval_seconds": 0, **changes}
    )
    with mock.patch.object(live_play, "SimulatorPool", ThreadPool):
        return open_host(plan_serving(str(pack.folder), settings), settings)


@contextmanager
def serving(pack: Pack, folder: Path, token: str = "", **changes: Any) -> Iterator[Client]:
    """Serve a pack on the engine-free backend for the length of the block."""
    host = open_served(pack, folder, **changes)
    config = server_config(make_app(host, Address(port=0, token=token)), host.settings.max_sessions)
    config.port = 0
    server = uvicorn.Server(config)
    thread = threading.Thread(target=asyncio.run, args=[server.serve()], daemon=True)
    thread.start()
    wait_until(lambda: server.started, "the start of the server")
    client = Client(host, Site(server.servers[0].sockets[0].getsockname()[1]), server, thread, token)
    try:
        yield client
    finally:
        client.stop()
