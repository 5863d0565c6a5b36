"""Records: the events of an episode and the settings of its run, stored as facts.

Verdicts (W, B, labels) are never stored here: `vigil.scoring.outcomes` computes them. Source: `protocol.md` section 7.
"""

import hashlib
from collections.abc import Iterable, Iterator
from datetime import datetime
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, ValidationError, model_validator

from vigil import __version__
from vigil.base.files import read_file, resolve_inside
from vigil.base.json_files import is_array, is_object, read_json
from vigil.base.models import FrozenModel
from vigil.base.versions import PackVersions, Versions, schema_mismatch
from vigil.errors import MAX_PART_CHARS, RecordError, first_error, shorten
from vigil.protocol.actions import AnyAction, InvalidAction, Reply
from vigil.protocol.house import canonical_json
from vigil.protocol.observation import Quality
from vigil.protocol.profile import Profile
from vigil.protocol.reasoning import Thinking
from vigil.protocol.world import Effect, WorldState
from vigil.records.costs import Prices, Tokens
from vigil.records.limits import MAX_EPOCHS

SCHEMA_VERSION = 3
"""Schema version of rows and headers; files with any other version are refused. It is raised by one if a field is
removed, or changes its name, unit or meaning, so that an older reader would misunderstand a row. It is not raised for a
new field with a default, because old rows stay valid. `tests/release/test_old_files.py` checks this."""
EPISODES_FILE = "episodes.jsonl"
HEADER_FILE = "run.json"
FRAMES_FOLDER = "frames"

End = Literal["report", "stop", "fail_no_report", "invalid_action_limit_exceeded", "error"]
Boundary = Literal["simulator", "model", "agent", "worker", "runner"]
AgentKind = Literal["scripted", "privileged", "model", "exec", "human", "remote"]
Key = tuple[str, int]


class StepRecord(FrozenModel):
    """One step: a reply and its effect. Exactly one of `action` and `invalid` is set."""

    index: int = Field(ge=1)
    """Number of the step, counted from 1."""
    frame_sha256: str | None = Field(default=None, pattern=r"^[0-9a-f]{64}$")
    """SHA-256 of the RGB bytes of the frame that the reply answered; None if the agent did not read the frame."""
    reply: Reply
    history_cut: bool = False
    """Whether the reply was cut in the dialogue history because of its length."""
    action: AnyAction | None = None
    invalid: InvalidAction | None = None
    ignored_keys: tuple[str, ...] = ()
    effect: Effect | None = None
    """Effect in the simulator (hidden from the agent); None for reports, stops and invalid actions."""
    world: WorldState
    """State of the agent and of the bound objects after the step (hidden from the agent)."""
    is_unconfirmed: bool = Field(default=False, exclude_if=lambda is_so: not is_so)
    """Whether the step is a report that the profile answered by a request to look again. Omitted if False."""

    @model_validator(mode="after")
    def _is_action_or_invalid(self) -> "StepRecord":
        if (self.action is None) == (self.invalid is None):
            raise ValueError("a step must have either an action or the reason why there is none")
        return self


class ErrorFact(FrozenModel):
    """An infrastructure failure: where it happened, and its message."""

    boundary: Boundary
    message: str


class ForkPoint(FrozenModel):
    """The recorded play that an episode continues. The first steps of the episode repeat those of the play."""

    run_id: str
    run_sha256: str
    """Hash of the run in which the continued play was recorded (`RunHeader.sha256`)."""
    epoch: int = Field(ge=1)
    attempt: int = Field(ge=1)
    step: int = Field(ge=0)
    """Number of recorded steps that were repeated before the agent's own first step."""


