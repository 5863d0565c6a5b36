"""Study file: models, conditions and repeats of an evaluation, as a person writes them in YAML.

A setting is any option of `vigil run`, without its dashes. A value given for a model overrides the value given for its
condition, and this overrides the value given for the whole study.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, StringConstraints, ValidationError

from vigil.analysis.measures.labels import StudyPanel
from vigil.analysis.measures.paper import paper
from vigil.errors import did_you_mean
from vigil.studies.yaml_text import Place, YamlText, read_yaml

MAX_REPEATS = 20
Name = Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$", max_length=60)]
"""Name that can also be the name of a folder: it has only letters, digits, `.`, `_` and `-`."""
ShownName = Annotated[str, StringConstraints(pattern=r"^\S(?:[^\n\[\]]*\S)?$", max_length=80)]
Settings = Annotated[dict[str, Any], BeforeValidator(lambda given: {} if given is None else given)]
"""Settings of `vigil run` by name. In YAML, a key with nothing after the colon means no settings."""


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class StudyModel(_Part):
    """A model or scripted agent of a study, with its conditions, repeats and place in tables."""

    name: ShownName
    """Name that tables and figures show."""
    model: str | None = None
    """Model as `provider/model`. Exactly one of `model` and `agent` must be set."""
    agent: str | None = None
    group: str | None = None
    """Heading above the model's rows in tables; by default the paper's group, which follows from the model's name."""
    panel: StudyPanel | None = None
    """Panel (group of rows in tables) of the model's main run; by default, the panel follows from the rule of exclusion
    in the glossary."""
    anchor: bool = False
    """Whether the model is shown in figures that show only a few models."""
    published: str | None = None
    """Name of the same model in the paper; by default the paper's model with an equal name, if there is one."""
    conditions: tuple[str, ...] | None = None
    """Conditions under which the model plays; by default all conditions of the study."""
    main: str | None = None
    """Condition of the model's main run; by default the study's `main`."""
    repeats: int = Field(default=1, ge=1, le=MAX_REPEATS)
    """Number of runs under the main condition, including the main run."""
    settings: Settings = {}


class StudyFile(_Part):
    """The content of a study's file: models, conditions, and settings of the runs."""

    name: Name
    folder: Path | None = None
    """Folder for the runs and the report; `runs/NAME` by default, where NAME is the study's name."""
    main: str | None = None
    """Condition of the models' main runs; by default the first condition."""
    settings: Settings = {}
    """Settings of every run, such as `pack`."""
    conditions: dict[Name, Settings] = Field(min_length=1)
    models: tuple[StudyModel, ...] = Field(min_length=1)
    episodes: tuple[str, ...] = ()
    """Episodes whose trajectories the report shows; by default one episode of SV and one of AI."""
    call_seconds: float = Field(default=5.0, gt=0, le=3600)
    """Time in seconds that a dry run assumes for each call of a model."""

    @property
    def place(self) -> Path:
        """Folder of the study's runs and report."""
        return self.folder or Path("runs") / self.name

    @property
    def main_condition(self) -> str:
        """Condition of the main runs of models that do not set their own `main`."""
        return self.main or next(iter(self.conditions))


@dataclass(frozen=True)
class StudySource:
    """A study, with the line of each key in its file."""

    study: StudyFile
    text: YamlText


def read_study(path: Path) -> StudySource:
    """Return the study in a file. Raises SettingError that names the line and the key."""
    text = read_yaml(path)
    if not isinstance(text.value, dict):
        raise text.error((), "a study must consist of keys with values, such as `name: my_study`.")
    try:
        study = StudyFile.model_validate(text.value)
    except ValidationError as error:
        raise _as_setting_error(text, error) from None
    source = StudySource(study, text)
    _check_names(source)
    return source


def _as_setting_error(text: YamlText, error: ValidationError) -> Exception:
    faults = error.errors()
    first = next((fault for fault in faults if fault["type"] == "extra_forbidden"), faults[0])
    place: Place = tuple(part for part in first["loc"] if part != "[key]")
    if first["type"] == "extra_forbidden":
        kind = StudyModel if place[0] == "models" else StudyFile
        hint = did_you_mean(str(place[-1]), kind.model_fields)
        return text.error(place, f"this key does not exist.{hint} Known: {', '.join(kind.model_fields)}.")
    if first["type"] == "missing":
        return text.error(place[:-1], f"the key `{place[-1]}` is missing. Add it.")
    return text.error(place, f"{first['msg']}, not {first['input']!r}.")


def _check_names(source: StudySource) -> None:
    """Raise SettingError if two models have the same name, or an entry names an unknown condition or paper model."""
    study, text = source.study, source.text
    conditions = list(study.conditions)
    if study.main is not None and study.main not in study.conditions:
        raise text.error(("main",), _unknown("condition", study.main, conditions))
    seen: dict[str, int] = {}
    for index, model in enumerate(study.models):
        here: Place = ("models", index)
        if model.name.casefold() in seen:
            raise text.error(
                (*here, "name"),
                f"the name {model.name!r} is also that of models[{seen[model.name.casefold()] + 1}]. Change one name.",
            )
        seen[model.name.casefold()] = index
        if (model.model is None) == (model.agent is None):
            raise text.error(here, "give exactly one of `model` and `agent`.")
        for place, name in enumerate(model.conditions or ()):
            if name not in study.conditions:
                raise text.error((*here, "conditions", place), _unknown("condition", name, conditions))
        played = model.conditions if model.conditions is not None else conditions
        main = model.main or study.main_condition
        if main not in played:
            raise text.error(
                (*here, "main" if model.main else "conditions"), _unknown("condition of its main run", main, played)
            )
        names = [each.name for each in paper().models]
        if model.published is not None and model.published not in names:
            raise text.error((*here, "published"), _unknown("published model", model.published, names))


def _unknown(what: str, name: str, known: Any) -> str:
    return f"{name!r} is not a {what}.{did_you_mean(name, known)} Known: {', '.join(known)}."
