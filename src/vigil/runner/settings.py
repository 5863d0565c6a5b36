"""Settings of a run, and what they come to: the pack, the episodes, the profile, the run's identity."""

import hashlib
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from vigil.agents.agent import REPLY_SECONDS
from vigil.agents.choose import is_exec, make_agent
from vigil.episode import Episode, Family
from vigil.errors import SettingError
from vigil.pack import Pack, Selection
from vigil.profile import BASELINE, Coordinates, ImageFormat, Profile, PromptVariant, ReplyPolicy, coordinates_for
from vigil.prompt import policy_sha256, policy_version
from vigil.record import AgentKind, RunSpec
from vigil.runner.pool import PATIENCE_S
from vigil.runner.redaction import Secrets, without_login, without_options, without_secrets
from vigil.runner.serving import Serving, serving
from vigil.runner.wire import Plan, PrivilegedFactory, Quality, SimulatorFactory
from vigil.sim import BACKENDS
from vigil.versions import Versions

RUNS_FOLDER = Path("runs")


@dataclass(frozen=True, slots=True, kw_only=True)
class RunSettings:
    """All that `vigil run` takes. Exactly one of `agent` and `model` is set."""

    pack: str | Path = "starter"
    agent: str | None = None
    """A scripted agent, `exec:COMMAND`, or a privileged one that `agent_factory` makes."""
    agent_factory: PrivilegedFactory | None = None
    model: str | None = None
    """`provider/model` as Inspect knows it."""
    base_url: str | None = None
    api_key_env: str | None = None
    """The variable that holds the key; None for the provider's own, which goes to its own hosts alone."""
    log_dir: Path | None = None
    """The run's folder; None for one under `runs/` that the same settings find again."""
    families: tuple[Family, ...] = ()
    episode_ids: tuple[str, ...] = ()
    limit: int | None = None
    epochs: int = 1
    workers: int | None = None
    """Simulator processes; None for one a CPU."""
    max_connections: int = 16
    """Requests to the model, and episodes alive, at once."""
    profile: str = BASELINE
    prompt_variant: PromptVariant = "default"
    coordinates: Coordinates | None = None
    """None takes the published table's entry for the model."""
    reply_policy: ReplyPolicy = "strict"
    image_format: ImageFormat = "png"
    temperature: float | None = None
    top_p: float | None = None
    max_tokens: int | None = None
    reasoning_effort: str | None = None
    extra_body: Mapping[str, Any] = field(default_factory=dict)
    model_args: Mapping[str, Any] = field(default_factory=dict)
    backend: str = "mujoco"
    simulator_factory: SimulatorFactory | None = None
    """Makes a simulator of one's own, which `backend` then only names in the header. Must be picklable."""
    render_quality: Quality = "default"
    asset_database: Path | None = None
    save_frames: bool = False
    preflight: bool = True
    retries: int = 8
    first_wait_s: float = 1.0
    longest_wait_s: float = 60.0
    """Between two tries of a request, whatever the provider asks for."""
    reply_seconds: int = REPLY_SECONDS
    """How long one reply of a model or a program may take."""
    patience_s: float = PATIENCE_S
    seed: int = 0


def plan_run(settings: RunSettings) -> tuple[Pack, list[Episode], RunSpec]:
    """Returns the pack, the episodes to play and the run's identity. Raises InputError."""
    _check(settings)
    pack = Pack.load(settings.pack)
    episodes = pack.select(Selection(settings.families, settings.episode_ids, settings.limit))
    profile = profile_of(settings)
    sampling = {
        "temperature": settings.temperature,
        "top_p": settings.top_p,
        "max_tokens": settings.max_tokens,
        "reasoning_effort": settings.reasoning_effort,
        "extra_body": dict(settings.extra_body) or None,
    }
    spec = RunSpec(
        agent=settings.model or public_name(settings.agent or ""),
        agent_kind=_kind(settings),
        base_url=_address(settings),
        sampling=without_secrets({name: value for name, value in sampling.items() if value is not None}),
        model_args=without_secrets(settings.model_args),
        profile=profile,
        versions=Versions.here(),
        prompt_policy=policy_version(profile),
        prompt_policy_sha256=policy_sha256(profile),
        pack=pack.name,
        pack_sha256=pack.sha256,
        pack_versions=pack.manifest.versions,
        episode_ids=tuple(episode.id for episode in episodes),
        epochs=settings.epochs,
        seed=settings.seed,
        simulator=settings.backend,
        asset_database_sha256=file_sha256(settings.asset_database) if settings.asset_database else None,
        render_quality=settings.render_quality,
    )
    return pack, episodes, spec


