"""The stream: an endless sequence of validated episodes with their houses. It depends only on the seed.

    with Stream(7, families=("PG", "SV"), difficulties=("easy",), workers=2) as stream:
        for item in stream:
            item.episode, item.house, item.solution

Background processes make houses before they are read, and the stream yields them in order. So the episodes do not
depend on the number or speed of the processes. A process that was killed is started again and makes the same house.
All processes end when their reader ends. The readers of a stream in one process, such as a group of environments,
share the processes and the houses.
"""

import os
import threading
from collections import deque
from collections.abc import Generator, Iterable, Iterator
from concurrent.futures import Future
from contextlib import closing
from copy import copy
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import count, islice
from typing import Literal, Self

from cachetools import LRUCache

from vigil.authoring.closure.generation import FAMILY
from vigil.authoring.drafting.drafts import Draft
from vigil.authoring.streaming.difficulty import DIFFICULTIES, Difficulty, difficulty_of
from vigil.authoring.streaming.houses import StreamHouse, StreamHouseMaker, StreamSettings
from vigil.base.imports import ENVIRONMENT_VARIABLE
from vigil.base.processes.group import WorkerGroup
from vigil.base.processes.worker import WorkerSettings
from vigil.errors import SettingError, SimulatorError
from vigil.protocol.episode import Episode, Solution
from vigil.protocol.families import FAMILIES, PACKAGED_FAMILIES, Family
from vigil.protocol.house import House
from vigil.scoring.chore_answers import ListAnswer

HOUSES_AHEAD = 2
"""Number of houses, for each background process, that are being made or wait to be read."""
MAX_HOUSES_WITHOUT_EPISODE = 40
"""Maximum number of successive houses without a wanted episode. Then the stream gives up."""
MAX_DEATHS = 3
"""Maximum number of processes that may die while they make the same house. Then the stream gives up."""
SHARED_HOUSES = 16
"""Number of houses last asked for that readers of the same stream share."""


@dataclass(frozen=True)
class StreamItem:
    """One episode of a stream."""

    number: int
    """Position of the episode among the episodes read, counted from 0."""
    house_number: int
    """Position of the episode's house in the stream, counted from 0."""
    draft: Draft
    house: House
    answer: ListAnswer | None = None
    """Answer of a list of chores; None for an episode of the families."""

    @property
    def episode(self) -> Episode:
        """The episode. Its id names the stream, the version and the number of the house, unless the seed is secret."""
        return self.draft.episode

    @property
    def difficulty(self) -> Difficulty:
        """The episode's difficulty: easy, medium or hard."""
        return difficulty_of(self.draft)

    @cached_property
    def solution(self) -> Solution:
        """Actions that solve the episode; they were replayed when the episode was validated."""
        return self.draft.solution


