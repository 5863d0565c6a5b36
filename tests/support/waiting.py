"""Waiting for what happens elsewhere: as long as it takes, since a machine may be slow."""

import time
from collections.abc import Callable

HANGS_AFTER_S = 600.0
"""After so long a test hangs for good; no machine that tests are run on is that slow."""


def wait_until(has_happened: Callable[[], object], what: str) -> None:
    """Wait until something has happened. Raises AssertionError with `what` when it never does."""
    end = time.monotonic() + HANGS_AFTER_S
    while not has_happened():
        assert time.monotonic() < end, f"{what} has not happened in {HANGS_AFTER_S:g} s"
        time.sleep(0.01)
