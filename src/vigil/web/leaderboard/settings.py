"""Settings of `vigil submit` and `vigil leaderboard build`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from vigil.base.settings import Setting, check_settings
from vigil.runner.shared_settings import AssetFile, Workers


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckSettings:
    """Settings of the check of entries."""

    frames: Annotated[
        bool,
        Setting(
            "Also draw every frame again and compare it with the recorded frame. The two can be equal only if the "
            "renderer is the same."
        ),
    ] = False
    workers: Workers = None
    asset_database: AssetFile = None

    def __post_init__(self) -> None:
        """Check the values against their declarations."""
        check_settings(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class BuildSettings(CheckSettings):
    """Settings for building a leaderboard's site."""

    cache: Annotated[
        Path | None,
        Setting(
            "Folder in which the results of checks are saved, so that only new bundles are checked.", unset="OUT-cache"
        ),
    ] = None
    packs: Annotated[
        tuple[Path, ...],
        Setting(
            "Folder of a pack that does not come with VIGIL; may be repeated.",
            name="pack",
            metavar="FOLDER",
            read=lambda texts: tuple(map(Path, texts)),
            repeats=True,
        ),
    ] = ()
    decisions: Annotated[
        Path | None,
        Setting("YAML file with the maintainers' decisions on entries: accepted, refused or withdrawn, and why."),
    ] = None
    earlier: Annotated[
        Path | None,
        Setting(
            "File entries.json of an earlier site; its results are added to the history, which shows models on several "
            "versions of a pack."
        ),
    ] = None
    shown_plays: Annotated[
        int,
        Setting(
            "Number of plays of each entry for which the site has a page with the trajectory.", minimum=0, maximum=1000
        ),
    ] = 4
