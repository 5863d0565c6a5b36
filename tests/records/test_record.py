"""Records on disk: appended row by row, continued after a kill, decided by key."""

import json
import os
from collections.abc import Callable
from datetime import timedelta
from pathlib import Path
from typing import get_args

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from tests.support.builders import NOON, RecordBuilder, thing
from vigil import __version__
from vigil.base.json_lines import dump_line
from vigil.base.versions import PackVersions, Versions
from vigil.errors import RecordError
from vigil.protocol.actions import InvalidAction
from vigil.protocol.profile import Profile
from vigil.records.record import (
    EPISODES_FILE,
    FRAMES_FOLDER,
    HEADER_FILE,
    SCHEMA_VERSION,
    AgentKind,
    Boundary,
    End,
    EpisodeRecord,
    ProviderFacts,
    Resumption,
    RowResolver,
    RunHeader,
    RunSpec,
    Shard,
    StepRecord,
    effective_records,
    read_header,
)
from vigil.records.record_file import RecordLog, read_records


def row(episode_id: str = "a", epoch: int = 1, end: str = "fail_no_report", attempt: int = 1) -> EpisodeRecord:
    record = RecordBuilder(target=thing()).do().end("error" if end == "error" else "fail_no_report")
    return record.model_copy(update={"episode_id": episode_id, "epoch": epoch, "attempt": attempt})


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "episodes.jsonl"


def write(path: Path, *records: EpisodeRecord) -> None:
    path.write_bytes(b"".join(dump_line(record) for record in records))


def test_rows_come_back_as_they_were_written(path: Path):
    records = [row("b"), row("a", epoch=2), row("a", end="error")]
    log = RecordLog(path)
    for record in records:
        log.append(record)
    log.close()
    assert read_records(path) == records
    assert path.read_bytes() == b"".join(dump_line(record) for record in records)


def test_a_standing_row_refuses_later_ones_and_an_error_gives_way(path: Path):
    log = RecordLog(path)
    log.append(row(end="error", attempt=1))
    assert not log.is_done(("a", 1))
    log.append(row(end="error", attempt=2))
    log.append(row(attempt=3))
    assert log.is_done(("a", 1))
    for late in (row(attempt=4), row(end="error", attempt=4)):
        with pytest.raises(RecordError, match="already has a row"):
            log.append(late)
    log.append(row(epoch=2))
    log.close()
    assert [record.attempt for record in effective_records(read_records(path)).values()] == [3, 1]


def test_standing_takes_the_first_row_without_error_and_else_the_last():
    rows = [
        row("b", attempt=1),
        row("b", attempt=2),
        row("a", end="error", attempt=1),
        row("a", end="error", attempt=2),
    ]
    chosen = effective_records(rows)
    assert list(chosen) == [("a", 1), ("b", 1)]
    assert [record.attempt for record in chosen.values()] == [2, 1]


@pytest.mark.parametrize("cut", [1, 40, -2])
def test_a_torn_last_line_is_cut_to_a_side_file(path: Path, cut: int):
    write(path, row("a"), row("b"))
    whole = path.read_bytes()
    torn = dump_line(row("c"))[:cut]
    path.write_bytes(whole + torn)
    assert len(read_records(path)) == 2
    assert path.read_bytes() == whole + torn
    log = RecordLog(path)
    assert log.partial_line_file is not None
    assert log.partial_line_file.read_bytes() == torn
    assert path.read_bytes() == whole
    log.append(row("c"))
    log.close()
    assert [record.episode_id for record in read_records(path)] == ["a", "b", "c"]


def test_a_whole_last_line_without_newline_is_kept(path: Path):
    write(path, row("a"), row("b"))
    path.write_bytes(path.read_bytes()[:-1])
    log = RecordLog(path)
    log.append(row("c"))
    log.close()
    assert [record.episode_id for record in read_records(path)] == ["a", "b", "c"]
    assert log.partial_line_file is None


def test_side_files_are_never_overwritten(path: Path):
    sides = []
    for _ in range(2):
        with path.open("ab") as file:
            file.write(b'{"torn')
        log = RecordLog(path)
        sides.append(log.partial_line_file)
        log.close()
    assert len(set(sides)) == 2


