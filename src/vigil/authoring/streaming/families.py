"""The families that a stream can hold: those of the package, and registered ones with what drafts their episodes."""

import os
from collections.abc import Mapping

from vigil.authoring.drafting.grammar import GRAMMAR, Proposals
from vigil.authoring.streaming.difficulty import MAX_ACTIONS
from vigil.base.imports import ENVIRONMENT_VARIABLE
from vigil.errors import SettingError
from vigil.protocol.episode import FAMILIES, Family

_own: set[Family] = set()


def register_drafts(family: Family, kinds: Mapping[str, Proposals], *, most_actions: tuple[int, int]) -> None:
    """Has streams of this process draft a family that `register_family` has added.

    `kinds` names functions that yield drafts in a house, as those of the grammar do; `most_actions` are those of the
    longest solution that is easy, and of the longest that is medium. Raises SettingError.
    """
    if family not in FAMILIES or (family in GRAMMAR and family not in _own):
        raise SettingError(
            f"Drafts for family {family!r}: it is the package's own, or unknown. Register the family first, with "
            "vigil.protocol.episode.register_family."
        )
    if not kinds or not 0 < most_actions[0] <= most_actions[1]:
        raise SettingError(
            f"Drafts for family {family!r}: expected a kind or more, and 0 < EASY <= MEDIUM actions; got kinds "
            f"{', '.join(kinds) or 'none'} and {most_actions}."
        )
    GRAMMAR[family], MAX_ACTIONS[family] = dict(kinds), most_actions
    _own.add(family)


def families_of_stream(asked: tuple[Family, ...], workers: int) -> tuple[Family, ...]:
    """Return which families a stream holds: those asked for, or all that can be drafted. Raises SettingError."""
    for family in asked:
        if family not in GRAMMAR:
            raise SettingError(
                f"A stream has nothing that drafts episodes of family {family!r}. Register it with "
                "vigil.authoring.streaming.families.register_drafts, or ask for other families: "
                f"{', '.join(each for each in FAMILIES if each in GRAMMAR)}."
            )
    chosen = asked or tuple(family for family in FAMILIES if family in GRAMMAR)
    own = [family for family in chosen if family in _own]
    if own and workers and ENVIRONMENT_VARIABLE not in os.environ:
        raise SettingError(
            f"Family {', '.join(own)} is registered in this process alone; background processes do not know it. Have "
            f"every process import what registers it ({ENVIRONMENT_VARIABLE}=MODULE), make the houses in this one "
            "(workers 0), or ask for the package's families."
        )
    return chosen
