"""`vigil view`: pages of runs, their episodes, packs and houses."""

import hashlib
from collections.abc import Iterable
from typing import Any, Literal
from urllib.parse import urlencode

from fastapi import FastAPI, Request
from fastapi.responses import HTMLResponse, RedirectResponse, Response

from vigil.base.glossary import RESULTS
from vigil.errors import RecordError, SettingError
from vigil.protocol.families import FAMILIES
from vigil.runner.workers.messages import RenderSettings
from vigil.scoring.outcomes import Outcome
from vigil.scoring.saved_run import RecordTable
from vigil.web.drawing import RenderService
from vigil.web.export import episode_film, episode_page
from vigil.web.forks import branches_of, continued_play
from vigil.web.frames import episode_of, episode_timeline, frame_of
from vigil.web.houses import add_house_pages
from vigil.web.library import Library, LibraryRun, RunState
from vigil.web.packs import add_pack_pages
from vigil.web.plan import try_plan
from vigil.web.site import Address, make_site, page, png
from vigil.web.tables import (
    RATE_COLUMNS,
    default_comparison,
    flipped_episodes,
    group_by_pack,
    progress_of,
    run_values,
    sorted_run_rows,
)

FILM_TYPES = {"gif": "image/gif", "mp4": "video/mp4"}
NEWEST_EPISODES = 8
"""Number of the newest episodes that a run's page lists while the run is in progress."""
STATES: tuple[RunState, ...] = ("in progress", "not ended", "interrupted", "ended")
"""States of runs; the runs that most likely have something new to show come first."""
EPISODE_COLUMNS = ("episode", "family", "label", "W", "B", "steps")


def make_view(
    library: Library,
    render_service: RenderService,
    address: Address | None = None,
    render_settings: RenderSettings | None = None,
) -> FastAPI:
    """Return the application; houses are drawn with `render_settings`.

    Raises SettingError if the address needs a token and does not have one.
    """
    site = make_site(address or Address())
    _add_run_pages(site, library)
    _add_episode_pages(site, library, render_service)
    add_pack_pages(site, library, render_service, render_settings or RenderSettings())
    add_house_pages(site, library, render_service, render_settings or RenderSettings())
    return site


def _add_run_pages(site: FastAPI, library: Library) -> None:
    @site.get("/glossary", response_class=HTMLResponse)
    def glossary() -> Response:
        return page("glossary.html", title="Glossary", glossary=RESULTS)

    @site.get("/", response_class=HTMLResponse)
    def runs(request: Request, sort: str = "B", dir: str = "desc", family: str = "") -> Response:
        _check_family(family)
        found = library.runs()
        tag = _etag(found)
        if _is_known(request, tag):
            return Response(status_code=304, headers=tag)
        rows = sorted_run_rows(found, family, sort, dir != "asc")
        state = min((run.state for run in found), key=STATES.index, default="ended")
        asked = {"sort": sort, "dir": dir, "family": family, "families": FAMILIES, "columns": RATE_COLUMNS}
        groups = group_by_pack(rows)
        asked |= {"groups": groups, "pair": default_comparison(groups)}
        return page("runs.html", headers=tag, title="Runs", rows=rows, state=state, tag=tag["ETag"], **asked)

    @site.get("/runs/{slug}", response_class=HTMLResponse)
    def run(slug: str, family: str = "", label: str = "", W: str = "", sort: str = "episode", dir: str = "asc"):
        _check_family(family)
        shown = library.run(slug)
        if shown.table is None:
            return page("broken_run.html", title=shown.name, run=shown)
        wanted = {"family": family, "label": label, "W": W}
        others = [other.slug for other in library.known_runs() if other.slug != slug]
        values = _run_status(shown, shown.table)
        listed = _episode_list(values["scores"].outcomes, wanted, sort, dir)
        return page("run.html", title=shown.name, others=others, **values, **listed)

    @site.get("/runs/{slug}/status", response_class=HTMLResponse)
    def run_status(request: Request, slug: str) -> Response:
        shown = library.run(slug)
        if shown.table is None:
            raise RecordError(f"Run {slug!r} cannot be read: {shown.fault}")
        tag = _etag([shown])
        if _is_known(request, tag):
            return Response(status_code=304, headers=tag)
        return page("run_status.html", headers=tag, **_run_status(shown, shown.table))

    @site.get("/compare", response_class=HTMLResponse)
    def compare_runs(a: str = "", b: str = "", family: str = "") -> Response:
        _check_family(family)
        if not a or not b:
            return RedirectResponse("/", 303)
        first, second = library.run(a), library.run(b)
        if first.table is None or second.table is None:
            unread = first if first.table is None else second
            raise RecordError(f"Run {unread.slug!r} cannot be read: {unread.fault}")
        (one, _), (other, _) = first.scores_and_summary(first.table), second.scores_and_summary(second.table)
        is_same_pack = first.pack is not None and second.pack is not None and first.pack.sha256 == second.pack.sha256
        values = {
            "a": first,
            "b": second,
            "comparison": flipped_episodes(one, other, family),
            "is_same_pack": is_same_pack,
        }
        return page("compare.html", title="Compare", family=family, families=FAMILIES, **values)


