"""Settings that several commands and dataclasses share; each is declared once, here. The functions at the end read
settings from the texts of a command line; their messages do not reveal secrets."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from vigil.base.json_files import is_object, read_json
from vigil.base.settings import Setting
from vigil.errors import SettingError
from vigil.protocol.actions import Coordinates, ReplyPolicy
from vigil.protocol.observation import Quality
from vigil.protocol.profile import PromptVariant, SystemRole
from vigil.protocol.prompt_file import read_prompt_file
from vigil.protocol.reasoning import Thinking
from vigil.runner.models.redaction import Secrets, without_option_secrets

if TYPE_CHECKING:
    from vigil.protocol.families import Family
    from vigil.records.costs import Prices
    from vigil.scoring.probe_schedule import ProbeSchedule

PackName = Annotated[
    str | Path,
    Setting("Pack whose episodes are used: its folder, or the name of a pack that comes with VIGIL.", metavar="PACK"),
]
PackLocation = Annotated[
    str | Path | None,
    Setting(
        "Pack on which the run was played, as folder or name; needed if the pack's folder has moved.",
        metavar="PACK",
        unset="the pack that the run recorded",
    ),
]
Families = Annotated[
    "tuple[Family, ...]",
    Setting(
        "Use only the tasks of this family, e.g. SM; may be repeated. All families if unset.",
        name="family",
        metavar="FAMILY",
        read="vigil.protocol.families:parse_families",
        repeats=True,
    ),
]
EpisodeIds = Annotated[
    tuple[str, ...],
    Setting("Use only the episode with this id; may be repeated. All episodes if unset.", name="episode", metavar="ID"),
]
BaseUrl = Annotated[
    str | None,
    Setting(
        "Address of an OpenAI-compatible server that answers for the model; the provider's own server if unset.",
        metavar="URL",
    ),
]
ApiKeyEnv = Annotated[
    str | None,
    Setting(
        "Name of the environment variable that holds the model's API key. If unset, the provider's "
        "own variable is used, and its key is sent only to the provider.",
        metavar="VAR",
    ),
]
ProfileOption = Annotated[
    str,
    Setting(
        "Evaluation profile: baseline (the agent gets only frames), action_feedback (it also gets "
        "feedback on each action), itemised_report (its report has a claim about each chore of a list), one of "
        "the profiles in docs/beliefs.md, which change how an episode is closed or what the agent sees, e.g. "
        "look_before_report, or a profile's full name.",
        metavar="NAME",
    ),
]
PromptVariantOption = Annotated[
    PromptVariant,
    Setting("Which of the paper's two wordings of the system prompt the agent gets.", name="prompt-variant"),
]
PromptFileOption = Annotated[
    str | None,
    Setting(
        "Text file with your own system prompt, which replaces the default one; <TASK_INSTRUCTION> in "
        "it marks where the instruction goes.",
        name="prompt-file",
        metavar="FILE",
        read=read_prompt_file,
    ),
]
CoordinatesOption = Annotated[
    Coordinates | None,
    Setting(
        "How the model gives the position of a click: in pixels of the frame (pixel), or as 0 to 1000 "
        "across and down the frame (normalized_1000).",
        unset="the model's published coordinates if known, otherwise pixel",
    ),
]
ReplyPolicyOption = Annotated[
    ReplyPolicy,
    Setting(
        "How a reply is read: strict accepts only one JSON object; lenient also accepts it inside a "
        "code fence or prose."
    ),
]
SystemRoleOption = Annotated[
    SystemRole,
    Setting(
        "How the system prompt is sent: system sends it as a separate message; user puts it at the "
        "start of the first user message."
    ),
]
ThinkingOption = Annotated[
    Thinking,
    Setting(
        "Whether the model thinks before it answers: on and off set the provider's own switch; default does not set it."
    ),
]
PricesOption = Annotated[
    "Prices | None",
    Setting(
        "Price of a million input tokens and of a million output tokens, e.g. 2.5,10; used to show what the run costs.",
        metavar="IN,OUT",
        read="vigil.records.costs:parse_prices",
    ),
]
ProbeSteps = Annotated[
    "ProbeSchedule | None",
    Setting(
        "Steps at which the model is also asked what it believes; this does not change the episode. Write every, a "
        "number N (every N-th step and the last), at-goal (the first step whose frame shows the goal attained), "
        "at-report (the last step), or several of these with commas between.",
        metavar="STEPS",
        read="vigil.scoring.probe_schedule:parse_schedule",
        unset="none in vigil run, every in vigil probe",
    ),
]
ProbeFraming = Annotated[
    Literal["state", "doubt", "both"],
    Setting(
        "How a probe asks: state asks whether the task is done; doubt first asks what speaks against this; both asks "
        "in both ways."
    ),
]
LogDir = Annotated[
    Path | None,
    Setting(
        "Folder in which the run is recorded; a folder under runs/ if unset. The same command "
        "continues an interrupted run."
    ),
]
Backend = Annotated[
    str,
    Setting(
        "Simulator in which episodes are played: mujoco (VIGIL's own), thor (AI2-THOR), or fake (no "
        "physics engine and coarse pictures, for tests).",
        metavar="NAME",
    ),
]
RenderQuality = Annotated[
    Quality,
    Setting(
        "Quality of the frames; fast is coarser than default and draws about twice as many frames per second.",
        name="render-quality",
    ),
]
Workers = Annotated[
    int | None,
    Setting(
        "Number of processes that share the work; the result does not depend on it.",
        minimum=1,
        metavar="N",
        unset="one per CPU",
    ),
]
AssetFile = Annotated[
    Path | None,
    Setting(
        "AI2-THOR's asset-database.json, which gives the sizes of THOR's assets in ProcTHOR's houses. "
        "Without it, typical sizes are used.",
        name="assets",
        metavar="FILE",
        env="VIGIL_ASSETS",
    ),
]


def public_name(agent: str) -> str:
    """Return an agent's name without the secrets in a program's command line."""
    from vigil.agents.registry import is_exec  # noqa: PLC0415 - loads the agents

    return Secrets.of().redact(without_option_secrets(agent)) if is_exec(agent) else agent


def single_value(option: str) -> Callable[[Sequence[str]], str]:
    """Return a function that reads an option that may be given only once; it raises SettingError on more values."""

    def read(texts: Sequence[str]) -> str:
        if len(texts) == 1:
            return texts[0]
        given = ", ".join(map(public_name, texts))
        raise SettingError(
            f"{option} is given {len(texts)} times ({given}), but a run takes only one. Run each with a separate "
            "--log-dir, then compare them: vigil score RUN RUN."
        )

    return read


def read_model_args(pairs: Sequence[str]) -> dict[str, Any]:
    """Return the pairs `K=V` as {K: V}; a value that is not JSON is a string. Raises SettingError."""
    found: dict[str, Any] = {}
    for pair in pairs:
        name, sign, value = pair.partition("=")
        if not sign or not name:
            shown = without_option_secrets(pair)
            raise SettingError(f"--model-arg {shown!r} is not K=V, e.g. --model-arg api_version=2024-10-21.")
        try:
            found[name] = read_json(value)
        except ValueError:
            found[name] = value
    return found


def read_extra_body(text: str) -> dict[str, Any]:
    """Return the JSON object in `text`. Raises SettingError."""
    try:
        found = read_json(text)
    except ValueError as error:
        raise SettingError(f"--extra-body is not JSON: {error}.") from None
    if not is_object(found):
        raise SettingError("--extra-body must be a JSON object, e.g. '{\"top_k\": 20}'.")
    return found
