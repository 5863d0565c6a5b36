"""Shards: the parts of a run that several machines play, each into a folder of its own.

Part i of n has whole episodes, with all their epochs. It is drawn from the run's episodes alone, so that every machine
draws the same parts: no two parts share an episode, and together they are all. How many episodes of a family a part has
differs by at most one from part to part, and so does the number of all its episodes. Within a family the parts follow
one another in the order of play, so that a part has few houses.
"""

import hashlib
import re
from collections.abc import Iterable, Mapping

from vigil.errors import SettingError
from vigil.protocol.episode import FAMILIES, Episode
from vigil.records.record import Shard

_TEXT = re.compile(r"([1-9]\d{0,5})/([1-9]\d{0,5})", re.ASCII)


def parse_shard(text: str) -> Shard:
    """Return the shard that a text such as 2/8 names. Raises SettingError."""
    match = _TEXT.fullmatch(text)
    index, count = (int(part) for part in match.groups()) if match else (0, 0)
    if not 1 <= index <= count:
        raise SettingError(f"--shard {text!r} is not I/N with I from 1 to N, e.g. --shard 2/8 for the second of eight.")
    return Shard(index=index, of=count)


def play_order(episodes: Iterable[Episode], pairs: Mapping[str, str] | None = None) -> list[Episode]:
    """Return episodes house by house, so that a house is loaded once; of twins the second when all else is played.

    `pairs` names the pair of each twin. Which of them comes first is as good as random: it does not tell the side.
    """
    rounds: tuple[list[Episode], list[Episode]] = [], []
    begun: set[str] = set()
    for episode in sorted(episodes, key=lambda episode: hashlib.sha256(episode.id.encode()).digest()):
        pair = (pairs or {}).get(episode.id, episode.id)
        rounds[pair in begun].append(episode)
        begun.add(pair)
    return [each for part in rounds for each in sorted(part, key=lambda each: (each.house.name, each.id))]


def shard_episodes(episodes: Iterable[Episode], shard: Shard | None) -> list[Episode]:
    """Return the episodes of a shard, sorted by id; all of them without one. Raises SettingError when it has none."""
    everything = sorted(episodes, key=lambda episode: episode.id)
    if shard is None:
        return everything
    if shard.of > len(everything):
        raise SettingError(
            f"Shard {shard} of {len(everything)} episodes: some shards would have none. Give {len(everything)} shards "
            "or fewer."
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
    """Return how many of the numbers from `start` to before `end` leave the remainder `index` when divided."""
    return (end - index + count - 1) // count - (start - index + count - 1) // count
