"""The stream: validated episodes with their houses, without end, the same for the same seed.

    with Stream(7, families=("PG", "SV"), difficulties=("easy",), workers=2) as stream:
        for item in stream:
            item.episode, item.house, item.solution

Houses are made ahead of the reader by background processes and handed on in order, so that neither their number nor
their speed shows in what is read.
"""

from collections import deque
from collections.abc import Generator, Iterable, Iterator
from concurrent.futures import Future
from contextlib import closing
from dataclasses import dataclass
from functools import cached_property
from itertools import count, islice
from typing import Self

from vigil.authoring.drafting.drafts import Draft
from vigil.authoring.streaming.background import HousePool
from vigil.authoring.streaming.difficulty import DIFFICULTIES, Difficulty, difficulty_of
from vigil.authoring.streaming.families import families_of_stream
from vigil.authoring.streaming.houses import StreamHouse, StreamHouseMaker, StreamSettings
from vigil.errors import SettingError
from vigil.protocol.episode import Episode, Solution
from vigil.protocol.families import Family
from vigil.protocol.house import House

HOUSES_AHEAD = 2
"""Houses that are being made or wait to be read, for each background process."""
MAX_HOUSES_WITHOUT_EPISODE = 40
"""Houses in a row without a wanted episode after which a stream gives up."""


@dataclass(frozen=True)
class StreamItem:
    """One episode of a stream."""

    number: int
    """Its place in what is read, from 0."""
    house_number: int
    """The place of its house in the stream."""
    draft: Draft
    house: House

    @property
    def episode(self) -> Episode:
        """The episode; its id tells the stream, its version and the house's number."""
        return self.draft.episode

    @property
    def difficulty(self) -> Difficulty:
        """How difficult it is."""
        return difficulty_of(self.draft)

    @cached_property
    def solution(self) -> Solution:
        """Actions that solve it, replayed under the contract when it was validated."""
        return Solution(episode_id=self.episode.id, actions=self.draft.actions)


class Stream:
    """Episodes of some families and difficulties, in the houses from `first` on, up to `last` (excluded) if given.

    Each iteration begins at the first house. `close`, or the end of a `with` block, ends the background processes.
    """

    def __init__(
        self,
        seed: int,
        *,
        families: tuple[Family, ...] = (),
        difficulties: tuple[Difficulty, ...] = (),
        first: int = 0,
        last: int | None = None,
        workers: int = 1,
        is_seed_secret: bool = False,
    ) -> None:
        """Nothing is made before it is read; 0 `workers` make houses in this process. Raises SettingError.

        Of a secret seed no house and no episode tells anything.
        """
        if first < 0 or (last is not None and last <= first):
            raise SettingError(f"Houses {first} to {last} of a stream: expected 0 <= FIRST < END.")
        if seed < 0 or workers < 0:
            raise SettingError(f"A stream's seed ({seed}) and number of workers ({workers}) are 0 or more.")
        self.settings = StreamSettings(
            seed, families_of_stream(families, workers), difficulties or DIFFICULTIES, is_seed_secret
        )
        self.first, self.last = first, last
        self._workers = workers
        self._pools: list[HousePool] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __iter__(self) -> Iterator[StreamItem]:
        return self.items()

    def items(self) -> Generator[StreamItem, None, None]:
        """Yield the episodes, as iteration does. Raises SettingError when none fits in many houses, SimulatorError."""
        with closing(self.houses()) as houses:
            yield from items_in(houses)

    def houses(self) -> Generator[StreamHouse, None, None]:
        """Yield house after house, those without a wanted episode too. Raises as `items` does."""
        barren = 0
        with closing(self._made()) as made:
            for house in made:
                barren = 0 if house.drafts else barren + 1
                if barren >= MAX_HOUSES_WITHOUT_EPISODE:
                    raise SettingError(self._nothing_found())
                yield house

    def after(self, houses: int) -> "Stream | None":
        """Return the same stream without its first houses; None when nothing is left of it."""
        first, asked = self.first + houses, self.settings
        if self.last is not None and first >= self.last:
            return None
        return Stream(
            asked.seed,
            families=asked.families,
            difficulties=asked.difficulties,
            first=first,
            last=self.last,
            workers=self._workers,
            is_seed_secret=asked.is_seed_secret,
        )

    def worker_pids(self) -> list[int]:
        """Return the ids of the background processes that run."""
        return [pid for pool in self._pools for pid in pool.pids()]

    def close(self) -> None:
        """Ends the background processes; who still reads is told that the stream is closed."""
        for pool in self._pools:
            pool.close()

    def _made(self) -> Generator[StreamHouse, None, None]:
        numbers = iter(range(self.first, self.last)) if self.last is not None else count(self.first)
        if not self._workers:
            maker = StreamHouseMaker(self.settings)
            yield from map(maker.made, numbers)
            return
        pool = HousePool(self.settings, self._workers)
        self._pools.append(pool)
        try:
            ahead: deque[Future[StreamHouse]] = deque(
                pool.ask(number) for number in islice(numbers, HOUSES_AHEAD * self._workers)
            )
            while ahead:
                house = ahead.popleft().result()
                ahead.extend(map(pool.ask, islice(numbers, 1)))
                yield house
        finally:
            self._pools.remove(pool)
            pool.close()

    def _nothing_found(self) -> str:
        asked = self.settings
        return (
            f"Stream {asked.label}: no episode of {', '.join(asked.families)} that is "
            f"{' or '.join(asked.difficulties)} in {MAX_HOUSES_WITHOUT_EPISODE} houses in a row. "
            "Ask for more families or difficulties."
        )


def items_in(houses: Iterable[StreamHouse]) -> Iterator[StreamItem]:
    """Yield the episodes of houses, in their order."""
    number = 0
    for made in houses:
        house = made.house if made.drafts else None
        for draft in made.drafts:
            assert house is not None
            yield StreamItem(number, made.number, draft, house)
            number += 1
