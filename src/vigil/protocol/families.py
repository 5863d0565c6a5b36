"""The registry of task families: the package's families (one file each in `vigil.authoring.families`) and custom
families.

The table `FAMILIES` is data: scoring has no code for a particular family. Source: `protocol.md` section 4 and the
paper's table `family_specs`.
"""

import re
from collections.abc import Collection, Iterable
from typing import Annotated, get_args

from pydantic import AfterValidator

from vigil.base.exported import exported_by_modules
from vigil.errors import SettingError, check_known
from vigil.protocol.family import FamilySpec
from vigil.protocol.goals import Goal

_REQUIRED = ("summary", "kinds", "briefing", "level_bounds", "sample_goal")
"""Fields that each family of the package must set."""


def _check_family(name: str) -> str:
    if name not in FAMILIES:
        raise ValueError(
            f"there is no family {name!r}; the families are {', '.join(FAMILIES)}. To use a custom family, import "
            "its module: `vigil run --import MODULE`, or for any command VIGIL_IMPORT=MODULE"
        )
    return name


Family = Annotated[str, AfterValidator(_check_family)]
"""Code of a family: a key of `FAMILIES`."""


FAMILIES: dict[Family, FamilySpec] = {
    spec.code: spec for spec in exported_by_modules("vigil.authoring.families", "FAMILY", _REQUIRED)
}
"""Code of a family -> the description of the family."""
PACKAGED_FAMILIES = frozenset(FAMILIES)


def register_family(spec: FamilySpec) -> None:
    """Add a custom family to `FAMILIES`, in this process only. The family can use only the existing kinds of goals.

    Raises SettingError if the code is taken or is not two capital letters, if a kind of goal is unknown, or unless 0 <
    `easy` <= `medium` in `grading`.
    """
    if not re.fullmatch(r"[A-Z]{2}", spec.code):
        raise SettingError(
            f"Family {spec.code!r}: the code of a family must be two capital letters, like {', '.join(FAMILIES)}."
        )
    taken = FAMILIES.get(spec.code, spec)
    if taken != spec:
        raise SettingError(f"Family {spec.code!r} is {taken.name!r} already. Choose another name.")
    known = [kind.model_fields["kind"].default for kind in get_args(get_args(Goal)[0])]
    for kind in spec.allowed_goal_kinds:
        check_known(f"Family {spec.code!r}: goal kind", kind, known)
    if spec.grading is not None and not 0 < spec.grading.easy <= spec.grading.medium:
        raise SettingError(
            f"Family {spec.code!r}: expected a grading with 0 < easy <= medium; got {spec.grading.easy:g} and "
            f"{spec.grading.medium:g}."
        )
    FAMILIES[spec.code] = spec


def parse_kinds(names: Iterable[str]) -> tuple[str, ...]:
    """Return the kinds of episodes that `names` lists, sorted. One name may list several, as in "put_into,rearrange".

    Raises SettingError for a name that is not a kind of any family.
    """
    known = sorted({kind for spec in FAMILIES.values() for kind in spec.kinds})
    wanted = sorted({word.strip() for name in names for word in name.split(",")})
    for word in wanted:
        check_known("Template", word, known, "The templates:")
    return tuple(wanted)


def wanted_kinds(family: Family, templates: Collection[str]) -> tuple[str, ...]:
    """Return the family's kinds that `templates` names; all kinds of the family if `templates` names none of them."""
    kinds = tuple(FAMILIES[family].kinds)
    return tuple(kind for kind in kinds if kind in templates) or kinds


def parse_families(names: Iterable[str]) -> tuple[Family, ...]:
    """Return the families that `names` lists, in the order of `FAMILIES`. One name may list several, as in "PG,sm".

    Raises SettingError for a name that is not a family.
    """
    wanted = {word.strip().upper() for name in names for word in name.split(",")}
    for word in sorted(wanted):
        check_known("Family", word, FAMILIES, "The families:")
    return tuple(family for family in FAMILIES if family in wanted)
