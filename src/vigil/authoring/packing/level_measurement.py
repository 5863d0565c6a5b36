"""Levels of many episodes, measured on their recorded solutions, house by house, in worker processes."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future

from vigil.authoring.packing.episode_measures import measures_of_episode
from vigil.authoring.packing.verify import HouseBatch, VerificationSettings, house_batches
from vigil.base.processes import worker_pool
from vigil.packs.pack import Pack
from vigil.protocol.house import House
from vigil.scoring.levels import EpisodeLevel, grade_episode
from vigil.sim.privileged import PrivilegedSimulator

OnMeasured = Callable[[int, int], None]
"""A function that gets the numbers of episodes measured and of all episodes."""


def pack_levels(
    pack: Pack, settings: VerificationSettings, on_measured: OnMeasured = lambda done, of: None
) -> list[EpisodeLevel]:
    """Return the level of each of a pack's episodes that has a recorded solution, sorted by id."""
    solved = {name: solution.actions for name, solution in pack.solutions.items()}
    return measured_levels(house_batches(pack.episodes, solved, pack.house_of), settings, on_measured)


def measured_levels(
    work: Sequence[HouseBatch], settings: VerificationSettings, on_measured: OnMeasured = lambda done, of: None
) -> list[EpisodeLevel]:
    """Return the level of each episode that has a solution, sorted by id."""
    total = sum(len(batch.episodes) for batch in work)
    found: list[EpisodeLevel] = []
    for batch in _batches(work, settings):
        found += batch
        on_measured(len(found), total)
    return sorted(found, key=lambda each: each.episode_id)


def _batches(work: Sequence[HouseBatch], settings: VerificationSettings) -> Iterator[list[EpisodeLevel]]:
    if settings.workers == 1 or len(work) < 2:
        simulator = settings.simulator()
        for batch in work:
            yield _measure(simulator, batch)
        return
    with worker_pool(settings.workers, _begin_worker, settings) as pool:
        futures: list[Future[list[EpisodeLevel]]] = [pool.submit(_measure_here, batch) for batch in work]
        try:
            for future in futures:
                yield future.result()
        finally:
            pool.shutdown(cancel_futures=True)


_simulators: list[PrivilegedSimulator] = []
"""The simulator of this worker process."""


def _begin_worker(settings: VerificationSettings) -> None:
    _simulators.append(settings.simulator())


def _measure_here(batch: HouseBatch) -> list[EpisodeLevel]:
    return _measure(_simulators[0], batch)


def _measure(simulator: PrivilegedSimulator, batch: HouseBatch) -> list[EpisodeLevel]:
    house = House(batch.name, batch.document)
    simulator.load(house)
    solved = ((episode, actions) for episode, actions in batch.episodes if actions is not None)
    return [
        grade_episode(episode, measures_of_episode(simulator, episode, house, actions)) for episode, actions in solved
    ]