def profile_of(settings: RunSettings) -> Profile:
    """Returns the condition of evaluation that the settings ask for."""
    fitting = coordinates_for(settings.model) if settings.model else "pixel"
    fields = {
        "name": settings.profile,
        "prompt_variant": settings.prompt_variant,
        "coordinates": settings.coordinates or fitting,
        "reply_policy": settings.reply_policy,
        "image_format": settings.image_format,
    }
    try:
        return Profile.model_validate(fields)
    except ValidationError as error:
        fault = error.errors()[0]
        raise SettingError(f"Profile: {fault['loc'][0]} is {fault['input']!r}. {fault['msg']}.") from None


def worker_plan(
    settings: RunSettings, pack: Pack, profile: Profile, *, run_id: str = "", frames: Path | None = None
) -> Plan:
    """Returns what the simulator workers are told."""
    return Plan(
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
        seed=settings.seed,
    )


def file_sha256(path: Path) -> str:
    """Returns the SHA-256 of a file. Raises SettingError when it is not there."""
    if not path.is_file():
        raise SettingError(f"Asset database {str(path)!r} does not exist. Give the path of an asset-database.json.")
    return hashlib.sha256(path.read_bytes()).hexdigest()


def log_dir(settings: RunSettings, spec: RunSpec) -> Path:
    """Returns the run's folder: as set, or one under `runs/` named after what the run is."""
    if settings.log_dir is not None:
        return settings.log_dir
    identity = spec.model_copy(update={"base_url": None}).model_dump_json()
    words = "".join(char if char.isalnum() or char in "._" else "-" for char in f"{spec.pack}-{spec.agent}")
    return RUNS_FOLDER / f"{words[:80].strip('-')}-{hashlib.sha256(identity.encode()).hexdigest()[:8]}"


def _address(settings: RunSettings) -> str | None:
    """Returns where the model is served, as the header keeps it; None when the provider decides."""
    if settings.model is None:
        return None
    url = serving_of(settings).base_url
    return None if url is None else without_login(url)


def serving_of(settings: RunSettings) -> Serving:
    """Returns how the run's model is reached. Raises SettingError."""
    return serving(settings.model or "", settings.base_url, settings.model_args, settings.api_key_env)


def public_name(agent: str) -> str:
    """Returns an agent's name without the secrets in the command line of a program."""
    return Secrets.of_command("").hide(without_options(agent)) if is_exec(agent) else agent


def secrets_of(settings: RunSettings) -> Secrets:
    """Returns the values that no file, message or table of the run may hold. Raises SettingError."""
    found = serving_of(settings) if settings.model is not None else None
    return Secrets.of(
        command=settings.agent or "",
        url=None if found is None else found.base_url,
        settings=({"model_args": settings.model_args, "extra_body": settings.extra_body},),
        key="" if found is None else found.api_key or "",
    )


def _kind(settings: RunSettings) -> AgentKind:
    if settings.model is not None:
        return "model"
    if settings.agent_factory is not None:
        return "privileged"
    return "exec" if is_exec(settings.agent or "") else "scripted"


def _check(settings: RunSettings) -> None:
    if (settings.agent is None) == (settings.model is None):
        raise SettingError("A run needs an agent or a model: give exactly one of --agent and --model.")
    for name, least in (("epochs", 1), ("max_connections", 1), ("retries", 0), ("reply_seconds", 1)):
        if getattr(settings, name) < least:
            raise SettingError(f"Setting {name} is {getattr(settings, name)}; it must be {least} or more.")
    for name in ("temperature", "top_p"):
        value = getattr(settings, name)
        if value is not None and not math.isfinite(value):
            raise SettingError(f"Setting {name} is {value}; it must be a finite number.")
    if settings.workers is not None and settings.workers < 1:
        raise SettingError(f"Setting workers is {settings.workers}; it must be 1 or more.")
    if settings.backend not in BACKENDS and settings.simulator_factory is None:
        raise SettingError(f"Simulator {settings.backend!r} does not exist. Choose one of: {', '.join(BACKENDS)}.")
    if settings.agent is not None and settings.agent_factory is None:
        make_agent(settings.agent, Profile())
    if settings.model is not None:
        serving_of(settings)
