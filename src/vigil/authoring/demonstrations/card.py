"""The card of a folder of demonstrations: a description of its content, with the configuration for HF `datasets`."""

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

{episodes} episodes of an endless stream of VIGIL, played by its solver. They do not include episodes or houses of the
packs that come with VIGIL.

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
  does not search. `is_privileged` marks these rows, since players could not know that direction. Leave them out, or do
  not count their loss, if a policy should learn from what it sees.
- Thoughts and reports are sentences of a few fixed forms. They use the instruction's names of things. "I see" means
  that at least 40 pixels of a thing are in the frame within 6 m, "I do not see" that none are.
- Every report in an answer is true according to the scoring of VIGIL. {false_reports}
- Pictures are drawn by MuJoCo, quality `{quality}`; another graphics driver may draw other pixels. Everything else
  depends only on the stream's seed, filters and version.
- `demonstrations.json` has all settings.
"""

_CHATS = {
    "tags": "",
    "rows_are": """\
Each row is one request to a model under the profile `{profile}` (prompt `{prompt}`), with the correct answer.""",
    "columns": """\
| `messages` | the chat that a model is sent, and as its last message the correct answer; past pictures are left out, \
as in evaluation |
| `images` | the only picture, that of the part `{{"type": "image"}}`{where} |
| `kind` | `demonstration`, or `correction`: the same request with an additional false report |
| `rejected` | the false report of a correction, to which the answer is preferred |
| `fault` | `premature_success` (the goal does not hold yet), `wrong_state` (the other label), `false_fail` (giving up \
when it is done) |
| `is_privileged` | true if the answer moves towards a thing that no frame so far has shown |
| `id`, `episode_id`, `family`, `difficulty`, `step` | source of the row; ids name the target: never show them to a \
model |""",
    "false_reports": "Every rejected report was also scored, and is false.",
}
_ACTIONS = {
    "tags": "LeRobot, robotics, ",
    "rows_are": """\
Each row is a frame under the profile `{profile}`, with the correct action. The folder is a dataset of the library
LeRobot, format v3.0.""",
    "columns": """\
| `observation.images.ego` | the frame that an agent is sent, (480, 640, 3), in the data file |
| `observation.state` | only in the profile with feedback: `too_far` and `path_blocked` of the action before |
| `action` | eight numbers, named in `meta/info.json` and described below; those that the skill does not use are 0 |
| `thought` | a sentence for the action; for a report, its summary |
| `is_privileged` | true if the action moves towards a thing that no frame so far has shown |
| `next.reward`, `next.done` | 1 and true at the report, which ends the episode and is true; 0 and false before |
| `task_index` | number of the instruction in `meta/tasks.parquet`; LeRobot adds its text as `task` |
| `timestamp`, `frame_index`, `episode_index`, `index` | position of the row; a step counts as a second |

| number of `action` | says |
|---|---|
{words}
| `magnitude` | steps of 0.25 m, or degrees |
| `x`, `y` | the middle of a pixel as a share of the frame: the pixel is the whole part of `x * 640`, `y * 480` |""",
    "false_reports": "There are no corrections,\n  since false reports must not be imitated.",
}


def card_of(facts: Mapping[str, Any], table: str) -> str:
    """Return the text of the README for a folder with these facts; `table` is the path of its rows."""
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
