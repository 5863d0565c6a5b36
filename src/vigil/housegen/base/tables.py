"""The generator's tables, in `tables.toml`: what rooms get, where objects lie, and how likely their states are."""

import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from vigil.assets.catalog import expand_groups

TABLES: dict[str, Any] = tomllib.loads((Path(__file__).parents[1] / "tables.toml").read_text(encoding="utf-8"))
"""Name of a table -> its rows. The constants that read a table say what it means."""


def names_in(rows: dict[str, Sequence[str]]) -> dict[str, tuple[str, ...]]:
    """Return rows of names; each "@group" among the names is replaced by the group's members."""
    return {key: expand_groups(names, TABLES["groups"]) for key, names in rows.items()}
