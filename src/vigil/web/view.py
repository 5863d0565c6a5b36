"""`vigil view`: pages of runs, their episodes, packs and houses."""

import hashlib
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Literal
from urllib.parse import quote, urlencode

from fastapi import FastAPI, Request
from fastapi.responses import HTMLResponse, RedirectResponse, Response

from vigil.base.glossary import RESULTS
from vigil.errors import SettingError, VigilError
from vigil.protocol.families import FAMILIES
from vigil.records.record import EpisodeRecord, ForkPoint, RunHeader, read_header
from vigil.runner.workers.messages import RenderSettings
from vigil.scoring.outcomes import Outcome
from vigil.scoring.saved_run import RecordTable
from vigil.web.drawing import RenderService
from vigil.web.export import episode_film, episode_page
from vigil.web.library import Library, LibraryRun, RunState
from vigil.web.packs import add_house_pages, add_pack_pages
from vigil.web.plan import try_plan
from vigil.web.site import Address, make_site, page, png
from vigil.web.tables import (
    RATE_COLUMNS,
    compare_runs,
    default_comparison,
    group_by_pack,
    progress_of,
    run_values,
    sorted_run_rows,
)
from vigil.web.timeline import episode_of, episode_timeline, frame_of

MEDIA_TYPES = {"html": "text/html", "gif": "image/gif", "mp4": "video/mp4"}
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
        groups = group_by_pack(rows)
        asked = {"sort": sort, "dir": dir, "family": family, "families": FAMILIES, "columns": RATE_COLUMNS}
        shown = {"rows": rows, "groups": groups, "pair": default_comparison(groups), "state": state}
        return page("runs.html", headers=tag, title="Runs", tag=tag["ETag"], **shown, **asked)

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
        _, _, table = shown.parts()
        tag = _etag([shown])
        if _is_known(request, tag):
            return Response(status_code=304, headers=tag)
        return page("run_status.html", headers=tag, **_run_status(shown, table))

    @site.get("/compare", response_class=HTMLResponse)
    def compare(a: str = "", b: str = "", family: str = "") -> Response:
        _check_family(family)
        if not a or not b:
            return RedirectResponse("/", 303)
        first, second = library.run(a), library.run(b)
        (_, pack, rows), (_, other_pack, other_rows) = first.parts(), second.parts()
        scores, other_scores = first.scores_and_summary(rows)[0], second.scores_and_summary(other_rows)[0]
        values = {
            "a": first,
            "b": second,
            "comparison": compare_runs(scores, other_scores, family),
            "is_same_pack": pack.sha256 == other_pack.sha256,
        }
        return page("compare.html", title="Compare", family=family, families=FAMILIES, **values)


