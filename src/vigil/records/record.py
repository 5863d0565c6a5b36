"""Records: what happened in an episode and under which settings, as facts on disk.

Verdicts (W, B, labels) are never stored here: `vigil.scoring.outcomes` computes them. Source: `protocol.md` section 7.
"""

import hashlib
from collections.abc import Iterable, Iterator
from datetime import datetime
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from vigil import __version__
from vigil.base.files import read_file, resolve_inside
from vigil.base.json_files import read_json
from vigil.base.versions import PackVersions, Versions, schema_mismatch
from vigil.errors import MAX_PART_CHARS, RecordError, first_error, shorten
from vigil.protocol.actions import Action, InvalidAction, Reply
from vigil.protocol.house import canonical_json
from vigil.protocol.observation import Quality
from vigil.protocol.profile import Profile
from vigil.protocol.reasoning import Thinking
from vigil.protocol.world import Effect, WorldState
from vigil.records.costs import Prices, Tokens

SCHEMA_VERSION = 2
"""Of rows and headers; no other is read. It is raised by one when a field changes its meaning, its unit or its name, or
goes away, so that an older reader would misunderstand a row; a new field with a default, which leaves old rows as they
are, does not raise it. Any other is refused with what to do. `tests/release/test_old_files.py` guards it."""
MAX_EPOCHS = 10_000
"""Plays of one episode, each of which is planned beforehand."""
EPISODES_FILE = "episodes.jsonl"
HEADER_FILE = "run.json"
FRAMES_FOLDER = "frames"

End = Literal["report", "fail_no_report", "invalid_action_limit_exceeded", "error"]
Boundary = Literal["simulator", "model", "agent", "worker", "runner"]
AgentKind = Literal["scripted", "privileged", "model", "exec", "human"]
Key = tuple[str, int]


