"""Settings that several verbs and dataclasses share, each declared once."""

from pathlib import Path
from typing import Annotated

from vigil.base.settings import Setting
from vigil.protocol.actions import Coordinates
from vigil.protocol.families import Family, parse_families
from vigil.protocol.observation import Quality
from vigil.protocol.profile import PromptVariant, SystemRole
from vigil.protocol.prompt_file import read_prompt_file
from vigil.protocol.reasoning import Thinking
from vigil.records.costs import Prices, parse_prices

PackName = Annotated[str | Path, Setting("A pack's folder, or the name of a packaged one.", metavar="PACK")]
PackLocation = Annotated[
    str | Path | None, Setting("Folder or name of the run's pack.", metavar="PACK", unset="as recorded")
]
Families = Annotated[
    tuple[Family, ...],
    Setting(
        "Use only this family; may be repeated.", name="family", metavar="FAMILY", read=parse_families, repeats=True
    ),
]
EpisodeIds = Annotated[
    tuple[str, ...], Setting("Use only this episode; may be repeated.", name="episode", metavar="ID")
]
BaseUrl = Annotated[str | None, Setting("Address of an OpenAI-compatible server.", metavar="URL")]
ApiKeyEnv = Annotated[
    str | None,
    Setting("Environment variable that holds the key for this model, e.g. for a server at --base-url.", metavar="VAR"),
]
ProfileOption = Annotated[
    str, Setting("Evaluation profile: baseline, action_feedback, or a profile's full name.", metavar="NAME")
]
PromptVariantOption = Annotated[PromptVariant, Setting("Variant of the system prompt.", name="prompt-variant")]
PromptFileOption = Annotated[
    str | None,
    Setting(
        "File with a custom system prompt, with placeholders.",
        name="prompt-file",
        metavar="FILE",
        read=read_prompt_file,
    ),
]
CoordinatesOption = Annotated[Coordinates | None, Setting("Coordinate system of the model's clicks.", unset="by model")]
SystemRoleOption = Annotated[
    SystemRole, Setting("Role of the system prompt; user puts it at the start of the first user message.")
]
ThinkingOption = Annotated[Thinking, Setting("Turn thinking on or off, with the provider's own switch.")]
PricesOption = Annotated[
    Prices | None,
    Setting(
        "Prices per million tokens, input and output; prints the cost so far.", metavar="IN,OUT", read=parse_prices
    ),
]
LogDir = Annotated[Path | None, Setting("Folder of the run; the same command continues it.")]
Backend = Annotated[str, Setting("Simulator: mujoco, thor (AI2-THOR), or fake (no engine).", metavar="NAME")]
RenderQuality = Annotated[
    Quality, Setting("Quality of the frames; fast draws about twice as many per second.", name="render-quality")
]
Workers = Annotated[
    int | None,
    Setting("Number of worker processes; it does not change the result.", minimum=1, metavar="N", unset="one per CPU"),
]
AssetFile = Annotated[
    Path | None,
    Setting(
        "AI2-THOR's asset database, for houses with THOR's assets. Without it, sizes are typical ones.",
        name="assets",
        metavar="FILE",
        env="VIGIL_ASSETS",
    ),
]
