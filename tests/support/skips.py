"""Check of skips: a test may be skipped only if an optional dependency is missing; any other skip is a failure."""

from collections.abc import Generator

import pytest

MAY_BE_MISSING = (
    "Chromium",
    "Playwright",
    "'datasets'",
    "ai2thor",
    "verifiers",
    "trl",
    "verl",
    "prime-rl",
    "lerobot",
    "LaTeX",
    "bubblewrap",
)
"""Optional dependencies, one of which the reason of an accepted skip must name."""


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Turn a skip for any other reason into a failure."""
    report = yield
    if report.skipped and not hasattr(report, "wasxfail"):
        assert isinstance(report.longrepr, tuple)
        reason = report.longrepr[2]
        if not any(name in reason for name in MAY_BE_MISSING):
            report.outcome = "failed"
            report.longrepr = f"{item.nodeid} was skipped for a reason that is not accepted. {reason}"
    return report
