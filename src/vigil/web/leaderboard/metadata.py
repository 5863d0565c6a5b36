"""Metadata of an entry: what its submitter states, and the check that the run's header agrees with it."""

import re
import unicodedata
from collections.abc import Iterator
from datetime import date
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, StringConstraints, ValidationError, create_model

from vigil.errors import SettingError, did_you_mean
from vigil.records.record import RunHeader
from vigil.studies.yaml_text import YamlText, place_text, read_yaml

Tier = Literal["self_reported", "re_simulated", "fresh_pack", "hosted", "maintainer_run"]
"""How far an entry can be trusted, from the least to the most; entries are ranked within their tier."""
TIERS: tuple[Tier, ...] = get_args(Tier)
Division = Literal["standard", "custom", "trained on streams", "baseline"]
"""Group of entries that are ranked together. Scripted agents, agents that see hidden state and people are baselines."""
MAX_PLAYS_OF_AN_EPISODE = 32
"""Maximum number of plays of one episode in an entry. It limits how long the check of an entry takes."""
MAX_NAME_CHARS = 300


_BLANK = re.compile("[\u034f\u115f\u1160\u17b4\u17b5\u180b-\u180f\u2800\u3164\ufe00-\ufe0f\uffa0\U000e0100-\U000e01ef]")
"""Characters that show nothing, although Unicode counts them as letters, marks or symbols."""
MAX_MARKS = 3
"""Maximum number of marks on one letter; more of them cover the lines above and below."""


def _plain(text: str) -> str:
    if not text.replace("\n", "").isprintable() or _BLANK.search(text):
        raise ValueError("the text contains a control character or an invisible character; remove it")
    if set("<>") & set(text):
        raise ValueError("the text contains < or >; remove these characters")
    kinds = "".join("m" if unicodedata.category(letter) in ("Mn", "Me") else "-" for letter in text)
    if "m" * (MAX_MARKS + 1) in kinds:
        raise ValueError(f"a letter has more than {MAX_MARKS} marks; remove some of them")
    return text


def _of_one_alphabet(text: str) -> str:
    """Return a name; raise ValueError if a word mixes Latin letters with letters that look like them."""
    for word in re.findall(r"[^\W\d_]+", text):
        alphabets = {unicodedata.name(letter, "").partition(" ")[0] for letter in word}
        if "LATIN" in alphabets and alphabets & _LIKE_LATIN:
            raise ValueError(
                f"the word {word!a} mixes Latin letters with letters that look like them; use one alphabet"
            )
    return text


_LIKE_LATIN = {"ARMENIAN", "CHEROKEE", "COPTIC", "CYRILLIC", "GREEK", "LISU"}
Line = Annotated[
    str,
    StringConstraints(min_length=1, max_length=100, pattern=r"^[^\n]+$", strip_whitespace=True),
    AfterValidator(_plain),
    AfterValidator(_of_one_alphabet),
]
Link = Annotated[str, StringConstraints(max_length=300, pattern=r"^https://[A-Za-z0-9.-]+(/[^\s\"'<>\\]*)?$")]


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class StatedFacts(_Part):
    """Facts about the run that the submitter states; the run's header must agree with them."""

    modified_prompts: bool = Field(description="true if the prompt is not one of VIGIL's")
    omitted_questions: bool = Field(description="true if episodes were left out")


class Methodology(_Part):
    """How the run was made."""

    evaluation_date: date = Field(description="day of the run, as 2026-01-31")
    notes: Annotated[str, StringConstraints(max_length=2000), AfterValidator(_plain)] = Field(
        description="anything that a reader should know, such as hardware or a wrapper around the model"
    )
    verification: StatedFacts


class EntryMetadata(_Part):
    """What a submitter states about an entry. Facts that the run's header records are not repeated here."""

    model_name: Line = Field(description="name of the model or agent")
    model_organization: Line = Field(description="who made the model")
    submitting_organization: Line = Field(description="who submits the entry")
    submission_date: date = Field(description="day of submission, as 2026-01-31")
    submission_type: Literal["standard", "custom"] = Field(
        description="standard: a model with VIGIL's prompt and client; custom: anything else"
    )
    contact_info: Line = Field(description="address for questions; it is published")
    references: tuple[Link, ...] = Field(max_length=10, description="https links to a paper, a model card or code")
    model_release: date | None = Field(
        description="day on which the model was released; null if the agent is not a model"
    )
    weights: Literal["open", "closed", "none"] = Field(description="open or closed weights; none for a program")
    trained_on_streams: bool = Field(description="true if the model was trained on VIGIL's episodes or streams")
    tier: Tier = Field(description=f"one of {', '.join(TIERS)}")
    methodology: Methodology


