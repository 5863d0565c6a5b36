"""The script that plays from the wheel: which interpreters it takes."""

import sys
from pathlib import Path

import pytest

from scripts.release_check import interpreter


def test_an_interpreter_is_found_by_the_path_it_tells() -> None:
    assert interpreter(sys.executable) == sys.executable


def test_a_stand_in_that_does_not_start_is_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    stand_in = tmp_path / "python3.99"
    stand_in.write_text("#!/bin/sh\necho 'python3.99: command not found' >&2\nexit 127\n")
    stand_in.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert interpreter("python3.99") is None


def test_an_interpreter_that_is_not_there_is_none() -> None:
    assert interpreter("python3.99") is None
