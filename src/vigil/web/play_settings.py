"""Settings of `vigil play`."""

from dataclasses import dataclass
from typing import Annotated

from vigil.base.settings import Setting, check_settings
from vigil.runner.shared_settings import AssetFile, Backend, Families, LogDir, PackName, RenderQuality


@dataclass(frozen=True, slots=True, kw_only=True)
class PlaySettings:
    """Settings of a play session."""

    player: Annotated[str, Setting("Name of the person who plays, recorded in the run's header.")]
    pack: PackName = "starter"
    limit: Annotated[
        int | None, Setting("Play at most N episodes, drawn at random; all if unset.", minimum=1, metavar="N")
    ] = None
    families: Families = ()
    practice: Annotated[
        bool,
        Setting(
            "Practise: show feedback after each action and the verdict after each episode. Practice is "
            "recorded as a separate run."
        ),
    ] = False
    """Whether to show feedback after each action and the verdict after each episode."""
    log_dir: LogDir = None
    quality: RenderQuality = "default"
    backend: Backend = "mujoco"
    assets: AssetFile = None
    seed: Annotated[
        int | None,
        Setting("Random seed of the order in which the episodes are played.", unset="made from the player's name"),
    ] = None

    def __post_init__(self) -> None:
        """Check the values against their declarations."""
        check_settings(self)
