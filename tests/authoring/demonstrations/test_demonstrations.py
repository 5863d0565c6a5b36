"""Demonstrations: the requests are a model's own, the answers right, the false reports false, the files readable."""

import asyncio
import io
import json
from collections.abc import Iterator, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
from PIL import Image

from tests.support.commands import command_runner
from vigil.agents.conversation import Message
from vigil.authoring.demonstrations.chat_rows import row_of
from vigil.authoring.demonstrations.columns import columns_of
from vigil.authoring.demonstrations.play import Demonstrator, Example
from vigil.authoring.demonstrations.write import check_source, write_demonstrations
from vigil.authoring.streaming.houses import StreamHouseMaker, StreamSettings
from vigil.authoring.streaming.stream import Stream, StreamItem, items_in
from vigil.errors import SettingError, SimulatorError
from vigil.packs.freeze import freeze
from vigil.protocol.actions import ParsedReply, Reply, Report
from vigil.protocol.profile import ACTION_FEEDBACK, Profile
from vigil.protocol.profiles.rows import PROFILE_NAMES
from vigil.protocol.replies import read_reply
from vigil.runner.workers.messages import Assignment, WorkerPlan
from vigil.runner.workers.players import ModelPlayer
from vigil.runner.workers.pool import SimulatorPool
from vigil.scoring.outcomes import score

PROFILE = Profile(name=ACTION_FEEDBACK, coordinates="normalized_1000")
PAST_FRAMES = Profile(name=PROFILE_NAMES["image_history_all"])


@pytest.fixture(scope="module")
def player() -> Iterator[Demonstrator]:
    player = Demonstrator(PROFILE, "fast")
    yield player
    player.close()


@pytest.fixture(scope="module")
def examples(items: list[StreamItem], player: Demonstrator) -> dict[str, list[Example]]:
    return {item.episode.family: player.examples(item) for item in items}


def demonstrated(found: Sequence[Example]) -> list[Example]:
    return [example for example in found if example.fault is None]


@pytest.mark.parametrize("profile", [PROFILE, PAST_FRAMES, Profile(name=PROFILE_NAMES["remaining_steps"])])
def test_the_messages_are_those_that_a_model_is_sent(profile: Profile, items: list[StreamItem], tmp_path: Path) -> None:
    item = next(item for item in items if item.episode.family == "AI")
    with closing(Demonstrator(profile, "fast")) as player:
        shown = player.examples(item, with_corrections=False)
    pack = freeze(tmp_path / "p", [item.episode], [item.solution], [item.house], name="p")
    answers, sent = [example.answer for example in shown], list[Sequence[Message]]()

    async def ask(messages: Sequence[Message]) -> Reply:
        sent.append(messages)
        return Reply(text=answers[len(sent) - 1])

    plan = WorkerPlan(pack.folder, "run", profile, quality="fast", pack_sha256=pack.sha256)
    with SimulatorPool(plan, 1) as pool:
        record = asyncio.run(ModelPlayer(pool, profile, ask, "run").play(Assignment(pack.episodes[0])))
    assert score(item.episode, record).B
    assert [list(example.messages) for example in shown] == [list(messages) for messages in sent]
    assert len(sent) > 2
    assert ('"feedback"' in sent[-1][-1].text) == profile.has_feedback
    assert ("remaining_steps" in sent[-1][-1].text) == profile.row.shows_remaining_steps
    assert len(shown[-1].pictures) == (len(sent) if profile.row.images else 1)


def test_answers_are_the_solver_s_actions_with_a_sentence(
    items: list[StreamItem], examples: dict[str, list[Example]]
) -> None:
    for item in items:
        for example, action in zip(demonstrated(examples[item.episode.family]), item.draft.actions, strict=True):
            parsed = read_reply(Reply(text=example.answer), PROFILE).parsed
            assert isinstance(parsed, ParsedReply)
            said = parsed.thought
            assert said[0].isupper()
            assert said.endswith(".")
            if isinstance(action, Report):
                assert parsed.action == action.model_copy(update={"summary": said})
            else:
                assert parsed.action == action  # pixels too, which went through 1000 parts of the frame


def test_rows_say_where_the_solver_goes_by_what_no_frame_has_shown(
    examples: dict[str, list[Example]], player: Demonstrator
) -> None:
    """All of these three families have their target in view at the start; a search has not."""
    assert not any(example.is_privileged for found in examples.values() for example in found)
    made = StreamHouseMaker(StreamSettings(7, ("VS",))).made(15)
    for item in items_in([made]):
        shown = demonstrated(player.examples(item))
        marks = [example.is_privileged for example in shown]
        assert (marks[0], marks[-1]) == (True, False)
        assert marks == sorted(marks, reverse=True)  # once seen, it has been seen
        assert all(row_of(example).columns["is_privileged"] == mark for example, mark in zip(shown, marks, strict=True))
        assert [columns_of(example)["is_privileged"] for example in shown] == marks


def test_a_correction_has_the_same_request_and_a_false_report(examples: dict[str, list[Example]]) -> None:
    faults = {family: [each.fault for each in found if each.fault] for family, found in examples.items()}
    assert faults == {
        "PG": ["premature_success", "false_fail"],
        "SV": ["wrong_state"],
        "AI": ["premature_success", "false_fail"],
    }
    for found in examples.values():
        for example in found:
            if example.rejected is not None:
                assert example.answer == found[example.step - 1].answer
                assert example.messages is found[example.step - 1].messages
    false, right = (json.loads(text or "") for text in (examples["SV"][-1].rejected, examples["SV"][-1].answer))
    assert {false["arguments"]["status"], right["arguments"]["status"]} in ({"on", "off"}, {"open", "closed"})


