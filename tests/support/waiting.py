"""Waiting for events in other threads and processes, with a long limit for slow machines."""

import time
from collections.abc import Callable

HANGS_AFTER_S = 600.0
"""Time after which a test counts as hanging; no test machine is that slow."""


def wait_until(has_happened: Callable[[], object], what: str) -> None:
    """Wait until `has_happened`. Raises AssertionError with `what` if it does not happen in time."""
    end = time.monotonic() + HANGS_AFTER_S
    while not has_happened():
        assert time.monotonic() < end, f"{what} has not happened in {HANGS_AFTER_S:g} s"
        time.sleep(0.01)