class EpisodeRecord(FrozenModel):
    """What happened in one attempt at one episode, step by step, and how it ended."""

    schema_version: int = SCHEMA_VERSION
    versions: Versions = Versions()
    """Versions of the rules, of objects' shapes and of the reply grammar under which the episode was played."""
    run_id: str
    run_sha256: str = ""
    """Hash of the run to which the record belongs (`RunHeader.sha256`); empty for a record outside a run."""
    episode_id: str
    epoch: int = Field(default=1, ge=1)
    attempt: int = Field(default=1, ge=1)
    prompt_sha256: str = ""
    """SHA-256 of the system prompt, including the instruction."""
    started: datetime
    ended: datetime
    initial: WorldState | None
    """World after the reset; None only if the simulator failed before or during the reset."""
    steps: tuple[StepRecord, ...]
    end: End
    error: ErrorFact | None = None
    fork: ForkPoint | None = Field(default=None, exclude_if=lambda fork: fork is None)
    """The play that the episode continues; None, and omitted from the row, if the episode does not continue a play."""
    has_report: bool = Field(default=True, exclude_if=lambda is_so: is_so)
    """Whether the agent could report; False under a profile that has `stop` instead. Omitted if it is True."""
    criteria: Reply | None = Field(default=None, exclude_if=lambda reply: reply is None)
    """The model's text on what it must see to report; None, and omitted, if the profile does not ask for it."""

    @model_validator(mode="after")
    def _is_consistent(self) -> "EpisodeRecord":
        if (self.end == "error") != (self.error is not None):
            raise ValueError(
                "a record must have `error` if its episode ended as an error, and must not have it otherwise"
            )
        if self.initial is None and self.end != "error":
            raise ValueError("only an error can end an episode before its reset")
        if [step.index for step in self.steps] != list(range(1, len(self.steps) + 1)):
            raise ValueError("steps must be numbered 1, 2, 3 ... without a gap")
        if self.end != "error" and self.replayed_steps >= len(self.steps) and self.fork is not None:
            raise ValueError("an episode that continues another play must have steps after the fork")
        return self

    @property
    def key(self) -> Key:
        """Episode id and epoch, which identify a play within a run."""
        return self.episode_id, self.epoch

    @property
    def replayed_steps(self) -> int:
        """Number of steps at the beginning that repeat another play; 0 if the episode does not continue a play."""
        return 0 if self.fork is None else self.fork.step

    @property
    def tokens(self) -> Tokens:
        """Tokens of the agent's own replies, without those of replies that repeat another play."""
        replies = [step.reply for step in self.steps[self.replayed_steps :]]
        return Tokens.of(reply.usage for reply in [*([self.criteria] if self.criteria else []), *replies])

    @property
    def worlds(self) -> tuple[WorldState, ...]:
        """Worlds at the reset and after every step. Raises RecordError if the world at the reset is missing."""
        if self.initial is None:
            raise RecordError(f"Record of episode {self.episode_id!r} has no initial world: it ended as an error.")
        return (self.initial, *(step.world for step in self.steps))


class Shard(FrozenModel):
    """A part of a run that is played separately; `vigil.records.shards` selects its episodes."""

    index: int = Field(ge=1)
    """Number of the shard, counted from 1."""
    of: int = Field(ge=1)
    """Number of shards into which the run is divided."""

    @model_validator(mode="after")
    def _is_within_count(self) -> "Shard":
        if self.index > self.of:
            raise ValueError("a shard's index is at most the number of shards")
        return self

    def __str__(self) -> str:
        return f"{self.index}/{self.of}"


class ForkSource(FrozenModel):
    """The run whose plays a run continues, and from which step."""

    run_id: str
    run_sha256: str
    """Hash of the continued run (`RunHeader.sha256`)."""
    profile: Profile
    """Profile of the continued run; its replies are read under this profile."""
    at: int | Literal["goal"]
    """Number of recorded steps that are repeated; `goal` for all steps up to the one that attained the goal."""


