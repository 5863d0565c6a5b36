"""Sources of episodes for training: a pack or a stream.

The Gymnasium environment draws episodes. verifiers, TRL and verl read rows; the episode that a row names
may be played in another process. That process loads the same pack or, for a stream, makes the house of the row again.
"""

import asyncio
import string
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future
from dataclasses import dataclass
from functools import lru_cache
from itertools import islice, zip_longest
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from cachetools import LRUCache

from vigil.authoring.streaming.address import address_of, is_stream, seed_in
from vigil.authoring.streaming.houses import StreamHouse
from vigil.authoring.streaming.stream import HousePool, Stream, StreamItem
from vigil.errors import SettingError
from vigil.integrations.options import EpisodeOptions, RowOptions
from vigil.packs.names import STREAM
from vigil.packs.pack import CHORES_SUITE, Pack, Selection, find_pack, manifest_sha256
from vigil.packs.private import check_revealed, is_private, is_secret
from vigil.protocol.episode import MAX_INSTRUCTION_CHARS, Episode
from vigil.protocol.house import House
from vigil.runner.workers.messages import Assignment, WorkerPlan
from vigil.scoring.chore_answers import ListAnswer, list_answers

PACK_CACHE_SIZE = 2
HOUSE_CACHE_SIZE = 64
"""Greatest number of a stream's houses that are cached, for episodes that are still to be played."""
MAX_FIRST_HOUSES = 2**31
"""A seed selects the house at which an endless stream starts. The index of this house is below this number."""


@dataclass(frozen=True, slots=True)
class SampledEpisode:
    """An episode with its house."""

    episode: Episode
    house: House
    answer: ListAnswer | None = None
    """Answer of the episode's list of chores; None for other episodes."""


class TaskRow(NamedTuple):
    """An episode and, for a stream, the index of its house."""

    episode: Episode
    house: int | None = None


class PackSource:
    """Episodes of a pack."""

    is_endless = False

    def __init__(self, pack: Pack, selection: Selection) -> None:
        self._pack, self._episodes = pack, pack.select(selection)
        self._answers = list_answers(pack.folder) if pack.manifest.suite == CHORES_SUITE else {}
        self.name = f"{pack.name}@{pack.sha256}"
        """Name and hash of the pack."""
        self.public_name = pack.name
        """Name for messages; it does not reveal a secret seed."""
        self.is_private = is_private(pack.manifest.meta)
        self.folder: Path | None = pack.folder
        """Folder of the pack, from which simulators load the houses."""

    def draw(self, rng: np.random.Generator, *, is_seeded: bool) -> Callable[[], SampledEpisode]:
        """Choose an episode at random, all with equal chance, and return a function that reads its house."""
        del is_seeded
        episode = self._episodes[int(rng.integers(len(self._episodes)))]
        return lambda: self._sampled(episode)

    def by_id(self, episode_id: str) -> SampledEpisode:
        """Return the episode with this id, even if it was not selected. Raises SettingError."""
        return self._sampled(self._pack.episode(episode_id))

    def _sampled(self, episode: Episode) -> SampledEpisode:
        return SampledEpisode(episode, self._pack.house_of(episode), self._answers.get(episode.id))

    def of_row(self, episode_id: str, house: int | None) -> SampledEpisode:
        """Return the episode with that id. Raises SettingError."""
        del house
        return self.by_id(episode_id)

    def longest_instruction(self) -> tuple[int, str]:
        """Return the length of the longest instruction, and all characters that may occur in an instruction."""
        instructions = [episode.instruction for episode in self._pack.episodes]
        return max(map(len, instructions)), _charset(instructions)

    def rows(self) -> Iterator[TaskRow]:
        """Yield the selected episodes, in order of their ids."""
        return map(TaskRow, self._episodes)

    async def assignment(self, episode_id: str, house: int | None) -> tuple[Assignment, ListAnswer | None]:
        """Return what a simulator worker needs to play the episode with that id, and the answer of a list of chores.

        Raises SettingError.
        """
        del house
        return Assignment(self._pack.episode(episode_id)), self._answers.get(episode_id)

    def close(self) -> None:
        """Do nothing."""


