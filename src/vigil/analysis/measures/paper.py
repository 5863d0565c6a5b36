"""Paper: the published rows, from another pack and simulator. They are a reference; never pool them with your runs.

`paper.json` holds them as printed. The paper uses NR in two meanings: with IL included (its table `extended_panel`;
here `NoRep`) and without IL (its table `open_repeat_robustness` and its text; here `NR`).
"""

import json
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any, Literal

Panel = Literal["full_panel", "excluded", "supplementary"]
NOTE = (
    "Rows marked † (`published` in CSV and JSON) are figures printed in the paper, measured on its own 1,000 "
    "episodes in AI2-THOR: another pack and another simulator. They are a reference for reading your own "
    "rows, not a baseline to test against."
)


@dataclass(frozen=True, slots=True)
class PublishedModel:
    """One of the 28 models that the paper evaluates, with its group and panel."""

    name: str
    group: str
    thinking: bool | None
    """Whether the model thinks; None if the paper does not say."""
    activated: str | None
    panel: Panel
    anchor: bool
    """Whether the model is one of the ten models of the main text."""
    api_identifier: str | None = None


@dataclass(frozen=True, slots=True)
class Paper:
    """The paper's printed results: its models, its tables, and rates from its text."""

    models: tuple[PublishedModel, ...]
    tables: dict[str, list[dict[str, Any]]]
    """Name of a table in the paper -> its rows. A row has the key `model`, unless the table is not about models."""
    text: dict[str, dict[str, float]]
    """Model -> rates printed only in the text. A rate whose name ends in `_neutral` is for the neutral prompt."""

    def model(self, name: str) -> PublishedModel:
        """Return the model that has this name in the rows."""
        return next(model for model in self.models if model.name == name)

    def rows(self, table: str) -> list[tuple[PublishedModel, dict[str, Any]]]:
        """Return a table's rows with their models, in printed order."""
        return [(self.model(row["model"]), row) for row in self.tables[table]]

    @property
    def families(self) -> tuple[str, ...]:
        """Codes of the paper's families, in the paper's order. A balanced pack has all of these families."""
        return tuple(self.tables["global_cross_section"][0]["families"])

    def points(self) -> list[tuple[PublishedModel, float, float]]:
        """Return every model's W and B in percent, from the primary panel or, for models that it lacks, the extended
        panel."""
        return [
            (model, row["W"], row["B"]) for table in ("full_panel", "extended_panel") for model, row in self.rows(table)
        ]


@cache
def paper() -> Paper:
    """Return the published rows, as shipped with the package."""
    data = json.loads((files("vigil.analysis.measures") / "paper.json").read_text(encoding="utf-8"))
    return Paper(tuple(PublishedModel(**model) for model in data["models"]), data["tables"], data["text"])
