"""Pages of houses: plan, rooms, objects, and an interactive walk."""

import base64
from typing import Annotated, Any

from fastapi import Body, FastAPI
from fastapi.responses import HTMLResponse, Response
from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from vigil.base.geometry import Pose
from vigil.protocol.actions import PhysicalAction
from vigil.protocol.house import House
from vigil.protocol.world import Setup
from vigil.runner.workers.messages import EpisodeMoment, RenderSettings
from vigil.web.drawing import RenderService
from vigil.web.library import Library
from vigil.web.plan import plan_of
from vigil.web.site import page, picture

MAX_COORDINATE_M = 10_000.0
"""Greatest coordinate (m) or angle (degrees) that a request may give for a pose."""


def _check_bounds(pose: Pose) -> Pose:
    if not all(abs(value) <= MAX_COORDINATE_M for value in (*pose.position, pose.rotation, pose.horizon)):
        raise ValueError(
            f"each coordinate and angle must be a number from -{MAX_COORDINATE_M:g} to {MAX_COORDINATE_M:g}"
        )
    return pose


BoundedPose = Annotated[Pose, AfterValidator(_check_bounds)]


class WalkRequest(BaseModel):
    """Request for one step of a walk: the pose, and the action to take from there."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    pose: BoundedPose
    action: Annotated[PhysicalAction | None, Field(discriminator="skill_name")] = None


class ViewPixel(BaseModel):
    """Request for the object at a pixel: the pose and the pixel."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    pose: BoundedPose
    x: int = Field(ge=0, lt=640)
    y: int = Field(ge=0, lt=480)


def add_house_pages(
    site: FastAPI, library: Library, render_service: RenderService, render_settings: RenderSettings
) -> None:
    """Add the pages of the houses of all packs."""

    @site.get("/houses", response_class=HTMLResponse)
    def houses() -> Response:
        library.runs()
        return page("houses.html", title="Houses", packs=list(library.packs.values()))

    @site.get("/houses/{slug}/{name}", response_class=HTMLResponse)
    def house(slug: str, name: str) -> Response:
        found, pack = _house(library, slug, name), library.packs[slug]
        plan = plan_of(found, pack.assets)
        episodes = pack.houses()[name]
        start = found.start or episodes[0].start
        values = {"pack": pack, "house": found, "plan": plan, "episodes": episodes}
        return page("house.html", title=name, start=start.model_dump(mode="json"), **values)

    @site.get("/houses/{slug}/{name}/plan.svg")
    def plan_picture(slug: str, name: str) -> Response:
        return picture("plan.svg", plan=plan_of(_house(library, slug, name), library.packs[slug].assets))

    @site.post("/houses/{slug}/{name}/walk")
    def walk(slug: str, name: str, request: Annotated[WalkRequest, Body()]) -> dict[str, Any]:
        walked = render_service.walk(_moment_of(library, slug, name, request.pose, render_settings), request.action)
        return {
            "pose": walked.pose.model_dump(mode="json"),
            "blocked": walked.effect.path_blocked,
            "by": walked.effect.blocked_by,
            "frame": "data:image/png;base64," + base64.b64encode(walked.picture).decode("ascii"),
        }

    @site.post("/houses/{slug}/{name}/name")
    def name_at(slug: str, name: str, request: Annotated[ViewPixel, Body()]) -> dict[str, Any]:
        moment = _moment_of(library, slug, name, request.pose, render_settings)
        return {"id": render_service.name_at(moment, request.x, request.y)}


def _house(library: Library, slug: str, name: str) -> House:
    if slug not in library.packs:
        library.runs()
    pack = library.packs[slug]
    if name not in pack.houses():
        raise KeyError(name)
    return pack.house(name)


def _moment_of(library: Library, slug: str, name: str, pose: Pose, render_settings: RenderSettings) -> EpisodeMoment:
    """Return the moment that shows a house from a pose."""
    house = _house(library, slug, name)
    return EpisodeMoment(render_settings, library.packs[slug].house_path(name), house.sha256, pose, Setup())
