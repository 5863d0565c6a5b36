"""Labels: what a study's file says of a run, for the tables and figures of a report."""

from dataclasses import dataclass
from typing import Literal

Role = Literal["main", "repeat", "condition"]
"""Role of a run among its model's runs: the main run, a repeat of the main run, or a run under another condition."""
StudyPanel = Literal["main", "extended", "supplementary"]


@dataclass(frozen=True, slots=True)
class RunLabel:
    """What a study's file says of one run: its name in tables, its role, and the group and panel of its row."""

    model: str
    """Name of the model in tables and figures."""
    role: Role
    mark: str = ""
    """What distinguishes the run from its model's main run: its condition or the number of its repeat."""
    group: str | None = None
    """Group in the panels; None for the group that the model's name implies."""
    panel: StudyPanel | None = None
    """Panel of the main run; None if the rule of exclusion (`is_excluded`) decides about the panel."""
    is_anchor: bool = False
    """Whether the model is among those that a paper discusses in detail."""
    published: str | None = None
    """Name of the same model in the published rows; None if there is none."""

    @property
    def name(self) -> str:
        """Name of the run, unique in its study."""
        return f"{self.model} [{self.mark}]" if self.mark else self.model
