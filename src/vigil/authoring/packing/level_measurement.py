"""Levels of many episodes, measured on their recorded solutions, house by house, in worker processes."""

from collections.abc import Callable, Sequence

from vigil.authoring.packing.episode_measures import measures_of_episode
from vigil.authoring.packing.verify import HouseBatch, VerificationSettings, house_batches, pack_tasks
from vigil.base.processes.group import map_in_workers
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
    return measured_levels(house_batches(pack_tasks(pack), pack.house_of), settings, on_measured)


def measured_levels(
    work: Sequence[HouseBatch], settings: VerificationSettings, on_measured: OnMeasured = lambda done, of: None
) -> list[EpisodeLevel]:
    """Return the level of each episode that has a solution, sorted by id."""
    total = sum(len(task.episodes) for batch in work for task in batch.tasks)
    found: list[EpisodeLevel] = []
    for batch in map_in_workers(settings.simulator, _measure, work, settings.workers):
        found += batch
        on_measured(len(found), total)
    return sorted(found, key=lambda each: each.episode_id)


def _measure(simulator: PrivilegedSimulator, batch: HouseBatch) -> list[EpisodeLevel]:
    house = House(batch.name, batch.document)
    simulator.load(house)
    return [
        grade_episode(episode, measures_of_episode(simulator, episode, house, actions))
        for task in batch.tasks
        for episode, actions in zip(task.episodes, task.solutions, strict=True)
        if actions is not None
    ]
