"""A stream as the folder of a pack: continued, added to, and never written over something else."""

from pathlib import Path

import pytest

from tests.support.commands import command_runner
from vigil.authoring.streaming import folder as module
from vigil.authoring.streaming.folder import write_stream
from vigil.authoring.streaming.houses import StreamHouse, StreamHouseMaker
from vigil.authoring.streaming.stream import Stream
from vigil.errors import SettingError
from vigil.packs.freeze import freeze
from vigil.packs.pack import Pack


@pytest.fixture
def numbers(pointing: StreamHouse, monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Houses are the bathroom under other names, made at no cost; returns the numbers of those that were made."""
    found: list[int] = []

    def made(self: StreamHouseMaker, number: int) -> StreamHouse:
        found.append(number)
        name = f"bathroom_{number}"
        drafts = tuple(
            draft.model_copy(
                update={
                    "episode": draft.episode.model_copy(
                        update={
                            "id": draft.episode.id.replace("_0000000015_", f"_{number:010d}_"),
                            "house": draft.episode.house.model_copy(update={"name": name}),
                        }
                    )
                }
            )
            for draft in pointing.drafts
        )
        return pointing.model_copy(update={"number": number, "name": name, "drafts": drafts})

    monkeypatch.setattr(StreamHouseMaker, "made", made)
    return found


def asked(**options) -> Stream:
    return Stream(7, families=("PG",), workers=0, **options)


def contents(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_a_folder_that_is_added_to_is_as_if_written_at_once(
    pointing: StreamHouse, numbers: list[int], tmp_path: Path
) -> None:
    (tmp_path / "at_once").mkdir()
    (tmp_path / "in_parts").mkdir()
    count = 2 * len(pointing.drafts) + 1
    at_once, in_parts = tmp_path / "at_once" / "train", tmp_path / "in_parts" / "train"
    write_stream(at_once, asked(), count)
    write_stream(in_parts, asked(), 2)
    assert len(Pack.load(in_parts).episodes) == 2
    numbers.clear()
    pack = write_stream(in_parts, asked(), count)
    assert numbers == [1, 2]
    assert contents(in_parts) == contents(at_once)
    assert pack.manifest.meta["stream"]["stream"].startswith("stream:7@")
    assert sorted(path.name for path in in_parts.parent.iterdir()) == ["train", "train.stream.jsonl"]


def test_an_interrupted_command_goes_on(numbers: list[int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(module, "freeze", interrupted)
    with pytest.raises(KeyboardInterrupt):
        write_stream(tmp_path / "train", asked(), 10)
    file = tmp_path / "train.stream.jsonl"
    file.write_bytes(file.read_bytes()[:-40])  # a kill tore the last line
    monkeypatch.setattr(module, "freeze", freeze)
    whole = numbers.copy()
    numbers.clear()
    assert len(write_stream(tmp_path / "train", asked(), 10).episodes) == 10
    assert numbers == whole[-1:]


def test_a_stream_that_ends_before_is_an_error(numbers: list[int], tmp_path: Path) -> None:
    with pytest.raises(SettingError, match=r"of the 500 requested episodes in houses 3 to 5"):
        write_stream(tmp_path / "train", asked(first=3, last=5), 500)
    assert numbers == [3, 4]


@pytest.mark.usefixtures("numbers")
def test_nothing_else_is_written_over(tmp_path: Path) -> None:
    write_stream(tmp_path / "train", asked(), 3)
    before = contents(tmp_path)
    with pytest.raises(SettingError, match="more than 2 episodes"):
        write_stream(tmp_path / "train", asked(), 2)
    with pytest.raises(SettingError, match="holds another pack"):
        write_stream(tmp_path / "train", asked(first=1), 5)
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "file").write_text("x")
    with pytest.raises(SettingError, match="is not an empty folder"):
        write_stream(tmp_path / "other", asked(), 2)
    (tmp_path / "train.stream.jsonl").rename(tmp_path / "new.stream.jsonl")
    with pytest.raises(SettingError, match="houses of another stream"):
        write_stream(tmp_path / "new", asked(first=1), 5)
    (tmp_path / "new.stream.jsonl").rename(tmp_path / "train.stream.jsonl")
    assert contents(tmp_path / "train") == {
        name.removeprefix("train/"): data for name, data in before.items() if name.startswith("train/")
    }


def test_the_command_writes_a_pack_and_keeps_its_houses(
    pointing: StreamHouse, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    run = command_runner(monkeypatch, capsys)
    asked_for = ("pack", "stream", "--seed", 7, "--family", "PG", "--houses", "15:16", "--workers", 1)
    said = run(*map(str, asked_for), "--count", "2", "--out", tmp_path / "train")
    assert said.code == 0
    assert "train: 2 episodes in 1 houses" in said.out
    ids = [draft.episode.id for draft in pointing.drafts]
    assert [episode.id for episode in Pack.load(tmp_path / "train").episodes] == ids[:2]
    said = run(*map(str, asked_for), "--count", "99", "--out", tmp_path / "train")
    assert "of the 99 requested episodes in houses 15 to 16" in said.err
    said = run("pack", "stream", "--seed", "7", "--count", "1", "--houses", "x", "--out", tmp_path / "other")
    assert "expected FIRST:END" in said.err
