"""A person's play: the contract, the record, the order, going on after a crash; and that nothing hidden crosses."""

import base64
import json
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from tests.support.web_server import Site, served
from vigil.cli import app
from vigil.errors import RecordError, SettingError
from vigil.packs.pack import Pack
from vigil.records.record import read_header
from vigil.records.record_file import read_records
from vigil.runner.verify_run import VerifySettings, verify_run
from vigil.scoring.outcomes import score
from vigil.web.live_play import random_order
from vigil.web.play import JOURNAL, PlaySettings, make_play, open_play_session

TURN = '{"skill_name": "navigate", "arguments": {"mode": "turn_left", "magnitude": 90}}'
POINT = '{"skill_name": "interact_pixel", "arguments": {"intent": "ground", "x": 320, "y": 300}}'
REPORT = '{"skill_name": "report", "arguments": {"status": "closed", "summary": "I looked."}}'


def settings(pack: Pack, folder: Path, **changes: Any) -> PlaySettings:
    return PlaySettings(**{"player": "ada", "pack": pack.folder, "log_dir": folder, "backend": "fake", **changes})


def ask(site: Site, path: str, body: Any = None) -> dict[str, Any]:
    answer = site.get(path) if body is None else site.post(path, json.dumps(body))
    assert answer.status == 200, answer.text
    return json.loads(answer.body)


def finish(site: Site) -> dict[str, Any]:
    state = ask(site, "/next", {})
    while state["is_on"]:
        state = ask(site, "/reply", {"moment": state["moment"], "text": REPORT})
    return state


def test_a_sitting_is_a_normal_run_and_nothing_hidden_crosses(pack: Pack, tmp_path: Path) -> None:
    play_session = open_play_session(settings(pack, tmp_path / "run"))
    traffic: list[bytes] = []
    try:
        with served(make_play(play_session)) as site:

            def heard(path: str, body: Any = None) -> dict[str, Any]:
                answer = site.get(path) if body is None else site.post(path, json.dumps(body))
                traffic.extend([answer.body, json.dumps(answer.headers).encode()])
                return json.loads(answer.body)

            traffic.append(site.get("/").body)
            assert heard("/state")["is_on"] is False
            state = {}
            for _ in pack.episodes:
                state = heard("/next", {})
                for text in (TURN, "this is no action", POINT):
                    if state["is_on"]:
                        state = heard("/reply", {"moment": state["moment"], "text": text})
                while state["is_on"]:
                    assert state["feedback"] is None
                    state = heard("/reply", {"moment": state["moment"], "text": REPORT})
            assert (state["done"], state["of"]) == (len(pack.episodes), len(pack.episodes))
            for path in ("/runs", "/houses", "/houses/tiny/tiny", "/episodes.jsonl", "/compare", f"/{JOURNAL}"):
                assert site.get(path).status == 404
            first = f"/packs/tiny/starts/{pack.episodes[0].id}.png"
            for path in ("/packs", "/packs/tiny", first, "/runs/run", "/runs/run/status"):
                assert site.get(path).status == 404
    finally:
        play_session.close()

    told = b"\n".join(traffic).decode("utf-8", "replace")
    for word in hidden_words(pack):
        assert word not in told, word
    header = read_header(tmp_path / "run")
    assert (header.spec.agent, header.spec.agent_kind) == ("human:ada", "human")
    assert header.ended is not None
    records = read_records(tmp_path / "run" / "episodes.jsonl")
    assert [record.episode_id for record in records] == random_order(header.spec.episode_ids, header.spec.seed)
    assert {score(pack.episode(record.episode_id), record).end for record in records} <= {"report", "fail_no_report"}
    assert any(step.invalid for record in records for step in record.steps)
    assert all(step.frame_sha256 for record in records for step in record.steps)
    assert verify_run(tmp_path / "run", VerifySettings(workers=1)).is_verified