def read_metadata(path: Path) -> EntryMetadata:
    """Return the metadata in a YAML file. Raises SettingError that names the line, and lists all missing values."""
    if not path.is_file():
        raise SettingError(
            f"{str(path)!r} does not exist. Write the entry's metadata to this file; docs/leaderboard.md shows an "
            f"example. {needed_values()}"
        )
    text = read_yaml(path)
    try:
        return EntryMetadata.model_validate(text.value)
    except ValidationError as error:
        raise _readable(text, error) from None


def _readable(text: YamlText, error: ValidationError) -> SettingError:
    faults = error.errors()
    known = dict(fields_of(EntryMetadata))
    missing = [place_text(fault["loc"]) for fault in faults if fault["type"] == "missing"]
    listed = [f"`{name}` ({known.get(name, 'a group of keys')})" for name in missing]
    if unknown := [fault for fault in faults if fault["type"] == "extra_forbidden"]:
        place = place_text(unknown[0]["loc"])
        return text.error(unknown[0]["loc"], f"this key does not exist.{did_you_mean(place, known)}")
    if listed:
        return text.error((), f"the metadata is incomplete. Missing: {'; '.join(listed)}.")
    return text.error(faults[0]["loc"], f"{reason(error)}.")


def reason(error: ValidationError) -> str:
    """Return why the first invalid value is invalid, without its place."""
    return error.errors()[0]["msg"].removeprefix("Value error, ")


def fields_of(kind: type[BaseModel], above: str = "") -> Iterator[tuple[str, str]]:
    """Yield the path of each value of the metadata, such as `methodology.notes`, with its description."""
    for name, field in kind.model_fields.items():
        inner: Any = field.annotation
        if isinstance(inner, type) and issubclass(inner, BaseModel):
            yield from fields_of(inner, f"{above}{name}.")
        else:
            yield above + name, field.description or ""


def needed_values() -> str:
    """Return a sentence that lists all values of the metadata."""
    return f"It needs {'; '.join(f'`{place}` ({said})' for place, said in fields_of(EntryMetadata))}."


def check_value(place: str, value: object) -> None:
    """Raise ValueError unless a value is valid at its path, such as `methodology.notes`."""
    *above, name = place.split(".")
    kind: Any = EntryMetadata
    for part in above:
        kind = kind.model_fields[part].annotation
    field = kind.model_fields[name]
    create_model("Value", value=(field.annotation, field)).model_validate({"value": value})


def division_of(header: RunHeader, metadata: EntryMetadata) -> Division:
    """Return the division in which an entry is ranked."""
    if header.spec.agent_kind in ("scripted", "privileged", "human"):
        return "baseline"
    return "trained on streams" if metadata.trained_on_streams else metadata.submission_type


def reasons_against(header: RunHeader, metadata: EntryMetadata) -> Iterator[str]:
    """Yield each reason why a run cannot be an entry, or contradicts its metadata."""
    spec, stated = header.spec, metadata.methodology.verification
    has_own_prompt = spec.profile.has_custom_prompt
    if stated.modified_prompts != has_own_prompt:
        yield f"`modified_prompts` is {stated.modified_prompts}, but the prompt is {spec.profile.prompt_variant!r}"
    if stated.omitted_questions:
        yield "`omitted_questions` is true, but an entry plays every episode of its pack"
    if metadata.submission_type == "standard" and (has_own_prompt or spec.agent_kind != "model"):
        yield (
            f"`submission_type` is standard, but the agent is of the kind {spec.agent_kind!r} with prompt "
            f"{spec.profile.prompt_variant!r}, so it must be custom"
        )
    if max(len(spec.agent), len(header.run_id)) > MAX_NAME_CHARS:
        yield f"the name of its agent or run has more than {MAX_NAME_CHARS} characters"
    if spec.shard is not None:
        yield f"it is shard {spec.shard} of a run; `vigil merge` joins the shards"
    if spec.fork is not None:
        yield "it continues plays of another run"
    if spec.epochs > MAX_PLAYS_OF_AN_EPISODE:
        yield f"it plays each episode {spec.epochs} times, and at most {MAX_PLAYS_OF_AN_EPISODE} are checked"
    if spec.simulator != "mujoco" and metadata.tier != "self_reported":
        yield f"runs on the simulator {spec.simulator!r} are not played again here, so its tier must be self_reported"
    if spec.simulator not in ("mujoco", "thor"):
        yield f"the simulator {spec.simulator!r} does not belong to the benchmark"
    yield from spec.versions.differences()
    yield from (f"its pack was made under {each}" for each in spec.pack_versions.differences())
