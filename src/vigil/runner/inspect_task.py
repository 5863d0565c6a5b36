"""Runs of models as Inspect evaluations, for `vigil run` and for `inspect eval`.

Inspect brings the providers, the limit on connections, and a log for its viewer. The messages, the retries
(`vigil.runner.models.ask`), the Env and the records are VIGIL's own. The results of `vigil run` are the records in
`episodes.jsonl`, not Inspect's log.
"""

import asyncio
import gc
import inspect
import warnings
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from inspect_ai import Task, task
from inspect_ai import eval as inspect_eval  # pyright: ignore[reportUnknownVariableType] - has untyped parameters
from inspect_ai._util.error import PrerequisiteError
from inspect_ai.dataset import MemoryDataset, Sample
from inspect_ai.log import EvalLog
from inspect_ai.model import (
    ChatMessageAssistant,
    ChatMessageUser,
    GenerateConfig,
    Model,
    get_model,
)
from inspect_ai.scorer import Score, Scorer, Target, grouped, mean, scorer
from inspect_ai.solver import Generate, Solver, TaskState, solver
from rich.markup import escape

from vigil.base.settings import declared_settings
from vigil.errors import InputError, ModelAPIError, SettingError, VigilError, did_you_mean
from vigil.packs.private import check_revealed, is_private
from vigil.protocol.actions import Coordinates
from vigil.protocol.episode import Episode
from vigil.protocol.profile import Profile, coordinates_for
from vigil.protocol.prompt import frame_stub
from vigil.records.record import EpisodeRecord
from vigil.runner.models.access import hiding_other_keys, model_access
from vigil.runner.models.ask import with_retries
from vigil.runner.models.inspect_model import PREFLIGHT_RETRIES, ModelClient, model_at, sender
from vigil.runner.models.network import disable_redirects
from vigil.runner.models.preflight import check_model
from vigil.runner.models.providers import parse_model_name
from vigil.runner.models.redaction import without_login
from vigil.runner.plan import RunPlan, plan_run
from vigil.runner.retries import RetryPolicy
from vigil.runner.settings import RunSettings
from vigil.runner.workers.messages import Assignment
from vigil.runner.workers.players import ModelPlayer, PlayOne
from vigil.runner.workers.pool import SimulatorPool, worker_count
from vigil.scoring.outcomes import score

_PREFIX = "" if {"site-packages", "dist-packages"} & set(Path(__file__).parts) else "vigil/"
"""Prefix of the names that are registered with Inspect.

Inspect adds the package's name by itself, except in an editable install whose distribution is named differently.
"""
_SHARED_SETTINGS = {
    *("pack", "families", "profile", "prompt_variant", "prompt_template", "coordinates", "reply_policy"),
    *("image_format", "system_role", "backend", "workers", "preflight", "force", "api_key_env"),
    "reveal_private_pack",
}
TASK_SETTINGS = {
    one.option.replace("-", "_"): one for one in declared_settings(RunSettings) if one.name in _SHARED_SETTINGS
}
"""Name of an option -> setting of a run, for the settings that Inspect does not have."""
_KEYWORD_ONLY = inspect.Parameter.KEYWORD_ONLY
PLACEHOLDER_MODEL = "mockllm/model"
"""Model name that stands in the settings until the name of Inspect's model is known."""


def evaluate(
    client: ModelClient,
    assignments: Sequence[Assignment],
    play_one: PlayOne,
    log_dir: Path,
    *,
    keep_samples: bool = True,
) -> None:
    """Play all `assignments`. Raises what `play_one` raises, or KeyboardInterrupt after an interruption.

    With `keep_samples=False` (for a private pack), Inspect's log has only rates, and numbers instead of episode ids.
    """
    stop: list[VigilError] = []
    closer = _ConnectionCloser(client.model, play_one, len(assignments))
    with _rare_garbage_collection(), warnings.catch_warnings():
        # pydantic warns about unusual answers of a server when Inspect writes its log
        warnings.filterwarnings("ignore", message="Pydantic serializer warnings", category=UserWarning)
        logs = inspect_eval(
            _task(assignments, closer.play_one, stop, is_numbered=not keep_samples),
            model=client.loggable_model(),
            log_dir=str(log_dir),
            display="none",
            score_display=False,
            max_samples=client.endpoint.max_connections,
            fail_on_error=False,
            log_images=False,
            log_samples=keep_samples,
            log_realtime=False,
            log_model_api=False,
            ctl_server=False,
            acp_server=False,
        )
    if stop:
        raise stop[0]
    _check(logs, 0 if keep_samples else len(assignments) - closer.played)


@contextmanager
def _rare_garbage_collection() -> Generator[None, None, None]:
    """Run the garbage collector rarely; otherwise it takes a quarter of a run's time, mostly for imported modules."""
    gc.collect()
    gc.freeze()
    usual = gc.get_threshold()
    gc.set_threshold(50_000, 20, 50)
    try:
        yield
    finally:
        gc.set_threshold(*usual)
        gc.unfreeze()


