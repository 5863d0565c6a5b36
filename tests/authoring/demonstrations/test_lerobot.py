"""Demonstrations as a LeRobot dataset: as format v3.0 says, what the agent saw, nothing hidden, and readable."""

import io
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from PIL import Image

from vigil.authoring.demonstrations import lerobot
from vigil.authoring.demonstrations.columns import ACTION_NAMES, numbers_of
from vigil.authoring.demonstrations.write import write_demonstrations
from vigil.authoring.streaming.stream import Stream, StreamItem
from vigil.integrations.gymnasium.spaces import StructuredActions
from vigil.protocol.actions import INTENTS, Action, InteractPixel, ParsedReply, Report
from vigil.protocol.profile import ACTION_FEEDBACK, Profile
from vigil.protocol.replies import read_reply

PROFILE = Profile(name=ACTION_FEEDBACK)
CAMERA = "observation.images.ego"
NEXT = ("next.reward", "next.done")
POSITION = ["timestamp", "frame_index", "episode_index", "index", "task_index"]
PAGE = (Path(__file__).parents[3] / "docs" / "stream.md").read_text(encoding="utf-8")


@pytest.fixture
def folder(stream: Stream, tmp_path: Path) -> Path:
    write_demonstrations(tmp_path / "lerobot", stream, 3, PROFILE, form="lerobot", quality="fast")
    return tmp_path / "lerobot"


def told(folder: Path, name: str) -> Any:
    return json.loads((folder / "meta" / name).read_text())


def frames_in(folder: Path) -> pa.Table:
    return pq.read_table(folder / "data" / "chunk-000" / "file-000.parquet")


def pixels(image: dict[str, Any]) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(image["bytes"])))


def test_files_and_columns_are_as_the_format_says(folder: Path) -> None:
    files = sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())
    assert files == [
        "README.md",
        "data/chunk-000/file-000.parquet",
        "demonstrations.json",
        "meta/episodes/chunk-000/file-000.parquet",
        "meta/info.json",
        "meta/stats.json",
        "meta/tasks.parquet",
    ]
    info, frames = told(folder, "info.json"), frames_in(folder)
    assert {name: info[name] for name in ("codebase_version", "fps", "video_path", "splits", "total_episodes")} == {
        "codebase_version": "v3.0",
        "fps": 1,
        "video_path": None,
        "splits": {"train": "0:3"},
        "total_episodes": 3,
    }
    assert info["total_frames"] == frames.num_rows
    assert (folder / info["data_path"].format(chunk_index=0, file_index=0)).exists()
    features = info["features"]
    assert list(features) == frames.column_names
    assert list(features) == [CAMERA, "observation.state", "action", "thought", "is_privileged", *NEXT, *POSITION]
    assert features[CAMERA] == {"dtype": "image", "shape": [480, 640, 3], "names": ["height", "width", "channels"]}
    assert features["observation.state"]["names"] == ["too_far", "path_blocked"]
    assert features["action"] == {"dtype": "float32", "shape": [8], "names": list(ACTION_NAMES)}
    types = {name: str(frames.schema.field(name).type) for name in features}
    assert types == {
        CAMERA: "struct<bytes: binary, path: string>",
        "observation.state": "fixed_size_list<element: float>[2]",
        "action": "fixed_size_list<element: float>[8]",
        "thought": "string",
        "is_privileged": "bool",
        "next.reward": "float",
        "next.done": "bool",
        "timestamp": "float",
        **dict.fromkeys(POSITION[1:], "int64"),
    }


def test_rows_episodes_and_tasks_fit_together(folder: Path, items: list[StreamItem]) -> None:
    frames = frames_in(folder).to_pylist()
    episodes = pq.read_table(folder / "meta" / "episodes" / "chunk-000" / "file-000.parquet").to_pylist()
    tasks = pd.read_parquet(folder / "meta" / "tasks.parquet")
    assert tasks["task_index"].tolist() == list(range(len(tasks)))
    assert told(folder, "info.json")["total_tasks"] == len(tasks)
    assert [frame["index"] for frame in frames] == list(range(len(frames)))
    for number, (episode, item) in enumerate(zip(episodes, items, strict=True)):
        of = frames[episode["dataset_from_index"] : episode["dataset_to_index"]]
        assert episode["episode_index"] == number
        assert episode["length"] == len(of) == len(item.draft.actions)
        assert episode["tasks"] == [item.episode.instruction]
        assert (episode["family"], episode["difficulty"]) == (item.episode.family, item.difficulty)
        assert {
            episode[f"{kind}/{name}_index"] for kind in ("data", "meta/episodes") for name in ("chunk", "file")
        } == {0}
        assert [frame["frame_index"] for frame in of] == [frame["timestamp"] for frame in of] == list(range(len(of)))
        assert {frame["episode_index"] for frame in of} == {number}
        assert {tasks.index[frame["task_index"]] for frame in of} == {item.episode.instruction}
        assert [frame["next.done"] for frame in of] == [frame["next.reward"] == 1 for frame in of]
        assert [frame["next.done"] for frame in of] == [False] * (len(of) - 1) + [True]
    assert episodes[-1]["dataset_to_index"] == len(frames)


