"""Settings of a run, as a user gives them. `vigil.runner.plan` works out what follows from them."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal, get_args

from vigil.agents.agent import FRAME_INTERVAL_SECONDS, REPLY_SECONDS
from vigil.base.settings import Setting, check_settings
from vigil.errors import SettingError
from vigil.packs.private import REVEAL_HELP
from vigil.protocol.actions import ReplyPolicy
from vigil.protocol.profile import ImageFormat
from vigil.protocol.prompt_file import check_template
from vigil.records.record import MAX_EPOCHS, Shard
from vigil.records.shards import parse_shard
from vigil.runner.option_parsing import read_extra_body, read_model_args, single_value
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
from vigil.runner.workers.messages import PrivilegedFactory, SimulatorFactory
from vigil.runner.workers.process import WORKER_TIMEOUT_S

ReasoningEffort = Literal["none", "minimal", "low", "medium", "high", "xhigh", "max"]
_EFFORT_HELP = f"How much a model reasons: {', '.join(get_args(ReasoningEffort))}. The provider's default if unset."
_DEFAULT = "the provider's default if unset."


@dataclass(frozen=True, slots=True, kw_only=True)
class RunSettings:
    """The settings of `vigil run`. Exactly one of `agent` and `model` is set.

    A field with a `Setting` is also an option of the command line. Raises SettingError when a value is out of bounds.
    """

    pack: PackName = "starter"
    agent: Annotated[
        str | None,
        Setting(
            "Agent that plays: solver, random, noop ... or exec:COMMAND.",
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
            "Model that plays: provider/model, as Inspect names it.",
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
        int | None, Setting("Play only N episodes, drawn evenly from the families or kinds.", minimum=1, metavar="N")
    ] = None
    families: Families = ()
    episode_ids: EpisodeIds = ()
    workers: Workers = None
    executor: Annotated[
        Literal["local", "ray"], Setting("Where simulators run: here, or on the nodes of a Ray cluster.")
    ] = "local"
    ray_address: Annotated[
        str | None, Setting("Address of a Ray cluster.", metavar="HOST:PORT", unset="RAY_ADDRESS, or a local Ray")
    ] = None
    max_connections: Annotated[
        int, Setting("Maximum number of episodes and requests at the same time.", minimum=1, metavar="N")
    ] = 16
    profile: ProfileOption = "baseline"
    prompt_variant: PromptVariantOption = "default"
    prompt_template: PromptFileOption = None
    coordinates: CoordinatesOption = None
    """Coordinate system of the model's clicks; None for the published table's entry for the model."""
    reply_policy: Annotated[
        ReplyPolicy, Setting("How replies are read; lenient strips a code fence or prose around the JSON.")
    ] = "strict"
    system_role: SystemRoleOption = "system"
    shard: Annotated[
        Shard | None, Setting("Play only part I of N of the episodes, e.g. 2/8.", metavar="I/N", read=parse_shard)
    ] = None
    """Part of the episodes to play; `vigil.runner.merge` joins the parts."""
    epochs: Annotated[
        int, Setting("Number of times to play each episode.", minimum=1, maximum=MAX_EPOCHS, metavar="N")
    ] = 1
    temperature: Annotated[float | None, Setting(f"Sampling temperature; {_DEFAULT}")] = None
    top_p: Annotated[float | None, Setting(f"Nucleus sampling probability; {_DEFAULT}")] = None
    max_tokens: Annotated[int | None, Setting(f"Maximum tokens of a reply; {_DEFAULT}", minimum=1, metavar="N")] = None
    reasoning_effort: Annotated[ReasoningEffort | None, Setting(_EFFORT_HELP, metavar="LEVEL")] = None
    thinking: ThinkingOption = "default"
    model_args: Annotated[
        Mapping[str, Any],
        Setting(
            "Argument of the provider's client, as K=V; may be repeated.",
            "model-arg",
            metavar="K=V",
            read=read_model_args,
            repeats=True,
        ),
    ] = field(default_factory=dict[str, Any])
    extra_body: Annotated[
        Mapping[str, Any], Setting("JSON object added to every request.", metavar="JSON", read=read_extra_body)
    ] = field(default_factory=dict[str, Any])
    image_format: Annotated[ImageFormat, Setting("Format in which frames are sent.")] = "png"
    render_quality: RenderQuality = "default"
    prices: PricesOption = None
    save_frames: Annotated[bool, Setting("Save every frame, named by its content hash.")] = False
    keep_reasoning: Annotated[
        bool, Setting("Save the reasoning that a model returns apart from its replies, in reasoning.jsonl.")
    ] = False
    backend: Backend = "mujoco"
    simulator_factory: SimulatorFactory | None = None
    """Factory of a custom simulator; `backend` is then only its name in the header. Must be picklable."""
    asset_database: AssetFile = None
    reply_seconds: Annotated[int, Setting("Time limit of one reply.", minimum=1, metavar="SECONDS")] = REPLY_SECONDS
    """Time limit of one reply of a model or a program."""
    frame_interval_seconds: Annotated[
        float,
        Setting(
            "A program gets its next frame a whole number of these periods after its reply; 0: as soon as it is ready.",
            minimum=0,
            maximum=60,
            metavar="SECONDS",
        ),
    ] = FRAME_INTERVAL_SECONDS
    keep_program: Annotated[
        bool, Setting("Use one process and folder of a program for all episodes of a worker, not one for each episode.")
    ] = False
    seed: Annotated[int, Setting("Random seed of the schedule and the scripted agents.")] = 0
    preflight: Annotated[
        bool, Setting("Skip the check that the model sees pictures and answers in the required form.")
    ] = True
    force: Annotated[
        bool,
        Setting("Continue although the check's example failed, or a different model or program answers than before."),
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
