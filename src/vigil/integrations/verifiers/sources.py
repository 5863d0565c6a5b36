"""Sources of tasks: a pack or a stream. A player finds the episode of a task again by its row.

A trainer's process reads the rows; another process, which has only a row, may play it. That process loads the same
pack, or for a stream makes the house again, once for about thirty episodes.
"""

import asyncio
from collections.abc import Iterator
from concurrent.futures import Future
from dataclasses import dataclass
from functools import cached_property
from itertools import islice
from pathlib import Path
from typing import NamedTuple, Protocol, TypeVar

from vigil.authoring.streaming.address import address_of, is_stream, seed_in
from vigil.authoring.streaming.background import HousePool
from vigil.authoring.streaming.difficulty import difficulties_named
from vigil.authoring.streaming.houses import StreamHouse
from vigil.authoring.streaming.stream import Stream
from vigil.errors import SettingError
from vigil.integrations.verifiers.config import VigilTasksetConfig
from vigil.packs.pack import Pack, Selection
from vigil.packs.private import check_revealed, is_private, is_secret
from vigil.protocol.episode import Episode
from vigil.protocol.families import parse_families
from vigil.runner.workers.messages import Assignment

REVEAL_OPTION = "--env.taskset.reveal-private-pack true"
"""Option that allows a private pack."""
HOUSE_CACHE_SIZE = 64
"""Number of houses of a stream that are cached for episodes not played yet."""


class TaskRow(NamedTuple):
    """An episode and, for a stream, the index of its house."""

    episode: Episode
    house: int | None = None


class TaskSource(Protocol):
    """A source of episodes with their houses."""

    is_endless: bool

    @property
    def name(self) -> str:
        """Name and version of the source. Raises PackMismatch if a pack cannot be loaded."""
        ...

    @property
    def folder(self) -> Path | None:
        """Folder of the pack that simulators load; None if assignments contain their houses."""
        ...

    def rows(self) -> Iterator[TaskRow]:
        """Yield the episodes. Raises PackMismatch, SettingError or SimulatorError."""
        ...

    async def assignment(self, episode_id: str, house: int | None) -> Assignment:
        """Return the assignment of an episode to play. Raises SettingError or SimulatorError."""
        ...

    def close(self) -> None:
        """End the source's background processes."""
        ...


def source_of(config: VigilTasksetConfig) -> TaskSource:
    """Return the source that the options name."""
    return StreamTasks(config) if is_stream(config.pack) else PackTasks(config)


class PackTasks:
    """Source of the episodes of a pack."""

    is_endless = False

    def __init__(self, config: VigilTasksetConfig) -> None:
        self._config = config

    @cached_property
    def _pack(self) -> Pack:
        found = Pack.load(self._config.pack)
        check_revealed(
            found.name,
            is_private(found.manifest.meta),
            "What verifiers keeps of its rollouts",
            reveals=self._config.reveal_private_pack,
            by=REVEAL_OPTION,
        )
        return found

    @property
    def name(self) -> str:
        """Name and hash of the pack."""
        return f"{self._pack.name}@{self._pack.sha256}"

    @property
    def folder(self) -> Path:
        """Folder of the pack."""
        return self._pack.folder

    def rows(self) -> Iterator[TaskRow]:
        """Yield the selected episodes, in order of their ids."""
        yield from map(
            TaskRow, self._pack.select(Selection(parse_families(self._config.family), (), self._config.limit))
        )

    async def assignment(self, episode_id: str, house: int | None) -> Assignment:
        """Return the assignment of the episode with that id."""
        del house
        return Assignment(self._pack.episode(episode_id))

    def close(self) -> None:
        """Do nothing."""


@dataclass(frozen=True, slots=True)
class _HouseTasks:
    """A house of a stream with its episodes."""

    assignments: dict[str, Assignment]

    @classmethod
    def of(cls, made: StreamHouse) -> "_HouseTasks":
        if not made.drafts:
            return cls({})
        house, episodes = made.house, [draft.episode for draft in made.drafts]
        return cls({episode.id: Assignment(episode, house=house) for episode in episodes})


_Cached = TypeVar("_Cached", _HouseTasks, "Future[StreamHouse]")


class StreamTasks:
    """Source of the episodes of a stream, in order."""

    folder = None

    def __init__(self, config: VigilTasksetConfig) -> None:
        self._seed, self._limit = seed_in(config.pack), config.limit
        check_revealed(
            "stream:...",
            is_secret(self._seed),
            "What verifiers keeps of its rollouts, with the seed in each id,",
            reveals=config.reveal_private_pack,
            by=REVEAL_OPTION,
        )
        first, last = config.houses or (0, None)
        self._stream = Stream(
            self._seed,
            families=parse_families(config.family),
            difficulties=difficulties_named(config.difficulty),
            first=first,
            last=last,
            workers=config.stream_workers,
        )
        self.is_endless = last is None and config.limit is None
        self._houses: dict[int, Future[StreamHouse] | _HouseTasks] = {}
        self._workers = max(1, config.stream_workers)
        self._pool: HousePool | None = None

    @property
    def name(self) -> str:
        """Address and version of the stream."""
        return address_of(self._seed)

    def rows(self) -> Iterator[TaskRow]:
        """Yield the episodes, and cache their houses for players in this process."""
        return islice(self._rows(), self._limit)

    async def assignment(self, episode_id: str, house: int | None) -> Assignment:
        """Return the assignment of the episode; unless its house is cached, it is first made in the background."""
        if house is None:
            raise SettingError(f"The row of episode {episode_id!r} does not name a house of stream {self._seed}.")
        found = self._houses.get(house)
        if found is None:
            found = self._cache(house, self._house_pool().ask(house))
        if isinstance(found, Future):
            made = await asyncio.shield(asyncio.wrap_future(found))
            cached = self._houses.get(house)
            found = cached if isinstance(cached, _HouseTasks) else self._cache(house, _HouseTasks.of(made))
        if episode_id not in found.assignments:
            raise SettingError(f"House {house} of {self.name} does not have the requested episode {episode_id!r}.")
        return found.assignments[episode_id]

    def close(self) -> None:
        """End the background processes."""
        self._stream.close()
        if self._pool is not None:
            self._pool.close()
        self._pool = None
        self._houses.clear()

    def _rows(self) -> Iterator[TaskRow]:
        for made in self._stream.houses():
            if made.drafts:
                self._cache(made.number, _HouseTasks.of(made))
            for draft in made.drafts:
                yield TaskRow(draft.episode, made.number)

    def _cache(self, number: int, cached: _Cached) -> _Cached:
        self._houses.pop(number, None)
        self._houses[number] = cached
        if len(self._houses) > HOUSE_CACHE_SIZE:
            del self._houses[next(iter(self._houses))]
        return cached

    def _house_pool(self) -> HousePool:
        if self._pool is None:
            self._pool = HousePool(self._stream.settings, self._workers)
        return self._pool
