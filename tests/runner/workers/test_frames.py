from pathlib import Path

import numpy as np
import pytest

from tests.support.tiny_pack import tiny_pack
from vigil.agents.scripted import scripted_agent
from vigil.assets.database import AssetDatabase
from vigil.env import Env
from vigil.errors import RecordError
from vigil.protocol.profile import Profile
from vigil.runner.workers.frames import FrameStore, frame_sha256, redraw
from vigil.runner.workers.worker import play
from vigil.sim import make_simulator


def test_frames_are_drawn_again_from_the_recorded_actions(tmp_path: Path) -> None:
    pack = tiny_pack(tmp_path / "pack", 1)
    episode = pack.episodes[0]
    env = Env(make_simulator("fake", assets=AssetDatabase.default()), pack.house_of, Profile())
    seen: list[np.ndarray] = []
    play(episode, env, scripted_agent("sweep"), on_reply=lambda observation, _: seen.append(observation.rgb.copy()))
    record = env.record()
    again = list(redraw(episode, record, env))
    assert len(seen) == 5
    assert all((first == second).all() for first, second in zip(seen, again, strict=True))
    assert [frame_sha256(rgb) for rgb in again] == [step.frame_sha256 for step in record.steps]


def test_a_frame_is_stored_once_and_found_by_its_hash(tmp_path: Path) -> None:
    store = FrameStore(tmp_path)
    rgb = np.random.default_rng(1).integers(0, 256, (480, 640, 3), dtype=np.uint8)
    sha256 = store.save(rgb)
    written = store.path(sha256).stat().st_mtime_ns
    assert store.save(rgb.copy()) == sha256
    assert store.path(sha256).stat().st_mtime_ns == written
    kept = store.frame(sha256)
    assert kept is not None
    assert (kept[1] == rgb).all()
    assert [path.name for path in tmp_path.rglob("*") if path.is_file()] == [f"{sha256}.png"]


def test_a_frame_that_was_not_kept_or_lies_elsewhere_is_none_and_another_is_named(tmp_path: Path) -> None:
    store, elsewhere = FrameStore(tmp_path / "run" / "frames"), FrameStore(tmp_path / "elsewhere")
    rgb = np.zeros((480, 640, 3), dtype=np.uint8)
    sha256 = elsewhere.save(rgb)
    path = store.path(sha256)
    assert store.frame(sha256) is store.frame(None) is None
    path.parent.mkdir(parents=True)
    path.symlink_to(elsewhere.path(sha256))
    assert store.frame(sha256) is None
    path.unlink()
    for data in (b"no picture", elsewhere.path(elsewhere.save(rgb + 1)).read_bytes()):
        path.write_bytes(data)
        with pytest.raises(
            RecordError, match=r"not an image of a frame|does not contain the frame whose hash is the file's name"
        ):
            store.frame(sha256)
