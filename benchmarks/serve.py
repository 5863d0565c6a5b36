"""Measures a server under load: many sessions at once, errors, and the time that the server adds to the simulator's.

    python benchmarks/serve.py --sessions 32 --steps 12 --pack starter --backend mujoco

The clients run in a process of their own. For each reply, the added time is the time from the arrival of the request
to the end of its answer, without the time in which the episode was queued or played in a simulator worker. The CPU time
of a reply is that of the server's thread, with its start and the resets; it does not depend on what else runs.
"""

import argparse
import asyncio
import json
import tempfile
import threading
import time
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from contextvars import ContextVar
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import uvicorn

from vigil.errors import VigilError
from vigil.integrations.serve.app import make_app
from vigil.integrations.serve.client import RemoteEnvironment, SessionEnded
from vigil.integrations.serve.host import open_host, plan_serving
from vigil.integrations.serve.patience import server_config
from vigil.integrations.serve.settings import ServeSettings
from vigil.runner.workers.pool import LiveEpisode
from vigil.web.site import Address

TURN = {"text": '{"skill_name": "navigate", "arguments": {"mode": "turn_left", "magnitude": 30}}'}
advance = LiveEpisode.advance
simulated: ContextVar[list[float]] = ContextVar("simulated")
"""Seconds that the simulator's worker needed for the current request."""


async def timed_advance(self: LiveEpisode, reply: Any) -> Any:
    began = time.perf_counter()
    try:
        return await advance(self, reply)
    finally:
        simulated.get([]).append(time.perf_counter() - began)


class Timed:
    """Application that notes, for each reply, the time that it took beside the simulator's."""

    def __init__(self, app: Any) -> None:
        self._app, self.added_ms = app, []

    async def __call__(self, scope: Any, receive: Any, send: Any) -> None:
        spent: list[float] = []
        simulated.set(spent)
        began = time.perf_counter()
        await self._app(scope, receive, send)
        if scope.get("path") == "/step":
            self.added_ms.append(1000 * (time.perf_counter() - began - sum(spent)))


def play(server: RemoteEnvironment, steps: int) -> int:
    """Play one episode; return the number of errors."""
    try:
        episode = server.reset()
        assert episode is not None
        for moment in range(steps):
            if server.step(episode._session, moment, TURN)["done"]:
                break
    except (VigilError, SessionEnded):
        return 1
    return 0


def play_all(url: str, sessions: int, steps: int) -> int:
    server = RemoteEnvironment(url)
    with ThreadPoolExecutor(sessions) as pool:
        return sum(pool.map(lambda _: play(server, steps), range(sessions)))


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--sessions", type=int, default=32)
    parser.add_argument("--steps", type=int, default=12)
    parser.add_argument("--pack", default="starter")
    parser.add_argument("--backend", default="mujoco")
    parser.add_argument("--workers", type=int, default=2)
    given = parser.parse_args()
    LiveEpisode.advance = timed_advance
    with tempfile.TemporaryDirectory() as folder, ProcessPoolExecutor(1, get_context("spawn")) as clients:
        settings = ServeSettings(
            name="load",
            log_dir=Path(folder) / "run",
            backend=given.backend,
            workers=given.workers,
            max_sessions=given.sessions,
            frame_interval_seconds=0,
            epochs=given.sessions,
        )
        host = open_host(plan_serving(given.pack, settings), settings)
        timed = Timed(make_app(host, Address()))
        config = server_config(timed, given.sessions)
        config.port = 0
        server = uvicorn.Server(config)
        cpu_s: list[float] = []

        def run() -> None:
            asyncio.run(server.serve())
            cpu_s.append(time.thread_time())

        thread = threading.Thread(target=run)
        thread.start()
        while not server.started:
            time.sleep(0.05)
        url = f"http://127.0.0.1:{server.servers[0].sockets[0].getsockname()[1]}"
        began = time.perf_counter()
        errors = clients.submit(play_all, url, given.sessions, given.steps).result()
        took = time.perf_counter() - began
        server.should_exit = True
        thread.join()
    p50, p99 = np.percentile(timed.added_ms, [50, 99])
    facts = {"sessions": given.sessions, "replies": len(timed.added_ms), "errors": errors, "seconds": round(took, 1)}
    facts["cpu_ms_a_reply"] = round(1000 * cpu_s[0] / len(timed.added_ms), 1)
    print(json.dumps({**facts, "added_ms_p50": round(p50, 1), "added_ms_p99": round(p99, 1)}))


if __name__ == "__main__":
    main()
