"""Difficulty: one measured fact of an episode, cut in three.

The bounds are those that part each family of `vigil_balanced_1000_v1_2` into three shares as equal as whole numbers of
actions allow. Pointing is graded already, by the size of its target; a state is verified in one action, so that how far
away it is grades it.
"""

from collections.abc import Iterable
from typing import Literal, get_args

from vigil.authoring.drafting.drafts import Draft
from vigil.errors import SettingError, did_you_mean
from vigil.protocol.families import FAMILIES
from vigil.protocol.family import TargetSize

Difficulty = Literal["easy", "medium", "hard"]
DIFFICULTIES: tuple[Difficulty, ...] = get_args(Difficulty)
OF_SIZE: dict[TargetSize, Difficulty] = {"large": "easy", "medium": "medium", "small": "hard"}


def difficulty_of(draft: Draft) -> Difficulty:
    """Return how difficult a draft is."""
    family = draft.episode.family
    if draft.episode.target_size is not None:
        return OF_SIZE[draft.episode.target_size]
    grading = FAMILIES[family].grading
    assert grading is not None, f"streams do not hold families without a grading, as {family} is"
    measured = draft.facts.distance_m if grading.by == "distance_m" else len(draft.actions)
    return "easy" if measured <= grading.easy else "medium" if measured <= grading.medium else "hard"


def difficulties_named(names: Iterable[str]) -> tuple[Difficulty, ...]:
    """Return the difficulties of these names, easy first; a name may hold several, as in "easy,medium".

    Raises SettingError on a name that is none.
    """
    wanted = {word.strip().lower() for name in names for word in name.split(",")}
    for word in sorted(wanted - set(DIFFICULTIES)):
        hint = did_you_mean(word, DIFFICULTIES)
        raise SettingError(f"Difficulty {word!r} does not exist.{hint} Choose of: {', '.join(DIFFICULTIES)}.")
    return tuple(each for each in DIFFICULTIES if each in wanted)
