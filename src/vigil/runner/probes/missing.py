"""Asks the probes that finished episodes of a run lack. The frames of these episodes were saved, or are drawn again."""

import asyncio
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from vigil.agents.frame_encoding import EncodedFrame, encode_frame
from vigil.protocol.episode import Episode
from vigil.records.record import EpisodeRecord
from vigil.runner.probes.prober import Prober
from vigil.runner.probes.requests import needed_frames
from vigil.runner.workers.frames import FrameStore
from vigil.runner.workers.messages import Assignment
from vigil.runner.workers.pool import SimulatorPool

Play = tuple[Episode, EpisodeRecord]


@dataclass(frozen=True, slots=True)
class MissingProbes:
    """The probes that remain to be asked, and where their frames come from."""

    prober: Prober
    store: FrameStore
    pool: SimulatorPool

    async def ask(
        self, plays: Sequence[Play], at_once: int, on_progress: Callable[[int, int], None] = lambda _done, _total: None
    ) -> None:
        """Ask the probes that `plays` lack, for `at_once` plays at the same time; stop if the server keeps failing.

        `on_progress` is called with (plays done, all plays). Raises RecordError.
        """
        waiting = iter(sorted(plays, key=lambda play: (play[0].house.name, play[1].key)))
        done = 0

        async def work() -> None:
            nonlocal done
            for episode, record in waiting:
                if not self.prober.has_stopped:
                    await self._ask(episode, record)
                done += 1
                on_progress(done, len(plays))

        await asyncio.gather(*(work() for _ in range(min(at_once, len(plays)))))

    async def _ask(self, episode: Episode, record: EpisodeRecord) -> None:
        missing = self.prober.plan.missing(self.prober.log.table, episode, record)
        steps = tuple(sorted(needed_frames(self.prober.profile, missing)))
        saved = {step: self.store.frame(record.steps[step - 1].frame_sha256) for step in steps}
        if all(saved.values()):
            image_format = self.prober.profile.image_format
            frames = {step: encode_frame(frame[1], image_format) for step, frame in saved.items() if frame is not None}
        else:
            frames = await self._drawn(episode, record, steps)
        await self.prober.ask_all(episode, record, frames)

    async def _drawn(self, episode: Episode, record: EpisodeRecord, steps: tuple[int, ...]) -> dict[int, EncodedFrame]:
        return await self.pool.frames(Assignment(episode, record.epoch, record.attempt), record, steps)
