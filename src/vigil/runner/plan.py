"""Plan of a run: everything that follows from its settings, worked out once, before anything is started.

Only this module and the command line read `RunSettings`. Code that plays, writes or estimates a run reads its plan.
"""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, Literal

from vigil.agents.exec_agent import ProgramSettings, file_hashes
from vigil.agents.registry import is_exec, make_agent
from vigil.agents.sandbox import check_sandbox
from vigil.assets.database import AssetDatabase
from vigil.base.settings import DefaultName, declared_settings
from vigil.base.versions import Versions
from vigil.errors import SettingError, did_you_mean
from vigil.packs.pack import CHORES_SUITE, Pack, Selection
from vigil.protocol.episode import Episode
from vigil.protocol.profile import Profile, coordinates_for
from vigil.protocol.profiles.rows import PROFILE_NAMES, PROFILES, unnameable
from vigil.protocol.prompt import policy_sha256, policy_version
from vigil.protocol.prompt_file import variant_of
from vigil.records.costs import Prices
from vigil.records.record import AgentKind, RunSpec
from vigil.records.shards import shard_episodes
from vigil.runner.forks import ForkPlan, parse_at
from vigil.runner.models.access import Endpoint, model_access
from vigil.runner.models.providers import parse_model_name, with_thinking
from vigil.runner.models.redaction import Secrets, redacted_errors, without_login, without_secrets
from vigil.runner.probes import ProbePlan, framings
from vigil.runner.retries import RetryPolicy
from vigil.runner.settings import RunSettings
from vigil.runner.shared_settings import public_name
from vigil.runner.workers.messages import WorkerPlan
from vigil.sim import BACKENDS, NAMELESS_BACKENDS

RUNS_FOLDER = Path("runs")
"""Parent folder of runs for which no folder is set."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Execution:
    """Settings of a run that are not part of its identity. `RunSettings` explains fields of the same name."""

    folder: Path
    """Folder in which the run is recorded."""
    input_paths: Mapping[str, str]
    """Paths of the run's inputs, for its header."""
    timeout_s: float
    """Time limit, in seconds, of one answer of a worker."""
    first_wait_s: float
    workers: int | None
    executor: Literal["local", "ray"]
    ray_address: str | None
    save_frames: bool
    prices: Prices | None
    preflight: bool
    force: bool
    probes: ProbePlan | None
    """Questions about the model's belief; None to ask none."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RunPlan:
    """Everything that is known about a run before it starts."""

    pack: Pack
    episodes: tuple[Episode, ...]
    """Episodes to play, sorted by id; for a shard, only the shard's part of them."""
    spec: RunSpec
    """Identity of the run: the condition, the player, and the ids of all shards' episodes."""
    worker: WorkerPlan
    """Plan of each simulator worker, with the agent that plays in it; the run's id and frame folder are set later."""
    endpoint: Endpoint | None
    """Model that is asked from the main process; None when an agent plays inside the workers."""
    execution: Execution
    forks: ForkPlan | None
    """Plays that the episodes continue; None if they begin at their start."""
    secrets: Secrets = field(repr=False)
    """Values that must not appear in a file, message or table of the run."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RemotePlan:
    """The player of a run on a server (`vigil run --env`), and how it plays; the server decides everything else."""

    url: str
    token: str = field(repr=False)
    agent: str
    """Name of the agent; empty if a model plays."""
    endpoint: Endpoint | None
    """The model that plays; None if an agent plays."""
    name: str
    """Name of the model, as the user gave it; empty if an agent plays."""
    program: ProgramSettings
    keep_program: bool
    seed: int
    workers: int | None
    preflight: bool
    force: bool


_OF_THE_PLAYER = {
    *("env", "env_token", "agent", "model", "base_url", "api_key_env", "workers", "max_connections", "temperature"),
    *("top_p", "max_tokens", "reasoning_effort", "thinking", "model_args", "extra_body", "reply_seconds"),
    *("keep_program", "sandbox", "preflight", "force", "seed"),
}
"""Settings that may be set together with `--env`; the server decides all others."""


def plan_remote_run(settings: RunSettings) -> RemotePlan:
    """Return the plan of a run on the server of the settings. Raises SettingError if a setting is the server's."""
    _check_one_player(settings)
    if settings.sandbox:
        check_sandbox()
    given = [
        one.display_name
        for one in declared_settings(RunSettings)
        if one.name not in _OF_THE_PLAYER and getattr(settings, one.name) != one.default
    ]
    if given:
        raise SettingError(f"{', '.join(given)}: with --env, the server decides this. Leave it out.")
    agent = settings.agent or ""
    hidden = (RUNS_FOLDER,) if settings.sandbox else None
    return RemotePlan(
        url=settings.env or "",
        token=settings.env_token,
        agent=agent,
        endpoint=None if settings.model is None else endpoint_of(settings),
        name=settings.model or "",
        program=ProgramSettings(settings.reply_seconds, 0.0, hidden, Secrets.of(command=agent).redact),
        **{name: getattr(settings, name) for name in ("keep_program", "seed", "workers", "preflight", "force")},
    )


