"""Pages of packs and houses.

A pack's page has its content and distribution, first frames of some episodes, and the card. A house's page has the
plan, rooms, objects, and an interactive walk. The pages are for evaluators: ids of episodes and goals reveal what is
hidden from an agent.
"""

import base64
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any

from fastapi import Body, FastAPI
from fastapi.responses import HTMLResponse, Response
from markdown_it import MarkdownIt
from markupsafe import Markup
from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from vigil.authoring.packing.dataset_card import CARD
from vigil.base.files import is_inside, open_file
from vigil.base.geometry import Pose
from vigil.errors import PackMismatch
from vigil.packs.even_draw import draw_evenly
from vigil.packs.names import other_names, version_words
from vigil.packs.pack import manifest_of, manifest_sha256
from vigil.protocol.actions import PhysicalAction
from vigil.protocol.episode import Episode
from vigil.protocol.families import FAMILIES, Family
from vigil.protocol.house import House
from vigil.protocol.world import Setup
from vigil.runner.workers.messages import EpisodeMoment, RenderSettings
from vigil.scoring.goal_words import describe_goal
from vigil.scoring.levels import LEVELS, read_pack_levels
from vigil.scoring.target_strata import sort_by_size
from vigil.web.drawing import RenderService
from vigil.web.library import Library, LibraryPack
from vigil.web.plan import plan_of
from vigil.web.site import page, picture, png

SAMPLES = 3
"""Number of episodes per family whose first frame is shown."""
MAX_CARD_BYTES = 200_000
MAX_COORDINATE_M = 10_000.0
"""Greatest coordinate (m) or angle (degrees) that a request may give for a pose."""
_STRATA = {
    "rooms": "rooms of the house",
    "house_sizes": "size of the house",
    "not_found_by_turning": "searches that turning does not end",
    "categories": "category of the target",
}
"""Key of a count in a manifest (other than the count of families) -> its name on the page."""


def add_pack_pages(
    site: FastAPI, library: Library, render_service: RenderService, render_settings: RenderSettings
) -> None:
    """Add the pages of all packs: those that come with VIGIL, those that the user named, and those of the runs."""

    @site.get("/packs", response_class=HTMLResponse)
    def packs() -> Response:
        library.runs()
        rows = [_pack_row(slug, folder) for slug, folder in sorted(library.pack_folders().items())]
        return page("packs.html", title="Packs", rows=rows)

    @site.get("/packs/{slug}", response_class=HTMLResponse)
    def pack(slug: str) -> Response:
        shown = _pack(library, slug)
        manifest = manifest_of(shown.folder)
        return page(
            "pack.html",
            title=manifest.name,
            pack=shown,
            manifest=manifest,
            version=version_words(manifest.name, manifest.version),
            families=family_rows(shown.episodes.values(), manifest.meta),
            strata={**other_strata(manifest.meta), **level_strata(shown)},
            samples=samples_of(shown.episodes.values()),
            specs=FAMILIES,
            describe_goal=describe_goal,
            card=card_html(shown.folder),
        )

    @site.get("/packs/{slug}/starts/{episode_id}.png")
    def start(slug: str, episode_id: str) -> Response:
        shown = _pack(library, slug)
        episode = shown.episodes[episode_id]
        house = shown.house_path(episode.house.name)
        moment = EpisodeMoment(render_settings, house, episode.house.sha256, episode.start, episode.setup)
        return png(render_service.picture(moment))


def _pack(library: Library, slug: str) -> LibraryPack:
    if slug not in library.pack_folders():
        library.runs()
    return library.pack(slug)


def _pack_row(slug: str, folder: Path) -> dict[str, Any]:
    """Return a pack's row in the list; `fault` says why a pack cannot be read."""
    try:
        manifest = manifest_of(folder)
        also = other_names(manifest.name, manifest.meta.get("aliases", ()))
        version = version_words(manifest.name, manifest.version)
        facts = {"manifest": manifest, "also": also, "version": version, "sha256": manifest_sha256(folder)}
        return {"slug": slug, **facts, "fault": ""}
    except PackMismatch as error:
        return {"slug": slug, "manifest": None, "also": [], "sha256": "", "fault": str(error)}


def family_rows(episodes: Iterable[Episode], meta: dict[str, Any]) -> list[dict[str, Any]]:
    """Return one row for each family of a pack: its specification, and the number of its episodes of each kind.

    The kinds are those over which the pack was balanced, if its manifest names them; otherwise the sizes of targets or
    the templates.
    """
    given = meta.get("strata", {}).get("families", {})
    by_family: dict[Family, list[Episode]] = {}
    for episode in episodes:
        by_family.setdefault(episode.family, []).append(episode)
    return [
        {
            "family": family,
            "spec": spec,
            "episodes": len(mine),
            "houses": len({episode.house.name for episode in mine}),
            "kinds": sort_by_size(
                given.get(family)
                or Counter(name for one in mine if (name := one.target_size or one.provenance.template))
            ),
        }
        for family, spec in FAMILIES.items()
        if (mine := by_family.get(family))
    ]


def other_strata(meta: dict[str, Any]) -> dict[str, dict[str, int]]:
    """Return the counts in the manifest that are not by family, under their names on the page."""
    strata = meta.get("strata", {})
    return {words: sort_by_size(strata[name]) for name, words in _STRATA.items() if strata.get(name)}


def level_strata(pack: LibraryPack) -> dict[str, dict[str, int]]:
    """Return the number of episodes of each level; empty if the pack has no levels."""
    counts = Counter(each.level for each in read_pack_levels(pack.folder).values())
    return {"level of difficulty": {level: counts[level] for level in LEVELS}} if counts else {}


def samples_of(episodes: Iterable[Episode]) -> dict[Family, list[Episode]]:
    """Return a few episodes of each family, always the same for a pack."""
    drawn = draw_evenly(episodes)
    found = {family: [episode for episode in drawn if episode.family == family][:SAMPLES] for family in FAMILIES}
    return {family: some for family, some in found.items() if some}


def card_html(folder: Path) -> Markup | None:
    """Return a pack's card as HTML, in which HTML of the card itself is escaped; None if the pack has no card."""
    path = folder / CARD
    if not path.is_file() or not is_inside(path, folder):
        return None
    with open_file(path, repr(str(path)), PackMismatch) as file:
        text = file.read(MAX_CARD_BYTES).decode("utf-8", "replace")
    if text.startswith("---\n"):
        text = text.partition("\n---\n")[2]
    markdown = MarkdownIt("commonmark", {"html": False}).enable("table")
    tokens = markdown.parse(text)
    for token in tokens:
        if token.type in ("heading_open", "heading_close"):
            token.tag = f"h{min(6, int(token.tag[1:]) + 2)}"  # two levels below the page's headings
    return Markup(markdown.renderer.render(tokens, markdown.options, {}))


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
