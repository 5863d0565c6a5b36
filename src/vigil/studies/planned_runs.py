"""Planned runs: the runs that a study's file asks for, each with its settings, its folder and its label."""

import json
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from vigil.analysis.measures.labels import RunLabel
from vigil.analysis.measures.paper import paper
from vigil.base.json_files import is_object
from vigil.base.settings import DeclaredSetting, declared_settings
from vigil.errors import SettingError, VigilError, did_you_mean
from vigil.records.record import EPISODES_FILE, Shard
from vigil.runner.settings import RunSettings
from vigil.scoring.saved_run import SavedRun, read_run
from vigil.studies.study_file import StudyModel, StudySource
from vigil.studies.yaml_text import Place

_OWN = frozenset({"agent", "model", "log_dir", "shard"})
"""Settings that a study's file must not set, because the study decides them."""
PARTS_FOLDER = "parts"
"""Name of the folder, inside the study's folder, for the parts of runs that several machines play."""


@dataclass(frozen=True, slots=True)
class PlannedRun:
    """One run that a study's file asks for, with its settings, label and folders."""

    settings: RunSettings
    """Settings of the whole run, without `shard`; `log_dir` is the run's folder."""
    label: RunLabel
    condition: str
    parts: Path
    """Folder of the run's parts, each of which has its own folder, such as `2-of-8`."""

    @property
    def folder(self) -> Path:
        """Folder of the run."""
        assert self.settings.log_dir is not None
        return self.settings.log_dir

    def part_folder(self, shard: Shard) -> Path:
        """Return the folder of one part of the run."""
        return self.parts / f"{shard.index}-of-{shard.of}"

    def saved(self) -> SavedRun | None:
        """Return the run with everything that was played so far; None if nothing was played. Raises RecordError or
        PackMismatch."""
        return read_run(self.folder, self.settings.pack) if (self.folder / EPISODES_FILE).exists() else None


def planned_runs(source: StudySource) -> list[PlannedRun]:
    """Return the runs of a study: the models in the order of the file, and for each model first its main run.

    Raises SettingError that names the line of an unknown setting or an invalid value.
    """
    return [run for index, model in enumerate(source.study.models) for run in _runs_of(source, index, model)]


def selected_runs(runs: Iterable[PlannedRun], models: Iterable[str], conditions: Iterable[str]) -> list[PlannedRun]:
    """Return the runs of the named models and conditions. An empty list selects all. Raises SettingError."""
    found = list(runs)
    wanted = {
        "model": (list(models), lambda run: run.label.model),
        "condition": (list(conditions), lambda run: run.condition),
    }
    for what, (names, name_of) in wanted.items():
        known = list(dict.fromkeys(map(name_of, found)))
        for name in names:
            if name not in known:
                raise SettingError(
                    f"The study has no {what} {name!r}.{did_you_mean(name, known)} Its {what}s: {', '.join(known)}."
                )
        found = [run for run in found if not names or name_of(run) in names]
    return found


def labels_of(runs: Iterable[PlannedRun]) -> dict[Path, RunLabel]:
    """Return {folder of a run: the run's label in the study}."""
    return {run.folder.resolve(): run.label for run in runs}


def _runs_of(source: StudySource, index: int, model: StudyModel) -> Iterator[PlannedRun]:
    study = source.study
    main = model.main or study.main_condition
    played = list(study.conditions) if model.conditions is None else list(model.conditions)
    names = {one.name for one in paper().models}
    folder = _folder_name(model.name)
    for condition in sorted(played, key=lambda name: name != main):
        settings = _settings(source, index, condition)
        for repeat in range(1, 1 + (model.repeats if condition == main else 1)):
            mark = "" if condition == main and repeat == 1 else f"repeat {repeat}" if condition == main else condition
            label = RunLabel(
                model=model.name,
                role="condition" if condition != main else "main" if repeat == 1 else "repeat",
                mark=mark,
                group=model.group,
                panel=model.panel,
                is_anchor=model.anchor,
                published=model.published or (model.name if model.name in names else None),
            )
            own = f"{condition}-{repeat}" if repeat > 1 else condition
            place = study.place / "runs" / folder / own
            chosen = _checked(source, index, {**settings, "log_dir": place})
            yield PlannedRun(chosen, label, condition, study.place / PARTS_FOLDER / folder / own)


def _folder_name(name: str) -> str:
    return re.sub(r"[^A-Za-z0-9._]+", "-", name).strip("-.") or "model"


def _settings(source: StudySource, index: int, condition: str) -> dict[str, Any]:
    """Return {name in Python: value} for the settings of a model's run under a condition."""
    study, model = source.study, source.study.models[index]
    found: dict[str, Any] = {"agent": model.agent, "model": model.model}
    for place, given in (
        (("settings",), study.settings),
        (("conditions", condition), study.conditions[condition]),
        (("models", index, "settings"), model.settings),
    ):
        found |= dict(_values(source, place, given))
    return found


def _values(source: StudySource, place: Place, given: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield the name in Python and the value of each setting in `given`."""
    declared = {one.option: one for one in declared_settings(RunSettings) if one.name not in _OWN}
    declared |= {one.name: one for one in declared.values()}
    for name, value in given.items():
        if name not in declared:
            known = sorted({one.option for one in declared.values()})
            raise source.text.error(
                (*place, name), f"{name!r} is not a setting of `vigil run`.{did_you_mean(name, known)}"
            )
        try:
            yield declared[name].name, _value(declared[name], value)
        except (VigilError, ValueError) as error:
            raise source.text.error((*place, name), str(error)) from None


def _value(one: DeclaredSetting, value: Any) -> Any:
    """Return a setting's value from a value in the file, which is parsed like an option's text on the command line."""
    if one.setting.read is not None:
        texts = [_text(each) for each in (value if isinstance(value, list) else [value])]
        if one.setting.repeats:
            pairs = [f"{key}={_text(each)}" for key, each in value.items()] if is_object(value) else texts
            return one.value(pairs)
        return one.value(texts[0] if len(texts) == 1 else "")
    try:
        return TypeAdapter(one.kind).validate_python(value)
    except ValidationError as error:
        raise SettingError(f"{error.errors()[0]['msg']}, not {value!r}.") from None


def _text(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value)


def _checked(source: StudySource, index: int, values: Mapping[str, Any]) -> RunSettings:
    """Return the settings of a run. Raises SettingError that names the line of the model."""
    try:
        return RunSettings(**values)
    except SettingError as error:
        raise source.text.error(("models", index), str(error)) from None
