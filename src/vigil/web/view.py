"""`vigil view`: pages of runs and their episodes."""

from typing import Any, Literal
from urllib.parse import urlencode

from fastapi import FastAPI
from fastapi.responses import HTMLResponse, RedirectResponse, Response

from vigil.episode import FAMILIES
from vigil.errors import RecordError, SettingError
from vigil.glossary import RESULTS
from vigil.runner.workers.messages import RenderSettings
from vigil.saved_run import RecordTable
from vigil.scoring import Outcome
from vigil.summary import summarise
from vigil.web.drawing import RenderService
from vigil.web.export import episode_film, episode_page
from vigil.web.frames import episode_of, episode_timeline, frame_of
from vigil.web.houses import add_house_pages
from vigil.web.library import Library, ShownRun
from vigil.web.phrases import LABELS as LABEL_WORDS
from vigil.web.plan import try_plan
from vigil.web.site import Address, make_site, page
from vigil.web.tables import LABELS, RATE_COLUMNS, bars_of, compare, run_rows

FILM_TYPES = {"gif": "image/gif", "mp4": "video/mp4"}
EPISODE_COLUMNS = ("episode", "family", "label", "W", "B", "steps")


def make_view(
    library: Library,
    render_service: RenderService,
    address: Address | None = None,
    render_settings: RenderSettings | None = None,
) -> FastAPI:
    """Returns the application; houses are drawn with `render_settings`. Raises SettingError when the address needs a
    token."""
    site = make_site(address or Address())
    _add_run_pages(site, library)
    _add_episode_pages(site, library, render_service)
    _add_glossary(site)
    add_house_pages(site, library, render_service, render_settings or RenderSettings())
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
        wanted = {"family": family, "label": label, "W": W}
        others = [other.slug for other in library.found() if other.slug != slug]
        return page("run.html", title=shown.name, others=others, **_run_values(shown, shown.table, wanted, sort, dir))

    @site.get("/compare", response_class=HTMLResponse)
    def compare_runs(a: str = "", b: str = "", family: str = "") -> Response:
        _check_family(family)
        if not a or not b:
            return RedirectResponse("/", 303)
        first, second = library.run(a), library.run(b)
        if first.table is None or second.table is None:
            unread = first if first.table is None else second
            raise RecordError(f"Run {unread.slug!r} cannot be read: {unread.fault}")
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


def _add_glossary(site: FastAPI) -> None:
    @site.get("/glossary", response_class=HTMLResponse)
    def glossary() -> Response:
        return page("glossary.html", title="Glossary", glossary=RESULTS)


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
        return page("episode.html", title=title, run=shown, timeline=timeline, plan=plan, here=here, is_alone=False)

    @site.get("/runs/{slug}/episodes/{episode_id}/{epoch}/frames/{step}.png")
    def frame(slug: str, episode_id: str, epoch: int, step: int) -> Response:
        shown = frame_of(library.run(slug), (episode_id, epoch), step, render_service)
        return Response(shown.data, media_type="image/png", headers={"Cache-Control": "private, max-age=600"})

    @site.get("/runs/{slug}/episodes/{episode_id}/{epoch}/frames/{step}.json")
    def frame_note(slug: str, episode_id: str, epoch: int, step: int) -> dict[str, Any]:
        shown = frame_of(library.run(slug), (episode_id, epoch), step, render_service)
        return {"origin": shown.origin, **shown.facts}

    @site.get("/runs/{slug}/episodes/{episode_id}/{epoch}/export.html")
    def export_page(slug: str, episode_id: str, epoch: int) -> Response:
        text = episode_page(library.run(slug), (episode_id, epoch), render_service)
        return Response(text, media_type="text/html", headers=_to_save(f"{episode_id}.{epoch}.html"))

    @site.get("/runs/{slug}/episodes/{episode_id}/{epoch}/export.{form}")
    def export_film(slug: str, episode_id: str, epoch: int, form: Literal["gif", "mp4"]) -> Response:
        data = episode_film(library.run(slug), (episode_id, epoch), render_service, form)
        return Response(data, media_type=FILM_TYPES[form], headers=_to_save(f"{episode_id}.{epoch}.{form}"))


def _to_save(name: str) -> dict[str, str]:
    return {"Content-Disposition": f'attachment; filename="{name}"'}


def _run_values(run: ShownRun, table: RecordTable, wanted: dict[str, str], sort: str, direction: str) -> dict[str, Any]:
    """Returns what the page of a run shows: all rates, and the episodes that are wanted."""
    settlement = table.settlement()
    outcomes = [outcome for outcome in settlement.outcomes if _is_wanted(outcome, wanted)]
    key = sort if sort in EPISODE_COLUMNS and sort != "episode" else "episode_id"
    outcomes.sort(key=lambda o: (getattr(o, key), o.episode_id, o.epoch), reverse=direction == "desc")
    here = f"/runs/{run.slug}"
    return {
        "run": run,
        "settlement": settlement,
        "summary": summarise(settlement),
        "bars": bars_of(settlement),
        "outcomes": outcomes,
        "wanted": wanted,
        "labels": LABELS,
        "label_words": LABEL_WORDS,
        "columns": RATE_COLUMNS,
        "episode_columns": EPISODE_COLUMNS,
        "sort": sort,
        "dir": direction,
        "families": FAMILIES,
        "link": lambda family="", label="": f"{here}?{urlencode({'family': family, 'label': label})}#episodes",
        "episode_link": lambda episode_id, epoch: f"{here}/episodes/{episode_id}/{epoch}",
    }


def _check_family(family: str) -> None:
    if family and family not in FAMILIES:
        raise SettingError(f"There is no family {family!r}. The families are {', '.join(FAMILIES)}.")


def _is_wanted(outcome: Outcome, wanted: dict[str, str]) -> bool:
    return (
        (not wanted["family"] or outcome.family == wanted["family"])
        and (not wanted["label"] or outcome.label == wanted["label"])
        and (not wanted["W"] or str(int(outcome.W)) == wanted["W"])
    )