def plan_run(settings: RunSettings, loaded: Pack | None = None) -> RunPlan:
    """Return the plan of a run. Raises InputError, without secrets in its message.

    `loaded` is the settings' pack, if the caller has it already.
    """
    endpoint = None if settings.model is None else endpoint_of(settings)
    secrets = _secrets(settings, endpoint)
    with redacted_errors(secrets):
        kind = _check_player(settings)
        forks = _fork_plan(settings)
        pack = loaded or Pack.load(settings.pack if forks is None else forks.run.pack_folder)
        assets = AssetDatabase.from_file(settings.asset_database)
        pack.check_assets(assets)
        _check_suite(profile_of(settings), pack)
        selected = _selected(settings, pack, forks)
        part = shard_episodes(selected, settings.shard)
        url = None if endpoint is None else endpoint.access.base_url
        spec = _spec(
            settings,
            pack,
            agent_kind=kind,
            base_url=None if url is None else without_login(url),
            episode_ids=tuple(episode.id for episode in selected),
            asset_database_sha256=assets.sha256,
            fork=None if forks is None else forks.source,
        )
        if forks is not None:
            forks.check(spec)
        folder = settings.log_dir or RUNS_FOLDER / _folder_name(spec)
        worker = WorkerPlan(
            hidden=(pack.folder, folder, RUNS_FOLDER) if settings.sandbox else None,
            pack=pack.folder,
            pack_sha256=pack.sha256,
            run_id="",
            profile=spec.profile,
            agent=settings.agent or "",
            quality=settings.render_quality,
            recorded_profile=None if forks is None else forks.source.profile,
            **_same_fields(settings, WorkerPlan),
        )
        execution = Execution(
            folder=folder,
            input_paths=input_paths(pack, settings.asset_database),
            timeout_s=settings.timeout_s + (settings.reply_seconds if kind == "exec" else 0.0),
            probes=None if settings.probe is None else ProbePlan(settings.probe, framings(settings.probe_framing)),
            **_same_fields(settings, Execution),
        )
        return RunPlan(
            pack=pack,
            episodes=tuple(part),
            spec=spec,
            worker=worker,
            endpoint=endpoint,
            execution=execution,
            secrets=secrets,
            forks=forks,
        )


def _fork_plan(settings: RunSettings) -> ForkPlan | None:
    """Return the plan of the plays that the run continues; None if it does not continue plays.

    If the user gives a pack, it must be the pack of these plays.
    """
    if settings.fork_from is None or settings.fork_at is None:
        return None
    pack = None if isinstance(settings.pack, DefaultName) else settings.pack
    return ForkPlan.read(settings.fork_from, parse_at(str(settings.fork_at)), pack)


