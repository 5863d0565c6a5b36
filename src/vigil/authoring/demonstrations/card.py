"""The card of a folder of demonstrations: what it holds, and how HF `datasets` finds its rows."""

from collections.abc import Mapping
from typing import Any

_CARD = """---
license: apache-2.0
language: en
pretty_name: VIGIL demonstrations of {stream}
tags: [embodied, egocentric, vision-language, demonstrations, synthetic]
configs:
- config_name: default
  data_files: {table}
---
# Demonstrations of {stream}

{episodes} episodes of an endless stream of VIGIL, played by its solver. Each row is one request of a model under the
profile `{profile}` (prompt `{prompt}`), with the answer that is right there. No episode or house of a pack that comes
with VIGIL is among them.

| column | says |
|---|---|
| `messages` | the chat that a model is sent, and as its last message the right answer; past pictures are left out, \
as in evaluation |
| `images` | the one picture, that of the part `{{"type": "image"}}`{where} |
| `kind` | `demonstration`, or `correction`: the same request with a false report besides |
| `rejected` | of a correction: the false report, which the answer is to be preferred to |
| `fault` | `premature_success` (the goal does not hold yet), `wrong_state` (the other label), `false_fail` (giving up \
when it is done) |
| `id`, `episode_id`, `family`, `difficulty`, `step` | where the row is from; ids name the target: never show them to \
a model |

## Counts
| rows | |
|---|---|
{rows}

| family | episodes |
|---|---|
{families}

## How they were made
- Houses and episodes are generated; every solution was validated by replaying it, and played again for these rows.
- Actions are the solver's, which knows the hidden world: it walks straight to what it has not seen yet. It does not
  search as one must who does not know.
- Thoughts and reports are sentences of a few fixed forms. They call things what the instruction calls them; "I see"
  stands where at least 40 pixels of a thing are in the frame within 6 m, "I do not see" where none is.
- Every report in an answer is true: the scoring of VIGIL calls it so. Every rejected one was scored too, and is false.
- Pictures are drawn by MuJoCo, quality `{quality}`; another graphics driver may draw other pixels. All else depends on
  the stream's seed, filters and version alone.
- `demonstrations.json` tells all settings.
"""


def card_of(facts: Mapping[str, Any], table: str) -> str:
    """Returns the text of the README."""
    return _CARD.format(
        stream=facts["stream"],
        table=table,
        episodes=sum(facts["episodes"].values()),
        profile=facts["profile"]["name"],
        prompt=facts["prompt"],
        where="" if facts["format"] == "parquet" else "; a path in this folder",
        rows=_table(facts["rows"]),
        families=_table(facts["episodes"]),
        quality=facts["quality"],
    )


def _table(counts: Mapping[str, int]) -> str:
    return "\n".join(f"| {name} | {count} |" for name, count in counts.items())
