"""Settings of `vigil run`, `verify`, `merge` and `probe`, as a user gives them. Other modules, such as
`vigil.runner.plan`, compute what follows from the settings, so that help can be shown without loading these modules."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args

from vigil.agents.agent import FRAME_INTERVAL_SECONDS, REPLY_SECONDS
from vigil.base.processes.worker import WORKER_TIMEOUT_S
from vigil.base.settings import DefaultName, Setting, check_settings
from vigil.errors import SettingError
from vigil.packs.private import REVEAL_HELP
from vigil.protocol.profile import ImageFormat
from vigil.protocol.prompt_file import check_template
from vigil.records.limits import MAX_EPOCHS
from vigil.runner import shared_settings as shared

if TYPE_CHECKING:
    from vigil.records.record import Shard
    from vigil.runner.workers.messages import PrivilegedFactory, SimulatorFactory


DEFAULT_PACK = DefaultName("starter")
ReasoningEffort = Literal["none", "minimal", "low", "medium", "high", "xhigh", "max"]
_DEFAULT = "the provider's default if unset."
_EFFORT_HELP = f"How much the model reasons before it answers: {', '.join(get_args(ReasoningEffort))}; {_DEFAULT}"


@dataclass(frozen=True, slots=True, kw_only=True)
class RunSettings:
    """The settings of `vigil run`. Exactly one of `agent` and `model` is set.

    A field with a `Setting` is also an option of the command line. Raises SettingError when a value is out of bounds.
    """

    pack: shared.PackName = DEFAULT_PACK
    agent: Annotated[
        str | None,
        Setting(
            "Agent that plays the episodes: a scripted one (solver, random, noop ...), or your own "
            "program as exec:COMMAND. Give either this or --model.",
            metavar="NAME",
            read=shared.single_value("--agent"),
            repeats=True,
        ),
    ] = None
    """Name of a scripted agent, `exec:COMMAND`, or name of a privileged agent that `agent_factory` makes."""
    agent_factory: "PrivilegedFactory | None" = None
    model: Annotated[
        str | None,
        Setting(
            "Model that plays the episodes, as provider/model, e.g. openai/gpt-4o. Give either this or --agent.",
            metavar="MODEL",
            read=shared.single_value("--model"),
            repeats=True,
        ),
    ] = None
    env: Annotated[
        str | None,
        Setting(
            "Address of a server (`vigil serve`) through which the episodes are played, e.g. "
            "http://127.0.0.1:8380. The server chooses the episodes and keeps the records.",
            metavar="URL",
            unset="simulators of this machine",
        ),
    ] = None
    env_token: Annotated[
        str, Setting("Token that the server of --env asks for.", metavar="TOKEN", env="VIGIL_ENV_TOKEN")
    ] = ""
    base_url: shared.BaseUrl = None
    api_key_env: shared.ApiKeyEnv = None
    log_dir: shared.LogDir = None
    """Folder of the run; None for a folder under `runs/` whose name depends only on the settings."""
    limit: Annotated[
        int | None,
        Setting(
            "Maximum number of episodes to play, spread evenly over the families of tasks (in a pack of "
            "the closure suite, over its kinds). All episodes if unset.",
            minimum=1,
            metavar="N",
        ),
    ] = None
    families: shared.Families = ()
    episode_ids: shared.EpisodeIds = ()
    workers: shared.Workers = None
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
    profile: shared.ProfileOption = "baseline"
    prompt_variant: shared.PromptVariantOption = "default"
    prompt_template: shared.PromptFileOption = None
    coordinates: shared.CoordinatesOption = None
    reply_policy: shared.ReplyPolicyOption = "strict"
    system_role: shared.SystemRoleOption = "system"
    shard: Annotated[
        "Shard | None",
        Setting(
            "Split the episodes into N parts and play only part I, e.g. 2/8, so that several machines can share a "
            "run; `vigil merge` joins the parts.",
            metavar="I/N",
            read="vigil.records.shards:parse_shard",
        ),
    ] = None
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
    thinking: shared.ThinkingOption = "default"
    model_args: Annotated[
        Mapping[str, Any],
        Setting(
            "Argument K with value V that is passed to the provider's client library; may be repeated.",
            "model-arg",
            metavar="K=V",
            read=shared.read_model_args,
            repeats=True,
        ),
    ] = field(default_factory=dict[str, Any])
    extra_body: Annotated[
        Mapping[str, Any],
        Setting(
            "JSON object whose fields are added to every request to the model.",
            metavar="JSON",
            read=shared.read_extra_body,
        ),
    ] = field(default_factory=dict[str, Any])
    image_format: Annotated[ImageFormat, Setting("Image format of the frames that the agent gets.")] = "png"
    render_quality: shared.RenderQuality = "default"
    prices: shared.PricesOption = None
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
    fork_from: Annotated[
        Path | None,
        Setting(
            "Folder of a run whose plays are continued: the recorded replies up to the step of --at are carried out "
            "again, then the new agent or model goes on.",
            name="from",
            metavar="RUN",
        ),
    ] = None
    fork_at: Annotated[
        int | str | None,
        Setting(
            "Step after which the plays of --from are continued: its number, or the word goal for the step that "
            "attained the goal.",
            name="at",
            metavar="STEP",
            minimum=0,
            read="vigil.runner.forks:parse_at",
        ),
    ] = None
    probe: shared.ProbeSteps = None
    probe_framing: shared.ProbeFraming = "state"
    backend: shared.Backend = "mujoco"
    simulator_factory: "SimulatorFactory | None" = None
    """Picklable function that makes a custom simulator; `backend` is then only the simulator's name in the header."""
    asset_database: shared.AssetFile = None
    reply_seconds: Annotated[
        int, Setting("Time limit in seconds for each reply of the agent.", minimum=1, metavar="SECONDS")
    ] = REPLY_SECONDS
    frame_interval_seconds: Annotated[
        float,
        Setting(
            "Interval in seconds, for an agent that is a program (exec:COMMAND): the next frame is sent a whole number "
            "of intervals after the reply, so that the waiting time does not reveal what the action did. With 0, "
            "each frame is sent as soon as it is ready.",
            minimum=0,
            maximum=60,
            metavar="SECONDS",
        ),
    ] = FRAME_INTERVAL_SECONDS
    keep_program: Annotated[
        bool,
        Setting(
            "Run the program of exec:COMMAND once, in one folder, for all episodes that a worker plays. By default "
            "each episode gets a new process in an empty folder."
        ),
    ] = False
    sandbox: Annotated[
        bool,
        Setting(
            "Start the program of exec:COMMAND in a sandbox (bubblewrap), where it sees the system, the files that "
            "its command names and its working folder, but no pack, run or home folder."
        ),
    ] = False
    seed: Annotated[
        int, Setting("Random seed of the order in which episodes are played, and of the scripted agents.")
    ] = 0
    preflight: Annotated[
        bool,
        Setting("Start the run without first checking that the model sees pictures and answers in the required form."),
    ] = True
    force: Annotated[
        bool,
        Setting(
            "Play the run although a check failed: the model did not answer the example observation with an "
            "action, or the model or program has changed since the run began."
        ),
    ] = False
    reveal_private_pack: Annotated[bool, Setting(REVEAL_HELP, is_option=False)] = False
    """Whether Inspect's log may hold the episodes of a private pack; only `inspect eval` has this setting."""
    retries: Annotated[
        int, Setting("Number of times that a failed request is sent again.", minimum=0, is_option=False)
    ] = 8
    first_wait_s: float = 1.0
    """Wait before the first retry of a request, in seconds."""
    longest_wait_s: float = 60.0
    """Maximum wait between two attempts at a request, in seconds, even if the provider asks for more."""
    timeout_s: float = WORKER_TIMEOUT_S

    def __post_init__(self) -> None:
        check_settings(self)
        if self.ray_address is not None and self.executor != "ray":
            raise SettingError("--ray-address needs --executor ray: give both, or neither.")
        if (self.fork_from is None) != (self.fork_at is None):
            raise SettingError(
                "--from and --at belong together: --from names the run to continue, --at the step after which it is "
                "continued. Give both, or neither."
            )
        if self.probe is not None and self.model is None:
            raise SettingError("--probe asks a model what it believes, but this run has an agent: leave --probe out.")
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


