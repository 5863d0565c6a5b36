"""`vigil train doctor`: it says that all is right where it is, and what is wrong where it is not."""

from typing import Any

import numpy as np
import pytest

from tests.support.commands import command_runner
from tests.support.tiny_pack import tiny_pack
from vigil.integrations import doctor
from vigil.integrations.trl import VigilReplies


@pytest.fixture(scope="module")
def pack(tmp_path_factory: pytest.TempPathFactory) -> str:
    folder = tmp_path_factory.mktemp("doctor") / "pack"
    tiny_pack(folder)
    return str(folder)


@pytest.mark.parametrize("integration", ["trl", "gymnasium"])
def test_all_is_right(integration: str, pack: str) -> None:
    options = {"pack": pack, "backend": "fake"}
    examine = doctor.examine_trl if integration == "trl" else doctor.examine_gymnasium
    found = list(examine(options, 2))
    assert [finding.check for finding in found if not finding.is_right] == []
    assert len(found) == (8 if integration == "trl" else 6)


def test_a_picture_that_is_dropped_or_changed_is_found(pack: str, monkeypatch: pytest.MonkeyPatch) -> None:
    plain = VigilReplies._shown

    def darker(self: VigilReplies, observation: Any) -> Any:
        text, picture = plain(self, observation)
        return [text, {**picture, "image": picture["image"].point(lambda value: value // 2)}]

    monkeypatch.setattr(VigilReplies, "_shown", darker)
    found = {finding.check: finding.is_right for finding in doctor.examine_trl({"pack": pack, "backend": "fake"}, 2)}
    assert not found["frames are those of the record"]
    assert found["texts next to frames"]


def test_patches_are_decoded_into_pictures() -> None:
    """The layout is that of Qwen-VL's image processor: blocks of merged patches, two equal moments."""

    class Layout:
        patch_size, merge_size, image_mean, image_std = 14, 2, (0.5, 0.4, 0.3), (0.2, 0.3, 0.4)

    rng, rows, columns = np.random.default_rng(0), 4, 6
    picture = rng.random((rows * 14, columns * 14, 3))
    scaled = ((picture - Layout.image_mean) / Layout.image_std).transpose(2, 0, 1)
    blocks = np.stack([scaled, scaled]).reshape(1, 2, 3, rows // 2, 2, 14, columns // 2, 2, 14)
    patches = blocks.transpose(0, 3, 6, 4, 7, 2, 1, 5, 8).reshape(rows * columns, -1)
    first, second = doctor.decode_patches(
        Layout, np.concatenate([patches, patches]), np.array([[1, rows, columns]] * 2)
    )
    assert np.allclose(first, picture)
    assert np.allclose(second, picture)


def test_the_command_prints_each_check_and_names_what_is_wrong(
    pack: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    run = command_runner(monkeypatch, capsys)
    printed = run("train", "doctor", "--with", "trl", "--pack", pack, "--backend", "fake")
    assert "ok     frames are those of the record" in printed.out
    assert printed.code == 0
    monkeypatch.setattr(doctor, "same", lambda check, *_: doctor.CheckResult(check, False, "here"))
    wrong = run("train", "doctor", "--with", "trl", "--pack", pack, "--backend", "fake")
    assert "WRONG  replies" in wrong.out
    assert wrong.code == 2
