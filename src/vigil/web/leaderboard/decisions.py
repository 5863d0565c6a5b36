"""Decisions: the file in which maintainers accept, refuse and withdraw entries, and put them into a tier."""

from datetime import date
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, StringConstraints, ValidationError

from vigil.errors import SettingError
from vigil.studies.yaml_text import read_yaml
from vigil.web.leaderboard.metadata import Line, Tier, reason

Status = Literal["accepted", "refused", "withdrawn"]


class EntryDecision(BaseModel):
    """A decision about the entry of one run."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    run: Annotated[str, StringConstraints(pattern=r"^[0-9a-f]{12}$")] = Field(description="id of the entry")
    status: Status
    why: Annotated[str, StringConstraints(min_length=1, max_length=1000)]
    by: Line
    date: date
    tier: Tier | None = None
    """Tier that the maintainers vouch for; None to use the tier that the check proves."""
    bundle: Annotated[str, StringConstraints(pattern=r"^[0-9a-f]{64}$")] | None = None
    """SHA-256 of the bundle that the decision accepts, if several bundles contain the same run."""


class _File(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)

    decisions: tuple[EntryDecision, ...]


def read_decisions(path: Path | None) -> dict[str, EntryDecision]:
    """Return {id of an entry: decision}. Raises SettingError that names the line of an invalid decision."""
    if path is None:
        return {}
    if not path.is_file():
        raise SettingError(
            f"--decisions {str(path)!r} does not exist. Give an existing file; docs/leaderboard.md shows an example."
        )
    text = read_yaml(path, is_text=True)
    try:
        found = _File.model_validate(text.value).decisions
    except ValidationError as error:
        raise text.error(tuple(error.errors()[0]["loc"]), f"{reason(error)}.") from None
    for index, decision in enumerate(found):
        if decision.run in {other.run for other in found[:index]}:
            raise text.error(("decisions", index), f"there are two decisions about {decision.run}. Remove one of them.")
    return {decision.run: decision for decision in found}