@dataclass(frozen=True, slots=True, kw_only=True)
class VerifySettings:
    """Settings of `vigil verify`, which verifies a run."""

    frames: Annotated[
        bool,
        Setting(
            "Also draw the frames again and compare them with the saved frames. They can be equal only if the "
            "renderer is the same."
        ),
    ] = False
    records_only: Annotated[
        bool,
        Setting(
            "Check only what does not need a simulator: replies, budgets, ends, prompts, and whether the "
            "records belong to the run."
        ),
    ] = False
    limit: Annotated[int | None, Setting("Verify only the first N records; all if unset.", minimum=1, metavar="N")] = (
        None
    )
    workers: shared.Workers = None
    pack: shared.PackLocation = None
    asset_database: shared.AssetFile = None
    backend: str | None = None
    """Simulator on which the replies are played again; None for the simulator of the run."""
    exact: bool | None = None
    """Whether numbers must be bit-identical; None: only if the facts `SAME_HOST` are the same here as in the run."""
    timeout_s: float = WORKER_TIMEOUT_S

    def __post_init__(self) -> None:
        check_settings(self)
        if self.records_only and self.frames:
            raise SettingError(
                "Drawing frames needs a simulator, but a check of the records only does not use one. Give either "
                "--frames or --records-only."
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class MergeSettings:
    """Settings of `vigil merge`, which joins shards."""

    partial: Annotated[
        bool,
        Setting(
            "Join the shards although episodes are missing; `vigil run --log-dir OUT` then plays the missing ones."
        ),
    ] = False
    force: Annotated[bool, Setting("Join the shards although different models or programs answered in them.")] = False
    pack: shared.PackLocation = None


@dataclass(frozen=True, slots=True, kw_only=True)
class FinishedProbeSettings:
    """Settings for probing a finished run. The model and its sampling settings are taken from the run."""

    steps: shared.ProbeSteps = None
    framing: shared.ProbeFraming = "state"
    base_url: shared.BaseUrl = None
    api_key_env: shared.ApiKeyEnv = None
    max_connections: Annotated[
        int, Setting("Maximum number of requests that are sent to the model at the same time.", minimum=1, metavar="N")
    ] = 16
    reply_seconds: Annotated[int, Setting("Time limit in seconds for each reply.", minimum=1, metavar="SECONDS")] = (
        REPLY_SECONDS
    )
    prices: shared.PricesOption = None
    force: Annotated[bool, Setting("Ask although the model has changed since the run was played.")] = False
    workers: shared.Workers = None
    pack: shared.PackLocation = None
    asset_database: shared.AssetFile = None
    retries: Annotated[
        int, Setting("Number of times that a failed request is sent again.", minimum=0, is_option=False)
    ] = 8
    first_wait_s: float = 1.0
    timeout_s: float = WORKER_TIMEOUT_S

    def __post_init__(self) -> None:
        check_settings(self)