def _add_episode_pages(site: FastAPI, library: Library, render_service: RenderService) -> None:
    @site.get("/runs/{slug}/episodes/{episode_id}/{epoch}", response_class=HTMLResponse)
    def episode(slug: str, episode_id: str, epoch: int) -> Response:
        shown = library.run(slug)
        found, record, pack = episode_of(shown, (episode_id, epoch))
        timeline = episode_timeline(shown, found, record)
        keys = sorted(shown.table.rows) if shown.table else []
        place = keys.index((episode_id, epoch))
        base = f"/runs/{slug}/episodes"
        timeline["frames"] = [f"{base}/{episode_id}/{epoch}/frames/{step.index}.png" for step in record.steps]
        timeline["before"] = None if place == 0 else f"{base}/{keys[place - 1][0]}/{keys[place - 1][1]}"
        timeline["after"] = None if place == len(keys) - 1 else f"{base}/{keys[place + 1][0]}/{keys[place + 1][1]}"
        timeline["frame_notes"] = None
        plan = try_plan(pack, found)
        title = f"{episode_id} · {shown.name}"
        here = f"{base}/{episode_id}/{epoch}"
        links = {"source": continued_play(library, record), "branches": branches_of(library, shown, record)}
        values = {"run": shown, "timeline": timeline, "plan": plan, "here": here, "is_alone": False, **links}
        return page("episode.html", title=title, **values)

    @site.get("/runs/{slug}/episodes/{episode_id}/{epoch}/frames/{step}.png")
    def frame(slug: str, episode_id: str, epoch: int, step: int) -> Response:
        shown = frame_of(library.run(slug), (episode_id, epoch), step, render_service)
        return png(shown.data)

    @site.get("/runs/{slug}/episodes/{episode_id}/{epoch}/frames/{step}.json")
    def frame_note(slug: str, episode_id: str, epoch: int, step: int) -> dict[str, Any]:
        shown = frame_of(library.run(slug), (episode_id, epoch), step, render_service)
        return {"origin": shown.origin, **shown.facts}

    @site.get("/runs/{slug}/episodes/{episode_id}/{epoch}/export.html")
    def export_page(slug: str, episode_id: str, epoch: int) -> Response:
        text = episode_page(library.run(slug), (episode_id, epoch), render_service)
        return _download(text, f"{episode_id}.{epoch}.html", "text/html")

    @site.get("/runs/{slug}/episodes/{episode_id}/{epoch}/export.{form}")
    def export_film(slug: str, episode_id: str, epoch: int, form: Literal["gif", "mp4"]) -> Response:
        data = episode_film(library.run(slug), (episode_id, epoch), render_service, form)
        return _download(data, f"{episode_id}.{epoch}.{form}", FILM_TYPES[form])


def _download(content: str | bytes, name: str, kind: str) -> Response:
    """Return a response that the browser saves as a file `name`; `kind` is its media type."""
    return Response(content, media_type=kind, headers={"Content-Disposition": f'attachment; filename="{name}"'})


def _etag(runs: Iterable[LibraryRun]) -> dict[str, str]:
    """Return the ETag header, a hash of the current content of these runs."""
    versions = " ".join(f"{run.slug} {run.version}" for run in runs)
    return {"ETag": f'"{hashlib.sha256(versions.encode()).hexdigest()[:16]}"'}


def _is_known(request: Request, tag: dict[str, str]) -> bool:
    """Return whether the page that sends this request already has the latest content."""
    return request.headers.get("if-none-match") == tag["ETag"]


def _run_status(run: LibraryRun, table: RecordTable) -> dict[str, Any]:
    """Return the values with which a template shows a run's status; the page refreshes them while the run is played."""
    scores, _ = run.scores_and_summary(table)
    here = f"/runs/{run.slug}"
    return {
        **run_values(run, table),
        "progress": progress_of(run, table, scores),
        "newest": [row.verdict for row in table.newest(NEWEST_EPISODES)],
        "tag": _etag([run])["ETag"],
        "link": lambda family="", label="": f"{here}?{urlencode({'family': family, 'label': label})}#episodes",
        "episode_link": lambda episode_id, epoch: f"{here}/episodes/{episode_id}/{epoch}",
    }


def _episode_list(scored: Iterable[Outcome], wanted: dict[str, str], sort: str, direction: str) -> dict[str, Any]:
    """Return the values with which a template shows a run's episodes, filtered and sorted."""
    outcomes = [outcome for outcome in scored if _is_wanted(outcome, wanted)]
    key = sort if sort in EPISODE_COLUMNS and sort != "episode" else "episode_id"
    outcomes.sort(key=lambda o: (getattr(o, key), o.episode_id, o.epoch), reverse=direction == "desc")
    listed = {"outcomes": outcomes, "wanted": wanted, "episode_columns": EPISODE_COLUMNS}
    return {**listed, "sort": sort, "dir": direction}


def _check_family(family: str) -> None:
    if family and family not in FAMILIES:
        raise SettingError(f"There is no family {family!r}. The families are {', '.join(FAMILIES)}.")


def _is_wanted(outcome: Outcome, wanted: dict[str, str]) -> bool:
    return (
        (not wanted["family"] or outcome.family == wanted["family"])
        and (not wanted["label"] or outcome.label == wanted["label"])
        and (not wanted["W"] or str(int(outcome.W)) == wanted["W"])
    )
