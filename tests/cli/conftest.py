"""Fixtures for tests of the command line."""

import pytest

from tests.support.commands import Vigil, command_runner


@pytest.fixture
def vigil(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Vigil:
    """Runs the command line in this process."""
    return command_runner(monkeypatch, capsys)
