"""Sources of the environment's episodes: a pack, drawn at random, or a stream, read in order."""

import string
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from vigil.authoring.streaming.address import is_stream, seed_in
from vigil.authoring.streaming.stream import Stream, StreamItem
from vigil.errors import SettingError
from vigil.integrations.gymnasium.options import Options
from vigil.packs.pack import Pack, Selection, find_pack, manifest_sha256
from vigil.protocol.episode import MAX_INSTRUCTION_CHARS, Episode
from vigil.protocol.house import House

PACK_CACHE_SIZE = 2
MAX_FIRST_HOUSES = 2**31
"""Number of houses of an endless stream from which a seed selects the first."""


@dataclass(frozen=True, slots=True)
class SampledEpisode:
    """An episode with its house."""

    episode: Episode
    house: House


class EpisodeSource(Protocol):
    """A source of episodes with their houses."""

    def draw(self, rng: np.random.Generator, *, is_seeded: bool) -> Callable[[], SampledEpisode]:
        """Choose the next episode with `rng` and return a function that waits for it.

        `is_seeded` says whether `rng` was just seeded. The function may be called in another thread, before the next
        draw.
        """
        ...

    def by_id(self, episode_id: str) -> SampledEpisode:
        """Return the episode with that id. Raises SettingError."""
        ...

    def longest_instruction(self) -> tuple[int, str]:
        """Return the greatest length of an instruction, and all characters that may occur in one."""
        ...

    def close(self) -> None:
        """End the source's background processes."""
        ...


def source_of(options: Options) -> EpisodeSource:
    """Return the source that the options name. Raises SettingError or PackMismatch."""
    if is_stream(options.pack):
        return StreamEpisodes(str(options.pack), options)
    for name in ("difficulty", "houses"):
        if getattr(options, name):
            raise SettingError(f"Vigil-v0: option {name} is for a stream (pack='stream:7'), not for a pack.")
    return PackEpisodes(options)


class PackEpisodes:
    """Episodes of a pack, drawn uniformly."""

    def __init__(self, options: Options) -> None:
        self._pack = load_pack(options.pack)
        self._pack.check_assets(options.assets)
        self._episodes = self._pack.select(Selection(families=options.family))

    def draw(self, rng: np.random.Generator, *, is_seeded: bool) -> Callable[[], SampledEpisode]:
        """Choose an episode."""
        del is_seeded
        episode = self._episodes[int(rng.integers(len(self._episodes)))]
        return lambda: self._with_house(episode)

    def by_id(self, episode_id: str) -> SampledEpisode:
        """Return any episode of the pack. Raises SettingError."""
        return self._with_house(self._pack.episode(episode_id))

    def longest_instruction(self) -> tuple[int, str]:
        """Return the length of the longest instruction, and the characters of all."""
        instructions = [episode.instruction for episode in self._pack.episodes]
        return max(map(len, instructions)), _charset(instructions)

    def close(self) -> None:
        """Do nothing."""

    def _with_house(self, episode: Episode) -> SampledEpisode:
        return SampledEpisode(episode, self._pack.house_of(episode))


class StreamEpisodes:
    """Episodes of a stream, in order. A seed selects the first house; without a seed the stream starts at its first.

    A finite stream starts again after its last house.
    """

    def __init__(self, address: str, options: Options) -> None:
        first, last = options.houses or (0, None)
        self._settings: dict[str, Any] = {
            "families": options.family,
            "difficulties": options.difficulty,
            "workers": options.workers,
        }
        self._seed, self._first, self._last = seed_in(address), first, last
        Stream(self._seed, first=first, last=last, **self._settings)
        self._items: Iterator[StreamItem] | None = None
        self._stream: Stream | None = None

    def draw(self, rng: np.random.Generator, *, is_seeded: bool) -> Callable[[], SampledEpisode]:
        """Choose the first house if `rng` was just seeded; return a function that waits for the next episode."""
        count = MAX_FIRST_HOUSES if self._last is None else self._last - self._first
        if is_seeded:
            self._begin(self._first + int(rng.integers(count)))
        elif self._items is None:
            self._begin(self._first)
        return self._next_in_stream

    def by_id(self, episode_id: str) -> SampledEpisode:
        """Raise SettingError: the episodes of a stream cannot be looked up by id."""
        raise SettingError(
            f"A stream is read in order, and {episode_id!r} is not the episode that was read last. `vigil pack stream` "
            "writes episodes to a folder, from which they can be selected."
        )

    def longest_instruction(self) -> tuple[int, str]:
        """Return the greatest length and the characters that the protocol allows."""
        return MAX_INSTRUCTION_CHARS, _charset(())

    def close(self) -> None:
        """End the background processes."""
        if self._stream is not None:
            self._stream.close()
        self._stream = self._items = None

    def _next_in_stream(self) -> SampledEpisode:
        """Return the next episode. Raises SettingError if there is none, or SimulatorError."""
        assert self._items is not None
        item = next(self._items, None)
        if item is None:
            self._begin(self._first)
            item = next(self._items, None)
        if item is None:
            raise SettingError(
                f"Stream {self._seed}: the houses {self._first} to {self._last} do not have an episode that fits."
            )
        return SampledEpisode(item.episode, item.house)

    def _begin(self, house: int) -> None:
        self.close()
        self._stream = Stream(self._seed, first=house, last=self._last, **self._settings)
        self._items = iter(self._stream)


def load_pack(name: str | Path) -> Pack:
    """Return a pack, shared by the environments of a process while its manifest is unchanged. Raises PackMismatch."""
    folder = find_pack(name)
    return _cached_pack(folder.resolve(), manifest_sha256(folder))


@lru_cache(maxsize=PACK_CACHE_SIZE)
def _cached_pack(folder: Path, sha256: str) -> Pack:
    del sha256  # part of the cache key: distinguishes a pack from an earlier one in the same folder
    return Pack.load(folder)


def _charset(instructions: Iterable[str]) -> str:
    return "".join(sorted({*string.printable, *"".join(instructions)}))