class StreamSource:
    """Episodes of a stream, in order.

    `draw` starts at a house that the seed selects; without a seed, it starts at the stream's first house. A finite
    stream starts again after its last house.
    """

    folder = None

    def __init__(self, options: EpisodeOptions, workers: int, limit: int | None = None) -> None:
        self._first, self._last = options.houses or (0, None)
        self._seed, self._limit, self._workers = seed_in(str(options.pack)), limit, workers
        self._filters: dict[str, Any] = {
            "families": tuple(options.family),
            "difficulties": tuple(options.difficulty),
            "suite": options.suite,
        }
        self._stream = self._from(self._first)
        self._items: Iterator[StreamItem] | None = None
        self._houses: LRUCache[int, Future[StreamHouse]] = LRUCache(HOUSE_CACHE_SIZE)
        self._pool: HousePool | None = None
        """Processes that make the houses of rows again; None until a row's house must be made."""
        self.name = address_of(self._seed)
        """Address and version of the stream."""
        self.public_name = f"{STREAM}..."
        """Name for messages; it does not reveal a secret seed."""
        self.is_private = is_secret(self._seed)
        self.is_endless = self._last is None and limit is None

    def draw(self, rng: np.random.Generator, *, is_seeded: bool) -> Callable[[], SampledEpisode]:
        """Return a function that waits for the next episode.

        If `rng` was just seeded, it selects the house whose episodes come next. The function may be called in another
        thread, but must be called before the next draw.
        """
        count = MAX_FIRST_HOUSES if self._last is None else self._last - self._first
        if is_seeded:
            self._begin(self._first + int(rng.integers(count)))
        elif self._items is None:
            self._begin(self._first)
        return self._next_in_stream

    def by_id(self, episode_id: str) -> SampledEpisode:
        """Raise SettingError: the episodes of a stream cannot be looked up by id."""
        raise SettingError(
            f"Episode {episode_id!r} cannot be selected: the episodes of a stream come in order, and only the last "
            "one can be played again by its id. `vigil pack stream` writes episodes to a folder, from which any "
            "episode can be selected."
        )

    def longest_instruction(self) -> tuple[int, str]:
        """Return the maximum length of an instruction under the protocol, and all characters that may occur in it."""
        return MAX_INSTRUCTION_CHARS, _charset(())

    def rows(self) -> Iterator[TaskRow]:
        """Yield the episodes, and cache their houses for players in this process."""
        return islice(self._rows(), self._limit)

    async def assignment(self, episode_id: str, house: int | None) -> tuple[Assignment, ListAnswer | None]:
        """Return what a simulator worker needs to play an episode, and the answer of a list of chores.

        If the house is not cached, it is first made in the background. Raises SettingError or SimulatorError.
        """
        made = await asyncio.shield(asyncio.wrap_future(self._future_house(episode_id, house)))
        found = self._episode_in(made, episode_id)
        return Assignment(found.episode, house=found.house), found.answer

    def of_row(self, episode_id: str, house: int | None) -> SampledEpisode:
        """Return an episode, waiting for its house if it is not cached. Raises SettingError or SimulatorError."""
        return self._episode_in(self._future_house(episode_id, house).result(), episode_id)

    def close(self) -> None:
        """End the background processes."""
        self._stream.close()
        self._items = None
        if self._pool is not None:
            self._pool.close()
        self._pool = None
        self._houses.clear()

    def _future_house(self, episode_id: str, house: int | None) -> Future[StreamHouse]:
        if house is None:
            raise SettingError(f"The row of episode {episode_id!r} does not name a house of stream {self._seed}.")
        if house not in self._houses:
            self._pool = self._pool or HousePool(self._stream.settings, max(1, self._workers))
            self._houses[house] = self._pool.ask(house)
        return self._houses[house]

    def _episode_in(self, made: StreamHouse, episode_id: str) -> SampledEpisode:
        for draft, answer in zip_longest(made.drafts, made.answers):
            if draft.episode.id == episode_id:
                return SampledEpisode(draft.episode, made.house, answer)
        raise SettingError(f"House {made.number} of {self.name} does not have the requested episode {episode_id!r}.")

    def _from(self, house: int) -> Stream:
        return Stream(self._seed, first=house, last=self._last, workers=self._workers, **self._filters)

    def _begin(self, house: int) -> None:
        self._stream.close()
        self._stream = self._from(house)
        self._items = iter(self._stream)

    def _next_in_stream(self) -> SampledEpisode:
        """Return the next episode. Raises SettingError if the stream has no episodes, or SimulatorError."""
        assert self._items is not None
        item = next(self._items, None)
        if item is None:
            self._begin(self._first)
            item = next(self._items, None)
        if item is None:
            raise SettingError(
                f"Stream {self._seed}: the houses {self._first} to {self._last} do not have an episode that passes "
                "the filters."
            )
        return SampledEpisode(item.episode, item.house, item.answer)

    def _rows(self) -> Iterator[TaskRow]:
        for made in self._stream.houses():
            self._houses[made.number] = Future()
            self._houses[made.number].set_result(made)
            yield from (TaskRow(draft.episode, made.number) for draft in made.drafts)


