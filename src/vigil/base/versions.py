"""Versions: under which rules, with which shapes and by which grammar of replies something was made.

Packs, run headers and episode records name them, because they tell what a package's version number does not: whether
a recorded action would do the same today. They are whole numbers, raised by one. 1 is what has no number: it was made
before versions were named. `tests/base/test_versions.py` fails when one of the three changes and its number does not.
"""

from typing import Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from vigil import __version__
from vigil.errors import shorten

RULES_VERSION = 3
"""Of the protocol as the package carries it out: contract, budgets, goals, and how the simulator behaves.

Raised when an episode could end otherwise, or a verdict come out otherwise, for the same replies and the same shapes.
A raise needs a record under docs/decisions that says what changes and how many recorded verdicts do, the golden
records written anew, and the packaged packs frozen anew under names of their own."""
SHAPES_VERSION = 4
"""Of the shapes that the package makes of a house's things: where parts, solids, surfaces and joints lie.

Raised when anything of that moves by more than `tests/golden/shapes.json` tolerates: what is in view, in reach or
in the way may then change in every recorded episode. A raise needs the packaged packs frozen anew."""
GRAMMAR_VERSION = 2
"""Of `vigil.protocol.replies`: which texts are an action, and which one.

Raised when any text is judged otherwise than before (`tests/golden/replies.json` pins some). A raise needs no new
packs, but replies that were judged by another grammar are not to be compared with those judged by this one."""
UNVERSIONED = 1
"""The version of what does not name one."""
MAX_SCHEMA_CHARS = 40


class PackVersions(BaseModel):
    """What a pack depends on."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    rules: int = Field(default=UNVERSIONED, ge=1)
    shapes: int = Field(default=UNVERSIONED, ge=1)

    @classmethod
    def current(cls) -> Self:
        """Return the versions of this package."""
        return cls.model_validate({name: number for name, number in _CURRENT.items() if name in cls.model_fields})

    def differences(self) -> list[str]:
        """Return in what these differ from this package's, e.g. `rules 1 (current 2)`."""
        numbers = self.model_dump()
        return [f"{name} {numbers[name]} (here {_CURRENT[name]})" for name in numbers if self._differs(name)]

    def note(self, what: str) -> str | None:
        """Return one line on how `what`, made under these, differs from this package; None when it does not."""
        found = self.differences()
        if not found:
            return None
        unnamed = "; 1 is from before versions were named" if UNVERSIONED in self.model_dump().values() else ""
        means = "; ".join(_DESCRIPTIONS[name] for name in type(self).model_fields if self._differs(name))
        return f"{what} was made under other versions: {', '.join(found)}{unnamed}. {means[:1].upper()}{means[1:]}."

    def _differs(self, name: str) -> bool:
        return getattr(self, name) != _CURRENT[name]


class Versions(PackVersions):
    """What a run and its records depend on."""

    grammar: int = Field(default=UNVERSIONED, ge=1)


def schema_mismatch(found: object, known: int) -> str | None:
    """Return why a file of schema `found` is not read where schema `known` is, and what to do; None when it is."""
    if found == known:
        return None
    is_newer = isinstance(found, int) and found > known
    advice = (
        "A newer vigil wrote it: `pip install --upgrade vigil-bench`, then read it again"
        if is_newer
        else "Read it with the vigil that wrote it"
    )
    return f"has schema {shorten(repr(found), MAX_SCHEMA_CHARS)}, vigil {__version__} reads {known}. {advice}"


def schema_validator(known: int) -> AfterValidator:
    """Return what holds the field `schema_version` of a file against the one schema that is read."""

    def checked(found: int) -> int:
        fault = schema_mismatch(found, known)
        if fault is not None:
            raise ValueError(f"it {fault}")
        return found

    return AfterValidator(checked)


_CURRENT = {"rules": RULES_VERSION, "shapes": SHAPES_VERSION, "grammar": GRAMMAR_VERSION}
_DESCRIPTIONS = {
    "rules": "the same actions may end otherwise here and get other verdicts",
    "shapes": "things may have other shapes here, so that the same actions may do something else",
    "grammar": "the same replies may be read otherwise here",
}
