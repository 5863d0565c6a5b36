"""Rows: each saved run as a flat table of verdicts, with one row per scored episode.

Every row is the result of `vigil.scoring.outcomes.score` for one record; this module adds no decision. Tables are
computed each time and never saved, because nobody could tell which code had made a saved table.
"""

import json
import os
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cache, partial
from pathlib import Path
from typing import cast, get_args

import numpy as np
import pandas as pd

from vigil.analysis.measures.beliefs.study import BeliefStudy, belief_studies
from vigil.analysis.measures.columns import run_columns
from vigil.analysis.measures.labels import RunLabel
from vigil.analysis.measures.models import ModelInfo, agent_of
from vigil.analysis.measures.paper import paper
from vigil.base.processes.group import given_state, map_in_workers
from vigil.errors import SettingError
from vigil.packs.files import Perturbation
from vigil.packs.pack import count_rooms, frozen_episodes, manifest_of
from vigil.packs.private import is_private, redact_ids
from vigil.protocol.families import Family
from vigil.records.probe_file import read_probes
from vigil.records.record import EPISODES_FILE, RunHeader
from vigil.scoring.levels import EpisodeLevel, read_pack_levels
from vigil.scoring.outcomes import REPORT_POLICIES, ActionKind, Outcome, credit
from vigil.scoring.saved_run import read_run
from vigil.scoring.summary import LIBRARY_REPLIES, has_many_errors, repeats

ACTION_KINDS: tuple[ActionKind, ...] = get_args(ActionKind)
_PARALLEL_FROM_BYTES = 64 * 1024 * 1024
_ERROR_COLUMNS = ["episode_id", "epoch", "attempt", "family", "boundary", "message"]
_Row = dict[str, object]


@dataclass(frozen=True)
class Run:
    """One scored run: its episodes as a flat table, and remarks on missing or unusual data."""

    folder: Path
    header: RunHeader
    model: ModelInfo
    rows: pd.DataFrame
    """One row per scored episode, sorted by episode and epoch."""
    errors: pd.DataFrame
    """Rows of episodes that ended as `error`: failures of the infrastructure, which are never scored."""
    planned: Mapping[Family, int]
    """Number of planned plays by family: episodes times epochs."""
    remarks: tuple[str, ...]
    """Caveats that a reader must see before the numbers, e.g. that rows are missing or duplicate."""
    name: str
    """Name of the run, unique in a report."""
    is_private: bool = False
    """Whether the run's pack is private."""
    label: RunLabel | None = None
    """What a study says of the run; None outside a study."""
    perturbation: Perturbation | None = None
    """How the run's pack differs from its original; None unless the pack is a perturbed copy."""
    beliefs: tuple[BeliefStudy, ...] = ()
    """Beliefs from the run's probes, by framing; empty without probes."""

    @property
    def marked_name(self) -> str:
        """The model's name, with the condition in brackets if it is not the default. A run and its repeats share it."""
        profile = self.header.spec.profile
        row = profile.row
        marks = ["+FB"] if profile.has_feedback else [] if row.is_papers else [row.short]
        marks += [] if self.perturbation is None else [f"{self.perturbation.change}, seed {self.perturbation.seed}"]
        source = self.header.spec.fork
        marks += [] if source is None else [f"from {source.run_id} at {source.at}"]
        condition = ", ".join([*marks, *([] if profile.prompt_variant == "default" else [profile.prompt_variant])])
        return f"{self.model.name} [{condition}]" if condition else self.model.name

    @property
    def n(self) -> int:
        """Number of scored episodes."""
        return len(self.rows)

    @property
    def n_planned(self) -> int:
        """Number of planned plays: episodes times epochs."""
        return sum(self.planned.values())

    @property
    def attempts(self) -> tuple[int, ...]:
        """Number of attempts at each episode; episodes that ended as an error are included."""
        return tuple(int(count) for count in (*self.rows["attempt"], *self.errors["attempt"]))

    @property
    def faults(self) -> tuple[str, ...]:
        """The warnings about this run at the top of a report."""
        found = []
        if not self.n:
            found.append("no episode is scored: the run is empty")
        elif self.n < self.n_planned:
            scored = set(self.rows["family"])
            without = [family for family in self.planned if family not in scored]
            none_of = f", none of {', '.join(without)}" if without else ""
            found.append(f"INCOMPLETE: {self.n} of {self.n_planned} episodes are scored{none_of}")
        absent = [family for family in paper().families if family not in self.planned]
        if absent:
            found.append(f"without episodes of {', '.join(absent)}; overall rates are not those of a balanced pack")
        if has_many_errors(len(self.errors), self.n):
            found.append(f"{len(self.errors)} of {self.n + len(self.errors)} episodes ended as errors (more than 1 %)")
        if again := repeats(self.attempts):
            found.append(again)
        return tuple(f"{self.name}: {fault}." for fault in (*found, *self.remarks))


