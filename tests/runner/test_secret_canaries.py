"""Secrets stay out of every file of a run: each way to hand one in, played for real, and the whole folder searched."""

import io
import sys
import zipfile
from pathlib import Path
from typing import Any

import pytest

from tests.support.chat_server import REPORT, ChatAnswer, ChatServer, failure, serving
from tests.support.inspect_marks import INSPECT
from tests.support.narrowing import present
from tests.support.quick_runs import quick
from tests.support.tiny_pack import tiny_pack
from vigil.analysis.measures.rows import read_runs
from vigil.analysis.measures.study import study
from vigil.analysis.report import make_report, markdown_report
from vigil.cli.scores import score
from vigil.errors import VigilError
from vigil.runner.run import RunResult, run_pack
from vigil.runner.settings import RunSettings

pytestmark = INSPECT
CANARY = "zqcanary"
HANDED: dict[str, Any] = {
    "extra_body": {
        "api_key": f"{CANARY}one",
        "nested": [{"deep": [{"token": f"{CANARY}two"}]}, ["Authorization", f"Bearer {CANARY}three"]],
        "extra_headers": {"X-Anything": f"{CANARY}four"},
        "proxy": f"http://me:{CANARY}five@proxy:1",
    },
    "model_args": {
        "default_headers": {"X-Team": f"{CANARY}six", "Authorization2": f"Bearer {CANARY}seven"},
        "default_query": {"api_key": f"{CANARY}eight"},
    },
}


@pytest.fixture(scope="module")
def pack(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("packs") / "tiny"
    tiny_pack(folder, 8)
    return folder


def settings(pack: Path, folder: Path, **changes: Any) -> RunSettings:
    return quick(pack, folder, **{"retries": 1, "limit": 2, "max_connections": 1, **changes})


def files_with(canary: str, folder: Path) -> list[str]:
    """Return the files that hold the canary, packed ones unpacked."""
    found = []
    for path in sorted(folder.rglob("*")):
        if path.is_file() and canary.encode() in unpacked(path.read_bytes()):
            found.append(path.name)
    return found


def unpacked(data: bytes) -> bytes:
    if not zipfile.is_zipfile(io.BytesIO(data)):
        return data
    with zipfile.ZipFile(io.BytesIO(data)) as packed:
        return data + b"".join(packed.read(name) for name in packed.namelist())


def asked(server: ChatServer) -> bytes:
    return b"".join(server.raw)


def shown(folder: Path) -> str:
    return markdown_report(make_report(study(read_runs([folder]), with_paper=False), ()), figures=False)


def test_a_models_secrets_reach_the_server_and_no_file(
    pack: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("OPENAI_API_KEY", f"{CANARY}own")
    monkeypatch.setenv("OPENAI_ORG_ID", f"{CANARY}org")
    monkeypatch.setenv("LOCAL_API_KEY", f"{CANARY}local")
    monkeypatch.setenv("MY_KEY", f"{CANARY}chosen")
    said = {"on": True}

    def brain(_: Any) -> ChatAnswer:
        everything = " ".join(f"{CANARY}{n}" for n in ("one", "two", "three", "four", "five", "eight", "chosen"))
        return (
            failure(500, f"cannot take {everything}") if said["on"] else ChatAnswer(REPORT, model=f"echo {CANARY}nine")
        )

    with serving(brain) as server:
        url = server.url.replace("http://", f"http://me:{CANARY}nine@")
        wanted = settings(
            pack,
            tmp_path / "run",
            model="openai/loopback",
            base_url=url,
            api_key_env="MY_KEY",
            **HANDED,
            preflight=False,
        )
        result = run_pack(wanted)
        assert result.errors == 2
        assert "cannot take (not recorded) (not recorded)" in present(result.records[0].error).message
        assert files_with(CANARY, tmp_path / "run") == []
        said["on"] = False
        # another key, the same run
        other = {**HANDED, "extra_body": {**HANDED["extra_body"], "api_key": f"{CANARY}changed"}}
        again: RunResult = run_pack(
            settings(pack, tmp_path / "run", model="openai/loopback", base_url=url, preflight=True, **other)
        )
    assert again.is_complete
    assert files_with(CANARY, tmp_path / "run") == []
    assert files_with("loopback", tmp_path / "run") != []
    assert any(name.endswith(".eval") for name in files_with("loopback", tmp_path / "run"))
    sent = asked(server)
    for name in ("one", "two", "three", "four", "six", "changed"):
        assert f"{CANARY}{name}".encode() in sent, name
    for name in ("own", "org", "local"):
        assert f"{CANARY}{name}".encode() not in sent, name
    score([tmp_path / "run"])
    assert CANARY not in capsys.readouterr().out + shown(tmp_path / "run")


def test_no_key_follows_a_redirect(pack: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MY_KEY", f"{CANARY}chosen")
    with serving(lambda _: ChatAnswer(REPORT)) as thief:

        def brain(_: Any) -> ChatAnswer:
            target = thief.url.replace("127.0.0.1", "localhost") + "/chat/completions"
            return ChatAnswer(REPORT, status=307, headers={"Location": target})

        with serving(brain) as server:
            args = {"default_headers": {"x-api-key": f"{CANARY}header"}}
            result = run_pack(
                settings(
                    pack, tmp_path / "run", model="openai/m", base_url=server.url, api_key_env="MY_KEY",
                    model_args=args, preflight=False,
                )
            )  # fmt: skip
    assert thief.raw == []
    assert f"{CANARY}chosen".encode() in asked(server)
    assert result.errors == 2


AGENT = f"""
import os, sys
print("told", sys.argv, os.environ["A_TOKEN"], file=sys.stderr, flush=True)
if "--fail" in sys.argv: sys.exit(sys.argv)
for line in sys.stdin:
    if '"type": "observation"' in line: print({REPORT!r}, flush=True)
"""


@pytest.mark.parametrize(
    "words",
    ["--api-key {}", "--token={}", "--header 'X-Api-Key: {}'", "--url http://me:{}@host/v1", "{}", "API_KEY={}"],
)
def test_a_programs_secrets_reach_it_and_no_file(
    pack: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: str
) -> None:
    (tmp_path / "agent.py").write_text(AGENT)
    run = tmp_path / "run"

    def command(secret: str) -> str:
        monkeypatch.setenv("A_TOKEN", secret)
        return f"exec:{sys.executable} {tmp_path / 'agent.py'} {words.format(secret)}"

    result = run_pack(settings(pack, run, agent=command(f"{CANARY}one"), limit=1))
    assert result.is_complete
    assert "(not recorded)" in result.header.spec.agent
    assert run_pack(settings(pack, run, agent=command(f"{CANARY}two"), limit=1)).resumed == 1
    assert "told" in "".join(path.read_text() for path in run.glob("logs/*.log"))
    assert files_with(CANARY, run) == []


def test_messages_to_the_user_hold_no_secret(pack: Path, tmp_path: Path) -> None:
    for wanted in (
        settings(pack, tmp_path / "a", agent=f"exec:/no/such/program --api-key {CANARY}"),
        settings(pack, tmp_path / "b", model="openai/m", base_url=f"ftp://me:{CANARY}@host"),
        settings(pack, tmp_path / "c", model="nosuch/m", model_args={"api_key": CANARY}),
    ):
        with pytest.raises(VigilError) as raised:
            run_pack(wanted)
        assert CANARY not in str(raised.value)
