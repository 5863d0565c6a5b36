"""Versions of the rules, the shapes and the reply grammar under which a pack, run or record was made.

Packs, run headers and episode records state these versions, because the package's version number does not say whether a
recorded action would still have the same effect. Each version is a whole number, raised by one at a change. Version 1
stands for all files that were made before versions were recorded. `tests/base/test_versions.py` fails if the rules,
shapes or grammar change but the number does not.
"""

from typing import Self

from pydantic import AfterValidator, Field

from vigil import __version__
from vigil.base.models import FrozenModel
from vigil.errors import shorten

RULES_VERSION = 3
"""Version of the protocol as implemented: contract, budgets, goals, and the simulator's behaviour.

It is raised if an episode with the same replies and shapes could end differently or get another verdict. Then a record
under docs/decisions must say what changes and how many recorded verdicts change, golden records must be generated
again, and the packaged packs must be frozen again under new names.
"""
SHAPES_VERSION = 5
"""Version of the shapes of a house's objects: the places of parts, solids, surfaces and joints.

It is raised if any of these moves by more than `tests/golden/shapes.json` tolerates. What is in view, in reach or in
the way may then change in every recorded episode, so the packaged packs must be frozen again.
"""
GRAMMAR_VERSION = 2
"""Version of the reply grammar in `vigil.protocol.replies`. The grammar decides which texts are actions, and which
actions they are.

It is raised if any text is parsed differently than before (`tests/golden/replies.json` has examples). New packs are not
needed then, but replies parsed under different versions of the grammar must not be compared.
"""
UNVERSIONED = 1
"""Version of a file that does not state a version."""
MAX_SCHEMA_CHARS = 40


class PackVersions(FrozenModel):
    """The versions that a pack depends on: those of the rules and of the shapes."""

    rules: int = Field(default=UNVERSIONED, ge=1)
    shapes: int = Field(default=UNVERSIONED, ge=1)

    @classmethod
    def current(cls) -> Self:
        """Return the versions of the rules and shapes in this package."""
        return cls.model_validate({name: number for name, number in _CURRENT.items() if name in cls.model_fields})

    def differences(self) -> list[str]:
        """Return descriptions of the versions that differ from this package's, e.g. `rules 1 (here 2)`."""
        numbers = self.model_dump()
        return [f"{name} {numbers[name]} (here {_CURRENT[name]})" for name in numbers if self._differs(name)]

    def note(self, what: str) -> str | None:
        """Return one line with the versions under which `what` was made; None if they are this package's versions."""
        found = self.differences()
        if not found:
            return None
        unnamed = "; 1 is from before versions were recorded" if UNVERSIONED in self.model_dump().values() else ""
        means = "; ".join(_DESCRIPTIONS[name] for name in type(self).model_fields if self._differs(name))
        return f"{what} was made under other versions: {', '.join(found)}{unnamed}. {means[:1].upper()}{means[1:]}."

    def _differs(self, name: str) -> bool:
        return getattr(self, name) != _CURRENT[name]


class Versions(PackVersions):
    """The versions that a run and its records depend on."""

    grammar: int = Field(default=UNVERSIONED, ge=1)


def schema_mismatch(found: object, known: int) -> str | None:
    """Return a message that a file of schema `found` cannot be read, and what to do; None if `found` equals `known`."""
    if found == known:
        return None
    is_newer = isinstance(found, int) and found > known
    advice = (
        "A newer vigil wrote it: `pip install --upgrade vigil-bench`, then read it again"
        if is_newer
        else "Read it with the version of vigil that wrote it"
    )
    return f"has schema {shorten(repr(found), MAX_SCHEMA_CHARS)}, but vigil {__version__} reads {known}. {advice}"


def schema_validator(known: int) -> AfterValidator:
    """Return a pydantic validator for the field `schema_version` that accepts only the value `known`."""

    def checked(found: int) -> int:
        fault = schema_mismatch(found, known)
        if fault is not None:
            raise ValueError(f"it {fault}")
        return found

    return AfterValidator(checked)


_CURRENT = {"rules": RULES_VERSION, "shapes": SHAPES_VERSION, "grammar": GRAMMAR_VERSION}
_DESCRIPTIONS = {
    "rules": "the same actions may end differently here and get other verdicts",
    "shapes": "objects may have other shapes here, so the same actions may have other effects",
    "grammar": "the same replies may be read differently here",
}
