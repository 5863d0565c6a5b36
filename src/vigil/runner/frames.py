"""Frames by content: kept as files when asked, else drawn again later from the recorded actions."""

import hashlib
import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from vigil.agents.picture import decode, encode
from vigil.env import Env
from vigil.episode import Episode
from vigil.errors import RecordError
from vigil.record import EpisodeRecord


def frame_sha256(rgb: np.ndarray) -> str:
    """Returns the SHA-256 of a frame's RGB bytes, by which records name it."""
    return hashlib.sha256(np.ascontiguousarray(rgb).tobytes()).hexdigest()


class FrameStore:
    """A folder of PNG files, each named by the hash of its pixels."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def path(self, sha256: str) -> Path:
        """Returns where the frame with that hash lies, or would."""
        return self._folder / sha256[:2] / f"{sha256}.png"

    def keep(self, rgb: np.ndarray) -> str:
        """Writes a frame unless it is there, and returns its hash."""
        sha256 = frame_sha256(rgb)
        path = self.path(sha256)
        if not path.exists():
            path.parent.mkdir(parents=True, exist_ok=True)
            partial = path.with_name(f"{path.name}.{os.getpid()}")
            partial.write_bytes(encode(rgb, "png").data)
            partial.replace(path)
        return sha256

    def load(self, sha256: str) -> np.ndarray:
        """Returns the frame with that hash, (480, 640, 3) uint8. Raises RecordError when it is not there."""
        path = self.path(sha256)
        if not path.is_file():
            raise RecordError(f"Frame {sha256} is not in {str(self._folder)!r}; draw it again from the actions.")
        return decode(path.read_bytes())


def redraw(episode: Episode, record: EpisodeRecord, env: Env) -> Iterator[np.ndarray]:
    """Yields the frame that each recorded reply answered, by carrying out the replies again in `env`."""
    observation = env.reset(episode)
    for step in record.steps:
        if observation is None:
            raise RecordError(
                f"Episode {episode.id!r} ended before step {step.index} when played again. Run `vigil verify`."
            )
        yield observation.rgb
        observation = env.step(step.reply)
