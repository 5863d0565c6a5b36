"""Options of exports: which hidden facts they include, and the facts about the publisher of results."""

from dataclasses import dataclass, fields
from typing import Annotated, Literal

from vigil.base.settings import Setting, check_settings
from vigil.packs.private import REVEAL_HELP


@dataclass(frozen=True, slots=True, kw_only=True)
class Disclosure:
    """Which hidden facts to include in an export; none by default."""

    answer_key: Annotated[
        bool,
        Setting(
            "Include the answer key: targets, correct labels, and the step at which each goal first held. "
            "For the formats hf and every-eval-ever."
        ),
    ] = False
    reveal_private_pack: Annotated[bool, Setting(REVEAL_HELP)] = False


NO_DISCLOSURE = Disclosure()


@dataclass(frozen=True, slots=True, kw_only=True)
class Publisher:
    """Options about the publication of results: the organization, its relationship to the model's developer, and the
    developer."""

    organization: Annotated[
        str, Setting("Organization that ran the evaluation, stated in the results of --format every-eval-ever.")
    ] = "unknown"
    relationship: Annotated[
        Literal["first_party", "third_party", "collaborative", "other"],
        Setting(
            "Relationship of that organization to the model's developer, stated in the results of "
            "--format every-eval-ever."
        ),
    ] = "other"
    developer: Annotated[
        str | None,
        Setting(
            "Developer of the model, stated in the results of --format every-eval-ever.", unset="from the model's name"
        ),
    ] = None
    force: Annotated[
        bool,
        Setting("Write results even if the run is incomplete, for --format every-eval-ever; the file then says so."),
    ] = False

    def __post_init__(self) -> None:
        """Check the values against the bounds in their declarations."""
        check_settings(self)

    @property
    def given(self) -> str:
        """Options that the user set, e.g. "--organization, --force"."""
        return ", ".join(f"--{each.name}" for each in fields(self) if getattr(self, each.name) != each.default)
