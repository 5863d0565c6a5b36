"""Settings of a run, and what follows from them: the pack, the episodes, the profile and the run's identity."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

from vigil.agents.agent import FRAME_INTERVAL_SECONDS, REPLY_SECONDS
from vigil.agents.exec_agent import file_hashes
from vigil.agents.registry import is_exec, make_agent
from vigil.assets.database import AssetDatabase
from vigil.base.settings import Setting, check_settings
from vigil.base.versions import Versions
from vigil.errors import SettingError, did_you_mean
from vigil.packs.pack import Pack, Selection
from vigil.packs.private import REVEAL_HELP
from vigil.processes.worker import WORKER_TIMEOUT_S
from vigil.protocol.actions import ReplyPolicy
from vigil.protocol.episode import Episode
from vigil.protocol.profile import (
    PROFILE_NAMES,
    ImageFormat,
    Profile,
    coordinates_for,
)
from vigil.protocol.prompt import policy_sha256, policy_version
from vigil.protocol.prompt_file import check_template, variant_of
from vigil.records.record import MAX_EPOCHS, AgentKind, RunSpec, Shard
from vigil.records.shards import parse_shard, shard_episodes
from vigil.runner.models.access import ModelAccess, model_access
from vigil.runner.models.providers import parse_model_name
from vigil.runner.models.redaction import Secrets, without_login, without_secrets
from vigil.runner.models.thinking import with_thinking
from vigil.runner.option_parsing import public_name, read_extra_body, read_model_args, single_value
from vigil.runner.shared_settings import (
    ApiKeyEnv,
    AssetFile,
    Backend,
    BaseUrl,
    CoordinatesOption,
    EpisodeIds,
    Families,
    LogDir,
    PackName,
    PricesOption,
    ProfileOption,
    PromptFileOption,
    PromptVariantOption,
    RenderQuality,
    SystemRoleOption,
    ThinkingOption,
    Workers,
)
from vigil.runner.workers.messages import PrivilegedFactory, SimulatorFactory, WorkerPlan
from vigil.sim import BACKENDS

RUNS_FOLDER = Path("runs")
"""Folder of runs for which none is set."""


ReasoningEffort = Literal["none", "minimal", "low", "medium", "high", "xhigh", "max"]
_DEFAULT = "the provider's default if unset."
_EFFORT_HELP = f"How much the model reasons before it answers: {', '.join(get_args(ReasoningEffort))}; {_DEFAULT}"


@dataclass(frozen=True, slots=True, kw_only=True)
class RunSettings:
    """The settings of `vigil run`. Exactly one of `agent` and `model` is set.

    A field with a `Setting` is also an option of the command line. Raises SettingError when a value is out of bounds.
    """

    pack: PackName = "starter"
    agent: Annotated[
        str | None,
        Setting(
            "Agent that plays the episodes: a scripted one (solver, random, noop ...), or your own "
            "program as exec:COMMAND. Give either this or --model.",
            metavar="NAME",
            read=single_value("--agent"),
            repeats=True,
        ),
    ] = None
    """A scripted agent, `exec:COMMAND`, or a privileged one that `agent_factory` makes."""
    agent_factory: PrivilegedFactory | None = None
    model: Annotated[
        str | None,
        Setting(
            "Model that plays the episodes, as provider/model, e.g. openai/gpt-4o. Give either this or --agent.",
            metavar="MODEL",
            read=single_value("--model"),
            repeats=True,
        ),
    ] = None
    base_url: BaseUrl = None
    api_key_env: ApiKeyEnv = None
    """Environment variable with the key; None for the provider's variable, whose key is sent only to its hosts."""
    log_dir: LogDir = None
    """Folder of the run; None for one under `runs/` that depends only on the settings."""
    limit: Annotated[
        int | None,
        Setting(
            "Maximum number of episodes to play, spread evenly over the families of tasks (in a pack of "
            "the closure suite, over its kinds). All episodes if unset.",
            minimum=1,
            metavar="N",
        ),
    ] = None
    families: Families = ()
    episode_ids: EpisodeIds = ()
    workers: Workers = None
    executor: Annotated[
        Literal["local", "ray"],
        Setting("Where the simulators run: on this machine (local), or on the nodes of a Ray cluster (ray)."),
    ] = "local"
    ray_address: Annotated[
        str | None,
        Setting(
            "Address of the Ray cluster that --executor ray uses.",
            metavar="HOST:PORT",
            unset="RAY_ADDRESS, or a local Ray",
        ),
    ] = None
    max_connections: Annotated[
        int,
        Setting(
            "Maximum number of episodes that are played, and of requests that are sent to the model, at the same time.",
            minimum=1,
            metavar="N",
        ),
    ] = 16
    profile: ProfileOption = "baseline"
    prompt_variant: PromptVariantOption = "default"
    prompt_template: PromptFileOption = None
    coordinates: CoordinatesOption = None
    """Coordinate system of the model's clicks; None for the published table's entry for the model."""
    reply_policy: Annotated[
        ReplyPolicy,
        Setting(
            "How a reply is read: strict accepts only one JSON object; lenient also accepts it inside a "
            "code fence or prose."
        ),
    ] = "strict"
    system_role: SystemRoleOption = "system"
    shard: Annotated[
        Shard | None,
        Setting(
            "Split the episodes into N parts and play only part I, e.g. 2/8. Several machines can so "
            "share a run; `vigil merge` joins the parts.",
            metavar="I/N",
            read=parse_shard,
        ),
    ] = None
    """Part of the episodes to play; `vigil.runner.merge` joins the parts."""
    epochs: Annotated[
        int, Setting("Number of times that each episode is played.", minimum=1, maximum=MAX_EPOCHS, metavar="N")
    ] = 1
    temperature: Annotated[float | None, Setting(f"Sampling temperature of the model; {_DEFAULT}")] = None
    top_p: Annotated[
        float | None, Setting(f"Probability mass of nucleus sampling (top-p) of the model; {_DEFAULT}")
    ] = None
    max_tokens: Annotated[
        int | None, Setting(f"Maximum number of tokens of a model's reply; {_DEFAULT}", minimum=1, metavar="N")
    ] = None
    reasoning_effort: Annotated[ReasoningEffort | None, Setting(_EFFORT_HELP, metavar="LEVEL")] = None
    thinking: ThinkingOption = "default"
    model_args: Annotated[
        Mapping[str, Any],
        Setting(
            "Argument K with value V that is passed to the provider's client library; may be repeated.",
            "model-arg",
            metavar="K=V",
            read=read_model_args,
            repeats=True,
        ),
    ] = field(default_factory=dict[str, Any])
    extra_body: Annotated[
        Mapping[str, Any],
        Setting(
            "JSON object whose fields are added to every request to the model.", metavar="JSON", read=read_extra_body
        ),
    ] = field(default_factory=dict[str, Any])
    image_format: Annotated[ImageFormat, Setting("Image format of the frames that the agent gets.")] = "png"
    render_quality: RenderQuality = "default"
    prices: PricesOption = None
    save_frames: Annotated[
        bool,
        Setting(
            "Save every frame that the agent gets in the run's folder, as a file named by the hash of its content."
        ),
    ] = False
    keep_reasoning: Annotated[
        bool,
        Setting(
            "Save the reasoning that the model's server sends separately from the replies, in the run's "
            "reasoning.jsonl."
        ),
    ] = False
    backend: Backend = "mujoco"
    simulator_factory: SimulatorFactory | None = None
    """Factory of a custom simulator; `backend` is then only its name in the header. Must be picklable."""
    asset_database: AssetFile = None
    reply_seconds: Annotated[
        int, Setting("Time limit of each reply of a model or program.", minimum=1, metavar="SECONDS")
    ] = REPLY_SECONDS
    """Time limit of one reply of a model or a program."""
    frame_interval_seconds: Annotated[
        float,
        Setting(
            "Period at which a program can get frames: a frame is sent a whole number of periods after "
            "the reply, so that its time reveals nothing. 0 sends each frame as soon as it is ready.",
            minimum=0,
            maximum=60,
            metavar="SECONDS",
        ),
    ] = FRAME_INTERVAL_SECONDS
    keep_program: Annotated[
        bool,
        Setting(
            "Keep the program running from episode to episode, in one folder. By default each episode "
            "gets a new process in an empty folder."
        ),
    ] = False
    seed: Annotated[
        int, Setting("Random seed of the order in which episodes are played, and of the scripted agents.")
    ] = 0
    preflight: Annotated[
        bool, Setting("Skip the check before the run that the model sees pictures and answers in the required form.")
    ] = True
    force: Annotated[
        bool,
        Setting(
            "Play the run although a check failed: the model did not answer the example observation with "
            "an action, or another model or program answers than when the run began."
        ),
    ] = False
    reveal_private_pack: Annotated[bool, Setting(REVEAL_HELP, is_option=False)] = False
    """Whether Inspect's log may hold the episodes of a private pack; only `inspect eval` takes it."""
    retries: Annotated[int, Setting("Retries of a failed request.", minimum=0, is_option=False)] = 8
    first_wait_s: float = 1.0
    """Wait before the first retry of a request, in seconds."""
    longest_wait_s: float = 60.0
    """Maximum wait between two attempts at a request, in seconds, even if the provider asks for more."""
    timeout_s: float = WORKER_TIMEOUT_S

    def __post_init__(self) -> None:
        """Check the values against their declarations."""
        check_settings(self)
        if self.ray_address is not None and self.executor != "ray":
            raise SettingError("--ray-address needs --executor ray: give both, or neither.")
        if self.prompt_template is None:
            return
        if self.prompt_variant != "default":
            raise SettingError(
                "A prompt file replaces the prompt variant: leave out --prompt-variant or --prompt-file."
            )
        try:
            check_template(self.prompt_template)
        except ValueError as error:
            raise SettingError(f"The prompt file: {error}") from None

    @property
    def player(self) -> str:
        """Name of the player in headers and tables, without secrets."""
        return self.model or public_name(self.agent or "")