@given(size=st.integers(min_value=0))
def test_a_kill_at_any_byte_loses_at_most_the_last_row(tmp_path_factory: pytest.TempPathFactory, size: int):
    path = tmp_path_factory.mktemp("run") / "episodes.jsonl"
    lines = [dump_line(row("a")), dump_line(row("b"))]
    whole = b"".join(lines)
    size %= len(whole) + 1
    path.write_bytes(whole[:size])
    log = RecordLog(path)
    log.close()
    complete = (size >= len(lines[0]) - 1) + (size >= len(whole) - 1)
    assert len(read_records(path)) == complete
    kept = b"".join(lines[:complete])
    assert path.read_bytes() == kept
    assert (log.partial_line_file.read_bytes() if log.partial_line_file else b"") == (whole[len(kept) : size])


def test_two_writers_are_refused(path: Path):
    log = RecordLog(path)
    with pytest.raises(RecordError, match="another process"):
        RecordLog(path)
    log.close()
    RecordLog(path).close()


def test_a_broken_line_in_the_middle_is_named_and_nothing_is_changed(path: Path):
    write(path, row("a"), row("b"))
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(lines[0] + b"{oops\n" + lines[1])
    before = path.read_bytes()
    with pytest.raises(RecordError, match="line 2 cannot be read: not JSON"):
        read_records(path)
    log = RecordLog(path)
    log.close()
    assert [(row.line, row.reason) for row in log.left_out] == [(2, "cannot be read")]
    assert list(log.rows) == [("a", 1), ("b", 1)]
    assert path.read_bytes() == before


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"schema_version": 99},
            r"has schema 99, but vigil \S+ reads 3\. A newer vigil wrote it: `pip install --upgrade vigil-bench`",
        ),
        ({"verdict": True}, "verdict: Extra inputs are not permitted; a newer vigil may have written it"),
        ({"end": "gave_up"}, "end: Input should be"),
    ],
)
def test_rows_of_another_schema_are_refused(path: Path, change: dict, message: str):
    fields = row().model_dump(mode="json") | change
    path.write_bytes(EpisodeRecord.model_construct(**fields).model_dump_json(warnings=False).encode() + b"\n")
    if "verdict" in change:
        path.write_bytes(path.read_bytes().replace(b'{"schema_version"', b'{"verdict":true,"schema_version"', 1))
    with pytest.raises(RecordError, match=message):
        read_records(path)


@pytest.mark.parametrize("place", ["rotation", "box_distance_m", "x"])
def test_a_number_that_is_none_cannot_get_into_a_record(place: str):
    text = dump_line(row()).decode()
    fields = json.loads(text)
    agent, state = fields["initial"]["agent"], fields["initial"]["objects"]["target"]
    target = {"rotation": agent, "box_distance_m": state, "x": agent["position"]}[place]
    target[0 if place == "x" else place] = float("nan")
    with pytest.raises(ValidationError, match="finite number"):
        EpisodeRecord.model_validate(fields)
    with pytest.raises(ValidationError, match=place if place != "x" else "position"):
        EpisodeRecord.model_validate_json(json.dumps(fields))


def test_a_row_with_a_number_that_is_none_costs_one_row(path: Path):
    write(path, row("a"), row("b"), row("c"))
    lines = path.read_bytes().splitlines(keepends=True)
    lines[1] = lines[1].replace(b'"rotation":0.0', b'"rotation":null', 1)
    path.write_bytes(b"".join(lines))
    log = RecordLog(path)
    log.close()
    assert list(log.rows) == [("a", 1), ("c", 1)]
    assert "initial.agent.rotation: Input should be a valid number" in str(log.left_out[0])


def test_a_missing_file_is_named(path: Path):
    with pytest.raises(RecordError, match="does not exist"):
        read_records(path)


def test_a_record_without_reset_has_no_worlds():
    record = row(end="error").model_copy(update={"initial": None, "steps": ()})
    with pytest.raises(RecordError, match="no initial world"):
        _ = record.worlds


def test_the_run_header_says_whether_the_agent_is_privileged():
    spec = RunSpec(
        agent="solver",
        agent_kind="privileged",
        profile=Profile(),
        prompt_policy="v",
        prompt_policy_sha256="0",
        pack="starter",
        pack_sha256="0",
        episode_ids=("a",),
    )
    header = RunHeader(
        run_id="r", nonce="0" * 32, spec=spec, package_version="0", started=NOON, ended=NOON + timedelta(1)
    )
    assert header.is_privileged
    assert RunHeader.model_validate_json(header.model_dump_json()) == header


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"end": "error"}, "must have `error` if its episode ended as an error"),
        ({"error": {"boundary": "model", "message": ""}}, "must have `error` if its episode ended as an error"),
        ({"initial": None}, "before its reset"),
        ({"steps": [row().steps[0].model_dump(mode="json") | {"index": 2}]}, "without a gap"),
        ({"steps": [row().steps[0].model_dump(mode="json") | {"action": None}]}, "either an action or the reason"),
    ],
)
def test_a_row_that_contradicts_itself_is_refused(path: Path, change: dict, message: str):
    fields = row().model_dump(mode="json") | change
    path.write_text(json.dumps(fields) + "\n")
    with pytest.raises(RecordError, match=message):
        read_records(path)