def hidden_words(pack: Pack) -> list[str]:
    """What a person who plays must not get to know: ids, goals, houses, budgets' names, verdicts, solutions."""
    words = ["box_distance", "max_steps", "max_invalid", "solution", "bindings", "W_strict", "path_blocked", "too_far"]
    for episode in pack.episodes:
        words += [episode.id, episode.house.sha256, *episode.bound_ids()]
        words += [episode.goal.kind] if episode.family != "SV" else []  # the prompt has a table "report_statuses"
    return words


def test_a_person_gets_the_frames_of_the_record(pack: Pack, tmp_path: Path) -> None:
    play_session = open_play_session(settings(pack, tmp_path / "run", limit=1, families=("SV",)))
    try:
        with served(make_play(play_session)) as site:
            first = ask(site, "/next", {})
            assert first["instruction"] in first["prompt"]
            assert first["frame"].startswith("data:image/png;base64,")
            second = ask(site, "/reply", {"moment": 0, "text": TURN})
            assert second["frame"] != first["frame"]
            again = ask(site, "/reply", {"moment": 0, "text": TURN})  # sent twice, carried out once
            assert again["moment"] == second["moment"] == 1
            assert finish(site)["done"] == 1
    finally:
        play_session.close()
    (record,) = read_records(tmp_path / "run" / "episodes.jsonl")
    assert [step.reply.text for step in record.steps] == [TURN, REPORT]


def test_a_sitting_goes_on_in_the_middle_of_an_episode(pack: Pack, tmp_path: Path) -> None:
    first = open_play_session(settings(pack, tmp_path / "run", limit=2))
    with served(make_play(first)) as site:
        ask(site, "/next", {})
        before = ask(site, "/reply", {"moment": 0, "text": TURN})
    first.close()
    with (tmp_path / "run" / JOURNAL).open("ab") as file:
        file.write(b'{"reply": {"te')  # what a crash leaves
    second = open_play_session(settings(pack, tmp_path / "run", limit=2))
    try:
        with served(make_play(second)) as site:
            after = ask(site, "/state")
            assert {**after, "practice": None} == {**before, "practice": None}
            finish(site)
            assert finish(site)["done"] == 2
    finally:
        second.close()
    records = read_records(tmp_path / "run" / "episodes.jsonl")
    assert [len(record.steps) for record in records] == [2, 1]


def test_practice_shows_feedback_and_the_verdict_under_a_profile_of_its_own(pack: Pack, tmp_path: Path) -> None:
    play_session = open_play_session(settings(pack, tmp_path / "run", limit=1, practice=True))
    try:
        with served(make_play(play_session)) as site:
            ask(site, "/next", {})
            walk = '{"skill_name": "navigate", "arguments": {"mode": "backward", "magnitude": 40}}'
            assert ask(site, "/reply", {"moment": 0, "text": walk})["feedback"] == {
                "too_far": False,
                "path_blocked": True,
            }
            assert any("goal" in line for line in finish(site)["told"])
    finally:
        play_session.close()
    header = read_header(tmp_path / "run")
    assert header.spec.agent == "human-practice:ada"
    assert header.spec.profile.has_feedback


def test_orders_differ_by_person_and_stay(pack: Pack) -> None:
    ids = [f"e{number}" for number in range(50)]
    assert random_order(ids, 1) == random_order(ids[::-1], 1)
    assert random_order(ids, 1) != random_order(ids, 2)
    assert sorted(random_order(ids, 1)) == sorted(ids)


def test_bad_names_and_other_runs_are_refused(pack: Pack, tmp_path: Path) -> None:
    with pytest.raises(SettingError, match="--player"):
        open_play_session(settings(pack, tmp_path / "run", player="../x"))
    open_play_session(settings(pack, tmp_path / "run", limit=1)).close()
    with pytest.raises(RecordError, match="another order"):
        open_play_session(settings(pack, tmp_path / "run", limit=2))