def test_statistics_are_of_all_rows_and_all_pixels(folder: Path) -> None:
    stats, table = told(folder, "stats.json"), frames_in(folder)
    frames = table.to_pylist()
    assert set(stats) == set(table.column_names) - {"thought"}
    seen = np.stack([pixels(frame[CAMERA]) for frame in frames]).reshape(-1, 3) / 255
    wanted = {CAMERA: seen} | {
        name: np.array([frame[name] for frame in frames], float).reshape(len(frames), -1)
        for name in stats
        if name != CAMERA
    }
    shares = {"q01": 0.01, "q10": 0.1, "q50": 0.5, "q90": 0.9, "q99": 0.99}
    for name, values in wanted.items():
        of = {statistic: np.array(value) for statistic, value in stats[name].items()}
        assert of.pop("count").tolist() == [len(frames)]
        shape = (3, 1, 1) if name == CAMERA else (values.shape[1],)
        assert {value.shape for value in of.values()} == {shape}
        right = {
            **{each: getattr(np, each)(values, axis=0) for each in ("min", "max", "mean", "std")},
            **{each: np.quantile(values, share, axis=0, method="inverted_cdf") for each, share in shares.items()},
        }
        for each, value in right.items():
            np.testing.assert_allclose(of.pop(each).ravel(), value, atol=1e-9, err_msg=f"{name} {each}")
        assert not of


def test_an_episode_s_statistics_are_of_its_own_rows(folder: Path) -> None:
    path = folder / "meta" / "episodes" / "chunk-000" / "file-000.parquet"
    for episode in pq.read_table(path).to_pylist():
        of = frames_in(folder).slice(episode["dataset_from_index"], episode["length"]).to_pylist()
        np.testing.assert_allclose(
            episode["stats/action/mean"], np.mean([frame["action"] for frame in of], axis=0), atol=1e-6
        )
        seen = np.stack([pixels(frame[CAMERA]) for frame in of])
        np.testing.assert_allclose(np.ravel(episode[f"stats/{CAMERA}/mean"]), seen.mean(axis=(0, 1, 2)) / 255)
        assert episode[f"stats/{CAMERA}/count"] == [len(of)]


def test_frames_and_thoughts_are_those_of_the_chats_without_corrections(
    folder: Path, stream: Stream, tmp_path: Path
) -> None:
    rows = write_demonstrations(tmp_path / "pq", stream, 3, PROFILE, form="parquet", quality="fast")["rows"]
    chats = pq.read_table(tmp_path / "pq" / "train.parquet").to_pylist()
    shown = [chat for chat in chats if chat["kind"] == "demonstration"]
    frames = frames_in(folder).to_pylist()
    assert json.loads((folder / "demonstrations.json").read_text())["rows"] == {"demonstration": rows["demonstration"]}
    assert len(shown) == len(frames) < len(chats)
    for chat, frame in zip(shown, frames, strict=True):
        assert frame[CAMERA]["bytes"] == chat["images"][0]["bytes"]
        assert frame["thought"] == json.loads(chat["messages"][-1]["content"][0]["text"])["thought"]
        sent = chat["messages"][-2]["content"][0]["text"]
        for name, number in zip(("too_far", "path_blocked"), frame["observation.state"], strict=True):
            assert number == (f'"{name}": true' in sent)


def actions_of(items: list[StreamItem]) -> list[Action]:
    return [action for item in items for action in item.draft.actions]


def documented(name: str) -> Any:
    """A function that the page shows."""
    (shown,) = [code for code in re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL) if f"def {name}(" in code]
    space: dict[str, Any] = {}
    exec(compile(shown, "docs/stream.md", "exec"), space)
    return space[name]


def test_numbers_say_the_very_action(folder: Path, items: list[StreamItem]) -> None:
    structured, spaces = documented("structured"), StructuredActions("pixel")
    frames = frames_in(folder).to_pylist()
    for frame, action in zip(frames, actions_of(items), strict=True):
        reply = spaces.reply(structured(np.array(frame["action"], np.float32), ACTION_NAMES, spaces.space))
        parsed = read_reply(reply).parsed
        assert isinstance(parsed, ParsedReply)
        right = action.model_copy(update={"summary": ""}) if isinstance(action, Report) else action
        assert parsed.action.model_dump() == pytest.approx(right.model_dump())