def _selected(settings: RunSettings, pack: Pack, forks: ForkPlan | None) -> list[Episode]:
    selection = Selection(settings.families, settings.episode_ids, settings.limit)
    if forks is None:
        return pack.select(selection)
    if settings.limit is None:
        return forks.episodes(pack.select(selection), settings.episode_ids)
    every = Selection(settings.families, settings.episode_ids, None)
    able = tuple(episode.id for episode in forks.episodes(pack.select(every), settings.episode_ids))
    return pack.select(Selection((), able, settings.limit))


def _check_suite(profile: Profile, pack: Pack) -> None:
    """Raise SettingError if the pack is scored by reports and the profile has none, or if the profile asks for claims
    about chores and the pack has no chores."""
    if not profile.row.has_report and pack.manifest.suite is not None:
        raise SettingError(
            f"Profile {profile.name!r} has no reports, but pack {pack.name!r} of the suite {pack.manifest.suite!r} is "
            "scored by reports. Give a pack of the eight families, or another profile."
        )
    if profile.has_claims and pack.manifest.suite != CHORES_SUITE:
        raise SettingError(
            f"Profile {profile.name!r} asks for a claim about each chore of a list, but pack {pack.name!r} has no "
            "lists. Give a pack of the suite `chores`, or choose the profile baseline or action_feedback."
        )


def _secrets(settings: RunSettings, endpoint: Endpoint | None) -> Secrets:
    return Secrets.of(
        command=settings.agent or "",
        url=None if endpoint is None else endpoint.access.base_url,
        settings=({"model_args": settings.model_args, "extra_body": settings.extra_body},),
        key="" if endpoint is None else endpoint.access.api_key or "",
    )


def _same_fields(settings: RunSettings, plan: type) -> dict[str, Any]:
    """Return {name: value} of those settings that are also fields of the class `plan`."""
    changed = {"pack", "profile", "agent", "timeout_s"}
    shared = {one.name for one in fields(plan)} & {one.name for one in fields(settings)} - changed
    return {name: getattr(settings, name) for name in shared}


def _spec(settings: RunSettings, pack: Pack, **facts: Any) -> RunSpec:
    """Return the identity of the run with these settings; `facts` are fields that do not follow from settings alone."""
    if facts["agent_kind"] == "exec" and settings.agent is not None:
        facts["agent_files"] = file_hashes(settings.agent, Path.cwd())
        facts["keep_program"] = settings.keep_program
        facts["sandbox"] = settings.sandbox
        facts["frame_interval_seconds"] = settings.frame_interval_seconds
    return run_spec(
        pack,
        profile_of(settings),
        agent=settings.model or public_name(settings.agent or ""),
        sampling=without_secrets(_sampling_of(settings)),
        thinking=settings.thinking,
        model_args=without_secrets(settings.model_args),
        shard=settings.shard,
        epochs=settings.epochs,
        seed=settings.seed,
        simulator=settings.backend,
        render_quality=settings.render_quality,
        **facts,
    )


def run_spec(pack: Pack, profile: Profile, **facts: Any) -> RunSpec:
    """Return the identity of a run on `pack` under `profile` with the current versions; `facts` are other fields."""
    return RunSpec(
        profile=profile,
        versions=Versions.current(),
        prompt_policy=policy_version(profile),
        prompt_policy_sha256=policy_sha256(profile),
        pack=pack.name,
        pack_sha256=pack.sha256,
        pack_versions=pack.manifest.versions,
        **facts,
    )


def input_paths(pack: Pack, asset_database: Path | None) -> dict[str, str]:
    """Return the paths of a run's inputs for its header, so that `vigil verify` finds them on the same machine."""
    places = {"pack_folder": str(pack.folder.resolve())}
    if asset_database is not None:
        places["asset_database"] = str(asset_database.resolve())
    return places


