"""Card of a folder of demonstrations: a description of the content, and the settings for Hugging Face `datasets`."""

from collections.abc import Mapping
from typing import Any

from vigil.authoring.cards import render_card
from vigil.authoring.demonstrations.columns import WORDS


def card_of(facts: Mapping[str, Any], table: str) -> str:
    """Return the text of the folder's README, which states these facts; `table` is the path of the rows."""
    is_lerobot, profile = facts["format"] == "lerobot", facts["profile"]["name"]
    return render_card(
        "demonstrations", **{**facts, "profile": profile}, table=table, is_lerobot=is_lerobot, words=WORDS
    )
