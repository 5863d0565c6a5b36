"""Runs of a model under each profile: what is sent, that it can be sent again, and that plays can be continued."""

import json
from pathlib import Path
from typing import Any

import pytest

from tests.runner.probes.test_probed_runs import BELIEF, EVERY, comparable, framing_of, settings
from tests.support.chat_server import LOOK, REPORT, ChatAnswer, ChatRequest, failure, serving
from tests.support.inspect_marks import INSPECT
from tests.support.tiny_pack import tiny_pack
from vigil.errors import SettingError
from vigil.protocol.profiles.rows import CRITERIA_REQUEST, LOOK_AGAIN, PROFILE_NAMES
from vigil.runner.plan import plan_run
from vigil.runner.probes import FinishedProbeSettings, plan_probing, probe_run
from vigil.runner.run import run_pack
from vigil.runner.verify_run import VerifySettings, verify_run

pytestmark = INSPECT
CLICK = '{"skill_name": "interact_pixel", "arguments": {"intent": "ground", "x": 320, "y": 240}}'
ONE = ("tiny-DA-000",)
PROFILES = ("look_before_report", "declare_criteria", "remaining_steps", "grounding_echo", "image_history_2",
            "image_history_all")  # fmt: skip


@pytest.fixture(scope="module")
def pack(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("packs") / "tiny"
    tiny_pack(folder, 1)
    return folder


def brain(asked: ChatRequest) -> ChatAnswer:
    """Answer the fourth step, and every later one, with a report."""
    if asked.texts[-1] == CRITERIA_REQUEST:
        return ChatAnswer("I must stand at the table.")
    if framing_of(asked):
        return ChatAnswer(BELIEF)
    turn = sum(message["role"] == "assistant" for message in asked.messages) + 1
    turn -= CRITERIA_REQUEST in asked.texts
    return ChatAnswer([LOOK, CLICK, LOOK, REPORT][min(turn, 4) - 1])


@pytest.mark.parametrize("profile", PROFILES)
def test_what_is_sent_can_be_sent_again_and_continued(pack: Path, tmp_path: Path, profile: str) -> None:
    with serving(brain) as server:
        wanted = settings(pack, server.url, tmp_path / "run", episode_ids=ONE, profile=profile, probe=EVERY)
        (record,) = run_pack(wanted).records
        during = [asked for asked in server.asked if framing_of(asked)]
        steps = [asked for asked in server.asked if not framing_of(asked) and asked.texts[-1] != CRITERIA_REQUEST]
        (tmp_path / "run" / "probes.jsonl").unlink()
        before = len(server.asked)
        again = FinishedProbeSettings(base_url=server.url, workers=1, max_connections=1)
        probe_run(plan_probing(tmp_path / "run", again), again)
        asked_later = server.asked[before:]
        before = len(server.asked)
        fork = settings(
            pack, server.url, tmp_path / "fork", episode_ids=ONE, profile=profile, fork_from=tmp_path / "run", fork_at=2
        )
        (continued,) = run_pack(fork).records
        of_fork = server.asked[before:]
    assert list(map(comparable, asked_later)) == list(map(comparable, during))
    assert [without_question(asked) for asked in during] == [json.dumps(asked.body) for asked in steps]
    assert comparable(of_fork[-1]) == comparable(steps[-1])  # the same model goes on as it did
    assert len(steps) == len(record.steps) == (5 if profile == "look_before_report" else 4)
    assert [step.model_dump_json() for step in continued.steps[:2]] == [
        step.model_dump_json() for step in record.steps[:2]
    ]
    for run in ("run", "fork"):
        assert verify_run(tmp_path / run, VerifySettings(workers=1, frames=True)).is_verified
    check_what_is_special(profile, record.criteria and record.criteria.text, steps)


def without_question(asked: ChatRequest) -> str:
    *earlier, last = asked.messages
    return json.dumps({**asked.body, "messages": [*earlier, {**last, "content": last["content"][:-1]}]})


def check_what_is_special(profile: str, criteria: str | None, steps: list[ChatRequest]) -> None:
    stubs = [json.loads(asked.texts[-1]) for asked in steps]
    facts: dict[str, Any] = {
        "look_before_report": [stub.get("request") for stub in stubs] == [None] * 4 + [LOOK_AGAIN],
        "declare_criteria": criteria == "I must stand at the table."
        and steps[0].texts[1:3] == [CRITERIA_REQUEST, criteria],
        "remaining_steps": [stub.get("remaining_steps") for stub in stubs] == [12, 11, 10, 9],
        "image_history_2": [len(asked.pictures) for asked in steps] == [1, 2, 3, 3],
        "image_history_all": [len(asked.pictures) for asked in steps] == [1, 2, 3, 4],
        "grounding_echo": steps[2].pictures != steps[1].pictures,
    }
    assert facts[profile]
    assert (criteria is not None) == (profile == "declare_criteria")


def test_a_profile_of_conversations_needs_a_model(pack: Path) -> None:
    for profile in ("declare_criteria", "image_history_2", PROFILE_NAMES["image_history_all"]):
        wanted = settings(pack, "", Path("unused"), episode_ids=ONE, model=None, agent="noop", profile=profile)
        with pytest.raises(SettingError, match="changes a model's conversation, but this run has no model"):
            plan_run(wanted)
    with pytest.raises(SettingError, match=r"'look_befor' does not exist. Did you mean 'look_before_report'"):
        plan_run(settings(pack, "", Path("unused"), episode_ids=ONE, profile="look_befor"))


def test_a_simulator_without_names_is_refused_before_the_run(pack: Path) -> None:
    with pytest.raises(SettingError, match="simulator 'thor' cannot find objects by their names"):
        plan_run(settings(pack, "", Path("unused"), episode_ids=ONE, profile="named_objects", backend="thor"))


def test_criteria_stay_in_the_row_of_a_play_that_fails_later(pack: Path, tmp_path: Path) -> None:
    def failing(asked: ChatRequest) -> ChatAnswer:
        return ChatAnswer("I must see it.") if asked.texts[-1] == CRITERIA_REQUEST else failure(500)

    with serving(failing) as server:
        wanted = settings(pack, server.url, tmp_path, episode_ids=ONE, retries=0, profile="declare_criteria")
        (record,) = run_pack(wanted).records
    assert (record.end, record.criteria and record.criteria.text) == ("error", "I must see it.")
