"""`vigil view`, `play`, `review` and `export` from the command line."""

import os
import signal
import socket
import subprocess
import sys
import urllib.request
from pathlib import Path

import pytest
from typer.testing import CliRunner

from tests.support.waiting import HANGS_AFTER_S, wait_until
from vigil.cli import app, web
from vigil.cli.exports.site import write_run_site
from vigil.errors import InputError, RecordError, SettingError
from vigil.packs.pack import Pack
from vigil.web.site import Address


def free_port() -> int:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return free.getsockname()[1]


@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        (["view", "no_such_folder"], RecordError, "no_such_folder"),
        (["view", ".", "--host", "0.0.0.0"], SettingError, "--token"),
        (["view", ".", "--pack", "startr"], InputError, "Did you mean 'starter'"),
        (["play", "--player", "a b"], SettingError, "--player"),
        (["play", "--player", "ada", "--host", "0.0.0.0"], SettingError, "--token"),
        (["play", "--player", "ada", "--family", "XY"], InputError, "XY"),
        (["review", "--reviewer", "../x"], SettingError, "reviewer"),
        (["review", "--reviewer", "ada", "--file", "no/such/reviews.jsonl"], SettingError, "does not exist"),
        (["export", ".", "--out", "site"], RecordError, "is not a run"),
        (["export", ".", "--out", "no/one.mp4", "--episode", "e"], SettingError, "does not exist. Make it first"),
    ],
    ids=lambda value: "-".join(value[:2]) if isinstance(value, list) else None,
)
def test_bad_input_is_named(
    arguments: list[str], error: type[Exception], words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    port = [] if arguments[0] == "export" else ["--port", str(free_port())]
    result = CliRunner().invoke(app, [*arguments, *port])
    assert isinstance(result.exception, error), result.output
    assert words in str(result.exception)
    assert list(tmp_path.iterdir()) == []


def test_a_port_in_use_is_named() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(SettingError, match=rf"Port {port} is in use. Give another, e.g. --port \d+\."):
            web.listen(Address(port=port))


def test_an_address_that_is_not_ours_is_named() -> None:
    with pytest.raises(SettingError, match=r"--host '192\.0\.2\.1' --port \d+: cannot listen there"):
        web.listen(Address("192.0.2.1", free_port(), "a long token"))


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere there is always a screen")
def test_where_no_browser_is_the_address_is_enough(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    opened: list[str] = []
    monkeypatch.setattr(web.webbrowser, "open", lambda url: not opened.append(url))
    for name in web.SCREENS:
        monkeypatch.delenv(name, raising=False)
    web.open_page("http://127.0.0.1:1/")
    assert "Open the address yourself" in capsys.readouterr().out
    assert opened == []
    monkeypatch.setenv("DISPLAY", ":0")
    web.open_page("http://127.0.0.1:1/")
    assert opened == ["http://127.0.0.1:1/"]
    monkeypatch.setattr(web.webbrowser, "open", lambda url: False)
    web.open_page("http://127.0.0.1:1/")
    assert "Open the address yourself" in capsys.readouterr().out


def test_a_folder_of_several_runs_is_no_site(runs: Path, pack: Pack, tmp_path: Path) -> None:
    with pytest.raises(
        RecordError, match=r"contains 2 runs, but only one can be exported. Give one of: .*random, .*sweep"
    ):
        write_run_site(runs, tmp_path / "site", None, [str(pack.folder)], None, reveals=False)


def test_one_episode_is_exported_to_a_file(runs: Path, pack: Pack, tmp_path: Path) -> None:
    def write(name: str, episode: str) -> bytes:
        return write_run_site(
            runs / "sweep", tmp_path / name, (episode, 1), [str(pack.folder)], None, reveals=False
        ).read_bytes()

    episode = pack.episodes[0].id
    assert write("one.gif", episode).startswith(b"GIF89a")
    assert write("one.mp4", episode)[4:8] == b"ftyp"
    with pytest.raises(SettingError, match="Did you mean"):
        write("two.gif", episode[:-1])
    with pytest.raises(SettingError, match=r"\.gif, \.webp, \.mp4 or \.html"):
        write("two.mp3", episode)


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="processes are looked up in /proc")
def test_a_server_ends_with_its_drawing_process(runs: Path, pack: Pack) -> None:
    port = free_port()
    command = [sys.executable, "-c", "from vigil.cli import main; main()", "view", str(runs), "--no-open"]
    server = subprocess.Popen([*command, "--pack", str(pack.folder), "--port", str(port)], stdout=subprocess.DEVNULL)
    try:
        base = f"http://127.0.0.1:{port}"
        wait_until(lambda: _answers(f"{base}/"), "an answer of the server")
        assert _answers(f"{base}/runs/random/episodes/{pack.episodes[0].id}/1/frames/1.png")
        children = _children(server.pid)
        assert children
        server.send_signal(signal.SIGTERM)
        server.wait(HANGS_AFTER_S)
        wait_until(lambda: not any(Path(f"/proc/{child}").exists() for child in children), "the end of its processes")
    finally:
        if server.poll() is None:
            server.kill()
            server.wait()


def _answers(url: str) -> bool:
    try:
        with urllib.request.urlopen(url, timeout=HANGS_AFTER_S) as answer:
            return answer.status == 200
    except OSError:
        return False


def _children(pid: int) -> list[int]:
    """Return the ids of a process's children."""
    found = []
    for entry in os.listdir("/proc"):
        try:
            fields = Path(f"/proc/{entry}/stat").read_text().rpartition(")")[2].split() if entry.isdigit() else []
        except OSError:
            continue
        if len(fields) > 1 and int(fields[1]) == pid:
            found.append(int(entry))
    return found