class _Record(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class StepRecord(_Record):
    """One reply and what it did. Exactly one of `action` and `invalid` is set."""

    index: int = Field(ge=1)
    """1 for the first reply."""
    frame_sha256: str | None = Field(default=None, pattern=r"^[0-9a-f]{64}$")
    """SHA-256 of the RGB bytes that the reply answered; None when nobody looked at the frame."""
    reply: Reply
    history_cut: bool = False
    """The reply was longer than what enters the dialogue history."""
    action: Action | None = None
    invalid: InvalidAction | None = None
    ignored_keys: tuple[str, ...] = ()
    effect: Effect | None = None
    """Hidden; None for reports and invalid actions."""
    world: WorldState
    """Hidden: the agent and the bound objects after the step."""

    @model_validator(mode="after")
    def _is_action_or_invalid(self) -> "StepRecord":
        if (self.action is None) == (self.invalid is None):
            raise ValueError("a step has either an action or the reason why there is none")
        return self


class ErrorFact(_Record):
    """An infrastructure failure: where it came from and what it said."""

    boundary: Boundary
    message: str


class EpisodeRecord(_Record):
    """One attempt at one episode."""

    schema_version: int = SCHEMA_VERSION
    versions: Versions = Versions()
    """Under which it was played."""
    run_id: str
    run_sha256: str = ""
    """Of the very run that it is a row of (`RunHeader.sha256`); empty for a record outside of one."""
    episode_id: str
    epoch: int = Field(default=1, ge=1)
    attempt: int = Field(default=1, ge=1)
    prompt_sha256: str = ""
    """SHA-256 of the rendered system prompt, instruction filled in."""
    started: datetime
    ended: datetime
    initial: WorldState | None
    """The world after the reset; None only when the simulator failed before it."""
    steps: tuple[StepRecord, ...]
    end: End
    error: ErrorFact | None = None

    @model_validator(mode="after")
    def _is_consistent(self) -> "EpisodeRecord":
        if (self.end == "error") != (self.error is not None):
            raise ValueError("`error` belongs to an end by error, and such an end needs it")
        if self.initial is None and self.end != "error":
            raise ValueError("only an error can end an episode before its reset")
        if [step.index for step in self.steps] != list(range(1, len(self.steps) + 1)):
            raise ValueError("steps are numbered 1, 2, 3 ... without a gap")
        return self

    @property
    def key(self) -> Key:
        """What identifies an episode within a run."""
        return self.episode_id, self.epoch

    @property
    def tokens(self) -> Tokens:
        """What its replies took."""
        return Tokens.of(step.reply.usage for step in self.steps)

    @property
    def worlds(self) -> tuple[WorldState, ...]:
        """The world at the reset and after every step. Raises RecordError when there was no reset."""
        if self.initial is None:
            raise RecordError(f"Record of episode {self.episode_id!r} has no initial world: it ended as an error.")
        return (self.initial, *(step.world for step in self.steps))


class Shard(_Record):
    """One of the parts of a run that are played apart from one another; `vigil.records.shards` says what is in it."""

    index: int = Field(ge=1)
    """1 for the first."""
    of: int = Field(ge=1)
    """How many there are."""

    @model_validator(mode="after")
    def _is_within_count(self) -> "Shard":
        if self.index > self.of:
            raise ValueError("a shard's index is at most the number of shards")
        return self

    def __str__(self) -> str:
        return f"{self.index}/{self.of}"


class RunSpec(_Record):
    """What a run is: two runs with equal specs may share a folder; a resumed run must have the same."""

    agent: str
    """Name of a scripted agent, `exec:COMMAND`, or `provider/model`."""
    agent_kind: AgentKind
    agent_files: dict[str, str] = Field(default_factory=dict)
    """Of `exec:COMMAND`: SHA-256 of the program and of the code that the command names, by file name."""
    keep_program: bool | None = None
    """Of `exec:COMMAND`: whether one process and folder play all episodes of a worker; None where nobody noted it."""
    beat_seconds: float | None = None
    """Of `exec:COMMAND`: frames are handed over whole numbers of these after the reply; 0 or None: when ready."""
    base_url: str | None = None
    sampling: dict[str, Any] = Field(default_factory=dict)
    """Only what the user set: temperature, top_p, max_tokens, reasoning_effort, extra_body ..."""
    thinking: Thinking = "default"
    """As the user set it; what was sent for it is in `sampling`."""
    model_args: dict[str, Any] = Field(default_factory=dict)
    profile: Profile = Field(default_factory=Profile)
    versions: Versions = Versions()
    """Of the package that plays it."""
    prompt_policy: str
    """The policy's version string."""
    prompt_policy_sha256: str
    pack: str
    pack_sha256: str
    pack_versions: PackVersions = PackVersions()
    """Under which the pack was made."""
    episode_ids: tuple[str, ...]
    """The episodes to play, sorted; of a shard's run, those of all shards."""
    shard: Shard | None = None
    """The part of them that is played here; None for all."""
    epochs: int = Field(default=1, ge=1, le=MAX_EPOCHS)
    seed: int = 0
    """For scheduling and scripted agents only."""
    simulator: str = "mujoco"
    """Backend as named on the command line."""
    asset_database_sha256: str | None = None
    """Of the file with the sizes of THOR's assets; None when the project's own sizes are used."""
    render_quality: Quality = "default"

    @property
    def name_suffix(self) -> str:
        """What stands behind the agent's name in every table: that it could know more than its frames tell."""
        if self.agent_kind == "privileged":
            return " (privileged)"
        return " (program kept)" if self.agent_kind == "exec" and self.keep_program is not False else ""

    @property
    def program_notes(self) -> tuple[str, ...]:
        """What a reader must know of a program that could learn more than its frames tell."""
        notes: list[str] = []
        if self.agent_kind == "exec" and self.keep_program is not False:
            notes.append(
                "Its program and the program's folder lived on from episode to episode, as with --keep-program: it "
                "could remember the other side of a pair, and an episode's earlier epochs."
            )
        if self.agent_kind == "exec" and not self.beat_seconds:
            notes.append(
                "Its program was handed frames as soon as they were ready, as with --beat-seconds 0: the time could "
                "tell whether an act was carried out."
            )
        return tuple(notes)

    @property
    def sha256(self) -> str:
        """The hash of all that may not change in its folder: not address, program and number of episodes.

        What is as by default is left out, so that a later vigil with more settings finds the same hash.
        """
        same = self.model_dump(mode="json", exclude={"base_url", "agent_files", "episode_ids"}, exclude_defaults=True)
        return hashlib.sha256(canonical_json(same)).hexdigest()

    @property
    def settings(self) -> dict[str, Any]:
        """All settings by their place, e.g. `profile.coordinates`; a list is a tuple."""
        return dict(_flatten("", self.model_dump(mode="json")))


class ProviderFacts(_Record):
    """What a model's provider said about itself in its answers, those to the check before the run among them."""

    replies: int = 0
    models: dict[str, int] = Field(default_factory=dict)
    """Names in the answers, with the number of replies: what an alias stood for."""
    finish_reasons: dict[str, int] = Field(default_factory=dict)
    addresses: tuple[str, ...] = ()
    """Where requests went, without logins and queries."""
    thinking: Literal["on", "off", "unknown"] = "unknown"
    """On when reasoning came, whatever was set; else as it was set."""
    thinking_set_by: str = ""
    """What was sent for it; empty when nothing was."""
    replies_with_reasoning: int = 0
    check: dict[str, str] = Field(default_factory=dict)
    """The check before the run by its parts (`sight`, `contract`): `passed`, `failed: ...`; empty when it was left
    out."""
    clients: dict[str, str] = Field(default_factory=dict)
    """Versions of the installed clients."""


class Resumption(_Record):
    """A later session of a run: what its rows were played with."""

    started: datetime
    rows_before: int
    """Rows of earlier sessions, the first ones in the file."""
    episodes: int | None = None
    """How many episodes the run was meant to play from then on: it may have grown; None where that was not noted."""
    commit: str | None = None
    is_dirty: bool | None = None
    renderer: str = ""
    host: dict[str, str] = Field(default_factory=dict)
    answered: ProviderFacts | None = None
    """Of a model's run."""
    agent_files: dict[str, str] = Field(default_factory=dict)
    """As in the spec; they may have changed since."""


class RunHeader(_Record):
    """`run.json`: the spec with the circumstances of the run."""

    schema_version: int = SCHEMA_VERSION
    run_id: str
    """The name of its folder when it was begun; other runs may have the same."""
    nonce: str = Field(pattern=r"^[0-9a-f]{32}$")
    """Drawn once for each run, so that no other has its hash."""
    spec: RunSpec
    package_version: str
    commit: str | None = None
    is_dirty: bool | None = None
    """Whether the checkout had uncommitted changes; None outside a checkout."""
    simulator_version: str = ""
    renderer: str = ""
    """GL renderer string; empty until known."""
    started: datetime
    ended: datetime | None = None
    host: dict[str, str] = Field(default_factory=dict)
    """The machine and where things lay on it: platform, python ..., `pack_folder`, `asset_database`."""
    prices: Prices | None = None
    """At which its costs are told, as given last; no part of what the run is."""
    answered: ProviderFacts | None = None
    """Of a model's run."""
    resumed: tuple[Resumption, ...] = ()
    """Later sessions in order; what is said above holds for the first."""

    @property
    def sha256(self) -> str:
        """The hash of the very run, which its rows hold: of its id, its nonce and its spec."""
        return hashlib.sha256(f"{self.run_id}\n{self.nonce}\n{self.spec.sha256}".encode()).hexdigest()

    def stamp(self, record: EpisodeRecord) -> EpisodeRecord:
        """Return a record as a row of this run."""
        return record.model_copy(update={"run_id": self.run_id, "run_sha256": self.sha256})

    @property
    def answering_models(self) -> tuple[str, ...]:
        """The names under which the model answered, in all sessions."""
        return tuple(sorted({name for answered in self._answered for name in answered.models}))

    @property
    def has_reasoning(self) -> bool:
        """Whether reasoning came with any answer, in any session, however thinking was set."""
        return self.replies_with_reasoning[0] > 0

    @property
    def replies_with_reasoning(self) -> tuple[int, int]:
        """How many replies came with reasoning, of how many, in all sessions."""
        return sum(one.replies_with_reasoning for one in self._answered), sum(one.replies for one in self._answered)

    @property
    def _answered(self) -> tuple[ProviderFacts, ...]:
        sessions = (self.answered, *(session.answered for session in self.resumed))
        return tuple(answered for answered in sessions if answered is not None)

    @property
    def hosts(self) -> tuple[dict[str, str], ...]:
        """The machines of all sessions."""
        return self.host, *(session.host for session in self.resumed)

    @property
    def pack_folder(self) -> str:
        """Where the pack was when the run began; empty when that was not noted."""
        return self.host.get("pack_folder", "")

    @property
    def version_notes(self) -> tuple[str, ...]:
        """What a reader must be told because the run, or its pack, was made under other versions than these."""
        notes = (
            self.spec.versions.note(f"Run {self.run_id!r}"),
            self.spec.pack_versions.note(f"Its pack {self.spec.pack!r}"),
        )
        return tuple(note for note in notes if note is not None)

    @property
    def notes(self) -> tuple[str, ...]:
        """What a reader must know of the run before any number."""
        return (*self.version_notes, *self.spec.program_notes)

    @property
    def is_privileged(self) -> bool:
        """Whether the agent had sight of hidden state."""
        return self.spec.agent_kind == "privileged"


def _flatten(place: str, fields: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    for name, value in sorted(fields.items()):
        if isinstance(value, dict):
            yield from _flatten(f"{place}{name}.", value)
        else:
            yield f"{place}{name}", tuple(value) if isinstance(value, list) else value


class RowResolver:
    """Which row stands for each key, told as rows come in: the first without error, else the last."""

    def __init__(self) -> None:
        self._done: set[Key] = set()

    def accept(self, record: EpisodeRecord) -> bool:
        """Take in a row. Returns whether it stands from now on, in the place of any row of its key before it."""
        if self.is_done(record.key):
            return False
        if record.end != "error":
            self._done.add(record.key)
        return True

    def is_done(self, key: Key) -> bool:
        """Whether a row without error stands for `key`, which then no later row replaces."""
        return key in self._done


def effective_records(records: Iterable[EpisodeRecord]) -> dict[Key, EpisodeRecord]:
    """Return the row that stands for each key, sorted by key."""
    rows = RowResolver()
    return dict(sorted({record.key: record for record in records if rows.accept(record)}.items()))


def _advice(header: dict[str, Any]) -> str:
    """Return what to do about a header with a fault; another version's may have fields that this one lacks."""
    wrote = header.get("package_version")
    if not isinstance(wrote, str) or wrote == __version__:
        return "Restore it from a copy."
    return f"vigil {shorten(wrote, MAX_PART_CHARS)} wrote it, this is {__version__}: read it with that version."


def read_header(path: Path) -> RunHeader:
    """Return the header in a run's folder. Raises RecordError."""
    file = resolve_inside(path, HEADER_FILE, RecordError)
    if not file.exists():
        raise RecordError(f"Folder {str(path)!r} has no {HEADER_FILE}; give the folder of a run (its --log-dir).")
    try:
        found = read_json(read_file(file, repr(str(file)), RecordError))
    except ValueError as error:
        raise RecordError(f"{str(file)!r} is not JSON: {error}. Restore it from a copy.") from None
    named = found if isinstance(found, dict) else {}
    other = schema_mismatch(named.get("schema_version"), SCHEMA_VERSION)
    if other is not None:
        raise RecordError(f"{str(file)!r} {other}.")
    try:
        return RunHeader.model_validate(found)
    except ValidationError as error:
        raise RecordError(f"{str(file)!r}: {first_error(error)}. {_advice(named)}") from None