def test_a_file_that_cannot_be_written_is_named(tmp_path: Path):
    (tmp_path / "episodes.jsonl").mkdir()
    with pytest.raises(RecordError, match=r"jsonl' is a folder, not a file\."):
        RecordLog(tmp_path / "episodes.jsonl")


def test_a_torn_line_that_cannot_be_put_aside_stays_where_it_is(path: Path, monkeypatch: pytest.MonkeyPatch):
    def fail(*_: object) -> int:
        raise OSError(28, "No space left on device")

    whole = dump_line(row("a")) + dump_line(row("b"))[:-9]
    path.write_bytes(whole)
    with monkeypatch.context() as patch:
        patch.setattr(Path, "write_bytes", fail)
        with pytest.raises(
            RecordError, match=r"partial last line.*cannot be moved to another file: No space left.*command again"
        ):
            RecordLog(path)
    assert path.read_bytes() == whole
    log = RecordLog(path)
    log.close()
    assert list(log.rows) == [("a", 1)]


def spec(**changes: object) -> RunSpec:
    fields = {"agent": "solver", "agent_kind": "privileged", "prompt_policy": "v", "prompt_policy_sha256": "0"}
    return RunSpec.model_validate({**fields, "pack": "p", "pack_sha256": "1", "episode_ids": ("a",), **changes})


def header(**changes: object) -> RunHeader:
    fields = {"run_id": "r", "nonce": "0" * 32, "spec": spec(), "package_version": "0", "started": NOON}
    return RunHeader.model_validate({**fields, **changes})


def test_what_a_row_and_a_header_say_when_nothing_is_said():
    step = row().steps[0]
    given = {"index": 1, "reply": step.reply, "action": step.action, "world": step.world}
    assert StepRecord.model_validate(given).model_dump(exclude=set(given)) == {
        "frame_sha256": None,
        "history_cut": False,
        "invalid": None,
        "ignored_keys": (),
        "effect": None,
    }
    required = {name: getattr(row(), name) for name in ("run_id", "episode_id", "started", "ended", "initial", "end")}
    assert EpisodeRecord.model_validate({**required, "steps": ()}).model_dump(exclude={*required, "versions"}) == {
        "schema_version": 3,
        "run_sha256": "",
        "epoch": 1,
        "attempt": 1,
        "prompt_sha256": "",
        "steps": (),
        "error": None,
    }
    told = {"agent", "agent_kind", "prompt_policy", "prompt_policy_sha256", "pack", "pack_sha256", "episode_ids"}
    assert spec().model_dump(exclude={*told, "versions", "pack_versions"}) == {
        "agent_files": {},
        "keep_program": None,
        "frame_interval_seconds": None,
        "base_url": None,
        "sampling": {},
        "thinking": "default",
        "model_args": {},
        "profile": Profile().model_dump(),
        "shard": None,
        "epochs": 1,
        "seed": 0,
        "simulator": "mujoco",
        "asset_database_sha256": None,
        "render_quality": "default",
    }
    assert header().model_dump(exclude={"run_id", "nonce", "spec", "package_version", "started"}) == {
        "schema_version": 3,
        "commit": None,
        "is_dirty": None,
        "simulator_version": "",
        "renderer": "",
        "ended": None,
        "host": {},
        "answered": None,
        "resumed": (),
        "prices": None,
    }
    session = Resumption(started=NOON, rows_before=2)
    assert session.model_dump(exclude={"started"}) == {
        "agent_files": {},
        "rows_before": 2,
        "episodes": None,
        "commit": None,
        "is_dirty": None,
        "answered": None,
        "renderer": "",
        "host": {},
    }
    assert EpisodeRecord.model_validate({**required, "steps": ()}).versions == spec().versions == Versions()
    assert spec().pack_versions == PackVersions()


