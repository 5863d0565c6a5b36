"""Settings of `vigil serve`."""

import re
from dataclasses import dataclass
from typing import Annotated

from vigil.agents.agent import FRAME_INTERVAL_SECONDS, REPLY_SECONDS
from vigil.base.settings import Setting, check_settings
from vigil.errors import SettingError
from vigil.records.record import MAX_EPOCHS
from vigil.runner.shared_settings import (
    AssetFile,
    Backend,
    CoordinatesOption,
    EpisodeIds,
    Families,
    LogDir,
    ProfileOption,
    PromptFileOption,
    PromptVariantOption,
    RenderQuality,
    ReplyPolicyOption,
    Workers,
)

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,59}")


@dataclass(frozen=True, slots=True, kw_only=True)
class ServeSettings:
    """Settings of a server. A server records one run of one agent, even if several sessions are open at once."""

    name: Annotated[str, Setting("Name of the player that the run is recorded for, e.g. acme-vlm-2.")]
    log_dir: LogDir = None
    limit: Annotated[
        int | None,
        Setting("Maximum number of episodes to serve, spread evenly over the families.", minimum=1, metavar="N"),
    ] = None
    families: Families = ()
    episode_ids: EpisodeIds = ()
    epochs: Annotated[
        int, Setting("Number of times that each episode is served.", minimum=1, maximum=MAX_EPOCHS, metavar="N")
    ] = 1
    profile: ProfileOption = "baseline"
    prompt_variant: PromptVariantOption = "default"
    prompt_template: PromptFileOption = None
    coordinates: CoordinatesOption = None
    reply_policy: ReplyPolicyOption = "strict"
    seed: Annotated[int, Setting("Random seed of the order in which episodes are served.")] = 0
    workers: Workers = None
    backend: Backend = "mujoco"
    render_quality: RenderQuality = "default"
    asset_database: AssetFile = None
    save_frames: Annotated[bool, Setting("Save every frame that a client gets in the run's folder.")] = False
    max_sessions: Annotated[
        int, Setting("Maximum number of episodes that are played at the same time.", minimum=1, metavar="N")
    ] = 32
    reply_seconds: Annotated[
        int, Setting("Time limit in seconds for each reply of a client.", minimum=1, metavar="SECONDS")
    ] = REPLY_SECONDS
    episode_seconds: Annotated[
        int, Setting("Time limit in seconds for all replies of one episode together.", minimum=1, metavar="SECONDS")
    ] = 24 * REPLY_SECONDS
    frame_interval_seconds: Annotated[
        float,
        Setting(
            "Interval in seconds: the next frame is sent a whole number of intervals after the reply arrived, so "
            "that the waiting time does not reveal what the reply did. With 0, it is sent as soon as it is ready.",
            minimum=0,
            maximum=60,
            metavar="SECONDS",
        ),
    ] = FRAME_INTERVAL_SECONDS
    training: Annotated[
        bool,
        Setting(
            "Serve for training: send the reward (B) at the end of each episode, and let clients choose an "
            "episode by its index. Do not use it for an evaluation."
        ),
    ] = False

    def __post_init__(self) -> None:
        """Check the values against their declarations."""
        check_settings(self)
        if not _NAME.fullmatch(self.name):
            raise SettingError(
                f"--name {self.name!r}: give at most 60 letters, digits, '_', '.' and '-', e.g. --name acme-vlm."
            )
