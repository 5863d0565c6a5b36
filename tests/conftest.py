"""Fixtures for every test."""

import gc
import os
import shutil
import ssl
import subprocess
import traceback
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from types import TracebackType
from typing import Any

import pytest
from hypothesis import HealthCheck, settings

from tests.support import forked_workers
from tests.support.module_order import long_first
from tests.support.thor_files import write_thor_files
from tests.support.waiting import HANGS_AFTER_S
from vigil.base.processes.worker import LocalProcess

pytest_plugins = ["tests.support.skips"]

settings.register_profile("vigil", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("vigil")

if forked_workers.CAN_FORK:
    LocalProcess._execute_child = forked_workers.execute_child  # pyright: ignore[reportAttributeAccessIssue]
ssl.create_default_context = cache(ssl.create_default_context)  # reads the certificates of all authorities

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
REAL_HOUSES = os.environ.get("VIGIL_PROCTHOR")
"""A folder with ProcTHOR's real houses and AI2-THOR's databases; without it the tests use made-up ones."""


def pytest_xdist_auto_num_workers() -> int:
    """Return two more than the number of cores: many tests wait for a process or a server."""
    return (os.cpu_count() or 1) + 2


def collect() -> None:
    """Collect garbage, then exclude the surviving objects from later collections, which would take up to a second."""
    gc.collect()
    gc.freeze()


def pytest_sessionfinish() -> None:
    """End the process from which workers are forked."""
    forked_workers.end_template()


def pytest_collection_finish() -> None:
    """Collect the garbage that importing the tests left behind."""
    collect()


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Deselect tests of the real houses unless they are available; with several processes, run slow modules first."""
    if REAL_HOUSES is None:
        real = [item for item in items if item.get_closest_marker("real_houses")]
        config.hook.pytest_deselected(items=real)
        items[:] = [item for item in items if item not in real]
    processes = int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1"))
    if processes > 1:
        items[:] = long_first(items, processes)


@pytest.fixture(scope="session")
def thor_files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of houses and databases in ProcTHOR's format: the real ones if VIGIL_PROCTHOR names their folder."""
    if REAL_HOUSES is not None:
        return Path(REAL_HOUSES)
    return write_thor_files(tmp_path_factory.mktemp("thor_files"))


@pytest.fixture
def started_workers(monkeypatch: pytest.MonkeyPatch) -> None:
    """Start the workers of a test as users' workers are started, and do not fork them."""
    monkeypatch.setattr(LocalProcess, "_execute_child", subprocess.Popen._execute_child)  # pyright: ignore


@pytest.fixture
def collected() -> Iterator[None]:
    """Collect garbage at the end, so that warnings about unclosed resources appear (or are filtered) in this test."""
    yield
    collect()


@pytest.fixture
def inspect_unformatted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Keep Inspect from formatting the source code around failed requests, and results that it does not show.

    Each takes a third of a second. Objects that were excluded from garbage collection before a run stay excluded.
    """

    def plain(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> tuple[str, str]:
        text = "".join(traceback.format_exception(kind, error, trace))
        return text, text

    monkeypatch.setattr("inspect_ai.model._model.format_traceback", plain)
    monkeypatch.setattr("inspect_ai._display.rich.display.tasks_results", lambda _: "")
    monkeypatch.setattr("gc.unfreeze", lambda: None)


def patient(make: Callable[..., Any]) -> Callable[..., Any]:
    """Return a wrapper of `make` whose pages or contexts wait longer, for slow machines."""

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