@pytest.mark.parametrize(
    ("kind", "allowed"),
    [
        (End, {"report", "stop", "fail_no_report", "invalid_action_limit_exceeded", "error"}),
        (Boundary, {"simulator", "model", "agent", "worker", "runner"}),
        (AgentKind, {"scripted", "privileged", "model", "exec", "human", "remote"}),
    ],
)
def test_the_words_of_a_record_stay(kind: object, allowed: set[str]):
    assert set(get_args(kind)) == allowed


@pytest.mark.parametrize(
    ("what", "change", "message"),
    [
        (spec, {"epochs": 0}, "epochs"),
        (spec, {"render_quality": "best"}, "render_quality"),
        (spec, {"sampling": {"temperature": 1.0}, "tools": ()}, "tools"),
        (spec, {"agent_kind": "robot"}, "agent_kind"),
        (header, {"hosts": {}}, "hosts"),
        (header, {"resumed": [{"started": NOON}]}, "rows_before"),
    ],
)
def test_a_header_that_is_none_is_refused(what: Callable[..., object], change: dict, message: str):
    with pytest.raises(ValidationError, match=message):
        what(**change)
    assert spec(epochs=1, render_quality="fast").render_quality == "fast"


@pytest.mark.parametrize("field", ["epoch", "attempt"])
def test_epochs_and_attempts_count_from_one(field: str):
    fields = row().model_dump()
    assert getattr(EpisodeRecord.model_validate(fields | {field: 1}), field) == 1
    with pytest.raises(ValidationError, match="greater than or equal to 1"):
        EpisodeRecord.model_validate(fields | {field: 0})


def test_a_step_says_by_itself_what_is_wrong_with_it():
    fields = row().steps[0].model_dump()
    with pytest.raises(ValidationError, match="greater than or equal to 1"):
        StepRecord.model_validate(fields | {"index": 0})
    reason = InvalidAction(kind="malformed_action", reason="not_json")
    for change in ({"action": None}, {"invalid": reason}):
        with pytest.raises(ValidationError, match="a step must have either an action or the reason why there is none"):
            StepRecord.model_validate(fields | change)
    without = {name: value for name, value in fields.items() if name != "action"}
    step = StepRecord.model_validate(without | {"invalid": reason})
    assert (step.action, step.invalid) == (None, reason)


def test_an_error_may_come_before_the_reset():
    fields = row(end="error").model_dump() | {"initial": None, "steps": ()}
    assert EpisodeRecord.model_validate(fields).initial is None


def test_settings_are_listed_by_their_place():
    settings = spec(sampling={"extra_body": {"k": [1]}}, episode_ids=("a", "b")).settings
    assert settings["sampling.extra_body.k"] == (1,)
    assert settings["profile.prompt_variant"] == "default"
    assert settings["episode_ids"] == ("a", "b")
    assert list(settings) == sorted(settings)


def test_records_do_not_change():
    with pytest.raises(ValidationError, match="frozen"):
        row().attempt = 2


def test_the_worlds_of_a_row_are_its_reset_and_what_each_step_left():
    record = row()
    assert record.worlds == (record.initial, *(step.world for step in record.steps))
    assert record.key == ("a", 1)
    with pytest.raises(RecordError, match=r"^Record of episode 'a' has no initial world: it ended as an error\.$"):
        _ = row(end="error").model_copy(update={"initial": None, "steps": ()}).worlds


def test_a_header_tells_the_machines_and_the_pack():
    later = Resumption(started=NOON, rows_before=1, host={"platform": "two"})
    found = header(host={"platform": "one", "pack_folder": "packs/p"}, resumed=(later,))
    assert found.hosts == ({"platform": "one", "pack_folder": "packs/p"}, {"platform": "two"})
    assert found.pack_folder == "packs/p"
    assert header().pack_folder == ""
    assert header().hosts == ({},)
    assert not header(spec=spec(agent_kind="model")).is_privileged


def test_a_header_says_under_which_other_versions_it_was_made():
    assert header(spec=spec(versions=Versions.current(), pack_versions=PackVersions.current())).version_notes == ()
    older = Versions.current().model_copy(update={"grammar": 1})
    shapes = PackVersions.current().model_copy(update={"shapes": 1})
    run, pack = header(spec=spec(versions=older, pack_versions=shapes)).version_notes
    assert "Run 'r'" in run
    assert "Its pack 'p'" in pack


