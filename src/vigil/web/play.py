"""`vigil play`: one person plays a pack, one episode at a time, under the same protocol as an agent.

The server has only the page for the person who plays, and never sends hidden state.
The records go into a normal run folder. The folder also has `play.jsonl`, with the random order and every reply, so
that a session continues where it stopped, even in the middle of an episode.
"""

import asyncio
import json
import re
import time
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

from fastapi import Body, FastAPI, Request
from fastapi.responses import HTMLResponse, Response
from pydantic import BaseModel, ConfigDict, Field, model_validator

from vigil.errors import RecordError, SettingError
from vigil.packs.pack import Pack, Selection
from vigil.protocol.actions import INTENTS, Reply
from vigil.protocol.observation import FRAME_HEIGHT, FRAME_WIDTH
from vigil.protocol.prompt import system_prompt
from vigil.records.record import EpisodeRecord
from vigil.runner.plan import RunPlan
from vigil.runner.run_folder import RunFolder
from vigil.runner.workers.messages import Assignment
from vigil.runner.workers.pool import SimulatorPool
from vigil.scoring.outcomes import score
from vigil.web import phrases
from vigil.web.live_play import LivePlay, open_journal, open_live_run, plan_live_run, random_order
from vigil.web.play_settings import PlaySettings
from vigil.web.site import Address, make_site, page

JOURNAL = "play.jsonl"
MAX_TEXT = 64 * 1024
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
        self._file, entries = open_journal(path, _Entry)
        if not entries:
            self._write({"order": self.order})
        elif entries[0].order != self.order:
            self.close()
            raise RecordError(
                f"{str(path)!r} was begun with another order of episodes. Give the same pack, limit and seed."
            )
        for entry in entries[1:]:
            if entry.reply is not None:
                self.replies.append(entry.reply)
            else:
                self.begun, self.replies = entry.begin or "", []

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

    def __init__(self, settings: PlaySettings, plan: RunPlan, folder: RunFolder, pool: SimulatorPool) -> None:
        """Make a session. Callers use `open_play_session` instead."""
        self._settings, self._folder, self._pool = settings, folder, pool
        self._episodes = {episode.id: episode for episode in plan.episodes}
        spec = folder.header.spec
        self._profile = spec.profile
        self._journal = PlayJournal(folder.path / JOURNAL, random_order(spec.episode_ids, spec.seed))
        self._lock = asyncio.Lock()
        self._play: LivePlay | None = None
        """The episode that is being played; None between episodes."""
        self._told: list[str] = []
        """Sentences about the episode that has just ended: the verdict (in practice only), or a simulator failure."""

    async def state(self) -> dict[str, Any]:
        """Return what the person may see at this moment."""
        async with self._lock:
            begun = self._journal.begun
            if self._play is None and begun and not self._has_row(begun):
                await self._begin(begun, self._journal.replies)
            return self._visible_state()

    async def next(self) -> dict[str, Any]:
        """Start the next episode unless one is being played, and return the new state."""
        async with self._lock:
            waiting = self._remaining()
            if self._play is None and waiting:
                self._journal.begin(waiting[0])
                await self._begin(waiting[0], [])
            return self._visible_state()

    async def reply(self, moment: int, text: str) -> dict[str, Any]:
        """Carry out a reply to view number `moment`, and return the new state. A reply to an older view is ignored."""
        async with self._lock:
            if self._play is not None and moment == self._play.moment:
                reply = Reply(text=text, seconds=round(time.monotonic() - self._play.since, 3))
                self._journal.add(reply)
                self._conclude(await self._play.advance(reply))
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
        self._told = []
        attempt = 1 + self._folder.played().count(episode_id)
        live = self._pool.live(Assignment(self._episodes[episode_id], attempt=attempt), replies)
        self._play = LivePlay(live=live, run_id=self._folder.header.run_id, moment=len(replies))
        self._conclude(await self._play.begin())

    def _conclude(self, record: EpisodeRecord | None) -> None:
        """Write the record of the episode that was being played, if it has ended."""
        if record is None:
            return
        self._play = None
        self._folder.append(record)
        if record.end == "error":
            self._told = ["The simulator failed. This episode will be played again later."]
        elif self._settings.practice:
            self._told = phrases.verdict_words(score(self._episodes[record.episode_id], record))
        if not self._remaining():
            self._folder.note_end()

    def _has_row(self, episode_id: str) -> bool:
        return episode_id in self._folder.played()

    def _remaining(self) -> list[str]:
        """Return the ids of the episodes that are still to be played; episodes that ended as an error come last."""
        open_ = [name for name in self._journal.order if not self._folder.log.is_done((name, 1))]
        return sorted(open_, key=self._has_row)

    def _visible_state(self) -> dict[str, Any]:
        shown: dict[str, Any] = {
            "player": self._settings.player,
            "practice": self._settings.practice,
            "done": len(self._journal.order) - len(self._remaining()),
            "of": len(self._journal.order),
            "is_on": self._play is not None,
            "told": self._told,
        }
        if self._play is not None and self._play.seen is not None:
            instruction, seen = self._play.live.assignment.episode.instruction, self._play.seen
            shown["moment"] = self._play.moment
            shown["instruction"] = instruction
            shown["prompt"] = system_prompt(instruction, self._profile)
            shown["frame"] = seen.picture.data_uri
            shown["feedback"] = None if seen.feedback is None else seen.feedback.model_dump()
        return shown


