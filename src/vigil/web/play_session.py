"""Play session: one person plays a pack, one episode at a time, under the same protocol as an agent.

The records go into a normal run folder. The folder also has `play.jsonl`, with the random order and every reply, so
that a session continues where it stopped, even in the middle of an episode.
"""

import asyncio
import json
import re
import time
import zlib
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel, ConfigDict, model_validator

from vigil.assets.database import AssetDatabase
from vigil.base.json_lines import AppendFile, parse_line
from vigil.errors import RecordError, SettingError, SimulatorError
from vigil.packs.pack import Pack, Selection
from vigil.protocol.actions import Reply
from vigil.protocol.episode import Episode
from vigil.protocol.profile import ACTION_FEEDBACK, BASELINE, Profile
from vigil.protocol.prompt import system_prompt
from vigil.records.record import EpisodeRecord, RunSpec
from vigil.runner.plan import RUNS_FOLDER, input_paths, run_spec
from vigil.runner.run_folder import RunFolder
from vigil.runner.workers.messages import Assignment, EncodedObservation, WorkerPlan
from vigil.runner.workers.players import error_record
from vigil.runner.workers.pool import LiveEpisode, SimulatorPool
from vigil.scoring.outcomes import score
from vigil.web.phrases import verdict_words
from vigil.web.play_settings import PlaySettings

JOURNAL = "play.jsonl"
_PLAYER = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,39}")


class _Entry(BaseModel):
    """One line of the journal. Exactly one of its three fields is set."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    order: list[str] | None = None
    begin: str | None = None
    reply: Reply | None = None

    @model_validator(mode="after")
    def _is_one(self) -> "_Entry":
        if len(self.model_fields_set) != 1:
            raise ValueError("a line must have exactly one of `order`, `begin` and `reply`")
        return self


class PlayJournal:
    """`play.jsonl`: the order of episodes, then each start of an episode and each reply, all written immediately."""

    def __init__(self, path: Path, order: Sequence[str]) -> None:
        """Open or create the journal. Raises RecordError if the file has the episodes in another order."""
        self.order = list(order)
        self.begun = ""
        """The id of the episode that was started last."""
        self.replies: list[Reply] = []
        self._file = AppendFile(path)
        try:
            self._read(path)
        except RecordError:
            self._file.close()
            raise

    def _read(self, path: Path) -> None:
        of, advice = f"Journal of a play session {str(path)!r}", "Choose another --log-dir."
        entries = [parse_line(line, _Entry, of, advice) for line in self._file.lines.complete]
        if entries and entries[0].order != self.order:
            raise RecordError(
                f"{str(path)!r} was begun with another order of episodes. Give the same pack, limit and seed."
            )
        for entry in entries[1:]:
            if entry.reply is not None:
                self.replies.append(entry.reply)
            else:
                self.begun, self.replies = entry.begin or "", []
        if entries:
            self._file.repair_tail()
        else:
            self._write({"order": self.order})

    def begin(self, episode_id: str) -> None:
        """Write the start of an episode."""
        self.begun, self.replies = episode_id, []
        self._write({"begin": episode_id})

    def add(self, reply: Reply) -> None:
        """Write a reply, before it is carried out."""
        self.replies.append(reply)
        self._write({"reply": reply.model_dump(mode="json")})

    def close(self) -> None:
        """Release the file."""
        self._file.close()

    def _write(self, line: dict[str, Any]) -> None:
        self._file.append(json.dumps(line).encode() + b"\n")


class PlaySession:
    """One person's session. The person's page receives only what `state` returns."""

    def __init__(self, settings: PlaySettings, pool: SimulatorPool, folder: RunFolder, pack: Pack) -> None:
        """Make a session. Callers use `open_play_session` instead."""
        self._settings = settings
        self._pool = pool
        self._folder = folder
        self._episodes = {episode.id: episode for episode in pack.episodes}
        self._profile = folder.header.spec.profile
        order = random_order(folder.header.spec.episode_ids, folder.header.spec.seed)
        self._journal = PlayJournal(folder.path / JOURNAL, order)
        self._lock = asyncio.Lock()
        self._live: LiveEpisode | None = None
        self._episode: Episode | None = None
        self._view: EncodedObservation | None = None
        self._moment = 0
        self._since = 0.0
        self._told: list[str] = []
        """Sentences about the episode that has just ended: the verdict (in practice only), or a simulator failure."""

    async def state(self) -> dict[str, Any]:
        """Return what the person may see at this moment."""
        async with self._lock:
            if self._live is None and self._is_mid_episode():
                await self._begin(self._journal.begun, self._journal.replies)
            return self._visible_state()

    async def next(self) -> dict[str, Any]:
        """Start the next episode unless one is being played, and return the new state."""
        async with self._lock:
            if self._live is None:
                waiting = self._remaining()
                if waiting:
                    self._journal.begin(waiting[0])
                    await self._begin(waiting[0], [])
            return self._visible_state()

    async def reply(self, moment: int, text: str) -> dict[str, Any]:
        """Carry out a reply to view number `moment`, and return the new state. A reply to an older view is ignored."""
        async with self._lock:
            if self._live is not None and moment == self._moment:
                reply = Reply(text=text, seconds=round(time.monotonic() - self._since, 3))
                self._journal.add(reply)
                try:
                    answer = await self._live.advance(reply)
                except SimulatorError as error:
                    answer = self._failed_record(self._live.assignment, error)
                self._count_reply(answer)
            return self._visible_state()

    @property
    def place(self) -> Path:
        """The folder of the run."""
        return self._folder.path

    def close(self) -> None:
        """End the simulator and release the run's folder."""
        self._pool.close()
        self._journal.close()
        self._folder.close()

    async def _begin(self, episode_id: str, replies: Sequence[Reply]) -> None:
        self._episode = self._episodes[episode_id]
        self._told = []
        self._moment = 0
        attempt = 1 + self._folder.played().count(episode_id)
        self._live = live = self._pool.live(Assignment(self._episode, attempt=attempt))
        try:
            answer = await live.begin()
            for reply in replies:
                if isinstance(answer, EncodedObservation):
                    self._moment += 1
                    answer = await live.advance(reply)
        except SimulatorError as error:
            answer = self._failed_record(live.assignment, error)
        self._count_reply(answer, counts=False)

    def _failed_record(self, assignment: Assignment, error: SimulatorError) -> EpisodeRecord:
        return error_record(assignment, self._folder.header.run_id, error, datetime.now(UTC))

    def _count_reply(self, answer: EncodedObservation | EpisodeRecord, *, counts: bool = True) -> None:
        self._since = time.monotonic()
        self._moment += counts
        if isinstance(answer, EncodedObservation):
            self._view = answer
            return
        if self._live is not None:
            self._live.close()
        self._live = self._view = None
        self._folder.append(answer)
        if self._settings.practice and self._episode is not None and answer.end != "error":
            self._told = verdict_words(score(self._episode, answer))
        if answer.end == "error":
            self._told = ["The simulator failed. This episode will be played again later."]
        if not self._remaining():
            self._folder.note_end()

    def _is_mid_episode(self) -> bool:
        begun = self._journal.begun
        return bool(begun) and not self._has_row(begun)

    def _has_row(self, episode_id: str) -> bool:
        return episode_id in self._folder.played()

    def _remaining(self) -> list[str]:
        """Return the ids of the episodes that are still to be played; episodes that ended as an error come last."""
        open_ = [name for name in self._journal.order if not self._folder.is_done(name, 1)]
        return sorted(open_, key=self._has_row)

    def _visible_state(self) -> dict[str, Any]:
        done = len(self._journal.order) - len(self._remaining())
        shown: dict[str, Any] = {
            "player": self._settings.player,
            "practice": self._settings.practice,
            "done": done,
            "of": len(self._journal.order),
            "is_on": self._live is not None,
            "told": self._told,
        }
        if self._live is not None and self._view is not None and self._episode is not None:
            shown["moment"] = self._moment
            shown["instruction"] = self._episode.instruction
            shown["prompt"] = system_prompt(self._episode.instruction, self._profile)
            shown["frame"] = self._view.picture.data_uri
            feedback = self._view.feedback
            shown["feedback"] = None if feedback is None else feedback.model_dump()
        return shown


