"""Whole runs of a model: real HTTP, real worker processes, Inspect in between."""

import inspect
import json
import os
import signal
import subprocess
import sys
import threading
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import psutil
import pytest
from inspect_ai import eval as evaluate
from inspect_ai import score
from inspect_ai._util.error import PrerequisiteError
from inspect_ai.log import EvalLog, read_eval_log

from tests.support.chat_server import LOOK, REPORT, ChatAnswer, ChatRequest, ChatServer, failure, serving
from tests.support.inspect_marks import INSPECT
from tests.support.narrowing import present
from tests.support.quick_runs import quick, without_times
from tests.support.tiny_pack import tiny_pack
from tests.support.waiting import HANGS_AFTER_S
from vigil.errors import InfrastructureError, ModelAPIError, RecordError
from vigil.packs.pack import Pack
from vigil.protocol.observation import FRAME_HEIGHT, FRAME_WIDTH
from vigil.protocol.profile import ACTION_FEEDBACK
from vigil.protocol.prompt import system_prompt
from vigil.records.costs import Prices
from vigil.records.record import EPISODES_FILE
from vigil.records.record_file import read_records
from vigil.runner import run as run_module
from vigil.runner.inspect_task import task_settings, vigil, vigil_score
from vigil.runner.plan import plan_run
from vigil.runner.run import RunResult, run_pack
from vigil.runner.run_folder import read_header
from vigil.runner.settings import RunSettings
from vigil.runner.verify_run import VerifySettings, verify_run

pytestmark = INSPECT
QUICK = ("DA", "PG")
OWN_PROMPT = "Task: <TASK_INSTRUCTION>"
WALK = '{"skill_name": "navigate", "arguments": {"mode": "forward", "magnitude": 40}}'


