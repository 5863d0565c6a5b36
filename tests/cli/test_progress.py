"""How progress is shown: in a terminal, in a pipe, and when the work is interrupted."""

import io
import sys
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import pytest

from vigil.cli import progress as module
from vigil.cli.progress import progress, progress_facts, read_runs_shown, run_progress
from vigil.runner.progress import RunProgress

PLAYS = Path(__file__).parents[2] / "docs" / "packs" / "plays"
HIDE_CURSOR, SHOW_CURSOR = "\x1b[?25l", "\x1b[?25h"
STANDING = RunProgress(
    total=2, done=1, errors=1, W=0.5, B=0.0, steps=3, elapsed_s=1.0, eta_s=1.0, cost=None, latest=None
)


class Terminal(io.StringIO):
    """Standard error that says that it is a terminal."""

    def isatty(self) -> bool:
        return True


def in_terminal(monkeypatch: pytest.MonkeyPatch) -> Terminal:
    """Makes standard error a terminal; inside of a test, since the capture puts its own there before."""
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "120")
    for name in ("FORCE_COLOR", "TTY_COMPATIBLE", "TTY_INTERACTIVE"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(sys, "stderr", made := Terminal())
    return made


def lines(capsys: pytest.CaptureFixture[str]) -> list[str]:
    said = capsys.readouterr()
    assert said.out == ""
    assert "\x1b" not in said.err
    return said.err.splitlines()


@pytest.mark.parametrize("is_forced", [False, True])
def test_a_pipe_gets_plain_lines_now_and_then_and_the_last(
    is_forced: bool, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    if is_forced:  # as some services for continuous integration do
        monkeypatch.setenv("FORCE_COLOR", "1")
    with progress("houses") as show:
        for done in range(1, 101):
            show(done, 100, f"{done} [drafts]")
    first, last = lines(capsys)
    assert first == "houses: 1/100  1 [drafts]  ETA -"
    assert last == "houses: 100/100  100 [drafts]  ETA 0:00"


def test_lists_of_chores_have_the_share_of_true_claims_next_to_w_and_b() -> None:
    assert progress_facts(STANDING) == "W 50.0  B 0.0  errors 1"
    assert progress_facts(replace(STANDING, T=0.75)) == "W 50.0  B 0.0  T 75.0  errors 1"


def test_a_pipe_gets_a_line_after_each_period(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    now_s = [0.0]
    monkeypatch.setattr(module.time, "monotonic", lambda: now_s[0])
    with progress("verify") as show:
        for done in range(1, 6):
            show(done, 9)
            now_s[0] += module.PLAIN_SECONDS / 2
    assert [line.split("  ")[0] for line in lines(capsys)] == ["verify: 1/9", "verify: 3/9", "verify: 5/9"]


def test_a_terminal_gets_a_bar_with_names_as_they_are(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = in_terminal(monkeypatch)
    with progress("exec:x [/b] :fire:") as show:
        show(1, 2, "errors [/c]")
        show(2, 2, "errors [/c]")
    said = terminal.getvalue()
    assert "exec:x [/b] :fire:" in said
    assert "errors [/c]" in said
    assert "2/2" in said
    assert said.count(HIDE_CURSOR) == said.count(SHOW_CURSOR) == 1


def test_an_interrupt_leaves_the_terminal_in_order(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = in_terminal(monkeypatch)
    outside = sys.stdout
    with suppress(KeyboardInterrupt), progress("houses") as show:
        show(1, 2)
        raise KeyboardInterrupt
    said = terminal.getvalue()
    assert said.rindex(SHOW_CURSOR) > said.rindex(HIDE_CURSOR)
    assert (sys.stdout, sys.stderr) == (outside, terminal)


def test_results_go_to_their_pipe_while_the_terminal_shows_a_bar(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    terminal = in_terminal(monkeypatch)
    with progress("houses") as show:
        show(1, 2)
        print("a result")
    assert capsys.readouterr().out == "a result\n"
    assert "a result" not in terminal.getvalue()


def test_nothing_is_shown_before_something_is_done(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = in_terminal(monkeypatch)
    with progress("verify"):
        pass
    assert terminal.getvalue() == ""


def test_the_time_left_counts_what_was_done_since_the_work_went_on(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    now_s = [1000.0]
    monkeypatch.setattr(module.time, "monotonic", lambda: now_s[0])
    with progress("noop") as show:
        show(90, 100)  # by an earlier session
        now_s[0] += 700  # longer than any window: one episode after another takes so long
        show(91, 100)
        now_s[0] += 100
        show(92, 100)  # 2 in 800 s
    assert [line.split("ETA ")[1] for line in lines(capsys)] == ["-", "1:45:00", "53:20"]


def test_several_at_once_are_not_taken_for_quick_ones(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    now_s = [0.0]
    monkeypatch.setattr(module.time, "monotonic", lambda: now_s[0])
    with progress("noop") as show:
        show(0, 16)
        now_s[0] += 80
        for done in range(1, 9):  # eight episodes end together
            show(done, 16)
        now_s[0] += 80
        show(9, 16)
    assert lines(capsys)[-1].endswith("ETA 2:04")


def test_work_that_tells_nothing_is_said_to_go_on(
    capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "QUIET_SECONDS", 0.01)
    said = ""
    with progress("checks") as show:
        while "checks: begun" not in said:  # waits for the event
            said += capfd.readouterr().err
        show(3, 9, "1 left out")
        while "  (begun " not in said:
            said += capfd.readouterr().err
    assert "checks: 3/9  1 left out  ETA -" in said


def test_a_terminal_sees_that_work_has_begun_which_tells_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = in_terminal(monkeypatch)
    monkeypatch.setattr(module, "QUIET_SECONDS", 0.01)
    with progress("checks"):
        while "checks" not in terminal.getvalue():
            pass
    assert terminal.getvalue().count(HIDE_CURSOR) == terminal.getvalue().count(SHOW_CURSOR) == 1


def test_a_runs_progress_counts_errors_as_done(capsys: pytest.CaptureFixture[str]) -> None:
    with run_progress("noop") as show:
        show(STANDING)
    assert lines(capsys) == ["noop: 2/2  W 50.0  B 0.0  errors 1  ETA 0:00"]
    assert progress_facts(STANDING) == "W 50.0  B 0.0  errors 1"


def test_a_runs_progress_says_what_it_cost_where_that_is_known() -> None:
    assert progress_facts(replace(STANDING, cost=1234.5)) == "W 50.0  B 0.0  cost 1,234.50  errors 1"


def test_reading_several_runs_shows_how_many_were_read(capsys: pytest.CaptureFixture[str]) -> None:
    folders = [PLAYS / "vigil_mini_v4_baseline", PLAYS / "vigil_mini_v4_look_before_report"]
    assert len(read_runs_shown(folders[:1])) == 1
    assert lines(capsys) == []
    assert len(read_runs_shown(folders)) == 2
    assert [line.split("  ")[0] for line in lines(capsys)] == ["runs: 0/2", "runs: 2/2"]
