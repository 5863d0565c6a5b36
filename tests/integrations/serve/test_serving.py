"""A server's sessions: the contract over the wire, the record, and that nothing hidden crosses."""

import json
from pathlib import Path

from tests.support.serving import KEY, REPORT, TURN, serving
from tests.web.test_play import hidden_words
from vigil.packs.pack import Pack
from vigil.records.record import read_header
from vigil.records.record_file import read_records
from vigil.runner.verify_run import VerifySettings, verify_run


def test_the_record_is_the_servers_and_nothing_hidden_crosses(pack: Pack, tmp_path: Path) -> None:
    with serving(pack, tmp_path / "run", KEY) as client:
        for path in ("/health", "/metadata", "/contract", "/schema", "/openapi.json", "/runs", "/sessions.jsonl"):
            client.ask("GET", path)
        client.ask("POST", "/mcp", {})
        for _ in pack.episodes:
            begun = client.reset(seed=3, episode_id=pack.episodes[0].id)["observation"]
            session = begun["session"]
            client.step(session, TURN)
            client.step(session, "this is no action")
            assert client.step(session, REPORT) == {
                "observation": {"moment": 3, "metadata": {}},
                "reward": None,
                "done": True,
            }
            client.ask("GET", "/state", session=session)
        assert client.reset()["observation"] == {"metadata": {}, "nothing_left": True}
        told = b"\n".join(client.traffic).decode()
    header, records = read_header(tmp_path / "run"), read_records(tmp_path / "run" / "episodes.jsonl")
    for word in [*hidden_words(pack), header.run_id + "/", header.nonce, pack.name, pack.sha256, str(tmp_path)]:
        assert word not in told, word
    assert (header.spec.agent, header.spec.agent_kind) == ("remote:ada", "remote")
    assert header.ended is not None
    assert {record.episode_id for record in records} == {episode.id for episode in pack.episodes}
    assert all(step.frame_sha256 for record in records for step in record.steps)
    assert verify_run(tmp_path / "run", VerifySettings(workers=1)).is_verified


def test_a_client_gets_the_frame_the_instruction_and_the_prompt(pack: Pack, tmp_path: Path) -> None:
    with serving(pack, tmp_path / "run", profile="action_feedback") as client:
        first = client.reset()["observation"]
        assert set(first) == {"moment", "metadata", "session", "instruction", "prompt", "frame"}
        assert first["instruction"] in first["prompt"]
        second = client.step(first["session"], TURN)["observation"]
        assert set(second) == {"moment", "metadata", "frame", "feedback"}
        assert second["frame"]["data"] != first["frame"]["data"]
        assert json.loads(client.ask("GET", "/state", session=first["session"]).body) == {
            "episode_id": None,
            "step_count": 1,
        }
