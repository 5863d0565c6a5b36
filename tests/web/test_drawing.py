"""The render service draws in a simulator worker: one that hangs or dies is replaced, and none outlives the pages."""

import os
import signal
import threading
import time
from collections import ChainMap
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import psutil
import pytest

from tests.support.waiting import HANGS_AFTER_S, wait_until
from vigil.agents.frame_encoding import decode_frame
from vigil.base.processes import worker
from vigil.errors import HouseError, SimulatorError
from vigil.packs.pack import Pack
from vigil.protocol.actions import Navigate
from vigil.protocol.profile import Profile
from vigil.runner.workers.drawing import MomentRenderer
from vigil.runner.workers.messages import EpisodeMoment, RenderSettings, WorkerPlan
from vigil.runner.workers.worker import EpisodeWorker
from vigil.web.drawing import RenderService

TURN = Navigate(mode="turn_right", magnitude=90.0)


@pytest.fixture
def service() -> Iterator[RenderService]:
    service = RenderService()
    yield service
    service.close()


@pytest.fixture
def moment(pack: Pack) -> EpisodeMoment:
    episode = pack.episodes[0]
    return EpisodeMoment(RenderSettings("fake"), house_of(pack), episode.house.sha256, episode.start, episode.setup)


class Endless(ChainMap[str, str]):
    """A place whose text is read from a pipe: whoever names it waits as long as nobody closes the other end."""

    def __init__(self, pipe: Path) -> None:
        super().__init__()
        self.pipe = pipe

    def __reduce__(self) -> tuple[Any, ...]:
        return ChainMap, (), {"maps": map(Path.read_bytes, [self.pipe])}


@pytest.fixture
def endless(moment: EpisodeMoment, tmp_path: Path) -> EpisodeMoment:
    """A moment over which the worker hangs."""
    os.mkfifo(tmp_path / "pipe")
    return replace(moment, house=Endless(tmp_path / "pipe"), house_sha256="0" * 64)  # type: ignore[arg-type]


def house_of(pack: Pack) -> Path:
    return next(path for path in pack.folder.rglob("*.json") if path.stem == pack.episodes[0].house.name)


def failures(ask: Callable[[], object]) -> tuple[threading.Thread, list[Exception]]:
    """Asks in a thread; the list takes what that raises."""
    raised: list[Exception] = []

    def run() -> None:
        try:
            ask()
        except SimulatorError as error:
            raised.append(error)

    thread = threading.Thread(target=run)
    thread.start()
    return thread, raised


def reader_of(endless: EpisodeMoment) -> int:
    """Waits until the worker hangs. Returns the end of the pipe to close afterwards."""
    house: object = endless.house
    assert isinstance(house, Endless)
    ends: list[int] = []

    def opens() -> bool:
        with suppress(OSError):
            ends.append(os.open(house.pipe, os.O_WRONLY | os.O_NONBLOCK))
        return bool(ends)

    wait_until(opens, "somebody reads the pipe")
    return ends[0]


def test_pictures_walks_and_names_are_of_the_moment(
    service: RenderService, moment: EpisodeMoment, tmp_path: Path
) -> None:
    first = service.picture(moment)
    assert decode_frame(first).shape == (480, 640, 3)
    assert service.walk(moment, None).picture == first
    turned = service.walk(moment, TURN)
    assert (turned.effect.turned_deg, turned.pose.rotation) == (90.0, moment.start.rotation + 90.0)
    later = replace(moment, actions=(TURN,))
    assert service.picture(later) == turned.picture != first
    assert service.walk(moment, None).picture == first  # after a later moment of the same house
    assert service.name_at(moment, 320, 240) is not None
    with pytest.raises(HouseError, match="does not exist"):
        service.picture(replace(moment, house=tmp_path / "gone.json", house_sha256="0" * 64))
    with pytest.raises(HouseError, match=r"has SHA-256 \S+, expected 000000000000\.\.\."):
        service.picture(replace(moment, house_sha256="0" * 64))
    assert service.walk(moment, None).picture == first


def test_a_process_that_dies_or_hangs_is_replaced(
    service: RenderService, moment: EpisodeMoment, endless: EpisodeMoment, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, dead = service.picture(moment), service._worker.pid
    assert dead is not None
    os.kill(dead, signal.SIGKILL)
    with pytest.raises(SimulatorError, match="died"):
        service.walk(moment, None)
    assert service.walk(moment, None).picture == first
    hung = service._worker.pid
    assert hung not in (None, dead)
    with monkeypatch.context() as impatient:
        is_over = threading.Event()
        impatient.setattr(service._worker, "_timeout_s", 3.0)
        impatient.setattr(service._worker._connection, "poll", lambda _: not is_over.wait())
        impatient.setattr(service, "_timeout_s", 0.2)
        thread, raised = failures(lambda: service.picture(endless))
        writer = reader_of(endless)
        with pytest.raises(SimulatorError, match="busy with other pictures"):
            service.walk(moment, None)
        is_over.set()
        thread.join()
        os.close(writer)
    assert "did not answer draw within 3 s" in str(raised[0])
    assert service.walk(moment, None).picture == first
    assert not Path(f"/proc/{hung}").exists()


@pytest.mark.parametrize("is_stopped", [False, True], ids=["busy", "stopped"])
def test_closing_ends_a_process_that_is_at_something(
    service: RenderService,
    moment: EpisodeMoment,
    endless: EpisodeMoment,
    monkeypatch: pytest.MonkeyPatch,
    is_stopped: bool,
) -> None:
    monkeypatch.setattr(worker, "SHUTDOWN_TIMEOUT_S", 0.5 if is_stopped else HANGS_AFTER_S)
    service.picture(moment)
    pid = service._worker.pid
    assert pid is not None
    asked = [failures(lambda: service.picture(endless)) for _ in range(2)]
    writer = reader_of(endless)
    # SIGTERM between Python's last look for signals and the read would only be noticed after the read.
    wait_until(lambda: psutil.Process(pid).status() == psutil.STATUS_SLEEPING, "the worker waits for the pipe")
    if is_stopped:
        os.kill(pid, signal.SIGSTOP)
    began = time.monotonic()
    service.close()
    assert time.monotonic() - began < HANGS_AFTER_S / 2
    os.close(writer)
    for thread, raised in asked:
        thread.join(HANGS_AFTER_S)
        assert "drawing-worker" in str(raised[0])
    assert not Path(f"/proc/{pid}").exists()
    with pytest.raises(SimulatorError, match="has been closed"):
        service.walk(moment, None)


def test_a_worker_whose_main_process_is_gone_ends_in_the_middle_of_a_drawing(endless: EpisodeMoment) -> None:
    process = worker.LocalProcess(MomentRenderer, None, {})
    connection = process.connect()
    connection.send((MomentRenderer.draw, (endless,)))
    assert connection.poll(HANGS_AFTER_S)
    assert connection.recv() == ("event", None)
    connection.close()
    assert process.wait(HANGS_AFTER_S) == 0


def test_a_worker_that_plays_draws_for_nobody(pack: Pack, moment: EpisodeMoment) -> None:
    player = EpisodeWorker(WorkerPlan(pack.folder, "run", Profile()))
    with pytest.raises(AttributeError, match="'EpisodeWorker' object has no attribute"):
        MomentRenderer.draw(player, moment)  # type: ignore[arg-type]  # pyright: ignore[reportArgumentType]
