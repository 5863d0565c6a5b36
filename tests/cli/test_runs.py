"""`vigil run`, `vigil verify` and `vigil score`: what they say and how they exit."""

import shutil
import signal
import subprocess
import sys
from pathlib import Path

import psutil
import pytest
from rich.table import Table

from tests.support.commands import CommandResult, Vigil
from tests.support.quick_runs import claim
from tests.support.tiny_pack import tiny_pack
from tests.support.waiting import HANGS_AFTER_S, wait_until
from vigil.cli import text
from vigil.cli.text import print_notes
from vigil.protocol.prompt_file import variant_of
from vigil.records.record import EPISODES_FILE
from vigil.records.record_file import read_records

MODEL = ("--model", "openai/m", "--dry-run")


@pytest.fixture(scope="module")
def pack(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A pack of four episodes."""
    folder = tmp_path_factory.mktemp("packs") / "tiny"
    tiny_pack(folder, 4)
    return folder


@pytest.fixture
def command(pack: Path, tmp_path: Path) -> tuple[str | Path, ...]:
    """A run that takes a moment."""
    return ("run", "--pack", pack, "--backend", "fake", "--workers", "1", "--log-dir", tmp_path / "run")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((*MODEL, "--profile", "basline"), ["'basline'", "Did you mean 'baseline'?", "action_feedback"]),
        ((*MODEL, "--profile", "itemised_report"), ["claim about each chore", "has no lists", "suite `chores`"]),
        ((*MODEL, "--prices", "2.5"), ["--prices '2.5'", "IN,OUT", "2.5,10"]),
        ((*MODEL, "--prices", "1,2,3"), ["--prices '1,2,3'"]),
        ((*MODEL, "--prices", "-1,2"), ["--prices '-1,2'"]),
        ((*MODEL, "--prices", "nan,2"), ["--prices 'nan,2'"]),
        ((*MODEL, "--prices", "one,2"), ["--prices 'one,2'"]),
        (("--agent", "noop", "--agent", "sweep"), ["--agent is given 2 times (noop, sweep)", "vigil score"]),
        (("--model", "openai/a", "--model", "openai/b"), ["--model is given 2 times (openai/a, openai/b)"]),
    ],
)
def test_bad_options_are_named(
    vigil: Vigil, command: tuple[str | Path, ...], tmp_path: Path, arguments: tuple[str, ...], words: list[str]
) -> None:
    said = vigil(*command, *arguments)
    assert said.code == 2
    assert said.err.startswith("vigil: ")
    for word in words:
        assert word in said.err
    assert not (tmp_path / "run").exists()


def test_a_dry_run_says_costs_at_the_prices_given(vigil: Vigil, command: tuple[str | Path, ...]) -> None:
    def numbers(said: CommandResult) -> dict[str, list[float]]:
        rows = [line.replace(",", "").split() for line in said.out.splitlines() if " .. " in line]
        return {" ".join(row[:-3]): [float(row[-3]), float(row[-1])] for row in rows}

    assert "cost" not in numbers(vigil(*command, *MODEL))
    priced = numbers(vigil(*command, *MODEL, "--prices", "2000,10000"))
    for bound in (0, 1):
        cost = (priced["input tokens"][bound] * 2000 + priced["output tokens"][bound] * 10000) / 1e6
        assert priced["cost"][bound] == pytest.approx(cost, abs=0.01)


def test_a_run_of_an_agent_that_tells_no_tokens_has_no_cost(vigil: Vigil, command: tuple[str | Path, ...]) -> None:
    said = vigil(*command, "--agent", "noop", "--limit", "1", "--prices", "2.5,10")
    assert said.code == 0
    assert "Cost so far: not known: no reply in the records reports its tokens." in said.out
    assert "cost" not in said.err


def test_what_was_there_before_and_what_was_torn_is_told(
    vigil: Vigil, command: tuple[str | Path, ...], tmp_path: Path
) -> None:
    path = tmp_path / "run" / EPISODES_FILE
    first = vigil(*command, "--agent", "noop")
    assert first.code == 0
    assert "Played before" not in first.out
    path.write_bytes(path.read_bytes()[:-100])
    again = vigil(*command, "--agent", "noop")
    assert (again.code, again.err.splitlines()[0].split(":")[0]) == (0, "noop")
    assert "Played before, and not played again: 3 of 4 episodes." in again.out
    assert f"interrupted while it wrote a row; the partial row is in {path}.partial-1." in again.out


def test_a_privileged_agent_is_marked_in_the_table_of_its_run(
    vigil: Vigil, pack: Path, tmp_path: Path, command: tuple[str | Path, ...]
) -> None:
    vigil(*command, "--agent", "noop")
    header = tmp_path / "run" / "run.json"
    assert "(privileged)" not in vigil("score", tmp_path / "run").out
    header.write_text(header.read_text().replace('"scripted"', '"privileged"'))
    assert "noop (privileged): %" in vigil("score", tmp_path / "run").out


def test_what_was_no_action_and_what_was_wrong_is_said_with_the_table(
    vigil: Vigil, command: tuple[str | Path, ...], tmp_path: Path
) -> None:
    ran = vigil(*command, "--agent", "malformed", "--limit", "1").out
    assert "malformed: 100% of the replies are not actions" in ran
    assert "no_object); none would parse leniently. `vigil view` shows the replies" in ran
    shutil.rmtree(tmp_path / "run")
    vigil(*command, "--agent", "always_success", "--limit", "1")
    scored = vigil("score", tmp_path / "run").out
    assert "FR and Other are: 1 false_success." in scored
    assert "no action" not in scored


def test_runs_of_one_agent_are_told_apart_in_a_table(vigil: Vigil, pack: Path, tmp_path: Path) -> None:
    for name, more in (("one", ()), ("two", ("--prompt-variant", "neutral_report", "--limit", "2"))):
        vigil("run", "--pack", pack, "--agent", "always_success", "--log-dir", tmp_path / name, *more)
    scored = vigil("score", tmp_path / "one", tmp_path / "two")
    differ = "episode_ids, profile.prompt_variant, prompt_policy, prompt_policy_sha256"
    assert f"2 runs are named always_success; they differ in {differ}." in scored.err
    assert all(name in scored.out for name in ("/one", "/two"))
    shutil.copytree(tmp_path / "one", tmp_path / "copy")
    assert "they differ only in time" in vigil("score", tmp_path / "one", tmp_path / "copy").err
    assert "runs are named" not in vigil("score", tmp_path / "one").err


def test_a_prompt_file_stands_behind_the_name_of_its_run(vigil: Vigil, pack: Path, tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("Do <TASK_INSTRUCTION>")
    words = ("run", "--pack", pack, "--backend", "fake", "--workers", "1", "--agent", "noop", "--limit", "1")
    played = vigil(*words, "--log-dir", tmp_path / "run", "--prompt-file", tmp_path / "mine.txt")
    assert played.code == 0, played.err
    assert f"noop [{variant_of('Do <TASK_INSTRUCTION>')}]" in " ".join(played.out.split())


def test_verify_says_how_many_frames_it_compared(vigil: Vigil, command: tuple[str | Path, ...], tmp_path: Path) -> None:
    vigil(*command, "--agent", "noop", "--limit", "2")
    unseen = vigil("verify", tmp_path / "run", "--workers", "1", "--frames")
    assert unseen.code == 0
    assert "2 episodes played again and 0 frames, compared exactly: 0 differences" in unseen.out
    assert "No frame was compared: the agent did not look at a frame in this run." in unseen.out
    shutil.rmtree(tmp_path / "run")
    vigil(*command, "--agent", "always_success", "--limit", "2", "--save-frames")
    seen = vigil("verify", tmp_path / "run", "--workers", "1", "--frames")
    assert "2 episodes played again and 2 frames, compared exactly: 0 differences" in seen.out
    assert "No frame" not in seen.out
    plain = vigil("verify", tmp_path / "run", "--workers", "1")
    assert "2 episodes played again, compared exactly: 0 differences" in plain.out


def test_score_gives_the_reasons_of_errors(vigil: Vigil, command: tuple[str | Path, ...], tmp_path: Path) -> None:
    ran = vigil(*command, "--agent", "exec:false", "--limit", "2")
    assert ran.code == 1
    assert [row.end for row in read_records(tmp_path / "run" / "episodes.jsonl")] == ["error", "error"]
    reason = "exec:false: 2 x error at the agent: Agent program 'exec:false' ended"
    scored = vigil("score", tmp_path / "run")
    assert scored.code == 0
    for said in (ran, scored):
        assert reason in said.out
        assert "0 of 2 episodes scored" in said.out


def test_a_hanging_program_costs_what_the_run_allows(
    vigil: Vigil, command: tuple[str | Path, ...], tmp_path: Path
) -> None:
    ran = vigil(*command, "--agent", "exec:sleep 600", "--limit", "1", "--reply-seconds", "1")
    assert ran.code == 1
    assert "'exec:sleep 600' does not read its input for 1 s" in ran.out
    (row,) = read_records(tmp_path / "run" / "episodes.jsonl")
    assert row.end == "error"


def test_an_interrupted_run_says_so_and_leaves_no_program_behind(
    command: tuple[str | Path, ...], tmp_path: Path
) -> None:
    pid = tmp_path / "pid"
    (tmp_path / "deaf.sh").write_text(f"echo $$ > {pid}.new && mv {pid}.new {pid} && exec sleep 60\n")
    # SIGINT is ignored in a process that a shell started in the background.
    accept = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"
    program = f"{accept}; from vigil.cli import main; main()"
    arguments = [*map(str, command), "--agent", f"exec:bash {tmp_path / 'deaf.sh'}"]
    running = subprocess.Popen([sys.executable, "-c", program, *arguments], stderr=subprocess.PIPE, text=True)
    wait_until(pid.exists, "the start of the program")
    running.send_signal(signal.SIGINT)
    said = running.communicate(timeout=HANGS_AFTER_S)[1]
    assert running.returncode == 130
    assert said.endswith("Interrupted. What a run has recorded is kept; the same command continues it.\n")
    assert "Traceback" not in said
    wait_until(lambda: not psutil.pid_exists(int(pid.read_text())), "the end of the program")


def test_where_programs_left_their_last_words_is_told(
    vigil: Vigil, command: tuple[str | Path, ...], tmp_path: Path
) -> None:
    said = vigil(*command, "--agent", "exec:bash -c 'echo no weights >&2; exit 3'", "--limit", "1")
    assert said.code == 1
    assert "(exit code 3)" in said.out
    assert f"wrote to standard error: {tmp_path / 'run' / 'logs'}" in said.out
    assert "no weights" in "".join(path.read_text() for path in (tmp_path / "run" / "logs").iterdir())


def test_a_run_without_rows_is_not_verified_and_that_is_said(
    vigil: Vigil, command: tuple[str | Path, ...], tmp_path: Path
) -> None:
    vigil(*command, "--agent", "noop", "--limit", "1")
    (tmp_path / "run" / EPISODES_FILE).write_bytes(b"")
    said = vigil("verify", tmp_path / "run", "--workers", "1", "--frames")
    assert said.code == 1
    assert "Nothing was verified" in said.out
    assert "No frame" not in said.out


@pytest.mark.parametrize("width", [80, 160])
def test_tables_are_cut_in_no_terminal(
    vigil: Vigil, command: tuple[str | Path, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, width: int
) -> None:
    vigil(*command, "--agent", "noop")
    header = tmp_path / "run" / "run.json"
    header.write_text(header.read_text().replace('"noop"', '"exec:long_words [b]odd [/name]"'))
    claim(tmp_path / "run")
    monkeypatch.setattr(text, "PIPED_WIDTH", width)
    alone = vigil("score", tmp_path / "run").out
    side_by_side = vigil("score", tmp_path / "run", tmp_path / "run").out
    for said in (alone, side_by_side):
        table = [line for line in said.splitlines() if line.strip()[:1] in tuple("┏┃┡│├└")]
        assert max(map(len, table)) <= width
        assert "…" not in said
        assert "W_strict" in said
        assert ("[95 % interval]" in said) == (width == 160)
    assert "exec:long_words [b]odd [/name]: %" in alone
    rates = next(line.replace("│", " ").split() for line in alone.splitlines() if "4/4" in line)
    assert (rates[:2], rates[-1]) == (["all", "4/4"], "11.8")


@pytest.mark.parametrize(
    ("agent", "count", "is_said"), [("malformed", 12, True), ("malformed", 9, False), ("noop", 12, False)]
)
def test_a_run_of_mostly_invalid_replies_says_so_aloud_once(
    vigil: Vigil, tmp_path: Path, agent: str, count: int, is_said: bool
) -> None:
    tiny_pack(tmp_path / "twelve", count, ("PG",))
    words = ("run", "--pack", tmp_path / "twelve", "--backend", "fake", "--workers", "1", "--agent", agent)
    said = vigil(*words, "--log-dir", tmp_path / "run")
    assert said.code == 0
    assert said.err.count("WARNING: ") == int(is_said)
    if is_said:
        assert "40 of 40 replies (100 %) are invalid after 10 episodes; most frequent: 40 no_object" in said.err


def test_invalid_replies_of_earlier_sessions_count_for_the_warning(vigil: Vigil, tmp_path: Path) -> None:
    tiny_pack(tmp_path / "twelve", 12, ("PG",))
    words = ("run", "--pack", tmp_path / "twelve", "--backend", "fake", "--workers", "1", "--agent", "malformed")
    assert "WARNING: " not in vigil(*words, "--log-dir", tmp_path / "run", "--limit", "9").err
    said = vigil(*words, "--log-dir", tmp_path / "run").err
    assert said.count("WARNING: ") == 1
    assert "40 of 40 replies (100 %) are invalid after 10 episodes" in said


def test_both_outputs_in_one_file_stand_in_their_order(command: tuple[str | Path, ...], tmp_path: Path) -> None:
    main = "from vigil.cli import main; main()"
    log = tmp_path / "log"
    with log.open("w") as file:
        words = [sys.executable, "-c", main, *map(str, command), "--agent", "noop", "--save-frames"]
        subprocess.run(words, stdout=file, stderr=file, check=True)
    text_of = log.read_text()
    assert text_of.index("noop: 0/4") < text_of.index("noop: 4/4") < text_of.index("Records: ")


def test_what_is_said_at_once_stands_before_what_comes_later(tmp_path: Path) -> None:
    program = (
        "import sys, vigil.cli as cli\n"
        "def app():\n    print('first')\n    print('second', file=sys.stderr)\n    print('third')\n"
        "cli.app = app\ncli.main()\n"
    )
    with (tmp_path / "log").open("w") as file:
        subprocess.run([sys.executable, "-c", program], stdout=file, stderr=file, check=True)
    assert (tmp_path / "log").read_text().split() == ["first", "second", "third"]


def test_a_name_in_a_table_stays_as_it_is(capsys: pytest.CaptureFixture[str]) -> None:
    table = Table("agent", title="exec:a :fire: [b]")
    table.add_row("exec:x :smile: [red]y[/red]")
    text.print_fitting(lambda _: table)
    said = capsys.readouterr().out
    assert "exec:x :smile: [red]y[/red]" in said
    assert "exec:a :fire: [b]" in said


def test_a_folder_of_runs_stands_for_its_runs(vigil: Vigil, command: tuple[str | Path, ...], tmp_path: Path) -> None:
    for agent in ("noop", "always_success"):
        assert vigil(*command[:-1], tmp_path / "runs" / agent, "--agent", agent).code == 0
    for verb in (("score",), ("report",)):
        said = vigil(*verb, tmp_path / "runs")
        assert said.code == 0
        assert "noop" in said.out
        assert "always_success" in said.out
    assert "'plane'" not in vigil("figure", "plane", tmp_path / "runs", "--out", tmp_path / "plane.png").err
    (tmp_path / "none").mkdir()
    assert "has no run.json" in vigil("report", tmp_path / "none").err


def test_a_note_of_several_runs_is_told_once(capsys: pytest.CaptureFixture[str]) -> None:
    print_notes(note for run in (("one", "both"), ("two", "both")) for note in run)
    assert capsys.readouterr().err.splitlines() == ["note: one", "note: both", "note: two"]
