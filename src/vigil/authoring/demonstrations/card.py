"""The card of a folder of demonstrations: what it holds, and how HF `datasets` finds its rows."""

from collections.abc import Mapping, Sequence
from typing import Any

from vigil.authoring.demonstrations.columns import WORDS

_CARD = """---
license: apache-2.0
language: en
pretty_name: VIGIL demonstrations of {stream}
tags: [{tags}embodied, egocentric, vision-language, demonstrations, synthetic]
configs:
- config_name: default
  data_files: {table}
---
# Demonstrations of {stream}

{episodes} episodes of an endless stream of VIGIL, played by its solver. No episode or house of a pack that comes with
VIGIL is among them.

{rows_are}

| column | says |
|---|---|
{columns}

## Counts
| rows | |
|---|---|
{rows}

| family | episodes |
|---|---|
{families}

## How they were made
- Houses and episodes are generated; every solution was validated by replaying it, and played again for these rows.
- Actions are the solver's, which knows the hidden world: it turns and walks straight to what it has not seen yet, and
  does not search. `is_privileged` marks these rows: no player could know that direction. Leave them out, or do not
  count their loss, where a policy is to learn from what it sees.
- Thoughts and reports are sentences of a few fixed forms. They call things what the instruction calls them; "I see"
  stands where at least 40 pixels of a thing are in the frame within 6 m, "I do not see" where none is.
- Every report in an answer is true: the scoring of VIGIL calls it so. {false_reports}
- Pictures are drawn by MuJoCo, quality `{quality}`; another graphics driver may draw other pixels. All else depends on
  the stream's seed, filters and version alone.
- `demonstrations.json` tells all settings.
"""

_CHATS = {
    "tags": "",
    "rows_are": """\
Each row is one request of a model under the profile `{profile}` (prompt `{prompt}`), with the answer that is right
there.""",
    "columns": """\
| `messages` | the chat that a model is sent, and as its last message the right answer; past pictures are left out, as \
in evaluation |
| `images` | the one picture, that of the part `{{"type": "image"}}`{where} |
| `kind` | `demonstration`, or `correction`: the same request with a false report besides |
| `rejected` | of a correction: the false report, which the answer is to be preferred to |
| `fault` | `premature_success` (the goal does not hold yet), `wrong_state` (the other label), `false_fail` (giving up \
when it is done) |
| `is_privileged` | true where the answer moves towards a thing that no frame so far has shown |
| `id`, `episode_id`, `family`, `difficulty`, `step` | where the row is from; ids name the target: never show them to \
a model |""",
    "false_reports": "Every rejected one was scored too, and is false.",
}
_ACTIONS = {
    "tags": "LeRobot, robotics, ",
    "rows_are": """\
Each row is a frame that is seen under the profile `{profile}`, with the action that is right there. The folder is a
dataset of the library LeRobot, format v3.0.""",
    "columns": """\
| `observation.images.ego` | the frame that an agent is sent, (480, 640, 3), in the data file |
| `observation.state` | in the profile with feedback alone: `too_far` and `path_blocked` of the action before |
| `action` | eight numbers, named in `meta/info.json` and told below; what the skill does not take is 0 |
| `thought` | a sentence that goes with the action; of a report, its summary |
| `is_privileged` | true where the action moves towards a thing that no frame so far has shown |
| `next.reward`, `next.done` | 1 and true at the report, which ends the episode and is true; 0 and false before |
| `task_index` | the instruction, by its number in `meta/tasks.parquet`; LeRobot adds its text as `task` |
| `timestamp`, `frame_index`, `episode_index`, `index` | where the row stands; a step counts as a second |

| number of `action` | says |
|---|---|
{words}
| `magnitude` | steps of 0.25 m, or degrees |
| `x`, `y` | the middle of a pixel as a share of the frame: the pixel is the whole part of `x * 640`, `y * 480` |""",
    "false_reports": "There are no corrections\n  here: a false report has no place among actions that are to be done.",
}


def card_of(facts: Mapping[str, Any], table: str) -> str:
    """Return the text of the README."""
    slots = {
        "profile": facts["profile"]["name"],
        "prompt": facts["prompt"],
        "where": "" if facts["format"] == "parquet" else "; a path in this folder",
        "words": "\n".join(f"| `{name}` | {_numbered(words)} |" for name, words in WORDS.items()),
    }
    texts = _ACTIONS if facts["format"] == "lerobot" else _CHATS
    return _CARD.format(
        stream=facts["stream"],
        table=table,
        episodes=sum(facts["episodes"].values()),
        rows=_table({**facts["rows"], "of these privileged": facts["privileged_rows"]}),
        families=_table(facts["episodes"]),
        quality=facts["quality"],
        **{name: text.format(**slots) for name, text in texts.items()},
    )


def _numbered(words: Sequence[str]) -> str:
    return ", ".join(f"{number} {word}" for number, word in enumerate(words))


def _table(counts: Mapping[str, int]) -> str:
    return "\n".join(f"| {name} | {count} |" for name, count in counts.items())