def plan_run(settings: RunSettings) -> tuple[Pack, list[Episode], RunSpec]:
    """Return the pack, the episodes to play (for a shard, the episodes of all shards) and the run's identity.

    Raises InputError.
    """
    _check_player(settings)
    pack, assets = Pack.load(settings.pack), AssetDatabase.from_file(settings.asset_database)
    pack.check_assets(assets)
    episodes = pack.select(Selection(settings.families, settings.episode_ids, settings.limit))
    shard_episodes(episodes, settings.shard)
    spec = run_spec(
        pack,
        profile_of(settings),
        agent=settings.player,
        agent_kind=_agent_kind(settings),
        base_url=_public_address(settings),
        sampling=without_secrets(sampling_of(settings)),
        thinking=settings.thinking,
        model_args=without_secrets(settings.model_args),
        episode_ids=tuple(episode.id for episode in episodes),
        shard=settings.shard,
        **_program_identity(settings),
        epochs=settings.epochs,
        seed=settings.seed,
        simulator=settings.backend,
        asset_database_sha256=assets.sha256,
        render_quality=settings.render_quality,
    )
    return pack, episodes, spec


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


def sampling_of(settings: RunSettings) -> dict[str, Any]:
    """Return the fields of each request other than its messages: those that were set, and the thinking switch.

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


def profile_of(settings: RunSettings) -> Profile:
    """Return the evaluation profile of the settings. Raises SettingError on an unknown one."""
    asked = settings.profile
    if asked not in PROFILE_NAMES:
        hint = did_you_mean(asked, PROFILE_NAMES)
        raise SettingError(f"Profile {asked!r} does not exist.{hint} Choose {' or '.join(PROFILE_NAMES)}.")
    fitting = coordinates_for(settings.model) if settings.model else "pixel"
    own = settings.prompt_template
    return Profile(
        name=PROFILE_NAMES[asked],
        prompt_variant=settings.prompt_variant if own is None else variant_of(own),
        prompt_template=own,
        coordinates=settings.coordinates or fitting,
        reply_policy=settings.reply_policy,
        image_format=settings.image_format,
        system_role=settings.system_role,
    )


def worker_plan(
    settings: RunSettings, pack: Pack, profile: Profile, *, run_id: str = "", frames: Path | None = None
) -> WorkerPlan:
    """Return the plan that every simulator worker gets."""
    return WorkerPlan(
        pack=pack.folder,
        run_id=run_id,
        profile=profile,
        backend=settings.backend,
        simulator_factory=settings.simulator_factory,
        quality=settings.render_quality,
        asset_database=settings.asset_database,
        frames=frames,
        agent=settings.agent or "",
        agent_factory=settings.agent_factory,
        reply_seconds=settings.reply_seconds,
        frame_interval_seconds=settings.frame_interval_seconds,
        keep_program=settings.keep_program,
        seed=settings.seed,
        pack_sha256=pack.sha256,
    )


def log_dir(settings: RunSettings, spec: RunSpec) -> Path:
    """Return the run's folder: as set, or one under `runs/` named after the run's identity."""
    if settings.log_dir is not None:
        return settings.log_dir
    identity = spec.model_copy(update={"base_url": None, "agent_files": {}}).model_dump_json()
    words = "".join(char if char.isalnum() or char in "._" else "-" for char in f"{spec.pack}-{spec.agent}")
    if spec.shard is not None:
        words = f"{words[:60]}-shard-{spec.shard.index}-of-{spec.shard.of}"
    return RUNS_FOLDER / f"{words[:80].strip('-')}-{hashlib.sha256(identity.encode()).hexdigest()[:8]}"


def _public_address(settings: RunSettings) -> str | None:
    """Return the address of the model's server for the header, without credentials; None for the provider's default."""
    if settings.model is None:
        return None
    url = access_of(settings).base_url
    return None if url is None else without_login(url)


def access_of(settings: RunSettings) -> ModelAccess:
    """Return the address and the key of the run's model. Raises SettingError."""
    return model_access(settings.model or "", settings.base_url, settings.model_args, settings.api_key_env)