def test_replies_of_no_shape_are_refused(pack: Pack, tmp_path: Path) -> None:
    play_session = open_play_session(settings(pack, tmp_path / "run", limit=1))
    try:
        with served(make_play(play_session)) as site:
            for body in ("[]", "{", '{"moment": -1, "text": ""}', '{"moment": 0, "text": "", "more": 1}'):
                assert site.post("/reply", body).status == 422
            assert site.get("/reply").status == 405
    finally:
        play_session.close()


def test_the_names_of_targets_never_cross(tmp_path: Path) -> None:
    """The starter pack's ids and houses tell what is sought; all that is sent is read, headers and pictures too."""
    starter = Pack.load("starter")
    play_session = open_play_session(settings(starter, tmp_path / "run", limit=6))
    sent: list[bytes] = []
    try:
        with served(make_play(play_session)) as site:

            def heard(path: str, body: Any = None) -> Any:
                answer = site.get(path) if body is None else site.post(path, json.dumps(body))
                sent.extend([json.dumps(answer.headers).encode(), answer.body])
                return answer

            for path in ("/", "/static/play.js", "/static/vigil.css", "/static/icon.svg", "/favicon.ico", "/nothing"):
                heard(path)
            state = json.loads(heard("/state").body)
            for _ in range(state["of"]):
                state = json.loads(heard("/next", {}).body)
                for text in (TURN, POINT, "no action", REPORT):
                    if state["is_on"]:
                        picture = base64.b64decode(state["frame"].partition(",")[2])
                        assert chunks_of(picture) == {b"IHDR", b"IDAT", b"IEND"}
                        state = json.loads(heard("/reply", {"moment": state["moment"], "text": text}).body)
                heard("/reply", {"moment": 99, "text": TURN})  # out of turn
                heard("/reply", {"moment": -1, "text": TURN})  # wrong
            assert state["done"] == state["of"] == 6
    finally:
        play_session.close()
    told = b"\n".join(sent).decode("utf-8", "replace")
    for word in set(hidden_words(starter)) - {"path_blocked", "too_far"}:  # the script names these two, for practice
        assert word not in told, word
    for episode in starter.episodes:
        assert episode.house.name not in told
        assert str(starter.folder) not in told


def chunks_of(png: bytes) -> set[bytes]:
    """Return the kinds of a PNG's chunks; text would be a chunk of another kind."""
    kinds, at = set(), 8
    while at < len(png):
        kinds.add(png[at + 4 : at + 8])
        at += 12 + int.from_bytes(png[at : at + 4], "big")
    return kinds


def test_all_verbs_take_a_persons_run_like_any_other(pack: Pack, tmp_path: Path) -> None:
    play_session = open_play_session(settings(pack, tmp_path / "run", limit=3))
    try:
        with served(make_play(play_session)) as site:
            assert [finish(site)["done"] for _ in range(3)] == [1, 2, 3]
    finally:
        play_session.close()
    place = [str(tmp_path / "run"), "--pack", str(pack.folder)]
    for command in (["score"], ["verify", "--workers", "1", "--frames"], ["report"]):
        result = CliRunner().invoke(app, [command[0], *place, *command[1:]])
        assert result.exit_code == 0, (command, result.output, result.exception)
        assert "ada" in result.output or "3 episodes" in result.output, result.output


def test_a_server_that_died_is_continued_without_a_second_copy(pack: Pack, tmp_path: Path) -> None:
    """The last reply of an episode was carried out and recorded, but the page never heard of it."""
    play_session = open_play_session(settings(pack, tmp_path / "run", limit=2))
    with served(make_play(play_session)) as site:
        finish(site)
    play_session.close()
    journal = tmp_path / "run" / JOURNAL
    order = json.loads(journal.read_text().splitlines()[0])["order"]
    again = open_play_session(settings(pack, tmp_path / "run", limit=2))
    try:
        with served(make_play(again)) as site:
            state = ask(site, "/state")
            assert (state["is_on"], state["done"]) == (False, 1)
            assert finish(site)["done"] == 2
    finally:
        again.close()
    records = read_records(tmp_path / "run" / "episodes.jsonl")
    assert [record.episode_id for record in records] == order
