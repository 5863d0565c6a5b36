"""Clients that forge, replay, flood, dawdle or die; and a server that is killed."""

import http.client
import json
import socket
import subprocess
import sys
import threading
import urllib.request
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime
from pathlib import Path

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Origin

from tests.support.serving import KEY, REPORT, TURN, Client, open_served, serving
from tests.support.waiting import HANGS_AFTER_S, wait_until
from tests.web.test_play import hidden_words
from vigil.errors import RecordError, SettingError
from vigil.integrations.serve import host as host_module
from vigil.integrations.serve.app import MAX_INVALID
from vigil.integrations.serve.messages import MAX_MESSAGE_BYTES
from vigil.integrations.serve.patience import Patience, PatientProtocol
from vigil.packs.pack import Pack
from vigil.records.record_file import read_records


def rows(run: Path) -> list:
    return read_records(run / "episodes.jsonl")


def test_forged_and_ended_sessions_are_refused(pack: Pack, tmp_path: Path) -> None:
    with serving(pack, tmp_path / "run", KEY) as client:
        session = client.reset()["observation"]["session"]
        for forged in ("", "x", session[:-1], session.swapcase(), "é", "../run", "0" * 199):
            answer = client.ask("POST", "/step", {"action": {"text": TURN}}, forged.encode().decode("latin-1"))
            assert answer.status == 410, (forged, answer.text)
        assert client.ask("POST", "/step", {"action": {"text": TURN}}, "0" * 201).status == 422
        assert client.step(session, REPORT)["done"]
        for method, path, body in (("POST", "/step", {"action": {"text": TURN}}), ("GET", "/state", None)):
            assert client.ask(method, path, body, session).status == 410
        assert client.ask("POST", "/reset", {"session": session}).status == 410
    assert [len(row.steps) for row in rows(tmp_path / "run")] == [1]


def test_without_the_servers_token_nothing_is_answered(pack: Pack, tmp_path: Path) -> None:
    with serving(pack, tmp_path / "run", KEY) as client:
        for token in ("", "Bearer", "Bearer a long secreT", f"Basic {KEY}"):
            for method, path in (("POST", "/reset"), ("GET", "/contract"), ("GET", "/openapi.json")):
                body = {} if method == "POST" else None
                assert client.ask(method, path, body, Authorization=token).status == 401
            with pytest.raises(InvalidStatus, match="403"), connect(socket_url(client), additional_headers={}):
                pass
        assert client.ask("GET", "/health", Authorization="").status == 200
        assert client.open_sessions == 0


def test_pages_of_other_sites_are_refused(pack: Pack, tmp_path: Path) -> None:
    with serving(pack, tmp_path / "run") as client:
        assert client.ask("POST", "/reset", {}, Origin="http://evil.example").status == 403
        assert client.ask("POST", "/reset", {}, Host="evil.example").status == 421
        for origin in ("http://evil.example", "null", client.site.url):
            with pytest.raises(InvalidStatus, match="403"), connect(socket_url(client), origin=Origin(origin)):
                pass


@pytest.mark.parametrize(
    "body", [b"", b"{", b"[]", b"null", b'{"action": 1}', b'{"action": {"text": 5}}', b"[" * 100_000, b'{"action":{}}']
)
def test_nonsense_changes_nothing(pack: Pack, tmp_path: Path, body: bytes) -> None:
    with serving(pack, tmp_path / "run", limit=1) as client:
        session = client.reset()["observation"]["session"]
        answer = client.ask("POST", "/step", body, session)
        assert answer.status in (200, 400, 415, 422), answer.text
        if answer.status == 200:  # an empty reply is a reply
            assert json.loads(answer.body)["observation"]["moment"] == 1
        else:
            assert client.reset(session=session)["observation"]["moment"] == 0


def test_a_reply_that_arrives_twice_is_carried_out_once(pack: Pack, tmp_path: Path) -> None:
    with serving(pack, tmp_path / "run", limit=1) as client:
        session = client.reset()["observation"]["session"]
        with ThreadPoolExecutor(8) as pool:
            answers = list(pool.map(lambda _: client.step(session, TURN, moment=0), range(8)))
        assert {answer["observation"]["moment"] for answer in answers} == {1}
        client.step(session, REPORT, moment=1)
    assert [len(row.steps) for row in rows(tmp_path / "run")] == [2]


