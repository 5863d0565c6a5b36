"""Obvious wrong ways: outcomes that look like success and must not count as it.

On top instead of inside, within instead of on, the look-alike, the wrong neighbour, done and undone again. Planning the
walks would take too long, so each is brought about by the simulator's own set-up, and judged by the scoring of any run.
"""

from dataclasses import dataclass

from vigil.authoring.solving.oracle import Oracle
from vigil.authoring.ways.goal_wrong_ways import wrongly_reached
from vigil.authoring.ways.synthetic_records import SyntheticWorlds
from vigil.authoring.ways.wrong_worlds import WrongWorlds
from vigil.protocol.episode import Episode
from vigil.records.record import EpisodeRecord
from vigil.scoring.outcomes import settle


@dataclass(frozen=True, slots=True)
class WrongWay:
    """One wrong way, with its record; None where the house does not allow it."""

    name: str
    record: EpisodeRecord | None


def wins(episode: Episode, way: WrongWay) -> bool:
    """Whether a wrong way counts as success."""
    if way.record is None:
        return False
    outcome = settle(episode, way.record)
    return outcome.W or outcome.B


def wrong_ways(scenes: SyntheticWorlds, oracle: Oracle, record: EpisodeRecord) -> list[WrongWay]:
    """Returns the wrong ways of an episode whose solution's record is given. The simulator is left anywhere."""
    worlds = WrongWorlds(scenes, oracle, record)
    return [WrongWay(name, made) for name, made in wrongly_reached(worlds.episode.goal, worlds)]