def test_a_header_is_read_or_the_fault_is_named(tmp_path: Path):
    folder, file = str(tmp_path), tmp_path / "run.json"
    with pytest.raises(RecordError) as none:
        read_header(tmp_path)
    assert str(none.value) == f"Folder {folder!r} has no run.json; give the folder of a run (its --log-dir)."
    whole = header(host={"a": "b"}, package_version=__version__)
    file.write_text(whole.model_dump_json())
    assert read_header(tmp_path) == whole
    for text, said in (
        ("{", " is not JSON: "),
        ("[]", f" has schema None, but vigil {__version__} reads {SCHEMA_VERSION}. Read it with the version of vigil "),
        ("{}", f" has schema None, but vigil {__version__} reads {SCHEMA_VERSION}. Read it with the version of vigil "),
        (
            whole.model_dump_json().replace(f":{SCHEMA_VERSION},", ":9,", 1),
            f" has schema 9, but vigil {__version__} reads {SCHEMA_VERSION}. A newer vigil",
        ),
        (whole.model_dump_json().replace("run_id", "id"), ": run_id: Field required. Restore it from a copy."),
    ):
        file.write_text(text)
        with pytest.raises(RecordError) as caught:
            read_header(tmp_path)
        assert str(caught.value).startswith(f"{str(file)!r}{said}")
        assert str(caught.value).endswith((" from a copy.", " vigil that wrote it.", ", then read it again."))


def test_a_header_of_another_version_with_a_fault_is_to_be_read_with_that_version(tmp_path: Path):
    fields = header(package_version="7.2.0").model_dump(mode="json") | {"weather": "fine"}
    (tmp_path / "run.json").write_text(json.dumps(fields))
    with pytest.raises(RecordError, match=rf"weather: .*vigil 7\.2\.0 wrote it, this is {__version__}: read it with"):
        read_header(tmp_path)


def test_rows_that_stand_are_sorted_by_episode_and_epoch():
    rows = [row("b"), row("a", epoch=2), row("a"), row("a", attempt=2)]
    assert [(key, record.attempt) for key, record in effective_records(rows).items()] == [
        (("a", 1), 1),
        (("a", 2), 1),
        (("b", 1), 1),
    ]
    table = RowResolver()
    assert [table.accept(each) for each in (row(end="error"), row(end="error"), row(), row(), row(end="error"))] == [
        *(True, True, True),
        *(False, False),
    ]
    assert not table.accept(row())
    assert table.accept(row(epoch=2))


def test_the_files_of_a_run_keep_their_names():
    assert (EPISODES_FILE, HEADER_FILE, FRAMES_FOLDER) == ("episodes.jsonl", "run.json", "frames")


def test_what_answered_is_told_over_all_sessions():
    assert ProviderFacts().model_dump() == {
        "replies": 0,
        "models": {},
        "finish_reasons": {},
        "addresses": (),
        "thinking": "unknown",
        "thinking_set_by": "",
        "replies_with_reasoning": 0,
        "check": {},
        "clients": {},
    }
    later = Resumption(started=NOON, rows_before=1, answered=ProviderFacts(models={"b": 1, "a": 2}))
    silent = Resumption(started=NOON, rows_before=1)
    first = ProviderFacts(models={"c": 1, "a": 1})
    assert header(answered=first, resumed=(later, silent)).answering_models == ("a", "b", "c")
    assert header(resumed=(later,)).answering_models == ("a", "b")
    assert header().answering_models == ()


def test_a_pipe_in_place_of_the_rows_is_named(path: Path):
    os.mkfifo(path)
    with pytest.raises(RecordError, match=r"episodes\.jsonl' is a pipe, not a file"):
        RecordLog(path)


@pytest.mark.parametrize(("index", "of"), [(1, 1), (1, 2), (2, 2), (3, 7)])
def test_a_shard_is_one_of_some(index, of):
    shard = Shard(index=index, of=of)
    assert str(shard) == f"{index}/{of}"
    assert Shard.model_validate_json(shard.model_dump_json()) == shard


@pytest.mark.parametrize(
    ("index", "of", "reason"),
    [
        (0, 1, "index\n.*greater than or equal to 1"),
        (1, 0, "of\n.*greater than or equal to 1"),
        (3, 2, "a shard's index is at most the number of shards"),
    ],
)
def test_no_shard_is_outside_of_its_number(index, of, reason):
    with pytest.raises(ValidationError, match=reason):
        Shard(index=index, of=of)