def open_play_session(settings: PlaySettings) -> PlaySession:
    """Return a play session, new or continued. Raises InputError, or SimulatorError if the simulator does not start."""
    if not _PLAYER.fullmatch(settings.player):
        raise SettingError(
            f"Player {settings.player!r}: a name has letters, digits, '_', '.' and '-', 40 at most, e.g. --player ada."
        )
    pack, assets = Pack.load(settings.pack), AssetDatabase.from_file(settings.assets)
    pack.check_assets(assets)
    spec = _spec(settings, pack, assets.sha256)
    name = f"{pack.name}-{spec.agent.replace(':', '-')}"
    path = settings.log_dir or RUNS_FOLDER / name
    folder = RunFolder.create_or_resume(path, spec, pack.episodes, input_paths(pack, settings.assets))
    plan = WorkerPlan(
        pack=pack.folder,
        run_id=folder.header.run_id,
        profile=spec.profile,
        backend=settings.backend,
        quality=settings.quality,
        asset_database=settings.assets,
        pack_sha256=pack.sha256,
    )
    pool = SimulatorPool(plan, 1, logs=folder.logs)
    try:
        folder.note_facts(pool.facts())
        return PlaySession(settings, pool, folder, pack)
    except BaseException:
        pool.close()
        folder.close()
        raise


def _spec(settings: PlaySettings, pack: Pack, assets_sha256: str | None) -> RunSpec:
    seed = zlib.crc32(settings.player.encode()) if settings.seed is None else settings.seed
    ids = [episode.id for episode in pack.select(Selection(settings.families))]
    chosen = sorted(random_order(ids, seed)[: settings.limit])
    return run_spec(
        pack,
        Profile(name=ACTION_FEEDBACK if settings.practice else BASELINE),
        agent=f"human{'-practice' if settings.practice else ''}:{settings.player}",
        agent_kind="human",
        episode_ids=tuple(chosen),
        seed=seed,
        simulator=settings.backend,
        asset_database_sha256=assets_sha256,
        render_quality=settings.quality,
    )


def random_order(episode_ids: Sequence[str], seed: int) -> list[str]:
    """Return the ids in a random order that depends only on `seed`."""
    ids = sorted(episode_ids)
    return [ids[index] for index in np.random.default_rng(seed).permutation(len(ids))]