def profile_of(settings: RunSettings) -> Profile:
    """Return the evaluation profile of the settings. Raises SettingError if the profile is unknown."""
    asked = settings.profile
    if asked not in PROFILE_NAMES:
        hint = did_you_mean(asked, PROFILE_NAMES)
        names = ", ".join(row.short for row in PROFILES.values())
        raise SettingError(f"Profile {asked!r} does not exist.{hint} Choose one of: {names}.")
    row = PROFILES[PROFILE_NAMES[asked]]
    if row.is_of_conversations and settings.model is None:
        raise SettingError(
            f"Profile {row.short!r} changes a model's conversation, but this run has no model. Choose another profile, "
            "or give --model."
        )
    if not row.has_pixels and settings.model is None and not is_exec(settings.agent or ""):
        raise SettingError(f"Profile {row.short!r} has no pixels, and agent {settings.agent!r} clicks on pixels.")
    if not row.has_pixels and settings.simulator_factory is None and settings.backend in NAMELESS_BACKENDS:
        raise SettingError(unnameable(row, settings.backend))
    own = settings.prompt_template
    return Profile(
        name=PROFILE_NAMES[asked],
        prompt_variant=settings.prompt_variant if own is None else variant_of(own),
        prompt_template=own,
        coordinates=settings.coordinates or coordinates_for(settings.model or ""),
        reply_policy=settings.reply_policy,
        image_format=settings.image_format,
        system_role=settings.system_role,
    )


def endpoint_of(settings: RunSettings) -> Endpoint:
    """Return how the model of the settings is reached and called. Raises SettingError."""
    return Endpoint(
        model_access(settings.model or "", settings.base_url, settings.model_args, settings.api_key_env),
        _sampling_of(settings),
        settings.max_connections,
        settings.reply_seconds,
        RetryPolicy(settings.retries, settings.first_wait_s, settings.longest_wait_s),
        settings.keep_reasoning,
    )


def _sampling_of(settings: RunSettings) -> dict[str, Any]:
    """Return the fields that each request has besides its messages: the user's sampling settings, and the thinking
    switch.

    Raises SettingError when settings contradict each other.
    """
    given = {
        "temperature": settings.temperature,
        "top_p": settings.top_p,
        "max_tokens": settings.max_tokens,
        "reasoning_effort": settings.reasoning_effort,
        "extra_body": dict(settings.extra_body) or None,
    }
    sampling = {name: value for name, value in given.items() if value is not None}
    return with_thinking(sampling, settings.thinking, parse_model_name(settings.model)) if settings.model else sampling


def _check_player(settings: RunSettings) -> AgentKind:
    """Return the kind of the run's player. Raises SettingError when the player or its simulator does not exist."""
    if settings.env is not None:
        raise SettingError("With --env the server plans and records the run: use `vigil run`, or leave out --env.")
    _check_one_player(settings)
    if settings.backend not in BACKENDS and settings.simulator_factory is None:
        raise SettingError(f"Simulator {settings.backend!r} does not exist. Choose one of: {', '.join(BACKENDS)}.")
    if settings.sandbox and not is_exec(settings.agent or ""):
        raise SettingError("--sandbox is for a program: give --agent exec:COMMAND, or leave out --sandbox.")
    if settings.sandbox:
        check_sandbox()
    if settings.agent is None:
        return "model"
    if settings.agent_factory is not None:
        return "privileged"
    make_agent(settings.agent, Profile())
    return "exec" if is_exec(settings.agent) else "scripted"


def _check_one_player(settings: RunSettings) -> None:
    if (settings.agent is None) == (settings.model is None):
        raise SettingError("A run needs an agent or a model: give exactly one of --agent and --model.")


def _folder_name(spec: RunSpec) -> str:
    """Return the default name of a run's folder. It depends only on the run's identity."""
    identity = spec.model_copy(update={"base_url": None, "agent_files": {}}).model_dump_json()
    words = "".join(char if char.isalnum() or char in "._" else "-" for char in f"{spec.pack}-{spec.agent}")
    if spec.shard is not None:
        words = f"{words[:60]}-shard-{spec.shard.index}-of-{spec.shard.of}"
    return f"{words[:80].strip('-')}-{hashlib.sha256(identity.encode()).hexdigest()[:8]}"
