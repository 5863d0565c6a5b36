"""`vigil view`: pages of runs and their episodes."""

from functools import lru_cache
from typing import Any

from fastapi import FastAPI
from fastapi.responses import FileResponse, HTMLResponse, RedirectResponse, Response

from vigil.assets.sizes import AssetDatabase
from vigil.episode import FAMILIES, Episode
from vigil.errors import RecordError, SettingError, VigilError
from vigil.house import House
from vigil.record import EpisodeRecord
from vigil.summary import summarise
from vigil.web.drawing import Drawer, Look, Scene
from vigil.web.houses import add_house_pages
from vigil.web.library import Library, ShownPack, ShownRun
from vigil.web.plan import Plan, plan_of
from vigil.web.site import Address, make_site, page
from vigil.web.story import story_of
from vigil.web.tables import LABELS, RATE_COLUMNS, bars_of, compare, run_rows
from vigil.web.words import LABELS as LABEL_WORDS

EPISODE_COLUMNS = ("episode", "label", "W", "B", "steps")


def make_view(library: Library, drawer: Drawer, address: Address | None = None) -> FastAPI:
    """Returns the application. Raises SettingError when the address needs a token."""
    site = make_site(address or Address())
    _add_run_pages(site, library)
    _add_episode_pages(site, library, drawer)
    add_house_pages(site, library, drawer)
    return site


def _add_run_pages(site: FastAPI, library: Library) -> None:
    @site.get("/", response_class=HTMLResponse)
    def runs(sort: str = "B", dir: str = "desc", family: str = "") -> Response:
        _check_family(family)
        rows = run_rows(library.runs(), family, sort, dir != "asc")
        values = {"rows": rows, "sort": sort, "dir": dir, "family": family, "families": FAMILIES}
        return page("runs.html", title="Runs", columns=RATE_COLUMNS, **values)

    @site.get("/runs/{slug}", response_class=HTMLResponse)
    def run(slug: str, family: str = "", label: str = "", W: str = "", sort: str = "episode", dir: str = "asc"):
        _check_family(family)
        shown = library.run(slug)
        if shown.table is None:
            return page("broken_run.html", title=shown.name, run=shown)
        settlement = shown.table.settlement()
        wanted = {"family": family, "label": label, "W": W}
        outcomes = [o for o in settlement.outcomes if _is_wanted(o, wanted)]
        key = {"episode": "episode_id"}.get(sort, sort) if sort in EPISODE_COLUMNS else "episode_id"
        outcomes.sort(key=lambda o: (getattr(o, key), o.episode_id, o.epoch), reverse=dir == "desc")
        return page(
            "run.html",
            title=shown.name,
            run=shown,
            settlement=settlement,
            summary=summarise(settlement),
            bars=bars_of(settlement),
            outcomes=outcomes,
            wanted=wanted,
            labels=LABELS,
            label_words=LABEL_WORDS,
            columns=RATE_COLUMNS,
            episode_columns=EPISODE_COLUMNS,
            sort=sort,
            dir=dir,
            families=FAMILIES,
            others=[other for other in library.runs() if other.slug != slug and other.table is not None],
        )

    @site.get("/compare", response_class=HTMLResponse)
    def compare_runs(a: str = "", b: str = "", family: str = "") -> Response:
        _check_family(family)
        if not a or not b:
            return RedirectResponse("/", 303)
        first, second = library.run(a), library.run(b)
        if first.table is None or second.table is None:
            raise RecordError("One of the two runs cannot be read; open it to see why.")
        comparison = compare(first.table.settlement(), second.table.settlement(), family)
        is_same_pack = first.pack is not None and second.pack is not None and first.pack.sha256 == second.pack.sha256
        return page(
            "compare.html",
            title="Compare",
            a=first,
            b=second,
            comparison=comparison,
            family=family,
            families=FAMILIES,
            is_same_pack=is_same_pack,
        )