class RunSpec(FrozenModel):
    """The settings that identify a run. A run can only be resumed with the same settings."""

    agent: str
    """The agent: the name of a scripted agent, `exec:COMMAND`, `provider/model`, or `remote:NAME` for a server."""
    agent_kind: AgentKind
    agent_files: dict[str, str] = Field(default_factory=dict)
    """File name -> SHA-256, for the files with the program and code that an `exec:COMMAND` names."""
    keep_program: bool | None = None
    """Whether an `exec:COMMAND` uses one process and folder for all episodes of a worker; None if not recorded."""
    frame_interval_seconds: float | None = None
    """Interval (s) at which an agent that is a program (`exec:COMMAND`) gets frames: the time from its reply to the
    next frame is a whole number of intervals. If 0 or None, a frame is sent as soon as it is ready."""
    sandbox: bool = Field(default=False, exclude_if=lambda is_so: not is_so)
    """Whether the program of `exec:COMMAND` ran in a sandbox. Omitted if False."""
    base_url: str | None = None
    sampling: dict[str, Any] = Field(default_factory=dict)
    """Sampling settings that the user set: temperature, top_p, max_tokens, reasoning_effort, extra_body ..."""
    thinking: Thinking = "default"
    """Thinking mode that the user set. The parameters that were sent for this mode are in `sampling`."""
    model_args: dict[str, Any] = Field(default_factory=dict)
    profile: Profile = Field(default_factory=Profile)
    versions: Versions = Versions()
    """Versions (of the rules, objects' shapes and the reply grammar) of the package that plays the run."""
    prompt_policy: str
    """Version string of the prompt (`vigil.protocol.prompt.policy_version`)."""
    prompt_policy_sha256: str
    pack: str
    pack_sha256: str
    pack_versions: PackVersions = PackVersions()
    """Versions of rules and shapes under which the pack was made."""
    episode_ids: tuple[str, ...]
    """Sorted ids of the episodes to play. If the run is a shard, the ids of all shards are listed."""
    shard: Shard | None = None
    """The part of the episodes that this run plays; None if it plays all of them."""
    epochs: int = Field(default=1, ge=1, le=MAX_EPOCHS)
    seed: int = 0
    """Seed for scheduling and for scripted agents; nothing else uses it."""
    simulator: str = "mujoco"
    """Name of the simulator's backend, as on the command line."""
    asset_database_sha256: str | None = None
    """SHA-256 of the file with the sizes of THOR's assets; None if the typical size of each category is used."""
    render_quality: Quality = "default"
    fork: ForkSource | None = Field(default=None, exclude_if=lambda fork: fork is None)
    """The run whose plays this run continues; None, and omitted, if the run does not continue plays."""

    @property
    def name_suffix(self) -> str:
        """Suffix of the agent's name in tables if the agent could learn more than its frames show; otherwise empty."""
        if self.agent_kind == "privileged":
            return " (privileged)"
        return " (program kept)" if self.agent_kind == "exec" and self.keep_program is not False else ""

    @property
    def program_notes(self) -> tuple[str, ...]:
        """Notes for readers if the agent is a program that could learn more than its frames show."""
        notes: list[str] = []
        if self.agent_kind == "exec" and self.keep_program is not False:
            notes.append(
                "Its program and the program's folder were used for many episodes, as with --keep-program: the program "
                "could remember the other twin of a pair, and earlier plays of an episode."
            )
        if self.agent_kind == "exec" and not self.frame_interval_seconds:
            notes.append(
                "Its program got frames as soon as they were ready, as with --frame-interval-seconds 0: "
                "the waiting time could reveal whether an action was carried out."
            )
        return tuple(notes)

    @property
    def sha256(self) -> str:
        """SHA-256 of the settings that must not change in a run's folder: all except the server's address, the
        program's files and the episodes.

        Settings with their default values are left out, so that a later version with more settings computes the same
        hash.
        """
        same = self.model_dump(mode="json", exclude={"base_url", "agent_files", "episode_ids"}, exclude_defaults=True)
        return hashlib.sha256(canonical_json(same)).hexdigest()

    @property
    def settings(self) -> dict[str, Any]:
        """All settings: path -> value, e.g. `profile.coordinates`; lists become tuples."""
        return dict(_flatten("", self.model_dump(mode="json")))


class ProviderFacts(FrozenModel):
    """Facts from the answers of a model's provider, including the answers to the check before the run."""

    replies: int = 0
    models: dict[str, int] = Field(default_factory=dict)
    """Model name in the answers -> number of replies with this name. It shows to which model an alias referred."""
    finish_reasons: dict[str, int] = Field(default_factory=dict)
    addresses: tuple[str, ...] = ()
    """URLs of the requests, without logins and query strings."""
    thinking: Literal["on", "off", "unknown"] = "unknown"
    """Thinking mode: `on` if any answer came with reasoning; otherwise the mode that the run set."""
    thinking_set_by: str = ""
    """Request parameters that set the thinking mode; empty if there were none."""
    replies_with_reasoning: int = 0
    check: dict[str, str] = Field(default_factory=dict)
    """Part of the check before the run (`sight`, `contract`) -> `passed` or `failed: ...`; empty if it was skipped."""
    clients: dict[str, str] = Field(default_factory=dict)
    """Name of an installed client library -> its version."""


class Resumption(FrozenModel):
    """A later session of a run, begun when the run was resumed, and the circumstances under which the session's rows
    were written."""

    started: datetime
    rows_before: int
    """Number of rows in the file when the session began. Earlier sessions wrote these rows."""
    episodes: int | None = None
    """Number of planned episodes in this session, which may be larger than before; None if not recorded."""
    commit: str | None = None
    is_dirty: bool | None = None
    renderer: str = ""
    host: dict[str, str] = Field(default_factory=dict)
    answered: ProviderFacts | None = None
    """Facts from the provider in this session; None unless a model played."""
    agent_files: dict[str, str] = Field(default_factory=dict)
    """Hashes of the agent's files in this session, as in `RunSpec`. They may have changed since the first session."""