def read_runs(
    folders: Sequence[Path],
    pack: str | Path | None = None,
    *,
    levels: Mapping[str, EpisodeLevel] | None = None,
    labels: Mapping[Path, RunLabel] | None = None,
    on_run: Callable[[int, int], None] = lambda done, total: None,
) -> list[Run]:
    """Return the scored runs in `folders`, sorted by name; the order of the folders does not matter.

    `pack` is the current folder of the runs' pack if it was moved. `levels` replace the levels in the pack's folder.
    `labels` are what a study says of the runs, by resolved folder. `on_run` is called after each run with the number
    of runs read and of all runs. Raises RecordError or PackMismatch.
    """
    unique = sorted({folder.resolve() for folder in folders})
    workers = 2 if sum(map(_file_size, unique)) > _PARALLEL_FROM_BYTES else 1
    runs: list[Run] = []
    for run in map_in_workers(partial(given_state, pack), _read_scored_run, unique, workers):
        runs.append(run)
        on_run(len(runs), len(unique))
    runs = [_labelled(run, (labels or {}).get(run.folder)) for run in runs]
    return _with_unique_names(
        runs if levels is None else [replace(run, rows=_with_levels(run.rows, levels)) for run in runs]
    )


def _labelled(run: Run, label: RunLabel | None) -> Run:
    if label is None:
        return run
    model = replace(run.model, name=label.model, group=label.group or run.model.group)
    return replace(run, label=label, model=model)


def _read_scored_run(pack: str | Path | None, folder: Path) -> Run:
    """Read the records of a run, and return the scored run."""
    run = read_run(folder, pack, _cached_episodes)
    manifest = manifest_of(run.pack_folder)
    if manifest.suite is not None:
        raise SettingError(
            f"Run {run.header.run_id!r} was played on pack {run.header.spec.pack!r} of the suite "
            f"{manifest.suite!r}, but this table is only for episodes of the eight families. `vigil report` shows runs "
            "of the suite in a separate section."
        )
    scores, header = run.table.scores(), run.header
    probes = read_probes(folder, header.sha256)
    model = agent_of(header.spec, has_reasoning=header.has_reasoning)
    table, rooms = outcome_table(scores.outcomes), _cached_room_counts(run.pack_folder)
    table["rooms"] = [rooms.get(house, np.nan) for house in values(table, "house", str)]
    errors = [{name: getattr(error, name) for name in _ERROR_COLUMNS} for error in scores.errors]
    library = f"{scores.library_replies} {LIBRARY_REPLIES}"
    notes = [note.removesuffix(".") for note in (*run.notes, *probes.notes)]  # the full stops are added on printing
    remarks = (*notes, *([library] if scores.library_replies else []))
    hides_ids = is_private(manifest.meta)
    return Run(
        folder=folder,
        header=header,
        model=model,
        rows=_with_levels(table, _cached_levels(run.pack_folder)),
        errors=pd.DataFrame(errors, columns=_ERROR_COLUMNS),
        planned=scores.planned,
        remarks=tuple(redact_ids(remarks, run.table.episodes)) if hides_ids else remarks,
        name=model.name,
        is_private=hides_ids,
        perturbation=manifest.perturbation,
        beliefs=belief_studies(run, probes),
    )


def _with_levels(table: pd.DataFrame, levels: Mapping[str, EpisodeLevel]) -> pd.DataFrame:
    """Return the rows with each episode's level and index; both are empty for an episode that was not measured."""
    found = [levels.get(name) for name in values(table, "episode_id", str)]
    texts = pd.Series([None if one is None else one.level for one in found], dtype=object)
    return table.assign(level=texts, level_index=[np.nan if one is None else one.index for one in found])


def combined_rows(runs: Iterable[Run]) -> pd.DataFrame:
    """Return the rows of all runs in one table; the first columns come from each run's header."""
    found = list(runs)
    headers = [{"run": run.name, "model": run.model.name, **run_columns(run.header)} for run in found]
    tables = [run.rows.assign(**header) for run, header in zip(found, headers, strict=True)]
    whole = pd.concat([table for table in tables if len(table)] or tables[:1], ignore_index=True)
    whole["temperature"] = whole["temperature"].astype("float64")
    first = list(headers[0])
    return whole.reindex(columns=[*first, *(column for column in whole.columns if column not in first)])