@pytest.fixture(scope="module")
def pack(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A pack of eight episodes."""
    folder = tmp_path_factory.mktemp("packs") / "tiny"
    tiny_pack(folder, 8)
    return folder


@pytest.fixture(scope="module")
def calm(pack: Path, tmp_path_factory: pytest.TempPathFactory) -> RunResult:
    """The result of a run in which nothing went wrong."""
    with serving(walk_and_report) as server:
        return run_pack(settings(pack, server.url, tmp_path_factory.mktemp("runs") / "calm"))


def settings(pack: Path, url: str, log_dir: Path, **changes: Any) -> RunSettings:
    fields = {"model": "openai/loopback", "base_url": url, "max_connections": 4, "retries": 3, "preflight": False}
    return quick(pack, log_dir, **{**fields, **changes})


def walk_and_report(asked: ChatRequest) -> ChatAnswer:
    return ChatAnswer(REPORT if asked.turn >= 4 else [LOOK, WALK, "prose"][asked.turn - 1], delay_s=0.01)


def test_a_run_is_recorded_resumed_and_verified(pack: Path, tmp_path: Path) -> None:
    with serving(walk_and_report) as server:
        wanted = settings(pack, server.url, tmp_path / "run", preflight=True, epochs=2, workers=2, families=QUICK)
        result = run_pack(wanted)
        asked = len(server.asked)
        again = run_pack(replace(wanted, base_url="http://127.0.0.1:9/v1", workers=1))
    assert (server.preflights, len(server.examples), server.most_alive <= 4) == (1, 1, True)
    assert result.is_complete
    assert (again.resumed, asked) == (8, 8 * 4)
    ends = {record.episode_id[5:7]: (record.end, len(record.steps)) for record in result.records}
    assert ends == dict.fromkeys(QUICK, ("report", 4))
    assert all(step.frame_sha256 for record in result.records for step in record.steps)
    assert verify_run(tmp_path / "run", VerifySettings(workers=1, frames=True)).is_verified
    spec = read_header(tmp_path / "run").spec
    assert (spec.agent, spec.agent_kind, spec.sampling) == ("openai/loopback", "model", {})
    assert list((tmp_path / "run" / "inspect").glob("*.eval"))


def test_a_cost_is_counted_over_all_sessions_and_is_no_part_of_what_the_run_is(pack: Path, tmp_path: Path) -> None:
    told: list[float | None] = []
    with serving(lambda _: ChatAnswer(REPORT, input_tokens=1000)) as server:
        wanted = settings(pack, server.url, tmp_path / "run", families=QUICK)
        first = run_pack(replace(wanted, limit=2), on_progress=lambda now: told.append(now.cost))
        assert set(told) == {None}
        assert first.header.prices is None
        told.clear()
        priced = replace(wanted, prices=Prices(input=1, output=100))
        later = run_pack(priced, on_progress=lambda now: told.append(now.cost))
        again = run_pack(replace(wanted, prices=Prices(input=2, output=0)))
    each = (1000 * 1 + 10 * 100) / 1e6
    assert told == pytest.approx([count * each for count in (2, 3, 4)])
    assert (first.tokens.total.reported, later.tokens.total.reported, later.resumed) == (2, 4, 2)
    assert later.header.prices == Prices(input=1, output=100)
    assert (again.resumed, again.header.prices) == (4, Prices(input=2, output=0))
    assert read_header(tmp_path / "run").prices == Prices(input=2, output=0)
    assert "prices" not in read_header(tmp_path / "run").spec.settings
    assert plan_run(priced).spec == plan_run(wanted).spec


def test_what_a_model_is_sent_is_the_contract_and_no_more(pack: Path, tmp_path: Path) -> None:
    def brain(asked: ChatRequest) -> ChatAnswer:
        return ChatAnswer(LOOK.replace("5}", f"{asked.turn % 20 + 1}}}"))

    with serving(brain) as server:
        wanted = settings(pack, server.url, tmp_path / "run", episode_ids=("tiny-AI-003",), profile=ACTION_FEEDBACK)
        record = run_pack(wanted).records[0]
    episode = Pack.load(pack).episode("tiny-AI-003")
    assert (record.end, len(server.asked)) == ("fail_no_report", 25)
    prompt = system_prompt(episode.instruction, read_header(tmp_path / "run").spec.profile)
    calm = {"too_far": False, "path_blocked": False}
    for index, asked in enumerate(server.asked):
        kept = min(index, 20)
        assert [m["role"] for m in asked.messages] == ["system", *["user", "assistant"] * kept, "user"]
        assert asked.texts[0] == prompt
        assert len(asked.pictures) == 1
        assert asked.texts[2:-1:2] == [step.reply.text for step in record.steps[index - kept : index]]
        past = [json.loads(text) for text in asked.texts[1:-1:2]]
        first = {"frame": {"role": "past"}}
        assert past == [first if index - kept + turn == 0 else {**first, "feedback": calm} for turn in range(kept)]
        now: dict[str, Any] = {"frame": {"role": "current", "width": FRAME_WIDTH, "height": FRAME_HEIGHT}}
        assert json.loads(asked.texts[-1]) == (now if index == 0 else {**now, "feedback": calm})


def test_a_prompt_file_is_sent_kept_and_held_to(pack: Path, tmp_path: Path) -> None:
    template = "Only this: <TASK_INSTRUCTION>"
    one = {"episode_ids": ("tiny-AI-003",), "prompt_template": template}
    with serving(lambda _: ChatAnswer(REPORT)) as server:
        wanted = settings(pack, server.url, tmp_path / "run", **one)
        run_pack(wanted)
        with pytest.raises(RecordError, match=r"profile\.prompt_variant: 'file-\w+' there, 'file-\w+' here"):
            run_pack(replace(wanted, prompt_template=f"{template}!"))
        assert run_pack(wanted).resumed == 1
    instruction = Pack.load(pack).episode("tiny-AI-003").instruction
    assert [asked.texts[0] for asked in server.asked] == [f"Only this: {instruction}"]
    assert read_header(tmp_path / "run").spec.profile.prompt_template == template
    assert verify_run(tmp_path / "run", VerifySettings(workers=1)).is_verified


def test_trouble_all_around_changes_no_record(pack: Path, calm: RunResult, tmp_path: Path) -> None:
    count = 0

    def troubled(asked: ChatRequest) -> ChatAnswer:
        nonlocal count
        count += 1
        if count % 5 == 0:
            return [failure(429), failure(500), ChatAnswer("x", breaks=True)][count // 5 % 3]
        return walk_and_report(asked)

    with serving(troubled) as server:
        rough = run_pack(settings(pack, server.url, tmp_path / "rough"))
    assert rough.is_complete
    assert [without_times(row) for row in rough.records] == [without_times(row) for row in calm.records]


def test_an_outage_gives_error_rows_with_what_was_played_and_the_same_command_goes_on(
    pack: Path, tmp_path: Path
) -> None:
    is_out = True

    def brain(asked: ChatRequest) -> ChatAnswer:
        return (
            failure(503, "gone fishing") if is_out and asked.turn == 3 and "(0)" in asked.texts[0] else ChatAnswer(LOOK)
        )

    with serving(brain) as server:
        wanted = settings(pack, server.url, tmp_path / "run", episode_ids=("tiny-DA-000", "tiny-PG-001", "tiny-SV-002"))
        result = run_pack(wanted)
        failed = next(record for record in result.records if record.end == "error")
        assert (result.errors, failed.episode_id, len(failed.steps)) == (1, "tiny-DA-000", 2)
        assert (present(failed.error).boundary, failed.attempt) == ("model", 1)
        assert "gone fishing" in present(failed.error).message
        is_out = False
        before = len(server.asked)
        again = run_pack(wanted)
    assert (again.resumed, again.errors, len(server.asked) - before) == (2, 0, 12)
    assert [
        row.end for row in read_records(tmp_path / "run" / "episodes.jsonl") if row.episode_id == "tiny-DA-000"
    ] == [
        "error",
        "fail_no_report",
    ]


def test_a_server_that_is_gone_for_good_stops_the_run(
    pack: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(run_module, "MAX_ERRORS_IN_A_ROW", 3)
    with serving(lambda asked: failure(401, "wrong key")) as server:
        with pytest.raises(InfrastructureError, match=r"3 episodes in a row.*wrong key"):
            run_pack(settings(pack, server.url, tmp_path / "run", max_connections=1))
        assert len(server.asked) == 3


def test_a_blind_server_is_found_out_before_anything_is_played(pack: Path, tmp_path: Path) -> None:
    with serving(walk_and_report, can_see=False) as server:
        with pytest.raises(ModelAPIError, match="images do not seem to reach the model"):
            run_pack(settings(pack, server.url, tmp_path / "run", preflight=True))
        assert server.asked == []
    assert not (tmp_path / "run").exists()


def test_a_model_that_answers_in_another_form_is_found_out_before_anything_is_played(
    pack: Path, tmp_path: Path
) -> None:
    with serving(walk_and_report) as server:
        server.example = ChatAnswer("<think>I will walk there, step by step")
        wanted = settings(pack, server.url, tmp_path / "run", preflight=True, families=("PG",), limit=1)
        with pytest.raises(ModelAPIError, match=r"unclosed_reasoning.*--reasoning-parser.*--force"):
            run_pack(wanted)
        assert server.asked == []
        assert not (tmp_path / "run").exists()
        result = run_pack(replace(wanted, force=True))
    assert result.is_complete
    assert present(result.header.answered).check["sight"] == "passed"
    assert present(result.header.answered).check["contract"].startswith("failed: unclosed_reasoning")
    assert any("The check before the run failed: unclosed_reasoning" in note for note in result.notes)


def test_what_really_answered_is_in_the_header(pack: Path, tmp_path: Path) -> None:
    def brain(asked: ChatRequest) -> ChatAnswer:
        return ChatAnswer(REPORT if asked.turn == 2 else LOOK, reasoning="hm", model="some-model-2026-01-01")

    with serving(brain) as server:
        server.example = ChatAnswer(REPORT, model="some-model-2026-01-01")
        chosen = {"families": ("PG",), "limit": 1, "thinking": "off", "model": "vllm/m", "preflight": True}
        result = run_pack(settings(pack, server.url, tmp_path / "run", **chosen))
        address = f"{server.url}/chat/completions"
    answered = present(read_header(tmp_path / "run").answered)
    assert answered == result.header.answered
    assert answered.models == {"loopback": 1, "some-model-2026-01-01": 3}
    assert answered.finish_reasons == {"stop": 4}
    assert answered.addresses == (address,)
    assert answered.check == {"sight": "passed", "contract": "passed"}
    assert {"inspect_ai", "openai"} <= answered.clients.keys()
    assert (answered.thinking, answered.replies_with_reasoning, answered.replies) == ("on", 2, 4)
    assert "chat_template_kwargs.enable_thinking=False" in answered.thinking_set_by
    assert server.asked[0].body["chat_template_kwargs"]["enable_thinking"] is False


def test_a_name_that_stands_for_another_model_on_resume_stops_the_run_unless_told_to_go_on(
    pack: Path, tmp_path: Path
) -> None:
    version, is_out = "model-1", True

    def brain(asked: ChatRequest) -> ChatAnswer:
        if is_out and "(1)" in asked.texts[0]:
            return failure(401, "not now")
        return ChatAnswer(REPORT, model=version)

    with serving(brain) as server:
        wanted = settings(pack, server.url, tmp_path / "run", episode_ids=("tiny-DA-000", "tiny-PG-001"))
        assert run_pack(wanted).errors == 1
        version, is_out = "model-2", False
        with pytest.raises(RecordError, match=r"answers as 'model-2' now.*answered by 'model-1'.*--force"):
            run_pack(wanted)
        result = run_pack(replace(wanted, force=True))
    assert result.is_complete
    assert present(result.header.answered).models == {"model-1": 1}
    assert present(result.header.resumed[-1].answered).models == {"model-2": 1}
    assert any("several names: model-1, model-2" in note for note in result.notes)


def test_a_context_too_small_for_the_first_request_is_an_error_with_the_size_that_is_needed(
    pack: Path, tmp_path: Path
) -> None:
    small = failure(400, "This model's maximum context length is 1024 tokens. Please reduce the length", code=400)
    with serving(lambda asked: small) as server:
        result = run_pack(settings(pack, server.url, tmp_path / "run", families=("DA",), limit=1))
    full = ChatAnswer("", finish_reason="model_context_window_exceeded")
    with serving(lambda asked: full) as server:
        other = run_pack(settings(pack, server.url, tmp_path / "other", families=("DA",), limit=1))
    for record in (result.records[0], other.records[0]):
        assert (record.end, present(record.error).boundary, record.steps) == ("error", "model", ())
        assert "takes about 2," in present(record.error).message
        assert "with a context of 16,384 tokens or more" in present(record.error).message


@pytest.mark.parametrize(("counted", "is_said"), [((2000, 3974, 2051, 2100), True), ((2000, 2100, 2100, 2200), False)])
def test_a_server_that_counts_fewer_tokens_for_a_longer_dialogue_is_told_of_once(
    pack: Path, tmp_path: Path, counted: tuple[int, ...], is_said: bool
) -> None:
    """As Ollama does when a dialogue does not fit into its context."""

    def brain(asked: ChatRequest) -> ChatAnswer:
        return ChatAnswer(REPORT if asked.turn == len(counted) else LOOK, input_tokens=counted[asked.turn - 1])

    said: list[str | None] = []
    with serving(brain) as server:
        wanted = settings(pack, server.url, tmp_path / "run", families=("DA", "SV"))
        run_pack(wanted, on_progress=lambda progress: said.append(progress.warning))
    warnings = [each for each in said if each is not None]
    assert len(warnings) == is_said
    assert all("counted 3,974 input tokens, and 2,051 for the next request" in each for each in warnings)
    assert all("Ollama: OLLAMA_CONTEXT_LENGTH" in each for each in warnings)


@pytest.mark.parametrize(
    ("point", "is_said"), [({"x": 0.5, "y": 0.5}, True), ({"x": 900, "y": 9}, True), ({"x": 9, "y": 9}, False)]
)
def test_clicks_in_other_coordinates_are_told_of_once(
    pack: Path, tmp_path: Path, point: dict[str, float], is_said: bool
) -> None:
    click = json.dumps({"skill_name": "interact_pixel", "arguments": {"intent": "ground", **point}})
    said: list[str | None] = []
    with serving(lambda asked: ChatAnswer(click)) as server:
        wanted = settings(pack, server.url, tmp_path / "run", families=("DA", "PG"))
        run_pack(wanted, on_progress=lambda progress: said.append(progress.warning))
    warnings = [each for each in said if each is not None and "other coordinates" in each]
    assert len(warnings) == is_said
    assert all("`vigil calibrate --model NAME`" in each for each in warnings)


FLAGGED = failure(400, "flagged by our safety system", code="content_policy_violation")


def test_rejections_of_what_the_agent_said_end_as_invalid_actions(pack: Path, tmp_path: Path) -> None:
    with serving(lambda asked: FLAGGED if asked.turn > 1 else ChatAnswer(LOOK)) as server:
        result = run_pack(settings(pack, server.url, tmp_path / "run", families=("SV",), limit=1))
    record = result.records[0]
    assert (record.end, len(record.steps), len(server.asked)) == ("invalid_action_limit_exceeded", 4, 10)
    assert [step.invalid and step.invalid.reason for step in record.steps] == [None, *["provider_rejected"] * 3]


def test_a_rejection_before_the_agent_said_anything_is_an_error_and_played_again(pack: Path, tmp_path: Path) -> None:
    chosen = settings(pack, "", tmp_path / "run", families=("DA",), limit=1)
    with serving(lambda asked: FLAGGED) as server:
        result = run_pack(replace(chosen, base_url=server.url))
        assert len(server.asked) == 3
    record = result.records[0]
    assert (record.end, record.steps, present(record.error).boundary) == ("error", (), "model")
    assert "rejected the request 3 times: " in present(record.error).message
    assert "flagged by our safety system" in present(record.error).message
    with serving(walk_and_report) as server:
        again = run_pack(replace(chosen, base_url=server.url))
    assert (again.resumed, again.is_complete, again.records[0].end) == (0, True, "report")


def test_a_worker_that_is_killed_changes_no_record(pack: Path, calm: RunResult, tmp_path: Path) -> None:
    killed: list[int] = []
    killed_at: list[datetime] = []
    one_at_a_time = threading.Lock()
    before = set(psutil.Process().children())

    def killing(asked: ChatRequest) -> ChatAnswer:
        with one_at_a_time:  # two episodes may reach their third turn together
            if asked.turn == 3 and not killed:
                children = set(psutil.Process().children()) - before
                workers = [child for child in children if os.getsid(child.pid) == child.pid]
                killed_at.append(datetime.now(UTC))
                killed.extend(child.pid for child in workers)
                for child in workers:
                    os.kill(child.pid, signal.SIGKILL)
        return walk_and_report(asked)

    with serving(killing) as server:
        rough = run_pack(settings(pack, server.url, tmp_path / "rough"))
    assert len(killed) == 1
    assert rough.is_complete
    assert len(server.asked) == 8 * 4
    assert [without_times(row) for row in rough.records] == [without_times(row) for row in calm.records]
    assert min(row.started for row in rough.records) < killed_at[0]


def test_a_run_that_is_killed_goes_on_where_it_was(pack: Path, tmp_path: Path) -> None:
    path = tmp_path / "run" / EPISODES_FILE
    process: list[subprocess.Popen[bytes]] = []

    def brain(asked: ChatRequest) -> ChatAnswer:
        if process and path.is_file() and path.read_bytes().count(b"\n") >= 2:
            process.pop().kill()
        return walk_and_report(asked)

    with serving(brain) as server:
        program = (
            "from pathlib import Path; from vigil.runner.run import run_pack; "
            "from vigil.runner.settings import RunSettings\n"
            f"run_pack(RunSettings(pack=Path({str(pack)!r}), model='openai/loopback', base_url={server.url!r}, "
            f"log_dir=Path({str(tmp_path / 'run')!r}), backend='fake', workers=1, max_connections=2, preflight=False))"
        )
        running = subprocess.Popen([sys.executable, "-c", program])
        process.append(running)
        assert running.wait(HANGS_AFTER_S) == -signal.SIGKILL
        survived = read_records(tmp_path / "run" / "episodes.jsonl")
        assert 2 <= len(survived) < 8
        again = run_pack(settings(pack, server.url, tmp_path / "run"))
    assert (again.resumed, again.is_complete) == (len(survived), True)
    assert list(again.header.spec.episode_ids) == [record.episode_id for record in again.records]


def test_an_interrupted_run_says_so_at_once_and_keeps_what_was_played(pack: Path, tmp_path: Path) -> None:
    path = tmp_path / "run" / EPISODES_FILE
    ended = threading.Event()

    def brain(asked: ChatRequest) -> ChatAnswer:
        if path.is_file() and path.read_bytes().count(b"\n") >= 1:
            running.send_signal(signal.SIGINT)
            ended.wait(HANGS_AFTER_S)
        return ChatAnswer(REPORT)

    with serving(brain) as server:
        program = (
            "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"  # ignored when started by `&`
            "from pathlib import Path; from vigil.runner.run import run_pack; "
            "from vigil.runner.settings import RunSettings\n"
            f"run_pack(RunSettings(pack=Path({str(pack)!r}), model='openai/loopback', base_url={server.url!r}, "
            f"log_dir=Path({str(tmp_path / 'run')!r}), backend='fake', workers=1, max_connections=1, preflight=False))"
        )
        running = subprocess.Popen([sys.executable, "-c", program])
        assert running.wait(HANGS_AFTER_S) == 130
        ended.set()
    assert len(read_records(tmp_path / "run" / "episodes.jsonl")) == 1


def inspect_eval(server: ChatServer, pack: Path, **arguments: Any) -> EvalLog:
    """Return the log of Inspect's own run of the task."""
    given = {"pack": str(pack), "family": "DA", "backend": "fake", "workers": 1, **arguments}
    model, address = "openai-api/local/m", server.url
    (log,) = evaluate("vigil/vigil", task_args=given, display="none", model=model, model_base_url=address)
    return log


@pytest.fixture
def _logs(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Inspect, unlike `vigil run`, wants a key for a server that takes none, and a folder for its logs."""
    monkeypatch.setenv("LOCAL_API_KEY", "none")
    monkeypatch.setenv("INSPECT_LOG_DIR", str(tmp_path / "logs"))


@pytest.mark.usefixtures("_logs")
def test_inspect_runs_the_pack_as_a_task_of_its_own(pack: Path, tmp_path: Path) -> None:
    inspect = Path(sys.executable).with_name("inspect")
    task = [word for pair in (f"pack={pack}", "family=DA", "backend=fake", "workers=1") for word in ("-T", pair)]
    options = ["--model", "openai-api/local/m", "--epochs", "2", "--display", "plain", *task]
    with serving(walk_and_report) as server:
        command = [inspect, "eval", "vigil/vigil", "--model-base-url", server.url, *options]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert (server.preflights, len(server.asked)) == (1, 2 * 2 * 4)
    assert all(len(asked.pictures) == 1 for asked in server.asked)
    assert "grouped_all" in done.stdout
    log = read_eval_log(str(next((tmp_path / "logs").glob("*.eval"))))
    samples = log.samples or []
    again = score(log, vigil_score(), action="overwrite", display="none").samples or []
    first, second = ([next(iter((row.scores or {}).values())).value for row in rows] for rows in (samples, again))
    assert first == second
    assert [isinstance(value, dict) and (value["W"], value["B"]) for value in first] == [(1.0, 1.0)] * 4


@pytest.mark.usefixtures("_logs")
def test_inspect_scores_only_w_without_reports(pack: Path) -> None:
    with serving(lambda asked: ChatAnswer('{"skill_name": "stop", "arguments": {}}')) as server:
        log = inspect_eval(server, pack, profile="stop_only", preflight=False)
    values = [next(iter((sample.scores or {}).values())).value for sample in log.samples or []]
    assert values
    assert all(isinstance(value, dict) and set(value) == {"W", "W_strict"} for value in values)


@pytest.mark.usefixtures("_logs")
def test_inspect_stops_at_a_blind_model_unless_told_not_to_look(pack: Path) -> None:
    with serving(walk_and_report, can_see=False) as server:
        failed = inspect_eval(server, pack)
        assert (server.preflights > 0, server.asked, failed.status) == (True, [], "error")
        assert failed.error is not None
        assert "Model 'openai-api/local/m' was sent an image of the number" in present(failed.error).message
        assert "-T preflight=false" in present(failed.error).message
        before = server.preflights
        assert inspect_eval(server, pack, preflight=False).status == "success"
    assert (server.preflights, len(server.asked)) == (before, 2 * 4)


@pytest.mark.usefixtures("_logs")
def test_inspect_names_a_model_that_does_not_answer(pack: Path) -> None:
    with serving(lambda asked: failure(503)) as server:
        gone = server
    error = inspect_eval(gone, pack).error
    assert error is not None
    assert f"at {gone.url} did not answer the check before the run" in error.message
    assert "(after 3 attempts)" in error.message


def test_inspects_task_takes_settings_of_a_run_with_their_defaults() -> None:
    taken = {name: one.default for name, one in inspect.signature(vigil).parameters.items()}
    assert taken == {
        **dict.fromkeys(("prompt_file", "coordinates", "workers", "api_key_env")),
        "pack": "starter",
        "family": (),
        "profile": "baseline",
        "prompt_variant": "default",
        "preflight": True,
        "reply_policy": "strict",
        "image_format": "png",
        "backend": "mujoco",
        "force": False,
        "system_role": "system",
        "reveal_private_pack": False,
    }


@pytest.mark.parametrize(
    ("given", "settings"),
    [
        ({}, {}),
        ({"family": "DA"}, {"families": ("DA",)}),
        ({"family": ["PG", "DA,SM"], "preflight": False}, {"families": ("PG", "DA", "SM"), "preflight": False}),
        ({"family": (), "prompt_file": None, "workers": 2}, {"families": (), "prompt_template": None, "workers": 2}),
    ],
)
def test_inspects_task_reads_its_arguments_as_the_command_reads_options(
    given: dict[str, Any], settings: dict[str, Any]
) -> None:
    assert task_settings(given) == settings


def test_inspects_task_reads_a_prompt_file(tmp_path: Path) -> None:
    path = tmp_path / "prompt.txt"
    path.write_text(OWN_PROMPT, encoding="utf-8")
    assert task_settings({"prompt_file": str(path)}) == {"prompt_template": OWN_PROMPT}


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ({"pack": "startr"}, "ERROR: .*'startr'.* Did you mean 'starter'"),
        ({"profile": "pure_depth"}, "ERROR: Profile 'pure_depth' does not exist"),
        ({"backend": "unity"}, "ERROR: Simulator 'unity' does not exist"),
        ({"coordinates": "pixels"}, "ERROR: --coordinates is 'pixels'. Did you mean 'pixel'"),
        ({"workers": 0}, "ERROR: --workers is 0; it must be 1 or more"),
        ({"famly": "DA"}, "ERROR: The task does not have an argument 'famly'. Did you mean 'family'"),
    ],
)
def test_inspect_is_told_of_bad_arguments_in_its_own_way(arguments: dict[str, Any], named: str) -> None:
    with pytest.raises(PrerequisiteError, match=named):
        vigil(**arguments)