EpisodeSource = PackSource | StreamSource


def source_of(options: EpisodeOptions, workers: int, limit: int | None = None) -> EpisodeSource:
    """Return the source that the options name.

    `workers` is the number of processes that make a stream's houses in advance; `limit` is the greatest number of rows.
    Raises SettingError or PackMismatch.
    """
    if is_stream(options.pack):
        return StreamSource(options, workers, limit)
    folder = find_pack(options.pack)
    pack = _cached_pack(folder.resolve(), manifest_sha256(folder))
    pack.check_assets(options.assets)
    return PackSource(pack, Selection(families=tuple(options.family), limit=limit))


def row_source(
    options: RowOptions, workers: int, by: str, what: str = "The data set and the logs of a trainer"
) -> EpisodeSource:
    """Return the source of the rows of a data set; `workers` as for `source_of`.

    Raises PackMismatch or SettingError, also if `what` would reveal a private pack; the message then names `by`, the
    option that allows it.
    """
    source = source_of(options, workers, options.limit)
    check_revealed(source.public_name, source.is_private, what, reveals=options.reveal_private_pack, by=by)
    return source


def bounded_rows(source: EpisodeSource) -> Iterator[TaskRow]:
    """Yield the rows of a source. Raises SettingError if the source is an endless stream."""
    if source.is_endless:
        raise SettingError(f"{source.public_name} is endless: give `limit`, or `houses` with an end, e.g. (0, 100).")
    yield from source.rows()


def worker_plan(source: EpisodeSource, options: EpisodeOptions, run_id: str) -> WorkerPlan:
    """Return the settings of the simulator workers that play the episodes of a source. Raises PackMismatch."""
    return WorkerPlan(
        source.folder,
        run_id,
        options.condition,
        backend=options.backend,
        quality=options.quality,
        asset_database=None if options.asset_database is None else Path(options.asset_database),
    )


@lru_cache(maxsize=PACK_CACHE_SIZE)
def _cached_pack(folder: Path, sha256: str) -> Pack:
    """Return the pack in `folder`. While its manifest is unchanged, all environments of a process share the pack."""
    del sha256  # part of the cache key: distinguishes a pack from an earlier one in the same folder
    return Pack.load(folder)


def _charset(instructions: Iterable[str]) -> str:
    return "".join(sorted({*string.printable, *"".join(instructions)}))
