"""Settings of the action `Initialize`, with AI2-THOR's defaults."""

from collections.abc import Mapping
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError
from pydantic.alias_generators import to_camel

from vigil.thor.base.errors import ActionFailed

RIGHT_ANGLE = 90.0
OLD_NAMES = {"renderObjectImage": "renderInstanceSegmentation", "renderClassImage": "renderSemanticSegmentation"}
"""Old name of a parameter -> its new name."""


class Settings(BaseModel):
    """The parameters of `Initialize` that have an effect in this engine. Other parameters are accepted and ignored."""

    model_config = ConfigDict(frozen=True, alias_generator=to_camel, populate_by_name=True, allow_inf_nan=False)

    grid_size: float = Field(default=0.25, gt=0.0, le=5.0)
    snap_to_grid: bool = True
    rotate_step_degrees: float = Field(default=RIGHT_ANGLE, gt=0.0)
    visibility_distance: float = Field(default=1.5, gt=0.0)
    visibility_scheme: Literal["Collider", "Distance"] = "Collider"
    field_of_view: float = Field(default=90.0, gt=0.0, lt=180.0)
    render_depth_image: bool = False
    render_instance_segmentation: bool = False
    render_semantic_segmentation: bool = False
    render_image: bool = True
    agent_mode: str = "default"
    agent_count: int = Field(default=1, ge=1)
    camera_near_plane: float = Field(default=0.1, gt=0.0)
    camera_far_plane: float = Field(default=20.0, gt=0.0)
    time_scale: float = Field(default=1.0, gt=0.0)
    fast_action_emit: bool = True
    max_upward_look_angle: float = Field(default=30.0, ge=0.0, le=90.0)
    max_downward_look_angle: float = Field(default=60.0, ge=0.0, le=90.0)
    screen_width: int = Field(default=300, gt=0, le=4096)
    screen_height: int = Field(default=300, gt=0, le=4096)

    @property
    def is_locobot(self) -> bool:
        """Whether the agent is a LoCoBot, whose camera is low and which cannot crouch."""
        return self.agent_mode.lower() == LOCOBOT

    @property
    def looks_up(self) -> float:
        """Greatest angle (deg) by which the camera looks up; AI2-THOR's default of 30 if the parameter is 0."""
        return self.max_upward_look_angle or 30.0

    @property
    def looks_down(self) -> float:
        """Greatest angle (deg) by which the camera looks down; AI2-THOR's default of 60 if the parameter is 0."""
        return self.max_downward_look_angle or 60.0


LOCOBOT = "locobot"
LOCOBOT_DEFAULTS = {"fieldOfView": 60.0, "maxUpwardLookAngle": 30.0, "maxDownwardLookAngle": 30.0}
"""Parameters whose defaults are others for a LoCoBot."""
UNSUPPORTED_SETTINGS = ("renderNormalsImage", "renderFlowImage")
"""Parameters that are refused when true, because this engine cannot draw the images that they request."""


def settings_of(sent: Mapping[str, Any], width: int, height: int) -> Settings:
    """Return the settings of an `Initialize` action, with the screen's size in pixels. Raises ActionFailed."""
    named = {OLD_NAMES.get(name, name): value for name, value in sent.items() if value is not None}
    for name in UNSUPPORTED_SETTINGS:
        if named.get(name):
            raise ActionFailed(f"{name} is not supported by VIGIL's engine: leave it out.")
    if str(named.get("agentMode")).lower() == LOCOBOT:
        named = {**LOCOBOT_DEFAULTS, **named}
    try:
        settings = Settings.model_validate({**named, "screenWidth": width, "screenHeight": height})
    except ValidationError as error:
        fault = error.errors(include_url=False)[0]
        place = ".".join(str(part) for part in fault["loc"])
        raise ActionFailed(f"Initialize: {place}: {fault['msg']} (got {fault['input']!r})") from None
    if not settings.is_locobot and settings.agent_mode.lower() != "default":
        raise ActionFailed(
            f"agentMode {settings.agent_mode!r}: VIGIL's engine has THOR's default agent, which has a hand without an "
            "arm, and the locobot. Leave agentMode out, and use PickupObject, MoveHeldObject and PutObject."
        )
    if settings.snap_to_grid and settings.rotate_step_degrees % RIGHT_ANGLE:
        raise ActionFailed(
            f"Invalid values 'rotateStepDegrees': ${settings.rotate_step_degrees} and 'snapToGrid':$True. "
            "'snapToGrid': 'True' is not supported when 'rotateStepDegrees' is different from grid rotation steps of "
            "0, 90, 180, 270 or 360."
        )
    return settings