def test_giant_requests_are_refused_and_the_session_goes_on(pack: Pack, tmp_path: Path) -> None:
    with serving(pack, tmp_path / "run", limit=1) as client:
        session = client.reset()["observation"]["session"]
        connection = http.client.HTTPConnection("127.0.0.1", client.site.port, timeout=HANGS_AFTER_S)
        connection.putrequest("POST", "/step")
        connection.putheader("Content-Type", "application/json")
        connection.putheader("Content-Length", str(MAX_MESSAGE_BYTES + 1))
        connection.endheaders()
        assert connection.getresponse().status == 415
        connection.close()
        chunked = client.ask("POST", "/step", b"0\r\n\r\n", session, **{"Transfer-Encoding": "chunked"})
        assert chunked.status in (400, 415)
        with connect(socket_url(client)) as ws:
            ws.send("x" * (MAX_MESSAGE_BYTES + 1))
            with pytest.raises(ConnectionClosed):
                ws.recv(HANGS_AFTER_S)
        answer = client.step(session, "x" * 200_000)
        assert answer["observation"]["moment"] == 1
        client.step(session, REPORT)
    (record,) = rows(tmp_path / "run")
    assert [step.invalid and step.invalid.reason for step in record.steps] == ["too_long", None]


def test_slow_requests_lose_their_connection_and_not_their_session(
    pack: Pack, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(PatientProtocol, "request_seconds", 0.2)
    monkeypatch.setattr(Patience.__init__, "__defaults__", (0.2,))
    with serving(pack, tmp_path / "run", limit=1) as client:
        session = client.reset()["observation"]["session"]
        head = b"POST /reset HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: 2\r\n\r\n"
        for sent in (b"", b"POST /reset HT", head, head + b"{"):
            with socket.create_connection(("127.0.0.1", client.site.port), HANGS_AFTER_S) as slow:
                slow.sendall(sent)
                answer = slow.recv(100)
                assert b"200" not in answer
                while answer:
                    answer = slow.recv(1000)
        assert client.step(session, REPORT)["done"]


def test_the_number_of_sessions_is_bounded(pack: Pack, tmp_path: Path) -> None:
    with serving(pack, tmp_path / "run", max_sessions=2) as client:
        with ThreadPoolExecutor(6) as pool:
            answers = list(pool.map(lambda _: client.ask("POST", "/reset", {}), range(6)))
        assert sorted(answer.status for answer in answers) == [200, 200, 503, 503, 503, 503]
        first = next(json.loads(answer.body) for answer in answers if answer.status == 200)
        client.step(first["observation"]["session"], REPORT)
        client.reset()


def test_a_client_that_stops_answering_frees_its_session(pack: Pack, tmp_path: Path) -> None:
    with serving(pack, tmp_path / "run", max_sessions=1, reply_seconds=1) as client:
        client.reset()
        wait_until(lambda: client.open_sessions == 0, "the end of the session")
        client.reset()
    record, *_ = rows(tmp_path / "run")  # the second session may have ended too
    assert record.end == "invalid_action_limit_exceeded"
    assert {step.invalid and step.invalid.reason for step in record.steps} == {"agent_ended"}
    assert record.steps[0].reply.agent_ended == "The client did not answer for 1 s."


def test_an_episode_has_a_budget_of_time(pack: Pack, tmp_path: Path) -> None:
    with serving(pack, tmp_path / "run", episode_seconds=1) as client:
        session = client.reset()["observation"]["session"]
        while (answer := client.ask("POST", "/step", {"action": {"text": TURN}}, session)).status == 200:
            if json.loads(answer.body)["done"]:
                break
        wait_until(lambda: client.open_sessions == 0, "the end of the session")
    (record,) = rows(tmp_path / "run")
    ended = {step.reply.agent_ended for step in record.steps} - {""}
    assert record.end == "fail_no_report" or ended == {"The client used up the episode's time."}


def socket_url(client: Client) -> str:
    return client.site.url.replace("http", "ws") + "/ws"


def test_a_killed_client_frees_its_session(pack: Pack, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(host_module, "RECONNECT_SECONDS", 0.1)
    with serving(pack, tmp_path / "run", KEY) as client:
        code = (
            "import sys, json\nfrom websockets.sync.client import connect\n"
            "ws = connect(sys.argv[1], additional_headers={'Authorization': 'Bearer ' + sys.argv[2]})\n"
            "ws.send('{\"type\": \"reset\"}')\nws.recv()\nprint('begun', flush=True)\nsys.stdin.read()\n"
        )
        command, pipe = [sys.executable, "-c", code, socket_url(client), KEY], subprocess.PIPE
        with subprocess.Popen(command, stdin=pipe, stdout=pipe) as player:
            assert player.stdout is not None
            assert player.stdout.readline() == b"begun\n"
            assert client.open_sessions == 1
            player.kill()
        wait_until(lambda: client.open_sessions == 0, "the end of the session")
    (record,) = rows(tmp_path / "run")
    assert {step.reply.agent_ended for step in record.steps} == {"The client closed the connection."}


def test_a_client_comes_back_after_its_connection_broke(pack: Pack, tmp_path: Path) -> None:
    with serving(pack, tmp_path / "run", limit=1) as client:
        with connect(socket_url(client)) as ws:
            ws.send('{"type": "reset"}')
            first = json.loads(ws.recv())["data"]["observation"]
            ws.send(json.dumps({"type": "step", "data": {"text": TURN}}))
            before = json.loads(ws.recv())["data"]["observation"]
        with connect(socket_url(client)) as ws:
            ws.send(json.dumps({"type": "reset", "data": {"session": first["session"]}}))
            again = json.loads(ws.recv())["data"]["observation"]
            assert (again["moment"], again["frame"]) == (1, before["frame"])
            ws.send('{"type": "state"}')
            assert json.loads(ws.recv()) == {"type": "state", "data": {"episode_id": None, "step_count": 1}}
            ws.send(json.dumps({"type": "step", "data": {"text": REPORT}}))
            assert json.loads(ws.recv())["data"]["done"] is True
    assert [len(row.steps) for row in rows(tmp_path / "run")] == [2]


def test_bad_messages_get_an_error_and_leak_nothing(pack: Pack, tmp_path: Path) -> None:
    with serving(pack, tmp_path / "run") as client, connect(socket_url(client)) as ws:
        told = []
        for text in ("", "{", "[]", '{"type": 1}', '{"type": "teleport"}', '{"type": "step", "data": {"text": "x"}}'):
            ws.send(text)
            told.append(ws.recv())
            assert json.loads(told[-1])["type"] == "error"
        ws.send('{"type": "reset", "data": {"index": 0}}')
        told.append(ws.recv())
        assert "The server chooses the episodes" in str(told[-1])
        for word in [*hidden_words(pack), str(tmp_path), "Traceback"]:
            assert word not in "".join(map(str, told))


def test_a_client_that_sends_only_nonsense_loses_its_connection_and_no_other(pack: Pack, tmp_path: Path) -> None:
    with serving(pack, tmp_path / "run") as client, connect(socket_url(client)) as honest:
        with connect(socket_url(client)) as flood:
            for _ in range(MAX_INVALID):
                flood.send("{}")
                assert json.loads(flood.recv())["type"] == "error"
            with pytest.raises(ConnectionClosed):
                flood.recv()
        honest.send('{"type": "reset"}')
        assert json.loads(honest.recv())["type"] == "observation"


def test_a_failure_inside_is_not_told(pack: Pack, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with serving(pack, tmp_path / "run") as client:
        session = client.reset()["observation"]["session"]

        def full(*_: object) -> None:
            raise RecordError(f"Cannot write to {tmp_path}")

        with monkeypatch.context() as broken:
            broken.setattr(client.host._journal, "add", full)
            answer = client.ask("POST", "/step", {"action": {"text": TURN}}, session)
        assert answer.status == 503
        assert str(tmp_path) not in answer.text
        assert client.step(session, TURN, moment=0)["observation"]["moment"] == 1


def test_a_server_that_ends_goes_on_with_its_sessions(pack: Pack, tmp_path: Path) -> None:
    run = tmp_path / "run"
    with serving(pack, run) as client:
        done = client.reset()["observation"]["session"]
        client.step(done, REPORT)
        session = client.reset()["observation"]["session"]
        before = client.step(session, TURN)
    assert len(rows(run)) == 1
    with (run / "sessions.jsonl").open("ab") as file:
        file.write(b'{"session": "00')  # what a crash leaves
    with serving(pack, run) as client:
        assert client.open_sessions == 1
        again = client.step(session, TURN, moment=0)  # the answer to it was lost
        assert again["observation"] == before["observation"]
        assert client.ask("POST", "/step", {"action": {"text": TURN}}, done).status == 410
        assert client.step(session, REPORT)["done"]
        for _ in pack.episodes[2:]:
            client.step(client.reset()["observation"]["session"], REPORT)
        assert client.reset()["observation"]["nothing_left"]
    assert [len(row.steps) for row in rows(run)] == [1, 2, *[1] * (len(pack.episodes) - 2)]
    assert {row.attempt for row in rows(run)} == {1}
    assert session not in (run / "sessions.jsonl").read_text()


def test_a_killed_server_loses_nothing(pack: Pack, tmp_path: Path) -> None:
    run, sessions = tmp_path / "run", []
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    options = ["--name", "ada", "--log-dir", str(run), "--backend", "fake", "--workers", "1", "--port", str(port)]
    start = [sys.executable, "-c", "from vigil.cli import main; main()"]
    command = [*start, "serve", str(pack.folder), *options, "--frame-interval-seconds", "0"]

    def ask(path: str, body: object, session: str = "") -> dict:
        headers = {"Content-Type": "application/json", "Vigil-Session": session}
        request = urllib.request.Request(f"http://127.0.0.1:{port}{path}", json.dumps(body).encode(), headers)
        with urllib.request.urlopen(request, timeout=HANGS_AFTER_S) as answer:
            return json.loads(answer.read())

    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        assert server.stdout is not None
        assert any("Serving" in line for line in iter(server.stdout.readline, ""))
        sessions.append(ask("/reset", {})["observation"]["session"])
        ask("/step", {"action": {"text": TURN}}, sessions[0])
        server.kill()
    killed = datetime.now(UTC)
    with serving(pack, run) as client:
        assert client.step(sessions[0], REPORT)["done"]
    assert [(len(row.steps), row.started < killed) for row in rows(run)] == [(2, True)]


def test_sessions_do_not_see_each_other(pack: Pack, tmp_path: Path) -> None:
    with serving(pack, tmp_path / "run") as client:
        begun = [client.reset()["observation"] for _ in range(4)]
        barrier = threading.Barrier(4)

        def play(number: int) -> int:
            barrier.wait()
            for _ in range(number):
                client.step(begun[number]["session"], TURN)
            return client.step(begun[number]["session"], REPORT)["observation"]["moment"]

        with ThreadPoolExecutor(4) as pool:
            assert list(pool.map(play, range(4))) == [1, 2, 3, 4]
    assert sorted(len(row.steps) for row in rows(tmp_path / "run")) == [1, 2, 3, 4]


def test_one_run_has_one_server(pack: Pack, tmp_path: Path) -> None:
    with serving(pack, tmp_path / "run"), pytest.raises(RecordError, match="another process"):
        open_served(pack, tmp_path / "run")
    with pytest.raises(SettingError, match="give at most 60 letters"):
        open_served(pack, tmp_path / "other", name="../ada")


def test_training_sends_the_reward_and_lets_clients_choose(pack: Pack, tmp_path: Path) -> None:
    with serving(pack, tmp_path / "run", training=True, epochs=2, families=("DA",)) as client:
        first, second = (client.reset(index=0)["observation"] for _ in range(2))
        assert first["frame"] == second["frame"]
        assert client.step(first["session"], REPORT)["reward"] == 0.0
        assert client.ask("POST", "/reset", {"index": 99}).status == 400
