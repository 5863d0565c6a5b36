"""Files of others: what is read, and what is refused by its kind, its size or where its link leads."""

import os
from pathlib import Path

import pytest

from vigil.base.files import file_sha256, read_file, refuse_outward_links, resolve_inside
from vigil.errors import RecordError


def test_a_file_is_read_whole_up_to_its_limit(tmp_path: Path):
    path = tmp_path / "a"
    path.write_bytes(b"12345")
    assert read_file(path, "A", RecordError, 5) == b"12345"
    assert file_sha256(path, "A") == "5994471abb01112afcc18159f6cc74b4f511b99806da59b3caf5a9c173cacfc5"
    with pytest.raises(RecordError, match=r"^A is over \S+ MiB, the limit for such a file\.$"):
        read_file(path, "A", RecordError, 4)


@pytest.mark.parametrize(
    ("place", "said"),
    [
        ("/dev/zero", "is a device, not a file"),
        ("pipe", "is a pipe, not a file"),
        (".", "is a folder, not a file"),
        ("none", "does not exist"),
        ("a\0b", "cannot be read: embedded null byte"),
        ("x" * 300, "cannot be read: File name too long"),
    ],
)
def test_what_is_no_file_is_refused_at_once(tmp_path: Path, place: str, said: str):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(RecordError, match=f"^It {said}"):
        read_file(tmp_path / place, "It", RecordError)


def test_links_are_followed_within_a_folder_alone(tmp_path: Path):
    folder = tmp_path / "run"
    (folder / "deep").mkdir(parents=True)
    (tmp_path / "secret").write_text("mine")
    (folder / "here").write_text("ours")
    (folder / "deep" / "link").symlink_to(folder / "here")
    refuse_outward_links(folder, RecordError)
    assert resolve_inside(folder, "deep/link", RecordError).read_text() == "ours"
    (folder / "deep" / "out").symlink_to(tmp_path / "secret")
    with pytest.raises(RecordError, match=r"out' is a link that leads out of .*run', so it is not followed"):
        refuse_outward_links(folder, RecordError)
    with pytest.raises(RecordError, match=r"deep/out in .* is a link that leads out of the folder"):
        resolve_inside(folder, "deep/out", RecordError)


def test_a_link_to_a_run_is_the_run(tmp_path: Path):
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "a").write_text("a")
    (tmp_path / "link").symlink_to(tmp_path / "run")
    assert resolve_inside(tmp_path / "link", "a", RecordError).read_text() == "a"