def _add_episode_pages(site: FastAPI, library: Library, render_service: RenderService) -> None:
    @site.get("/runs/{slug}/episodes/{episode_id}/{epoch}", response_class=HTMLResponse)
    def episode(slug: str, episode_id: str, epoch: int) -> Response:
        shown = library.run(slug)
        found, record, pack = episode_of(shown, (episode_id, epoch))
        timeline = episode_timeline(shown, found, record)
        base, keys = f"/runs/{slug}/episodes", sorted(shown.table.rows) if shown.table else []
        here, place = f"{base}/{episode_id}/{epoch}", keys.index((episode_id, epoch))
        links = [None, *(f"{base}/{name}/{number}" for name, number in keys), None]
        timeline["frames"] = [f"{here}/frames/{step.index}.png" for step in record.steps]
        timeline["before"], timeline["after"], timeline["frame_notes"] = links[place], links[place + 2], None
        values = {"run": shown, "timeline": timeline, "plan": try_plan(pack, found), "here": here, "is_alone": False}
        forks = {"source": continued_play(library, record), "branches": branches_of(library, shown, record)}
        return page("episode.html", title=f"{episode_id} · {shown.name}", **values, **forks)

    @site.get("/runs/{slug}/episodes/{episode_id}/{epoch}/frames/{step}.png")
    def frame(slug: str, episode_id: str, epoch: int, step: int) -> Response:
        shown = frame_of(library.run(slug), (episode_id, epoch), step, render_service)
        return png(shown.data)

    @site.get("/runs/{slug}/episodes/{episode_id}/{epoch}/frames/{step}.json")
    def frame_note(slug: str, episode_id: str, epoch: int, step: int) -> dict[str, Any]:
        shown = frame_of(library.run(slug), (episode_id, epoch), step, render_service)
        return {"origin": shown.origin, **shown.facts}

    @site.get("/runs/{slug}/episodes/{episode_id}/{epoch}/export.{form}")
    def export(slug: str, episode_id: str, epoch: int, form: Literal["html", "gif", "mp4"]) -> Response:
        shown, key = library.run(slug), (episode_id, epoch)
        is_page = form == "html"
        content = (
            episode_page(shown, key, render_service) if is_page else episode_film(shown, key, render_service, form)
        )
        headers = {"Content-Disposition": f'attachment; filename="{episode_id}.{epoch}.{form}"'}
        return Response(content, media_type=MEDIA_TYPES[form], headers=headers)


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
    outcomes = [
        outcome
        for outcome in scored
        if wanted["family"] in ("", outcome.family)
        and wanted["label"] in ("", outcome.label)
        and wanted["W"] in ("", str(int(outcome.W)))
    ]
    key = sort if sort in EPISODE_COLUMNS and sort != "episode" else "episode_id"
    outcomes.sort(key=lambda o: (getattr(o, key), o.episode_id, o.epoch), reverse=direction == "desc")
    listed = {"outcomes": outcomes, "wanted": wanted, "episode_columns": EPISODE_COLUMNS}
    return {**listed, "sort": sort, "dir": direction}


def _check_family(family: str) -> None:
    if family and family not in FAMILIES:
        raise SettingError(f"There is no family {family!r}. The families are {', '.join(FAMILIES)}.")


@dataclass(frozen=True, slots=True)
class ForkLink:
    """A link to a play of the same episode."""

    name: str
    href: str
    step: int
    """Number of steps that both plays share."""


def continued_play(library: Library, record: EpisodeRecord) -> ForkLink | None:
    """Return the play that a record continues; None if it continues no play, or that play is not in the library."""
    point = record.fork
    if point is None:
        return None
    for run in library.known_runs():
        header = _header_of(run)
        if header is not None and header.sha256 == point.run_sha256:
            return _link(run, record.episode_id, point.epoch, point)
    return None


def branches_of(library: Library, shown: LibraryRun, record: EpisodeRecord) -> list[ForkLink]:
    """Return the plays of the library that continue a record of a run, sorted by the names of their runs."""
    found: list[ForkLink] = []
    source = _header_of(shown)
    for run in library.known_runs():
        header = _header_of(run)
        fork = None if header is None or run.slug == shown.slug else header.spec.fork
        if fork is None or source is None or fork.run_sha256 != source.sha256:
            continue
        table = library.run(run.slug).table
        if table is None:
            continue
        for key in sorted(key for key in table.rows if key[0] == record.episode_id):
            point = table.record(key).fork
            if point is not None and (point.epoch, point.attempt) == (record.epoch, record.attempt):
                found.append(_link(run, *key, point))
    return found


def _link(run: LibraryRun, episode_id: str, epoch: int, point: ForkPoint) -> ForkLink:
    return ForkLink(run.slug, f"/runs/{quote(run.slug)}/episodes/{quote(episode_id)}/{epoch}", point.step)


def _header_of(run: LibraryRun) -> RunHeader | None:
    """Return a run's header; of a run that has not been shown yet, nothing else is read, because rows take long."""
    if run.header is None:
        with suppress(VigilError, OSError):  # the list of runs says why
            run.header = read_header(run.folder)
    return run.header