def test_every_pixel_and_intent_comes_back() -> None:
    structured, spaces = documented("structured"), StructuredActions("pixel")
    for x in range(640):
        action = InteractPixel(intent=list(INTENTS)[x % 7], x=x, y=x % 480)
        again = structured(np.array(numbers_of(action), np.float32), ACTION_NAMES, spaces.space)
        parsed = read_reply(spaces.reply(again)).parsed
        assert isinstance(parsed, ParsedReply)
        assert parsed.action == action
    assert numbers_of(InteractPixel(intent="drop")) == [2, 0, 0, 0, 7, 0, 0, 0]


def test_nothing_hidden_is_in_the_folder(folder: Path, items: list[StreamItem]) -> None:
    rows = frames_in(folder).drop_columns([CAMERA]).to_pylist()
    episodes = pq.read_table(folder / "meta" / "episodes" / "chunk-000" / "file-000.parquet").to_pylist()
    text = json.dumps([rows, episodes])
    hidden = [name for item in items for name in (item.episode.id, *item.episode.bindings.values())]
    assert hidden
    assert not [name for name in hidden if name in text]
    read = [name for name in told(folder, "info.json")["features"] if name.startswith("observation")]
    assert read == [CAMERA, "observation.state"]


def test_without_feedback_the_frame_is_all_that_is_observed(stream: Stream, tmp_path: Path) -> None:
    write_demonstrations(tmp_path / "d", stream, 1, Profile(), form="lerobot", quality="fast")
    names = list(told(tmp_path / "d", "info.json")["features"])
    assert names[:2] == [CAMERA, "action"]
    assert frames_in(tmp_path / "d").column_names == names


def test_the_same_stream_gives_the_same_bytes(folder: Path, stream: Stream, tmp_path: Path) -> None:
    again = tmp_path / "again"
    write_demonstrations(again, stream, 3, PROFILE, form="lerobot", quality="fast")
    for path in sorted(folder.rglob("*.*")):
        assert path.read_bytes() == (again / path.relative_to(folder)).read_bytes(), path.name


def test_files_that_grow_too_large_are_followed_by_others(
    folder: Path, stream: Stream, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(lerobot, "FILE_MB", 0)
    monkeypatch.setattr(lerobot, "FILES_A_CHUNK", 2)
    many = tmp_path / "many"
    write_demonstrations(many, stream, 3, PROFILE, form="lerobot", quality="fast")
    info = told(many, "info.json")
    episodes = pq.read_table(many / "meta" / "episodes" / "chunk-000" / "file-000.parquet").to_pylist()
    places = [(episode["data/chunk_index"], episode["data/file_index"]) for episode in episodes]
    assert places == [(0, 0), (0, 1), (1, 0)]
    tables = [pq.read_table(many / info["data_path"].format(chunk_index=c, file_index=f)) for c, f in places]
    assert [table.num_rows for table in tables] == [episode["length"] for episode in episodes]
    assert pa.concat_tables(tables).equals(frames_in(folder))


def test_the_card_tells_every_column_and_every_number_of_an_action(folder: Path) -> None:
    card = (folder / "README.md").read_text()
    names = set(re.findall(r"`([a-z_.]+)`", card))
    assert {*told(folder, "info.json")["features"], *ACTION_NAMES} <= names
    assert "2 interact_pixel" in card
    assert "There are no corrections" in card
    assert "data_files: data/*/*.parquet" in card


@pytest.mark.filterwarnings("ignore")
def test_lerobot_reads_it(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HF_HUB_OFFLINE", "1")
    monkeypatch.setenv("HF_HOME", str(tmp_path / "home"))
    library = pytest.importorskip(
        "lerobot.datasets.lerobot_dataset", reason="lerobot is not installed: docs/stream.md says how"
    )
    dataset = library.LeRobotDataset("vigil/demos", root=folder)
    frames = frames_in(folder).to_pylist()
    tasks = pd.read_parquet(folder / "meta" / "tasks.parquet").index
    assert len(dataset) == len(frames)
    for item, frame in zip(dataset, frames, strict=True):
        seen = (item[CAMERA].numpy().transpose(1, 2, 0) * 255).round().astype(np.uint8)
        assert np.array_equal(seen, pixels(frame[CAMERA]))
        assert item["action"].tolist() == frame["action"]
        assert item["task"] == tasks[frame["task_index"]]
        assert item["thought"] == frame["thought"]
    (last,) = library.LeRobotDataset("vigil/demos", root=folder, episodes=[2]).hf_dataset.unique("episode_index")
    assert int(last) == 2
    ahead = library.LeRobotDataset("vigil/demos", root=folder, delta_timestamps={"action": [0.0, 1.0]})[0]["action"]
    assert ahead.tolist() == [frames[0]["action"], frames[1]["action"]]
