"""Labels: what a study's file says of a run, for the tables and figures of a report."""

from dataclasses import dataclass
from typing import Literal

Role = Literal["main", "repeat", "condition"]
"""Place of a run among those of its model: its main one, a further play of that, or one under another condition."""
StudyPanel = Literal["main", "extended", "supplementary"]


@dataclass(frozen=True, slots=True)
class RunLabel:
    """What a study says of one run."""

    model: str
    """Name of the model in tables and figures."""
    role: Role
    mark: str = ""
    """What distinguishes the run from the main one: its condition or the number of its repeat."""
    group: str | None = None
    """Group in the panels; None to use the one that the model's name implies."""
    panel: StudyPanel | None = None
    """Panel of the main run; None to use the rule of exclusion."""
    is_anchor: bool = False
    """Whether the model is among those that a paper discusses in detail."""
    published: str | None = None
    """Name of the same model in the published rows; None if there is none."""

    @property
    def name(self) -> str:
        """Name of the run, unique in its study."""
        return f"{self.model} [{self.mark}]" if self.mark else self.model
