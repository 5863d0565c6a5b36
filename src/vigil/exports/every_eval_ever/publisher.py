"""Publisher of results: facts that the database requires and a run does not contain."""

from dataclasses import dataclass, fields
from typing import Annotated, Literal

from vigil.base.settings import Setting, check_settings

Relationship = Literal["first_party", "third_party", "collaborative", "other"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Publisher:
    """Who publishes the results, and how."""

    organization: Annotated[str, Setting("Organization that ran the evaluation, for every-eval-ever.")] = "unknown"
    relationship: Annotated[
        Relationship, Setting("Relationship of the evaluator to the model's developer, for every-eval-ever.")
    ] = "other"
    developer: Annotated[
        str | None, Setting("Developer of the model, for every-eval-ever.", unset="from the model's name")
    ] = None
    force: Annotated[bool, Setting("Also write an incomplete run, for every-eval-ever; the file says so.")] = False

    def __post_init__(self) -> None:
        """Check the values against their declarations."""
        check_settings(self)

    @property
    def given(self) -> str:
        """The options that were set, as the export writes them."""
        return ", ".join(f"--{each.name}" for each in fields(self) if getattr(self, each.name) != each.default)