class _ConnectionCloser:
    """Player that closes the model's connections after the last episode, while the event loop still runs."""

    def __init__(self, model: Model, play_one: PlayOne, episodes: int) -> None:
        self._model = model
        self._play_one = play_one
        self._left = episodes
        self._alive = 0
        self.played = 0
        """Number of episodes that have ended, including those that ended with infrastructure errors."""

    async def play_one(self, assignment: Assignment) -> EpisodeRecord:
        self._left -= 1
        self._alive += 1
        try:
            record = await self._play_one(assignment)
            self.played += 1
            return record
        except VigilError:
            self._left = 0
            raise
        finally:
            self._alive -= 1
            if self._left == 0 and self._alive == 0:
                await self._model.api.aclose()


def _check(logs: list[EvalLog], missing: int) -> None:
    if not logs or any(log.status == "cancelled" for log in logs):
        raise KeyboardInterrupt  # Inspect has handled the signal and does not raise it again
    for log in logs:
        faults = [sample.error.message for sample in log.samples or [] if sample.error is not None]
        if log.status != "success" or faults or missing:
            reasons = "; ".join(faults[:3]) or f"{missing} episodes broke off"
            what = reasons if log.error is None else log.error.message
            raise ModelAPIError(f"Inspect's evaluation ended as {log.status!r}: {what}. See {log.location}.")


def _task(
    assignments: Sequence[Assignment],
    play_one: PlayOne,
    stop: list[VigilError] | None = None,
    *,
    is_numbered: bool = False,
    **more: Any,
) -> Task:
    """Return Inspect's task. With `is_numbered`, its samples have numbers instead of ids, to keep ids secret."""
    by_id: dict[str, Assignment] = {}
    for number, assignment in enumerate(assignments, start=1):
        name = assignment.episode.id if assignment.epoch == 1 else f"{assignment.episode.id}@{assignment.epoch}"
        by_id[str(number) if is_numbered else name] = assignment
    samples = [
        Sample(
            id=name,
            input=assignment.episode.instruction,
            metadata={"family": assignment.episode.family, "episode": assignment.episode.model_dump(mode="json")},
        )
        for name, assignment in by_id.items()
    ]
    agent = _agent(by_id, play_one, stop)
    return Task(dataset=MemoryDataset(samples, name="vigil"), solver=agent, scorer=vigil_score(), name="vigil", **more)


def _agent(by_id: Mapping[str, Assignment], play_one: PlayOne, stop: list[VigilError] | None) -> Solver:
    """Return Inspect's solver; an error that stops the run is appended to `stop`, or raised when `stop` is None."""

    @solver(name="vigil_agent")
    def vigil_agent() -> Solver:
        async def solve(state: TaskState, generate: Generate) -> TaskState:
            if stop:
                return state
            assignment = by_id[str(state.sample_id)]
            if state.epoch > 1:
                assignment = replace(assignment, epoch=state.epoch)
            try:
                record = await play_one(assignment)
            except VigilError as error:
                if stop is None:
                    raise
                stop.append(error)
                return state
            state.metadata["record"] = record.model_dump(mode="json")
            state.messages = []  # the episode as Inspect's viewer shows it
            for step in record.steps:
                frame = ChatMessageUser(content=frame_stub("past", None))
                state.messages += [frame, ChatMessageAssistant(content=step.reply.text)]
            state.completed = True
            return state

        return solve

    return vigil_agent()


@scorer(name=f"{_PREFIX}vigil_score", metrics={"*": [grouped(mean(), "family")]})
def vigil_score() -> Scorer:
    """Score a sample from the record that it contains, so that `inspect score` can score it again."""

    async def score_sample(state: TaskState, target: Target) -> Score | None:
        if "record" not in state.metadata:
            return None
        record = EpisodeRecord.model_validate(state.metadata["record"])
        if record.end == "error":
            return None
        outcome = score(Episode.model_validate(state.metadata["episode"]), record)
        value = {"W": float(outcome.W), "W_strict": float(outcome.W_strict)}
        if outcome.has_report:
            value["B"] = float(outcome.B)
            value |= {label: float(outcome.label == label) for label in ("FR", "NR", "IL", "Other")}
        return Score(value=dict(value), answer=outcome.reported, explanation=outcome.subtype)

    return score_sample


def _with_parameters(make: Callable[..., Task]) -> Callable[..., Task]:
    """Return `make` with the signature in which Inspect looks for arguments: one argument for each of TASK_SETTINGS."""
    parameters = [inspect.Parameter(name, _KEYWORD_ONLY, default=one.default) for name, one in TASK_SETTINGS.items()]
    make.__signature__ = inspect.Signature(parameters)  # pyright: ignore[reportFunctionMemberAccess] - Inspect reads it
    return make