class RunHeader(FrozenModel):
    """Content of `run.json`: the settings of the run (`spec`), and the circumstances in which it was played."""

    schema_version: int = SCHEMA_VERSION
    run_id: str
    """Name of the run's folder when the run started. Other runs may have the same name."""
    nonce: str = Field(pattern=r"^[0-9a-f]{32}$")
    """Random value drawn once per run, so that the run's hash is unique."""
    spec: RunSpec
    package_version: str
    commit: str | None = None
    is_dirty: bool | None = None
    """Whether the checkout of the code had uncommitted changes; None if the code was not in a checkout."""
    simulator_version: str = ""
    renderer: str = ""
    """GL renderer string; empty until it is known."""
    started: datetime
    ended: datetime | None = None
    host: dict[str, str] = Field(default_factory=dict)
    """Facts about the machine (platform, python ...), and paths on the machine (`pack_folder`, `asset_database`)."""
    prices: Prices | None = None
    """Prices of tokens, as the user last gave them. They are not part of the run's identity."""
    answered: ProviderFacts | None = None
    """Facts from the provider in the first session; None unless a model played."""
    resumed: tuple[Resumption, ...] = ()
    """Later sessions, in order. The other fields of the header describe the first session."""

    @property
    def sha256(self) -> str:
        """SHA-256 of the run's id, nonce and spec; every row of the run has it."""
        return hashlib.sha256(f"{self.run_id}\n{self.nonce}\n{self.spec.sha256}".encode()).hexdigest()

    def stamp(self, record: EpisodeRecord) -> EpisodeRecord:
        """Return the record with the id and hash of this run, so that it becomes a row of the run."""
        return record.model_copy(update={"run_id": self.run_id, "run_sha256": self.sha256})

    @property
    def answering_models(self) -> tuple[str, ...]:
        """Model names in the answers of all sessions, sorted."""
        return tuple(sorted({name for answered in self._answered for name in answered.models}))

    @property
    def has_reasoning(self) -> bool:
        """Whether any answer in any session came with reasoning. The thinking mode that was set does not matter."""
        return self.replies_with_reasoning[0] > 0

    @property
    def replies_with_reasoning(self) -> tuple[int, int]:
        """Number of replies with reasoning and number of all replies, over all sessions."""
        return sum(one.replies_with_reasoning for one in self._answered), sum(one.replies for one in self._answered)

    @property
    def _answered(self) -> tuple[ProviderFacts, ...]:
        sessions = (self.answered, *(session.answered for session in self.resumed))
        return tuple(answered for answered in sessions if answered is not None)

    @property
    def hosts(self) -> tuple[dict[str, str], ...]:
        """Facts about the machines of all sessions, one mapping per session."""
        return self.host, *(session.host for session in self.resumed)

    @property
    def pack_folder(self) -> str:
        """Folder of the pack when the run started, or of the pack published with the run; empty if not recorded."""
        return self.host.get("pack_folder", "")

    @property
    def version_notes(self) -> tuple[str, ...]:
        """Notes for readers if the run or its pack was made under other versions than this package's."""
        notes = (
            self.spec.versions.note(f"Run {self.run_id!r}"),
            self.spec.pack_versions.note(f"Its pack {self.spec.pack!r}"),
        )
        return tuple(note for note in notes if note is not None)

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes about the run, to be read before its results."""
        source = self.spec.fork
        forked = (
            f"Run {self.run_id!r} continues plays of run {source.run_id!r} "
            f"{'from the step that attained the goal' if source.at == 'goal' else f'after step {source.at}'}."
            if source is not None
            else ""
        )
        return (*self.version_notes, *self.spec.program_notes, *([forked] if forked else []))

    @property
    def is_privileged(self) -> bool:
        """Whether the agent had access to hidden state."""
        return self.spec.agent_kind == "privileged"


def _flatten(place: str, fields: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    for name, value in sorted(fields.items()):
        if is_object(value):
            yield from _flatten(f"{place}{name}.", value)
        else:
            yield f"{place}{name}", tuple(value) if is_array(value) else value


class RowResolver:
    """Finds the row that counts for each key (episode and epoch) while rows are read: the first row without an error.
    If all rows of the key have an error, the last row counts."""

    def __init__(self) -> None:
        self._done: set[Key] = set()

    def accept(self, record: EpisodeRecord) -> bool:
        """Read a row. Return whether it is now the row that counts for its key."""
        if record.key in self._done:
            return False
        if record.end != "error":
            self._done.add(record.key)
        return True


def effective_records(records: Iterable[EpisodeRecord]) -> dict[Key, EpisodeRecord]:
    """Return the row that counts for each key (episode and epoch), sorted by key."""
    rows = RowResolver()
    return dict(sorted({record.key: record for record in records if rows.accept(record)}.items()))


def _advice(header: dict[str, Any]) -> str:
    """Return advice on what to do about an invalid header, in case another version of vigil wrote it."""
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
    named: dict[str, Any] = found if is_object(found) else {}
    other = schema_mismatch(named.get("schema_version"), SCHEMA_VERSION)
    if other is not None:
        raise RecordError(f"{str(file)!r} {other}.")
    try:
        header = RunHeader.model_validate(found)
    except ValidationError as error:
        raise RecordError(f"{str(file)!r}: {first_error(error)}. {_advice(named)}") from None
    if not header.pack_folder or Path(header.pack_folder).is_absolute():
        return header
    return header.model_copy(update={"host": {**header.host, "pack_folder": str(path / header.pack_folder)}})
