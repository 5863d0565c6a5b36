"""Settings that several verbs and dataclasses share, each declared once."""

from pathlib import Path
from typing import Annotated

from vigil.base.settings import Setting
from vigil.protocol.actions import Coordinates
from vigil.protocol.episode import Family, parse_families
from vigil.protocol.observation import Quality
from vigil.protocol.profile import PromptVariant, SystemRole
from vigil.protocol.prompt_file import read_prompt_file
from vigil.protocol.reasoning import Thinking
from vigil.records.costs import Prices, parse_prices

PackName = Annotated[str | Path, Setting("A pack's folder, or the name of a packaged one.", metavar="PACK")]
PackLocation = Annotated[str | Path | None, Setting("Where the pack is now.", metavar="PACK", unset="as recorded")]
Families = Annotated[
    tuple[Family, ...],
    Setting("Only this family; may be repeated.", name="family", metavar="FAMILY", read=parse_families, repeats=True),
]
EpisodeIds = Annotated[tuple[str, ...], Setting("Only this episode; may be repeated.", name="episode", metavar="ID")]
BaseUrl = Annotated[str | None, Setting("Address of an OpenAI-style server.", metavar="URL")]
ApiKeyEnv = Annotated[
    str | None,
    Setting("Variable with the key for this model, e.g. at an address not its provider's own.", metavar="VAR"),
]
ProfileOption = Annotated[str, Setting("baseline or action_feedback, or a profile's full name.", metavar="NAME")]
PromptVariantOption = Annotated[PromptVariant, Setting("System prompt.", name="prompt-variant")]
PromptFileOption = Annotated[
    str | None,
    Setting("System prompt of your own, with placeholders.", name="prompt-file", metavar="FILE", read=read_prompt_file),
]
CoordinatesOption = Annotated[Coordinates | None, Setting("How it points.", unset="by model")]
SystemRoleOption = Annotated[
    SystemRole, Setting("user: the system prompt begins the first user message, for models without the role.")
]
ThinkingOption = Annotated[Thinking, Setting("Turn thinking on or off, in the provider's own way.")]
PricesOption = Annotated[
    Prices | None, Setting("Of a million tokens: what replies cost is told.", metavar="IN,OUT", read=parse_prices)
]
LogDir = Annotated[Path | None, Setting("The run's folder; the same command continues it.")]
Backend = Annotated[str, Setting("Simulator: mujoco, thor (AI2-THOR), or fake (no engine).", metavar="NAME")]
RenderQuality = Annotated[
    Quality, Setting("Quality of the picture; fast draws twice as many frames a second.", name="render-quality")
]
Workers = Annotated[
    int | None,
    Setting("Worker processes; the result is the same with any number.", minimum=1, metavar="N", unset="one a CPU"),
]
AssetFile = Annotated[
    Path | None,
    Setting(
        "AI2-THOR's asset database, for houses that use THOR's assets. Without it: typical sizes.",
        name="assets",
        metavar="FILE",
        env="VIGIL_ASSETS",
    ),
]