@task(name=f"{_PREFIX}vigil")
@_with_parameters
def vigil(**given: Any) -> Task:
    """A pack as an Inspect task: `inspect eval vigil/vigil --model provider/model -T pack=starter`.

    The results are in Inspect's log, and Inspect manages epochs, retries and resuming; only `vigil run` writes
    `episodes.jsonl`. The key in a provider's usual variable is sent only to the provider's own hosts. For any other
    address, `api_key_env` names the variable with the key.
    """
    try:
        settings = RunSettings(model=PLACEHOLDER_MODEL, **task_settings(given))
        plan = plan_run(settings)
        check_revealed(
            plan.pack.name,
            is_private(plan.pack.manifest.meta),
            "Inspect's log, with each prompt, reply and hidden state,",
            reveals=settings.reveal_private_pack,
            by="-T reveal_private_pack=true (`vigil run` plays it and keeps a log without them)",
        )
    except InputError as error:
        raise PrerequisiteError(f"ERROR: {escape(str(error))}") from None  # Inspect prints it without a traceback
    assignments = [Assignment(episode) for episode in plan.episodes]
    metadata = {"pack_sha256": plan.spec.pack_sha256, "prompt_policy_sha256": plan.spec.prompt_policy_sha256}
    session = _InspectSession(plan, settings.coordinates, settings.api_key_env)
    return _task(assignments, session.play_one, metadata=metadata)


def task_settings(given: Mapping[str, Any]) -> dict[str, Any]:
    """Return {field name: value}, a run's settings, from the arguments of the task. Raises SettingError."""
    found: dict[str, Any] = {}
    for name, text in given.items():
        if name not in TASK_SETTINGS:
            hint = did_you_mean(name, TASK_SETTINGS)
            raise SettingError(
                f"The task does not have an argument {name!r}.{hint} It takes: {', '.join(TASK_SETTINGS)}."
            )
        one = TASK_SETTINGS[name]
        takes_texts = one.setting.repeats and isinstance(text, str)
        found[one.name] = one.value([text] if takes_texts else text)
    return found


class _InspectSession:
    """Player inside an evaluation that `inspect eval` has started. Simulators are made when they are first needed.

    A model is checked before its first episode, as in `vigil run`. Whenever no episode is being played, the model
    clients that this session made are closed, because the event loop may end soon.
    """

    def __init__(self, plan: RunPlan, coordinates: Coordinates | None, api_key_env: str | None) -> None:
        """If `coordinates` is None, each model uses the coordinate system that the published table has for it.

        `api_key_env` names the variable with the key for an address that is not the provider's.
        """
        self._plan = plan
        self._coordinates = coordinates
        self._api_key_env = api_key_env
        self._pools: dict[Profile, SimulatorPool] = {}
        self._checked: set[str] = set()
        self._models: dict[str, Model] = {}
        self._made: set[str] = set()
        """Names of the models whose clients this session made. Inspect made the others."""
        self._alive = 0
        self._one_at_a_time = asyncio.Lock()

    async def play_one(self, assignment: Assignment) -> EpisodeRecord:
        self._alive += 1
        try:
            return await self._play(assignment)
        finally:
            self._alive -= 1
            if self._alive == 0:  # Inspect may still use its own clients, so these stay open
                made = [self._models.pop(name) for name in sorted(self._made)]
                self._made.clear()
                for model in made:
                    await model.api.aclose()

    async def _play(self, assignment: Assignment) -> EpisodeRecord:
        model = self._model()
        coordinates = self._coordinates or coordinates_for(str(get_model()))
        profile = self._plan.spec.profile.model_copy(update={"coordinates": coordinates})
        await self._check(model, profile)
        if profile not in self._pools:
            plan = replace(self._plan.worker, run_id="inspect", profile=profile)
            self._pools[profile] = SimulatorPool(plan, worker_count(self._plan.execution.workers))
        player = ModelPlayer(self._pools[profile], profile, with_retries(sender(model), RetryPolicy()), "inspect")
        record = await player.play(assignment)
        if record.error is not None:
            raise RuntimeError(f"{record.error.boundary}: {record.error.message}")
        return record

    def _model(self) -> Model:
        """Return Inspect's active model, with the key that may be sent to its address. Raises SettingError."""
        active = get_model()
        name = str(active)
        if name not in self._models:
            self._models[name] = _with_key(active, self._api_key_env)
            if self._models[name] is not active:
                self._made.add(name)
        return self._models[name]

    async def _check(self, model: Model, profile: Profile) -> None:
        execution = self._plan.execution
        async with self._one_at_a_time:
            if execution.preflight and str(model) not in self._checked:
                send = sender(model, GenerateConfig(max_retries=0))  # Inspect's default is without limit
                ask = with_retries(send, RetryPolicy(retries=PREFLIGHT_RETRIES))
                address = without_login(model.api.base_url or "")
                await check_model(ask, str(model), profile, address, force=execution.force)
                self._checked.add(str(model))


def _with_key(active: Model, api_key_env: str | None) -> Model:
    """Return `active`, or a copy with another key if Inspect would send a provider's key to a host that is not the
    provider's."""
    if not parse_model_name(str(active)).is_known:
        return active
    found = model_access(str(active), active.api.base_url, active.model_args, api_key_env)
    model = active
    if found.is_foreign or api_key_env is not None:
        with hiding_other_keys(found):
            model = model_at(found, active.config)
    disable_redirects(model.api)
    return model
