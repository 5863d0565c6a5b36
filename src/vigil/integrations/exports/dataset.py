"""Export of runs as a folder that `datasets.load_dataset` loads: a table of episodes, a table of steps, and a card."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path

from vigil.analysis.measures.columns import COLUMNS, without_answer_key
from vigil.analysis.measures.rows import Run, combined_rows
from vigil.errors import SettingError
from vigil.integrations.exports.options import NO_DISCLOSURE, Disclosure
from vigil.integrations.exports.steps import columns_with, has_frames, write_steps
from vigil.packs.private import check_revealed
from vigil.scoring.saved_run import read_run

CARD = "README.md"
EPISODES, STEPS = "episodes.parquet", "steps"
_CARD_HEAD = f"""---
pretty_name: VIGIL, replies and verdicts
# license: who publishes this folder says here under which terms
tags:
- embodied-agents
- evaluation
- vigil
configs:
- config_name: episodes
  default: true
  data_files: {EPISODES}
- config_name: steps
  data_files: {STEPS}/*.parquet
---
# VIGIL: replies and verdicts

Agents played episodes in furnished houses only from egocentric RGB frames, and closed each with a report of their own.
W says that the world reached the goal; B that it did, and the report matches. FR: a report that does not match. NR: no
report. IL: too many invalid replies.

```python
from datasets import load_dataset

episodes = load_dataset("FOLDER", "episodes", split="train")
steps = load_dataset("FOLDER", "steps", split="train")
```
"""
_CARD_TAIL = """
## What is not here
Hidden state (where objects were, what each action did to them, the goals) is left out: it is the answer key of the
pack, and published data ends up in training data. The folders of the runs contain the hidden state. Addresses and keys
of servers are left out, too.
{answer_key}

Episodes that a failure of the infrastructure ended are not scored, and are left out.

## Licence and citation
Not stated yet. The replies come from models, and the providers of these models may have their own terms. The frames
show the houses of the packs.
"""


_WITHOUT_ANSWER_KEY = (
    "These columns of `episodes` are left out, too: `target`, `distance_m`, `expected`, `first_goal_step`, `lag`,\n"
    "`lag_from_reset` and `actions_after_goal.KIND`. For a question about a state (SV), a report with B "
    "reveals the label."
)
_WITH_ANSWER_KEY = (
    "**The answer key is here in part**: the columns `target`, `distance_m`, `expected`, `first_goal_step`, `lag`,\n"
    "`lag_from_reset` and `actions_after_goal.KIND` are included, because `--answer-key` was given."
)


def write_dataset(
    runs: Sequence[Run],
    pack: str | Path | None,
    out: Path,
    disclosure: Disclosure = NO_DISCLOSURE,
    *,
    with_reasoning: bool = False,
) -> Path:
    """Write runs into `out`, a new or empty folder, and return the path of the card.

    `pack` is the current folder of the runs' pack. Stored reasoning is included only if `with_reasoning` is True.

    Raises SettingError (also if the pack is private and may not be revealed), RecordError or PackMismatch.
    """
    check_rows(runs, disclosure)
    if out.exists() and any(out.iterdir()):
        raise SettingError(f"Folder {str(out)!r} is not empty; export into a new one.")
    saved = [read_run(run.folder, pack) for run in runs]
    extra = {"image"} if any(map(has_frames, saved)) else set[str]()
    if with_reasoning:
        extra.add("reasoning")
    (out / STEPS).mkdir(parents=True, exist_ok=True)
    rows = combined_rows(runs)
    shown = list(rows.columns) if disclosure.answer_key else without_answer_key(rows.columns)
    rows.reindex(columns=shown).to_parquet(out / EPISODES, index=False)
    for number, (run, records) in enumerate(zip(runs, saved, strict=True)):
        write_steps(records, run.name, out / STEPS / f"{number:04}.parquet", extra)
    (out / CARD).write_text(_card(runs, extra, has_key=disclosure.answer_key), encoding="utf-8")
    return out / CARD


def check_rows(runs: Iterable[Run], disclosure: Disclosure) -> None:
    """Raise SettingError if the rows of a run would reveal a private pack, and `disclosure` does not allow this."""
    for run in runs:
        what = "A row for each episode, with its id, its house and what was said,"
        check_revealed(run.header.spec.pack, run.is_private, what, reveals=disclosure.reveal_private_pack)


def _card(runs: Sequence[Run], extra: Collection[str], *, has_key: bool) -> str:
    steps = {name: says for name, (_, says) in columns_with(extra).items()}
    parts = [_CARD_HEAD, "## Runs", *map(_run_description, runs), ""]
    if faults := [f"- {fault}" for run in runs for fault in run.faults]:
        parts += ["## What is missing or unusual", *faults, ""]
    columns = {name: COLUMNS[name] for name in (COLUMNS if has_key else without_answer_key(COLUMNS))}
    parts += ["## `episodes`: one row per episode", *_column_list(columns), ""]
    tail = _CARD_TAIL.format(answer_key=_WITH_ANSWER_KEY if has_key else _WITHOUT_ANSWER_KEY)
    parts += ["## `steps`: one row per reply", *_column_list(steps), tail]
    return "\n".join(parts)


def _run_description(run: Run) -> str:
    spec = run.header.spec
    names = ("W", "B") if spec.profile.row.has_report else ("W",)
    rates = ", ".join(f"{name} {100 * run.rows[name].mean():.1f} %" for name in names) if run.n else "no rates"
    agent = " ".join(spec.agent.split())
    return (
        f"- `{run.name}`: agent `{agent}`, pack `{spec.pack}` (SHA-256 {spec.pack_sha256[:12]}...), "
        f"{run.n} of {run.n_planned} episodes scored, {rates}"
    )


def _column_list(columns: Mapping[str, str]) -> list[str]:
    return [f"- `{name}`: {says}" for name, says in columns.items()]
