"""How the command ends when something goes wrong outside VIGIL's own checks."""

import errno

import pytest

from vigil import cli


def ended(monkeypatch: pytest.MonkeyPatch, error: BaseException) -> int:
    def fail() -> None:
        raise error

    monkeypatch.setattr(cli, "app", fail)
    with pytest.raises(SystemExit) as end:
        cli.main()
    return int(end.value.code or 0)


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (PermissionError(errno.EACCES, "Permission denied", "/there/x.png"), "'/there/x.png': Permission denied. Give"),
        (OSError(errno.ENOSPC, "No space left on device"), "vigil: No space left on device. Give a place that"),
    ],
)
def test_a_file_that_cannot_be_used_is_named_without_a_traceback(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], error: OSError, said: str
) -> None:
    assert ended(monkeypatch, error) == 2
    assert said in capsys.readouterr().err


@pytest.mark.parametrize("error", [KeyboardInterrupt(), SystemExit(130)])
def test_an_interruption_is_told_once(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], error: BaseException
) -> None:
    assert ended(monkeypatch, error) == 130
    assert capsys.readouterr().err.count("Interrupted.") == 1


def test_other_exits_pass_in_silence(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    assert ended(monkeypatch, SystemExit(1)) == 1
    assert capsys.readouterr().err == ""


def test_a_fault_of_the_programs_own_is_not_dressed_up(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(OSError, match="not a socket"):
        ended(monkeypatch, OSError(errno.ENOTSOCK, "not a socket"))