def secrets_of(settings: RunSettings) -> Secrets:
    """Return the secrets, which must not be in a file, message or table of the run. Raises SettingError."""
    found = access_of(settings) if settings.model is not None else None
    return Secrets.of(
        command=settings.agent or "",
        url=None if found is None else found.base_url,
        settings=({"model_args": settings.model_args, "extra_body": settings.extra_body},),
        key="" if found is None else found.api_key or "",
    )


def _program_identity(settings: RunSettings) -> dict[str, Any]:
    """Return the fields of the run's identity that depend on the program that plays; empty without a program."""
    if settings.agent is None or _agent_kind(settings) != "exec":
        return {}
    return {
        "agent_files": file_hashes(settings.agent, Path.cwd()),
        "keep_program": settings.keep_program,
        "frame_interval_seconds": settings.frame_interval_seconds,
    }


def _agent_kind(settings: RunSettings) -> AgentKind:
    if settings.model is not None:
        return "model"
    if settings.agent_factory is not None:
        return "privileged"
    return "exec" if is_exec(settings.agent or "") else "scripted"


def _check_player(settings: RunSettings) -> None:
    if (settings.agent is None) == (settings.model is None):
        raise SettingError("A run needs an agent or a model: give exactly one of --agent and --model.")
    if settings.backend not in BACKENDS and settings.simulator_factory is None:
        raise SettingError(f"Simulator {settings.backend!r} does not exist. Choose one of: {', '.join(BACKENDS)}.")
    if settings.agent is not None and settings.agent_factory is None:
        make_agent(settings.agent, Profile())
    if settings.model is not None:
        access_of(settings)
