"""Fixtures for every test."""

import gc
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, settings

settings.register_profile("vigil", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("vigil")

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
PROCTHOR = Path(__file__).parents[2] / "shared" / "procthor"


@pytest.fixture(scope="session")
def procthor() -> Path:
    """The folder of real ProcTHOR houses and databases; skips where it is not there."""
    if not PROCTHOR.is_dir():
        pytest.skip(f"no real houses at {PROCTHOR}")
    return PROCTHOR


@pytest.fixture
def collected() -> Iterator[None]:
    """Collects garbage at the end, so that what a test leaves open is told of, or filtered, in that test."""
    yield
    gc.collect()


@pytest.fixture(scope="module")
def chromium() -> Iterator[Any]:
    """A headless browser; skips where none is installed."""
    sync_api = pytest.importorskip("playwright.sync_api", reason="Playwright is not installed: pip install playwright")
    if CHROMIUM is None:
        pytest.skip("no Chromium is installed: apt-get install chromium")
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield browser
        browser.close()