def select_rows(rows: pd.DataFrame, mask: np.ndarray) -> pd.DataFrame:
    """Return the rows for which `mask` is true."""
    return cast(pd.DataFrame, rows[mask])


def values(rows: pd.DataFrame, column: str, kind: type = float) -> np.ndarray:
    """Return a column as an array of the type `kind`; missing values are NaN for floats, None for objects."""
    return np.asarray(rows[column], dtype=kind)


def flat_row(outcome: Outcome) -> _Row:
    """Return an outcome as one flat row.

    Each kind of action has a column with its number of actions, and each report policy a column with B under this
    policy. The reasons of invalid actions are one JSON object.
    """
    row: _Row = {}
    for field in fields(outcome):
        value = getattr(outcome, field.name)
        if field.name == "invalid_reasons":
            row[field.name] = json.dumps(value)
        elif isinstance(value, dict):
            row.update({f"{field.name}.{kind}": value[kind] for kind in ACTION_KINDS})
        else:
            row[field.name] = value
    credits = {f"credit.{policy}": credit(outcome, policy) for policy in REPORT_POLICIES}
    return {**row, **credits, "is_reported": outcome.is_reported, "zero_progress": outcome.is_at_zero_progress}


def outcome_table(outcomes: Iterable[Outcome]) -> pd.DataFrame:
    """Return outcomes as a table sorted by episode and epoch; the columns have the types in `_SCHEMA`.

    A missing text is None.
    """
    rows = [flat_row(outcome) for outcome in outcomes]
    table = pd.DataFrame(rows, columns=list(_SCHEMA))
    texts = [name for name, kind in _SCHEMA.items() if kind == "object"]
    table[texts] = table[texts].astype(object).where(table[texts].notna(), None)
    return table.astype(_SCHEMA).sort_values(["episode_id", "epoch"], ignore_index=True)


def _schema() -> dict[str, str]:
    kinds: dict[str, str] = {}
    plain = {"bool": "bool", "int": "int64", "float": "float64"}
    for field in fields(Outcome):
        shown = str(field.type)
        if field.name.startswith("actions"):
            kinds.update({f"{field.name}.{kind}": "int64" for kind in ACTION_KINDS})
        elif "int | None" in shown or "float | None" in shown:
            kinds[field.name] = "float64"
        elif field.type in (bool, int, float):
            kinds[field.name] = plain[field.type.__name__]
        else:
            kinds[field.name] = "object"
    credits = {f"credit.{policy}": "float64" for policy in REPORT_POLICIES}
    of_pack = {"rooms": "float64", "level": "object", "level_index": "float64"}
    return {**kinds, **credits, "is_reported": "bool", "zero_progress": "bool", **of_pack}


_SCHEMA = _schema()


_cached_episodes = cache(frozen_episodes)
"""Function that returns a pack's episodes and caches them, because many runs of a report have the same pack."""
_cached_room_counts, _cached_levels = cache(count_rooms), cache(read_pack_levels)


def _file_size(folder: Path) -> int:
    file = folder / EPISODES_FILE
    return file.stat().st_size if file.is_file() else 0


def _with_unique_names(runs: Iterable[Run]) -> list[Run]:
    """Return the runs with unique names, sorted by name.

    A name is the model's name and, if several runs have that model, what distinguishes the run. A custom prompt is
    always in the name.
    """
    found = list(runs)
    models = Counter(run.model.name for run in found)
    names = [
        run.label.name
        if run.label is not None
        else run.marked_name
        if models[run.model.name] > 1 or run.header.spec.profile.has_custom_prompt
        else run.model.name
        for run in found
    ]
    above = Path(os.path.commonpath([run.folder for run in found] or [""]))
    for more in ([run.header.run_id for run in found], [str(run.folder.relative_to(above)) for run in found]):
        name_counts = Counter(name for name, _ in set(zip(names, more, strict=True)))
        names = [
            f"{name} · {extra}" if name_counts[name] > 1 else name for name, extra in zip(names, more, strict=True)
        ]
    named = [replace(run, name=name) for run, name in zip(found, names, strict=True)]
    return sorted(named, key=lambda run: run.name)
