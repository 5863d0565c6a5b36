"""The families that a stream can have: those of the package, and registered families that have kinds and grades."""

import os

from vigil.base.imports import ENVIRONMENT_VARIABLE
from vigil.errors import SettingError
from vigil.protocol.families import FAMILIES, PACKAGED_FAMILIES, Family


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
