"""The wires, without AI2-THOR's client: forms over HTTP, messages for pipes, the command line."""

import io
import json
import os
import shlex
import subprocess
import sys
import threading
from email.parser import BytesParser
from email.policy import HTTP
from http.server import BaseHTTPRequestHandler, HTTPServer

import pytest
from typer.testing import CliRunner

from tests.support.waiting import HANGS_AFTER_S
from vigil.cli import app
from vigil.errors import SettingError
from vigil.thor.base.images import Image
from vigil.thor.engine import EngineResponse
from vigil.thor.launch import thor_engine
from vigil.thor.serve import main
from vigil.thor.wire import fifo, wsgi


def fields_of(message: bytes) -> list[tuple[int, bytes]]:
    found, place = [], 0
    while place < len(message):
        kind, length = fifo.HEADER.unpack_from(message, place)
        place += fifo.HEADER.size
        found.append((kind, message[place : place + length]))
        place += length
    return found


def test_a_message_is_its_fields_and_an_end():
    response = EngineResponse({"sequenceId": 3}, [Image("image", False, b"rgb"), Image("depth", True, b"far")])
    fields = fields_of(fifo.message(response, lambda data: json.dumps(data).encode()))
    assert fields == [(1, b'{"sequenceId": 3}'), (4, b"rgb"), (12, b"far"), (255, b"")]
    patch = fields_of(fifo.message(EngineResponse({}, is_patch=True), lambda data: b"{}"))
    assert [kind for kind, _ in patch] == [11, 255]


def test_a_pipe_that_cannot_be_opened_is_an_error_at_once(client, tmp_path):
    with pytest.raises(IsADirectoryError):
        fifo.serve(client.engine, {"AI2THOR_FIFO_SERVER_PIPE_PATH": str(tmp_path)})


def test_actions_are_read_to_the_end_of_the_pipe():
    one = json.dumps({"action": "Pass"}).encode()
    whole = fifo.HEADER.pack(2, len(one)) + one + fifo.HEADER.pack(255, 0)
    assert list(fifo.actions(io.BytesIO(whole * 2 + whole[:3]))) == [{"action": "Pass"}] * 2
    with pytest.raises(fifo.ClientGone):
        list(fifo.actions(io.BytesIO(fifo.HEADER.pack(77, 0))))
    with pytest.raises(fifo.ClientGone):
        list(fifo.actions(io.BytesIO(fifo.HEADER.pack(255, 0))))


@pytest.fixture
def posts():
    """A server that answers each form with the next of its actions, and keeps what was posted."""
    kept: list[dict] = []
    replies = [{"action": "MoveAhead", "sequenceId": 1}, {"action": "Fly", "sequenceId": 2}, {}]

    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def do_POST(self) -> None:
            body = self.rfile.read(int(self.headers["Content-Length"]))
            head = f"Content-Type: {self.headers['Content-Type']}\r\n\r\n".encode()
            parts = BytesParser(policy=HTTP).parsebytes(head + body).iter_parts()
            kept.append(
                {part.get_param("name", header="content-disposition"): part.get_payload(decode=True) for part in parts}
            )
            reply = json.dumps(replies[len(kept) - 1]).encode()
            self.send_response(200)
            self.send_header("Content-Length", str(len(reply)))
            self.end_headers()
            self.wfile.write(reply)

        def log_message(self, format: str, *args: object) -> None:
            """Says nothing."""

    server = HTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield server.server_address, kept
    server.shutdown()
    thread.join()
    server.server_close()


def test_each_form_carries_what_the_last_action_did(client, posts):
    (host, port), kept = posts
    client.stand(3.5, 2.5, yaw=90.0)
    environment = {"AI2THOR_HOST": host, "AI2THOR_PORT": str(port), "AI2THOR_CLIENT_TOKEN": "secret"}
    wsgi.serve(client.engine, environment)
    metadata = [json.loads(form["metadata"]) for form in kept]
    assert [each["sequenceId"] for each in metadata] == [0, 1, 2]
    assert [each["agents"][0]["lastActionSuccess"] for each in metadata] == [True, True, False]
    assert metadata[2]["agents"][0]["errorMessage"] == "Invalid action: Fly"
    assert {form["token"] for form in kept} == {b"secret"}
    assert len(kept[0]["image"]) == 32 * 24 * 3


def test_without_a_client_the_engine_says_how_it_is_started(monkeypatch, capsys):
    monkeypatch.delenv("AI2THOR_SERVER_TYPE", raising=False)
    assert main(["-screen-width", "300"]) == 2
    assert "vigil.thor_engine()" in capsys.readouterr().err


def test_the_verb_takes_what_the_client_adds(monkeypatch):
    monkeypatch.delenv("AI2THOR_SERVER_TYPE", raising=False)
    words = ["-screen-fullscreen", "0", "-screen-quality", "7", "-screen-width", "300", "-screen-height", "300"]
    done = CliRunner().invoke(app, ["thor-engine", "--backend", "fake", *words])
    assert done.exit_code == 2
    assert "The engine is started by AI2-THOR's client" in done.output


def test_the_command_is_one_that_the_client_can_split(monkeypatch, tmp_path):
    monkeypatch.delenv("DISPLAY", raising=False)
    words = shlex.split(thor_engine(backend="fake", quality="fast"))
    assert words == [sys.executable, "-m", "vigil.thor", "--backend=fake", "--render-quality=fast"]
    assert os.environ["DISPLAY"]
    with pytest.raises(SettingError, match="does not have backend"):
        thor_engine(backend="unity")
    with pytest.raises(SettingError, match="does not exist"):
        thor_engine(asset_database=tmp_path / "nowhere.json")


def test_the_client_that_vanishes_leaves_no_engine(tmp_path):
    """Nobody ever reads from the pipe, and the process that started the engine ends."""
    pipe = tmp_path / "server.pipe"
    os.mkfifo(pipe)
    starter = "import os, sys; from vigil.thor.wire import fifo\nif os.fork(): sys.exit()\n"
    starter += f"try: fifo._opened({str(pipe)!r}, os.getppid() if os.getppid() != 1 else 0)\n"
    starter += "except fifo.ClientGone: print('gone', flush=True)"
    done = subprocess.run(
        [sys.executable, "-c", starter], capture_output=True, text=True, timeout=HANGS_AFTER_S, check=True
    )
    assert done.stdout == "gone\n"
