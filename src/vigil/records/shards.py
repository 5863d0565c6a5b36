"""Shards: the parts of a run that several machines play, each into a separate folder.

A shard has whole episodes, with all their epochs. Every machine computes the same shards, because they depend only on
the run's episodes. Each episode is in exactly one shard. The numbers of episodes per family, and in total, differ by at
most one between shards. Within a family, a shard's episodes are consecutive in the order of play, so that each shard
has few houses.
"""

import hashlib
import re
from collections.abc import Iterable, Mapping

from vigil.errors import SettingError
from vigil.protocol.episode import Episode
from vigil.protocol.families import FAMILIES
from vigil.records.record import Shard

_TEXT = re.compile(r"([1-9]\d{0,5})/([1-9]\d{0,5})", re.ASCII)


def parse_shard(text: str) -> Shard:
    """Return the shard in a text such as "2/8". Raises SettingError."""
    match = _TEXT.fullmatch(text)
    index, count = (int(part) for part in match.groups()) if match else (0, 0)
    if not 1 <= index <= count:
        raise SettingError(f"--shard {text!r} is not I/N with I from 1 to N, e.g. --shard 2/8 for the second of eight.")
    return Shard(index=index, of=count)


def play_order(episodes: Iterable[Episode], pairs: Mapping[str, str] | None = None) -> list[Episode]:
    """Return episodes house by house, so that each house is loaded only once. The second episode of each pair of twins
    comes after all other episodes.

    `pairs` maps the ids of twins (episodes whose houses differ in one object) to the names of their pairs. Which twin
    comes first is pseudo-random, so that the order does not reveal which twin can be solved.
    """
    rounds: tuple[list[Episode], list[Episode]] = [], []
    begun: set[str] = set()
    for episode in sorted(episodes, key=lambda episode: hashlib.sha256(episode.id.encode()).digest()):
        pair = (pairs or {}).get(episode.id, episode.id)
        rounds[pair in begun].append(episode)
        begun.add(pair)
    return [each for part in rounds for each in sorted(part, key=lambda each: (each.house.name, each.id))]


def shard_episodes(episodes: Iterable[Episode], shard: Shard | None) -> list[Episode]:
    """Return the episodes of a shard (None: all), sorted by id. Raises SettingError if there are none."""
    everything = sorted(episodes, key=lambda episode: episode.id)
    if shard is None:
        return everything
    if shard.of > len(everything):
        raise SettingError(
            f"Shard {shard} of {len(everything)} episodes: some shards would not have any episode. Give "
            f"{len(everything)} shards or fewer."
        )
    part: list[Episode] = []
    dealt = 0
    for family in FAMILIES:
        mine = play_order(episode for episode in everything if episode.family == family)
        sizes = [_count_dealt_to(index, shard.of, dealt, dealt + len(mine)) for index in range(shard.of)]
        before = sum(sizes[: shard.index - 1])
        part += mine[before : before + sizes[shard.index - 1]]
        dealt += len(mine)
    return sorted(part, key=lambda episode: episode.id)


def _count_dealt_to(index: int, count: int, start: int, end: int) -> int:
    """Return how many numbers in [start, end) have remainder `index` modulo `count`."""
    return (end - index + count - 1) // count - (start - index + count - 1) // count