def test_a_report_that_is_true_is_no_correction(
    items: list[StreamItem], player: Demonstrator, examples: dict[str, list[Example]]
) -> None:
    for item in items:
        player.examples(item)
        shown = demonstrated(examples[item.episode.family])
        assert player._false_ones(shown, [(shown[-1], "premature_success", shown[-1].answer)]) == []


def test_a_solution_that_fails_when_it_is_played_again_is_an_error(
    items: list[StreamItem], player: Demonstrator
) -> None:
    item = next(item for item in items if item.episode.family == "PG")
    broken = item.draft.model_copy(update={"actions": item.draft.actions[1:]})
    with pytest.raises(SimulatorError, match="does not solve the episode"):
        player.examples(StreamItem(0, 15, broken, item.house))


def test_both_forms_of_chats_hold_the_same_rows_and_pictures(stream: Stream, tmp_path: Path) -> None:
    told = write_demonstrations(tmp_path / "sft", stream, 2, PROFILE, quality="fast")
    assert write_demonstrations(tmp_path / "pq", stream, 2, PROFILE, form="parquet", quality="fast") == told | {
        "format": "parquet"
    }
    lines = [json.loads(line) for line in (tmp_path / "sft" / "train.jsonl").read_text().splitlines()]
    table = pq.read_table(tmp_path / "pq" / "train.parquet")
    rows = table.to_pylist()
    assert [{**row, "images": None} for row in rows] == [{**line, "images": None} for line in lines]
    assert len(rows) == sum(told["rows"].values())
    for line, row in zip(lines, rows, strict=True):
        (path,), (image,) = line["images"], row["images"]
        assert (tmp_path / "sft" / path).read_bytes() == image["bytes"]
        assert np.asarray(Image.open(io.BytesIO(image["bytes"]))).shape == (480, 640, 3)
        parts = [part["type"] for message in line["messages"] for part in message["content"]]
        assert parts.count("image") == 1
        assert [message["role"] for message in line["messages"]][-2:] == ["user", "assistant"]
    features = json.loads(table.schema.metadata[b"huggingface"])["info"]["features"]
    assert list(features) == table.column_names
    again = write_demonstrations(tmp_path / "again", stream, 2, PROFILE, quality="fast")
    assert again == told
    assert (tmp_path / "again" / "train.jsonl").read_bytes() == (tmp_path / "sft" / "train.jsonl").read_bytes()


def test_rows_have_all_pictures_that_the_profile_shows(stream: Stream, tmp_path: Path) -> None:
    for form in ("sft", "parquet"):
        write_demonstrations(tmp_path / form, stream, 1, PAST_FRAMES, form=form, quality="fast")
    lines = [json.loads(line) for line in (tmp_path / "sft" / "train.jsonl").read_text().splitlines()]
    rows = pq.read_table(tmp_path / "parquet" / "train.parquet").to_pylist()
    for line, row in zip(lines, rows, strict=True):
        assert [path[-6:-4] for path in line["images"]] == [f"{step:02d}" for step in range(1, line["step"] + 1)]
        parts = [part["type"] for message in line["messages"] for part in message["content"]]
        assert parts.count("image") == line["step"]
        files = [(tmp_path / "sft" / path).read_bytes() for path in line["images"]]
        assert files == [image["bytes"] for image in row["images"]]
    assert max(line["step"] for line in lines) > 1


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("form", ["sft", "parquet", "lerobot"])
def test_hf_datasets_reads_every_form(
    form: Any, stream: Stream, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HF_HUB_OFFLINE", "1")
    monkeypatch.setenv("HF_HOME", str(tmp_path / "home"))
    datasets = pytest.importorskip("datasets")
    told = write_demonstrations(tmp_path / "d", stream, 1, PROFILE, form=form, quality="fast")
    loaded = datasets.load_dataset(str(tmp_path / "d"), split="train", cache_dir=str(tmp_path / "cache"))
    assert loaded.num_rows == sum(told["rows"].values())
    first = loaded[0]
    if form == "lerobot":
        assert first["observation.images.ego"].size == (640, 480)
        assert len(first["action"]) == 8
        return
    assert first["messages"][0]["role"] == "system"
    assert first["images"][0].size == (640, 480) if form == "parquet" else first["images"][0].startswith("images/")


@pytest.mark.parametrize("pack", ["starter", "vigil_mini", "some/folder", "."])
def test_no_pack_is_demonstrated(
    pack: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SettingError, match=r"Demonstrations cannot be made from pack .* --pack stream:7"):
        check_source(pack)
    said = command_runner(monkeypatch, capsys)("demos", "--pack", pack, "--out", tmp_path / "d")
    assert said.code == 2
    assert "Demonstrations cannot be made" in said.err
    assert not list(tmp_path.iterdir())


def test_a_folder_is_written_whole_or_not_at_all(stream: Stream, tmp_path: Path) -> None:
    with pytest.raises(SettingError, match="has only 3 of the 4 requested episodes"):
        write_demonstrations(tmp_path / "d", stream, 4, PROFILE, quality="fast")
    assert not list(tmp_path.iterdir())
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "file").write_text("x")
    with pytest.raises(SettingError, match="not an empty folder"):
        write_demonstrations(tmp_path / "full", stream, 1, PROFILE)
    with pytest.raises(SettingError, match=r"Format 'csv' does not exist. Choose one of: sft, parquet, lerobot\."):
        write_demonstrations(tmp_path / "d", stream, 1, PROFILE, form="csv")  # type: ignore[arg-type]
