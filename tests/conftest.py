"""Fixtures for every test."""

import gc
import os
import shutil
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path
from types import TracebackType
from typing import Any

import pytest
from forked_workers import PoolContext, fork
from hypothesis import HealthCheck, settings
from module_order import long_first
from thor_files import write_thor_files
from waiting import HANGS_AFTER_S

from vigil.base import processes
from vigil.runner.workers import process

pytest_plugins = ["skips"]

settings.register_profile("vigil", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("vigil")

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
REAL_LAUNCH, REAL_CONTEXT = process.launch, processes.spawn_context
REAL_HOUSES = os.environ.get("VIGIL_PROCTHOR")
"""A folder with ProcTHOR's real houses and AI2-THOR's databases; without it the tests take made-up ones."""


def pytest_xdist_auto_num_workers() -> int:
    """Two more than there are cores: many tests wait for a process or a server of theirs."""
    return (os.cpu_count() or 1) + 2


def collect() -> None:
    """Collect garbage, and leave what lives on out of later collections, which would take a second in the end."""
    gc.collect()
    gc.freeze()


def pytest_collection_finish() -> None:
    """Collect what was left over by importing the tests."""
    collect()


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out what is true of the real houses alone, unless they are there; several processes begin with what takes
    long."""
    if REAL_HOUSES is None:
        real = [item for item in items if item.get_closest_marker("real_houses")]
        config.hook.pytest_deselected(items=real)
        items[:] = [item for item in items if item not in real]
    processes = int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1"))
    if processes > 1:
        items[:] = long_first(items, processes)


@pytest.fixture(scope="session")
def thor_files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of houses and databases in ProcTHOR's form: the real ones where VIGIL_PROCTHOR names their folder."""
    if REAL_HOUSES is not None:
        return Path(REAL_HOUSES)
    return write_thor_files(tmp_path_factory.mktemp("thor_files"))


@pytest.fixture(scope="session", autouse=True)
def forked_workers() -> Iterator[None]:
    """Fork workers from a process that has imported all they need."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(process, "launch", fork)
        patch.setattr(processes, "spawn_context", PoolContext)
        yield


@pytest.fixture
def real_workers(monkeypatch: pytest.MonkeyPatch) -> None:
    """Start workers as users' are."""
    monkeypatch.setattr(process, "launch", REAL_LAUNCH)
    monkeypatch.setattr(processes, "spawn_context", REAL_CONTEXT)


@pytest.fixture
def collected() -> Iterator[None]:
    """Collect garbage at the end, so that what a test leaves open is told of, or filtered, in that test."""
    yield
    collect()


@pytest.fixture
def plain_tracebacks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Keep Inspect from drawing the source around every failed request, a third of a second each."""

    def plain(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> tuple[str, str]:
        text = "".join(traceback.format_exception(kind, error, trace))
        return text, text

    monkeypatch.setattr("inspect_ai.model._model.format_traceback", plain)
    monkeypatch.setattr("inspect_ai._display.core.results.rich_traceback", lambda *error: plain(*error)[0])


def patient(make: Callable[..., Any]) -> Callable[..., Any]:
    """Return a maker of pages or of their contexts, which then wait for what a slow machine shows late."""

    def made(**options: Any) -> Any:
        found = make(**options)
        found.set_default_timeout(1000 * HANGS_AFTER_S)
        return found

    return made


@pytest.fixture(scope="module")
def chromium() -> Iterator[Any]:
    """A headless browser; skips where none is installed."""
    sync_api = pytest.importorskip("playwright.sync_api", reason="Playwright is not installed: pip install playwright")
    if CHROMIUM is None:
        pytest.skip("no Chromium is installed: apt-get install chromium")
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        browser.new_page, browser.new_context = patient(browser.new_page), patient(browser.new_context)
        yield browser
        browser.close()
