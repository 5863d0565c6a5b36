"""`vigil run --env`: agents, programs and models play through a server, whose record is that of a local run."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from tests.support import chat_server
from tests.support.serving import KEY, REPORT, Client, serving
from vigil.cli import app
from vigil.errors import InfrastructureError, SettingError
from vigil.integrations.serve.client import RemoteEnvironment
from vigil.integrations.serve.playing import play_remotely
from vigil.packs.pack import Pack
from vigil.records.record import EpisodeRecord
from vigil.records.record_file import read_records
from vigil.runner.plan import RemotePlan, plan_remote_run, plan_run
from vigil.runner.run import run_pack
from vigil.runner.settings import RunSettings

EXAMPLE = Path(__file__).parents[3] / "examples" / "remote_client.py"
PROGRAM = """
import json, sys
for line in sys.stdin:
    message = json.loads(line)
    if message["type"] == "observation":
        print(json.dumps({"skill_name": "look", "arguments": {"direction": "up", "magnitude": 5}}), flush=True)
        if __name__ == "__main__" and len(sys.argv) > 1:
            sys.exit(3)
"""


def through(client: Client, **settings: Any) -> RemotePlan:
    """Return the plan of a run on the server of `client`."""
    chosen = {"env": client.site.url, "env_token": client.token, "workers": 2, "max_connections": 4, **settings}
    return plan_remote_run(RunSettings(**chosen))


def steps_of(run: Path) -> dict[str, list[dict[str, Any]]]:
    """The steps of each episode, without what differs from play to play."""
    timed = {"steps": {"__all__": {"reply": {"seconds", "usage"}}}}
    rows: list[EpisodeRecord] = read_records(run / "episodes.jsonl")
    return {row.episode_id: row.model_dump(mode="json", exclude=timed)["steps"] for row in rows}


def test_a_programs_record_is_that_of_a_local_run(pack: Pack, tmp_path: Path) -> None:
    program = tmp_path / "program.py"
    program.write_text(PROGRAM)
    agent, quick = f"exec:{sys.executable} {program}", {"backend": "fake", "frame_interval_seconds": 0.0}
    local = run_pack(RunSettings(pack=pack.folder, agent=agent, log_dir=tmp_path / "local", limit=2, **quick))
    with serving(pack, tmp_path / "run", KEY, limit=2) as client:
        assert play_remotely(through(client, agent=agent)) == 2
    assert steps_of(tmp_path / "run") == steps_of(local.folder)


def test_the_plain_client_of_the_examples_plays_every_episode(pack: Pack, tmp_path: Path) -> None:
    with serving(pack, tmp_path / "run") as client:
        command = [sys.executable, str(EXAMPLE), client.site.url]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert sorted(done.stdout.splitlines()) == sorted(episode.instruction for episode in pack.episodes)
    rows: list[EpisodeRecord] = read_records(tmp_path / "run" / "episodes.jsonl")
    assert sorted(row.episode_id for row in rows) == sorted(episode.id for episode in pack.episodes)


def test_a_program_that_ends_is_recorded_as_a_local_one(pack: Pack, tmp_path: Path) -> None:
    program = tmp_path / "program.py"
    program.write_text(PROGRAM)
    with serving(pack, tmp_path / "run", limit=1) as client:
        play_remotely(through(client, agent=f"exec:{sys.executable} {program} end"))
    (record,) = read_records(tmp_path / "run" / "episodes.jsonl")
    assert any(step.invalid and step.invalid.reason == "agent_ended" for step in record.steps)
    assert any("exit code 3" in step.reply.agent_ended for step in record.steps)


def test_a_model_plays_through_a_server(pack: Pack, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SOME_KEY", "unused")
    with (
        chat_server.serving(lambda _: chat_server.ChatAnswer(REPORT)) as model,
        serving(pack, tmp_path / "run", KEY, limit=2) as client,
    ):
        model_of = {"model": "openai-api/some/x", "base_url": model.url, "api_key_env": "SOME_KEY"}
        played = play_remotely(through(client, preflight=False, **model_of))
    assert played == 2
    records = read_records(tmp_path / "run" / "episodes.jsonl")
    assert {record.end for record in records} == {"report"}
    assert all(record.steps[0].reply.usage for record in records)


def test_a_long_or_broken_reply_reaches_the_record(pack: Pack, tmp_path: Path) -> None:
    program = tmp_path / "program.py"
    program.write_text(
        "import sys\nfor line in sys.stdin:\n  if b'observation' in line.encode()[:40]:\n"
        "    sys.stdout.buffer.write(b'\\xff' * 9 + b'\\n'); sys.stdout.flush()\n"
        "    sys.stdin.readline(); sys.stdout.write('\\x01' * 900000 + '\\n'); sys.stdout.flush()\n"
    )
    with serving(pack, tmp_path / "run", limit=1) as client:
        play_remotely(through(client, agent=f"exec:{sys.executable} {program}"))
    (record,) = read_records(tmp_path / "run" / "episodes.jsonl")
    reasons = [step.invalid.reason for step in record.steps if step.invalid]
    assert reasons[:2] == ["not_utf8", "too_long"]


def test_what_the_server_decides_cannot_be_set(pack: Pack, tmp_path: Path) -> None:
    with serving(pack, tmp_path / "run", KEY) as client:
        with pytest.raises(SettingError, match=r"--limit, --profile: with --env, the server decides this"):
            play_remotely(through(client, agent="noop", limit=3, profile="action_feedback"))
        with pytest.raises(SettingError, match=r"give --env-token, or set VIGIL_ENV_TOKEN"):
            play_remotely(through(client, agent="noop", env_token=""))
        with pytest.raises(SettingError, match="'solver' does not exist"):
            play_remotely(through(client, agent="solver"))
    with pytest.raises(SettingError, match=r"is not the address of a server"):
        play_remotely(through(client, agent="noop", env="127.0.0.1:8380"))
    with pytest.raises(InfrastructureError, match=r"cannot be reached"):
        RemoteEnvironment(client.site.url).contract()
    with pytest.raises(SettingError, match="the server plans and records"):
        plan_run(RunSettings(env=client.site.url, agent="noop"))


def test_the_command_says_who_has_the_records(pack: Pack, tmp_path: Path) -> None:
    with serving(pack, tmp_path / "run", limit=1) as client:
        result = CliRunner().invoke(app, ["run", "--env", client.site.url, "--agent", "noop"])
    assert result.exit_code == 0, result.output
    assert f"1 episodes were played at {client.site.url}; the server keeps their records" in result.output
