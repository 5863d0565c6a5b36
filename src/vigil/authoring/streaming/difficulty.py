"""Difficulty: one measured fact of an episode, cut in three.

The bounds are those that part each family of `vigil_balanced_1000_v1_2` into three shares as equal as whole numbers of
actions allow. Pointing is graded already, by the size of its target; a state is verified in one action, so that how far
away it is grades it.
"""

from collections.abc import Iterable
from typing import Literal, get_args

from vigil.authoring.drafting.drafts import Draft
from vigil.errors import SettingError, did_you_mean
from vigil.protocol.episode import Family, TargetSize

Difficulty = Literal["easy", "medium", "hard"]
DIFFICULTIES: tuple[Difficulty, ...] = get_args(Difficulty)
OF_SIZE: dict[TargetSize, Difficulty] = {"large": "easy", "medium": "medium", "small": "hard"}
MAX_ACTIONS: dict[Family, tuple[int, int]] = {
    "DA": (4, 6), "VS": (2, 5), "AI": (5, 7), "SI": (5, 9), "SM": (8, 11), "CR": (5, 8),
}  # fmt: skip
"""Family -> actions of the longest solution that is easy, and of the longest that is medium; the report counts."""
MAX_DISTANCE_M = (1.1, 2.0)
"""Of state verification: from the start to the farthest target that is easy, and to the farthest that is medium."""


def difficulty_of(draft: Draft) -> Difficulty:
    """Return how difficult a draft is."""
    family = draft.episode.family
    if draft.episode.target_size is not None:
        return OF_SIZE[draft.episode.target_size]
    if family == "SV":
        measured, (easy, medium) = draft.facts.distance_m, MAX_DISTANCE_M
    else:
        measured, (easy, medium) = len(draft.actions), MAX_ACTIONS[family]
    return "easy" if measured <= easy else "medium" if measured <= medium else "hard"


def difficulties_named(names: Iterable[str]) -> tuple[Difficulty, ...]:
    """Return the difficulties of these names, easy first; a name may hold several, as in "easy,medium".

    Raises SettingError on a name that is none.
    """
    wanted = {word.strip().lower() for name in names for word in name.split(",")}
    for word in sorted(wanted - set(DIFFICULTIES)):
        hint = did_you_mean(word, DIFFICULTIES)
        raise SettingError(f"Difficulty {word!r} does not exist.{hint} Choose of: {', '.join(DIFFICULTIES)}.")
    return tuple(each for each in DIFFICULTIES if each in wanted)