class Stream:
    """A stream of episodes of some families and difficulties.

    It has the houses from number `first` up to `last` (excluded; None: without end). Each iteration begins at the first
    house. `close`, or the end of a `with` block, ends the background processes.
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
        suite: Literal["chores"] | None = None,
    ) -> None:
        """Make a stream. Houses are made when the stream is read.

        By default, the stream has all families and difficulties. With a `suite`, its episodes are those of the suite
        instead. With 0 `workers`, houses are made in this process. With `is_seed_secret`, houses and episodes do not
        reveal the seed. Raises SettingError.
        """
        if first < 0 or (last is not None and last <= first):
            raise SettingError(f"Houses {first} to {last} of a stream: expected 0 <= FIRST < END.")
        if seed < 0 or workers < 0:
            raise SettingError(f"A stream's seed ({seed}) and number of workers ({workers}) must be 0 or more.")
        if suite is not None and families:
            raise SettingError(
                "A stream has episodes either of families or of a suite, not of both. Leave one of the two out."
            )
        chosen: tuple[Family, ...] = families_of_stream(families, workers) if suite is None else (FAMILY,)
        self.settings = StreamSettings(seed, chosen, difficulties or DIFFICULTIES, is_seed_secret, suite)
        self.first, self.last = first, last
        self._workers = workers
        self._pools: list[SharedHouses] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __iter__(self) -> Iterator[StreamItem]:
        return self.items()

    def items(self) -> Generator[StreamItem, None, None]:
        """Yield the episodes, as iteration over the stream does.

        Raises SettingError if many successive houses have no wanted episode, SimulatorError if a house cannot be made.
        """
        with closing(self.houses()) as houses:
            yield from items_in(houses)

    def houses(self) -> Generator[StreamHouse, None, None]:
        """Yield all houses, including those without a wanted episode. Raises the same errors as `items`."""
        without_episode = 0
        with closing(self._made_houses()) as made:
            for house in made:
                without_episode = 0 if house.drafts else without_episode + 1
                if without_episode >= MAX_HOUSES_WITHOUT_EPISODE:
                    asked = self.settings
                    raise SettingError(
                        f"Stream {asked.label}: no episode of {', '.join(asked.families)} that is "
                        f"{' or '.join(asked.difficulties)} in {MAX_HOUSES_WITHOUT_EPISODE} houses in a row. "
                        "Ask for more families or difficulties."
                    )
                yield house

    def after(self, houses: int) -> "Stream | None":
        """Return the stream without its first `houses` houses; None if no houses are left."""
        rest = copy(self)
        rest.first, rest._pools = self.first + houses, []
        return rest if rest.last is None or rest.first < rest.last else None

    def worker_pids(self) -> list[int]:
        """Return the ids of the running background processes."""
        return [pid for pool in self._pools for pid in pool.pids()]

    def close(self) -> None:
        """End the background processes, unless another stream in this process shares them.

        Iterations that are still running raise SimulatorError.
        """
        for pool in self._pools:
            pool.close()

    def _made_houses(self) -> Generator[StreamHouse, None, None]:
        numbers = iter(range(self.first, self.last)) if self.last is not None else count(self.first)
        if not self._workers:
            maker = StreamHouseMaker(self.settings)
            yield from map(maker.made, numbers)
            return
        pool = SharedHouses(self.settings, self._workers)
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


def items_in(houses: Iterable[StreamHouse]) -> Iterator[StreamItem]:
    """Yield the episodes in these houses, in order, numbered from 0."""
    drafts = ((made, place) for made in houses for place in range(len(made.drafts)))
    for number, (made, place) in enumerate(drafts):
        answer = made.answers[place] if made.answers else None
        yield StreamItem(number, made.number, made.drafts[place], made.house, answer)


def families_of_stream(asked: tuple[Family, ...], workers: int) -> tuple[Family, ...]:
    """Return the families of a stream: those in `asked`, or all that can be drafted if `asked` is empty.

    Raises SettingError if a family cannot be drafted, or if the stream's background processes do not know it.
    """
    drafted = [
        family for family, spec in FAMILIES.items() if spec.kinds and (spec.grading or spec.stratum == "target_size")
    ]
    for family in asked:
        if family not in drafted:
            raise SettingError(
                f"A stream cannot draft family {family!r}: register it with `kinds` and a `grading` "
                f"(vigil.protocol.family.FamilySpec), or ask for other families: {', '.join(drafted)}."
            )
    chosen = asked or tuple(drafted)
    custom = [family for family in chosen if family not in PACKAGED_FAMILIES]
    if custom and workers and ENVIRONMENT_VARIABLE not in os.environ:
        raise SettingError(
            f"Family {', '.join(custom)} is registered only in this process; background processes do not know it. "
            f"Let every process import the module that registers it ({ENVIRONMENT_VARIABLE}=MODULE), make the "
            "houses in this process (workers 0), or ask only for the package's families."
        )
    return chosen


class HousePool(WorkerGroup):
    """A pool of processes that make houses in the order in which they were requested."""

    def __init__(self, settings: StreamSettings, workers: int) -> None:
        advice = "Check that there is enough memory; each process takes about 500 MB."
        super().__init__(
            partial(StreamHouseMaker, settings),
            workers,
            f"Stream {settings.label}: house maker",
            WorkerSettings(attempts=MAX_DEATHS, advice=advice, fault=SimulatorError),
        )

    def ask(self, number: int) -> "Future[StreamHouse]":
        """Return the future of a house. It raises SimulatorError if `MAX_DEATHS` processes died making the house."""
        return self.submit(StreamHouseMaker.made, number)


class SharedHouses:
    """A reader's access to a `HousePool` that all readers of the same stream in this process share.

    The pool ends when its last reader is closed.
    """

    def __init__(self, settings: StreamSettings, workers: int) -> None:
        self._key = os.getpid(), settings, workers
        with _lock:
            pool, houses, readers = _shared.get(self._key) or (HousePool(settings, workers), LRUCache(SHARED_HOUSES), 0)
            _shared[self._key] = pool, houses, readers + 1
        self.pids = pool.pids
        self._pool, self._houses = pool, houses
        self._is_closed = False

    def ask(self, number: int) -> "Future[StreamHouse]":
        """Return the future of a house, see `HousePool.ask`. Raises SimulatorError if this reader is closed."""
        if self._is_closed:
            raise SimulatorError("The stream has been closed.")
        with _lock:
            found = self._houses.get(number)
            if found is None or (found.done() and found.exception() is not None):
                found = self._houses[number] = self._pool.ask(number)
        return found

    def close(self) -> None:
        """End the pool if this was its last reader."""
        if self._is_closed:
            return
        self._is_closed = True
        with _lock:
            pool, houses, readers = _shared.pop(self._key)
            if readers > 1:
                _shared[self._key] = pool, houses, readers - 1
        if readers == 1:
            pool.close()


_lock = threading.Lock()
_shared: dict[tuple[int, StreamSettings, int], tuple[HousePool, LRUCache[int, "Future[StreamHouse]"], int]] = {}
"""(id of this process, settings, workers) -> pool, its houses and the number of its readers."""