def _add_episode_pages(site: FastAPI, library: Library, drawer: Drawer) -> None:
    @site.get("/runs/{slug}/episodes/{episode_id}/{epoch}", response_class=HTMLResponse)
    def episode(slug: str, episode_id: str, epoch: int) -> Response:
        shown = library.run(slug)
        found, record, pack = episode_of(shown, episode_id, epoch)
        story = tell(shown, found, record)
        keys = sorted(shown.table.rows) if shown.table else []
        place = keys.index((episode_id, epoch))
        base = f"/runs/{slug}/episodes"
        story["frames"] = [f"{base}/{episode_id}/{epoch}/frames/{step.index}.png" for step in record.steps]
        story["before"] = None if place == 0 else f"{base}/{keys[place - 1][0]}/{keys[place - 1][1]}"
        story["after"] = None if place == len(keys) - 1 else f"{base}/{keys[place + 1][0]}/{keys[place + 1][1]}"
        is_saved = all(shown.saved_frame(step.frame_sha256) for step in record.steps)
        plan = try_plan(pack, found)
        title = f"{episode_id} · {shown.name}"
        return page("episode.html", title=title, run=shown, story=story, plan=plan, is_saved=is_saved, is_alone=False)

    @site.get("/runs/{slug}/episodes/{episode_id}/{epoch}/frames/{step}.png")
    def frame(slug: str, episode_id: str, epoch: int, step: int) -> Response:
        shown = library.run(slug)
        found, record, pack = episode_of(shown, episode_id, epoch)
        if not 1 <= step <= len(record.steps):
            raise KeyError(step)
        saved = shown.saved_frame(record.steps[step - 1].frame_sha256)
        if saved is not None:
            return FileResponse(saved, media_type="image/png", headers={"Cache-Control": "private, max-age=3600"})
        data = drawer.picture(scene_of(shown, found, record, pack, step))
        return Response(data, media_type="image/png", headers={"Cache-Control": "private, max-age=600"})


def tell(run: ShownRun, episode: Episode, record: EpisodeRecord) -> dict[str, Any]:
    """Returns the story of a record of a run."""
    if run.header is None or run.table is None:
        raise RecordError(f"Run {run.slug!r} cannot be read: {run.fault}")
    return story_of(episode, record, run.header.spec.profile, run.table.rows[record.key].outcome)


def episode_of(run: ShownRun, episode_id: str, epoch: int) -> tuple[Episode, EpisodeRecord, ShownPack]:
    """Returns an episode of a run with its record and its pack. Raises KeyError or RecordError."""
    if run.table is None or run.pack is None:
        raise RecordError(f"Run {run.slug!r} cannot be read: {run.fault}")
    if (episode_id, epoch) not in run.table.rows:
        raise KeyError(episode_id)
    return run.table.episodes[episode_id], run.table.record((episode_id, epoch)), run.pack


def scene_of(run: ShownRun, episode: Episode, record: EpisodeRecord, pack: ShownPack, step: int) -> Scene:
    """Returns the scene that the reply of a step answered. Raises VigilError when it cannot be drawn again."""
    if run.header is None:
        raise RecordError(f"Run {run.slug!r} cannot be read: {run.fault}")
    spec = run.header.spec
    if spec.asset_database_sha256 is not None:
        raise SettingError("Played with an asset database; its frames can only be shown when they were saved.")
    pack.house(episode.house.name)
    done = [each.action for each in record.steps[: step - 1]]
    return Scene(
        look=Look(spec.simulator, spec.render_quality),
        house=pack.house_path(episode.house.name),
        start=episode.start,
        setup=episode.setup,
        actions=tuple(action for action in done if action is not None and action.skill_name != "report"),
    )


def try_plan(pack: ShownPack, episode: Episode) -> Plan | None:
    """Returns the floor plan of an episode's house; None when the house cannot be read."""
    try:
        return _cached_plan(pack.house(episode.house.name))
    except VigilError:
        return None


@lru_cache(maxsize=32)
def _cached_plan(house: House) -> Plan:
    return plan_of(house, AssetDatabase.default())


def _check_family(family: str) -> None:
    if family and family not in FAMILIES:
        raise SettingError(f"There is no family {family!r}. The families are {', '.join(FAMILIES)}.")


def _is_wanted(outcome: Any, wanted: dict[str, str]) -> bool:
    return (
        (not wanted["family"] or outcome.family == wanted["family"])
        and (not wanted["label"] or outcome.label == wanted["label"])
        and (not wanted["W"] or str(int(outcome.W)) == wanted["W"])
    )
