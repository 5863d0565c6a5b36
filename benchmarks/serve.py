"""Measures a server under load: 32 sessions at once, errors, and the time that the server adds to the simulator's.

    python benchmarks/serve.py --sessions 32 --steps 12 --pack starter --backend mujoco

For each reply, the added time is the time that a client waited, without the time in which its episode was queued or
played in a simulator worker.
"""

import argparse
import asyncio
import json
import tempfile
import threading
import time
from collections import defaultdict
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import uvicorn

from vigil.runner.workers.pool import LiveEpisode
from vigil.serve.app import make_app
from vigil.serve.client import RemoteEnvironment
from vigil.serve.host import open_host
from vigil.serve.patience import server_config
from vigil.serve.settings import ServeSettings, plan_serving
from vigil.web.site import Address

TURN = {"text": '{"skill_name": "navigate", "arguments": {"mode": "turn_left", "magnitude": 30}}'}
_advance = LiveEpisode.advance
simulated: dict[str, list[float]] = defaultdict(list)
"""Episode -> seconds of each of its replies in the simulator's worker, with the time in the worker's queue."""


async def timed_advance(self: LiveEpisode, reply):
    began = time.perf_counter()
    try:
        return await _advance(self, reply)
    finally:
        simulated[self.assignment.episode.instruction].append(time.perf_counter() - began)


def play(server: RemoteEnvironment, steps: int) -> tuple[str, list[float], int]:
    """Play one episode; return its instruction, the seconds of each reply, and the number of errors."""
    episode = server.reset()
    assert episode is not None
    waited: list[float] = []
    errors = 0
    for moment in range(steps):
        began = time.perf_counter()
        try:
            answer = server.step(episode._session, moment, TURN)
        except Exception:
            errors += 1
            break
        waited.append(time.perf_counter() - began)
        if answer["done"]:
            break
    return episode.instruction, waited, errors


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--sessions", type=int, default=32)
    parser.add_argument("--steps", type=int, default=12)
    parser.add_argument("--pack", default="starter")
    parser.add_argument("--backend", default="mujoco")
    parser.add_argument("--workers", type=int, default=2)
    given = parser.parse_args()
    LiveEpisode.advance = timed_advance
    with tempfile.TemporaryDirectory() as folder:
        settings = ServeSettings(
            name="load",
            log_dir=Path(folder) / "run",
            backend=given.backend,
            workers=given.workers,
            max_sessions=given.sessions,
            frame_interval_seconds=0,
        )
        host = open_host(plan_serving(given.pack, settings), settings)
        config = server_config(make_app(host, Address()), given.sessions)
        config.port = 0
        server = uvicorn.Server(config)
        thread = threading.Thread(target=asyncio.run, args=[server.serve()])
        thread.start()
        while not server.started:
            time.sleep(0.05)
        client = RemoteEnvironment(f"http://127.0.0.1:{server.servers[0].sockets[0].getsockname()[1]}")
        began = time.perf_counter()
        with ThreadPoolExecutor(given.sessions) as pool:
            played = list(pool.map(lambda _: play(client, given.steps), range(given.sessions)))
        took = time.perf_counter() - began
        server.should_exit = True
        thread.join()
    added, errors = [], 0
    for instruction, waited, failed in played:
        errors += failed
        added += [1000 * (wait - own) for wait, own in zip(waited, simulated[instruction], strict=False)]
    p50, p99 = np.percentile(added, [50, 99])
    facts = {"sessions": given.sessions, "replies": len(added), "errors": errors, "seconds": round(took, 1)}
    print(json.dumps({**facts, "added_ms_p50": round(p50, 1), "added_ms_p99": round(p99, 1)}))


if __name__ == "__main__":
    main()
