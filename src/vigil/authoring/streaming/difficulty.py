"""Difficulty of streamed episodes: one measured fact, and two bounds that divide it into three grades.

The bounds (`FamilySpec.grading`) divide each family of `vigil_balanced_1000_v1_2` into three shares that are as equal
as whole numbers of actions allow. Three kinds of episodes are graded by another fact: pointing by the size of its
target, state verification (which takes one action) by the distance of the target, and lists of chores by their length.
"""

from collections.abc import Iterable
from typing import Literal, get_args

from vigil.authoring.drafting.drafts import Draft
from vigil.errors import SettingError, did_you_mean
from vigil.protocol.families import FAMILIES
from vigil.protocol.family import TargetSize
from vigil.protocol.goals import Chores

Difficulty = Literal["easy", "medium", "hard"]
DIFFICULTIES: tuple[Difficulty, ...] = get_args(Difficulty)
LISTS = (5, 7)
"""Maximum number of chores of an easy list, and of a medium list."""
OF_SIZE: dict[TargetSize, Difficulty] = {"large": "easy", "medium": "medium", "small": "hard"}


def difficulty_of(draft: Draft) -> Difficulty:
    """Return the difficulty of a draft: easy, medium or hard."""
    family, goal = draft.episode.family, draft.episode.goal
    if isinstance(goal, Chores):
        return "easy" if len(goal.chores) <= LISTS[0] else "medium" if len(goal.chores) <= LISTS[1] else "hard"
    if draft.episode.target_size is not None:
        return OF_SIZE[draft.episode.target_size]
    grading = FAMILIES[family].grading
    assert grading is not None, f"family {family} has no grading, so that streams cannot hold it"
    measured = draft.facts.distance_m if grading.by == "distance_m" else len(draft.actions)
    return "easy" if measured <= grading.easy else "medium" if measured <= grading.medium else "hard"


def difficulties_named(names: Iterable[str]) -> tuple[Difficulty, ...]:
    """Return the difficulties that `names` lists, easy first. One name may list several, as in "easy,medium".

    Raises SettingError if a name is unknown.
    """
    wanted = {word.strip().lower() for name in names for word in name.split(",")}
    for word in sorted(wanted - set(DIFFICULTIES)):
        hint = did_you_mean(word, DIFFICULTIES)
        raise SettingError(f"Difficulty {word!r} does not exist.{hint} Choose from: {', '.join(DIFFICULTIES)}.")
    return tuple(each for each in DIFFICULTIES if each in wanted)
