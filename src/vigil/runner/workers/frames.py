"""Frames by content hash: saved as files on request, otherwise drawn again from the recorded replies.

The few frames of a figure are drawn in the calling process, because the user waits for them and can interrupt. Pages
serve several people for hours, so they draw in a worker with a watchdog (`vigil.web.drawing`).
"""

import hashlib
import os
from collections.abc import Container, Iterable, Iterator
from contextlib import closing
from pathlib import Path

import numpy as np

from vigil.agents.frame_encoding import decode_frame, encode_frame
from vigil.assets.database import AssetDatabase
from vigil.base.files import MIB, is_inside, read_file
from vigil.env import Env
from vigil.errors import RecordError
from vigil.packs.pack import Pack
from vigil.protocol.episode import Episode
from vigil.protocol.observation import Observation
from vigil.protocol.profile import Profile
from vigil.records.record import FRAMES_FOLDER, EpisodeRecord, RunSpec
from vigil.sim import make_simulator

MAX_FRAME_BYTES = 4 * MIB


def frame_sha256(rgb: np.ndarray) -> str:
    """Return the SHA-256 of a frame's RGB bytes. It is the name of the frame in records."""
    return hashlib.sha256(np.ascontiguousarray(rgb).tobytes()).hexdigest()


class FrameStore:
    """A folder of PNG files, each named by the hash of its pixels."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def path(self, sha256: str) -> Path:
        """Return the path of the frame with that hash; the file may not exist."""
        return self._folder / sha256[:2] / f"{sha256}.png"

    def save(self, rgb: np.ndarray) -> str:
        """Write a frame, unless its file exists already, and return its hash."""
        sha256 = frame_sha256(rgb)
        path = self.path(sha256)
        if not path.exists():
            path.parent.mkdir(parents=True, exist_ok=True)
            partial = path.with_name(f"{path.name}.{os.getpid()}")
            partial.write_bytes(encode_frame(rgb, "png").data)
            partial.replace(path)
        return sha256

    def file(self, sha256: str | None) -> bytes | None:
        """Return the bytes of the file with that hash; None if the run's folder does not have it."""
        path = None if sha256 is None else self.path(sha256)
        if path is None or not path.is_file() or not is_inside(path, self._folder.parent):
            return None
        return read_file(path, repr(str(path)), RecordError, MAX_FRAME_BYTES)

    def frame(self, sha256: str | None) -> tuple[bytes, np.ndarray] | None:
        """Return the saved frame with that hash, as file bytes and (480, 640, 3) uint8; None when it was not saved.

        Raises RecordError when the file holds other pixels.
        """
        data = self.file(sha256)
        if data is None:
            return None
        rgb = decode_frame(data)
        if frame_sha256(rgb) != sha256:
            raise RecordError(
                f"{str(self.path(str(sha256)))!r} does not contain the frame whose hash is the file's name. Remove it."
            )
        return data, rgb


def redraw(
    episode: Episode, record: EpisodeRecord, env: Env, steps: Container[int] | None = None
) -> Iterator[np.ndarray]:
    """Yield the frame that each recorded reply answered; the replies are carried out again in `env`.

    With `steps`, only the frames of these steps are drawn. Raises RecordError when the episode ends earlier than
    recorded.
    """
    observation = env.reset(episode, record.replayed_steps)
    for step in record.steps:
        if observation is None:
            raise RecordError(
                f"Episode {episode.id!r} ended before step {step.index} when played again. Run `vigil verify`."
            )
        if steps is None or step.index in steps:
            yield observation.rgb
        observation = env.step(step.reply)


def frames_of_record(
    folder: Path, spec: RunSpec, pack: Pack, record: EpisodeRecord, assets: Path | None
) -> list[np.ndarray]:
    """Return the frame that the agent saw before each reply, from `folder`; if one is missing there, draw all again."""
    store = FrameStore(folder / FRAMES_FOLDER)
    kept = [store.frame(step.frame_sha256) for step in record.steps]
    if all(kept):
        return [frame[1] for frame in kept if frame]
    database = AssetDatabase.from_file(assets)
    pack.check_assets(database)
    recorded = None if spec.fork is None else spec.fork.profile
    with closing(make_simulator(spec.simulator, assets=database, quality=spec.render_quality)) as simulator:
        env = Env(simulator, pack.house_of, spec.profile, recorded_profile=recorded)
        return list(redraw(pack.episode(record.episode_id), record, env))


def first_frames(
    pack: Pack, episodes: Iterable[Episode], assets: Path | None
) -> Iterator[tuple[Episode, Observation, np.ndarray]]:
    """Yield each episode of a pack with its first observation and the pixels (x, y) of its target, (n, 2).

    In an episode with a chain, the chain's first object takes the place of the target. There are no pixels if the
    object is out of view. A frame can be drawn only before the next episode is taken.
    """
    database = AssetDatabase.from_file(assets)
    pack.check_assets(database)
    with closing(make_simulator("mujoco", assets=database)) as simulator:
        env = Env(simulator, pack.house_of, Profile())
        for episode in episodes:
            observation = env.reset(episode)
            if observation is None:
                raise RecordError(f"Episode {episode.id!r} ended at its reset: {env.record().error}.")
            yield episode, observation, simulator.pixels_of((*episode.goal.chain, episode.goal)[0].object_id)