def open_play_session(settings: PlaySettings) -> PlaySession:
    """Return a play session, new or continued. Raises InputError, or SimulatorError if the simulator does not start."""
    player = settings.player
    if not _PLAYER.fullmatch(player):
        raise SettingError(
            f"Player {player!r}: a name has letters, digits, '_', '.' and '-', 40 at most, e.g. --player ada."
        )
    pack = Pack.load(settings.pack)
    seed = zlib.crc32(player.encode()) if settings.seed is None else settings.seed
    ids = [episode.id for episode in pack.select(Selection(settings.families))]
    run_settings = {
        "pack": settings.pack,
        "episode_ids": tuple(random_order(ids, seed)[: settings.limit]),
        "profile": "action_feedback" if settings.practice else "baseline",
        "seed": seed,
        "workers": 1,
        "backend": settings.backend,
        "render_quality": settings.quality,
        "asset_database": settings.assets,
    }
    name = f"human{'-practice' if settings.practice else ''}:{player}"
    plan = plan_live_run(run_settings, name, "human", settings.log_dir, pack)
    return open_live_run(plan, lambda folder, pool: PlaySession(settings, plan, folder, pool))


class PlayerReply(BaseModel):
    """A reply from the page: the number of the view that the person saw, and the exact text to record."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    moment: int = Field(ge=0)
    text: str = Field(max_length=MAX_TEXT)


def make_play(play_session: PlaySession, address: Address | None = None) -> FastAPI:
    """Return the application. Raises SettingError if the address needs a token and does not have one."""
    site = make_site(address or Address())

    @site.get("/", response_class=HTMLResponse)
    def play(request: Request) -> Response:
        aimed = {name: phrases.INTENTS[name] for name, spec in INTENTS.items() if spec.needs_pixel}
        values = {"intents": aimed, "statuses": phrases.STATUSES, "width": FRAME_WIDTH, "height": FRAME_HEIGHT}
        return page("play.html", title="Play", **values)

    @site.get("/state")
    async def state() -> dict[str, Any]:
        return await play_session.state()

    @site.post("/next")
    async def next_episode() -> dict[str, Any]:
        return await play_session.next()

    @site.post("/reply")
    async def reply(answer: Annotated[PlayerReply, Body()]) -> dict[str, Any]:
        return await play_session.reply(answer.moment, answer.text)

    return site
