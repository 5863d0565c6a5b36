"""Exports: an episode as one self-contained page or a film; a run as a folder of pages that any web server can host."""

import base64
import hashlib
import io
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple

from markupsafe import Markup
from PIL import Image

from vigil.base.glossary import RESULTS
from vigil.errors import SettingError
from vigil.packs.pack import manifest_of
from vigil.packs.private import check_revealed, is_private
from vigil.records.record import Key
from vigil.web.drawing import RenderService
from vigil.web.films.film import FilmFrame, film_frames_of, gif, mp4, webp
from vigil.web.library import LibraryRun
from vigil.web.plan import try_film_plan, try_plan
from vigil.web.site import STATIC, TEMPLATES
from vigil.web.tables import run_values
from vigil.web.timeline import episode_of, episode_timeline, frames_of

JPEG_QUALITY = 86
NO_FRAME = {"is_recorded": None, "note": "This frame was not saved and cannot be drawn again."}
EPISODES_FOLDER = "episodes"
FilmForm = Literal["gif", "webp", "mp4"]
_FILMS: dict[FilmForm, Callable[[Sequence[FilmFrame]], bytes]] = {"gif": gif, "webp": webp, "mp4": mp4}


class Links(NamedTuple):
    """Links of a page to other pages of its site; a standalone page does not have links."""

    home: str | None = None
    before: str | None = None
    after: str | None = None


STANDALONE = Links()


def episode_page(
    run: LibraryRun, key: Key, render_service: RenderService, links: Links = STANDALONE, *, reveals: bool = False
) -> str:
    """Return one HTML page that contains everything: pictures, style and script.

    Raises SettingError if the pack is private, unless `reveals` is true.
    """
    _check_private(run, reveals=reveals)
    episode, record, pack = episode_of(run, key)
    timeline = episode_timeline(run, episode, record)
    frames = frames_of(run, key, render_service)
    timeline["frames"] = ["" if frame is None else _jpeg_uri(frame.data) for frame in frames]
    timeline["frame_notes"] = [NO_FRAME if frame is None else frame.facts for frame in frames]
    return TEMPLATES.get_template("alone.html").render(
        title=f"{episode.id} · {run.name}",
        run=run,
        timeline=timeline,
        plan=try_plan(pack, episode),
        links=links,
        is_alone=not (links.before or links.after),
        **embedded(_script("viewer.js")),
    )


def episode_film(
    run: LibraryRun, key: Key, render_service: RenderService, form: FilmForm, *, reveals: bool = False
) -> bytes:
    """Return an episode as a film.

    Raises SettingError if nothing can be shown, if PyAV is missing for MP4, or for a private pack unless `reveals` is
    true.
    """
    _check_private(run, reveals=reveals)
    episode, record, pack = episode_of(run, key)
    frames = [None if frame is None else frame.data for frame in frames_of(run, key, render_service)]
    shots = film_frames_of(episode_timeline(run, episode, record), frames, try_film_plan(pack, episode))
    return _FILMS[form](shots)


def export_site(
    run: LibraryRun,
    out: Path,
    render_service: RenderService,
    report: Callable[[str], None] = lambda line: None,
    *,
    reveals: bool = False,
) -> Path:
    """Write a run as pages into `out`, a new or empty folder, and return the path of the index.

    `report` is called with the id of each episode. Raises RecordError if the run cannot be read, and SettingError if
    `out` is not empty, or if the pack is private and `reveals` is false.
    """
    _check_private(run, reveals=reveals)
    _, _, table = run.parts()
    if out.exists() and any(out.iterdir()):
        raise SettingError(f"Folder {str(out)!r} is not empty; export into a new one.")
    (out / EPISODES_FOLDER).mkdir(parents=True, exist_ok=True)
    values = run_values(run, table)
    index = TEMPLATES.get_template("run_alone.html").render(
        title=run.name,
        **values,
        outcomes=values["scores"].outcomes,
        link=lambda family="", label="": f"#family={family}&label={label}",
        episode_link=lambda episode_id, epoch: f"{EPISODES_FOLDER}/{page_name(episode_id, epoch)}",
        **embedded(_script("filter.js")),
    )
    keys = sorted(table.rows)
    names = [page_name(*key) for key in keys]
    for key, before, name, after in zip(keys, [None, *names], names, [*names[1:], None], strict=False):
        text = episode_page(run, key, render_service, Links("../index.html", before, after), reveals=reveals)
        (out / EPISODES_FOLDER / name).write_text(text, encoding="utf-8")
        report(key[0])
    glossary = TEMPLATES.get_template("glossary_alone.html").render(
        title="Glossary", run=run, glossary=RESULTS, **embedded(_script("filter.js"))
    )
    (out / "glossary.html").write_text(glossary, encoding="utf-8")
    (out / "index.html").write_text(index, encoding="utf-8")
    return out / "index.html"


def _check_private(run: LibraryRun, *, reveals: bool) -> None:
    if run.pack is not None:
        manifest = manifest_of(run.pack.folder)
        check_revealed(manifest.name, is_private(manifest.meta), "A page or film of its episodes", reveals=reveals)


def page_name(episode_id: str, epoch: int) -> str:
    """Return the name of the file with the page of a play."""
    return f"{episode_id}.{epoch}.html"


def _jpeg_uri(png: bytes) -> str:
    buffer = io.BytesIO()
    Image.open(io.BytesIO(png)).convert("RGB").save(buffer, "JPEG", quality=JPEG_QUALITY)
    return "data:image/jpeg;base64," + base64.b64encode(buffer.getvalue()).decode("ascii")


def _script(name: str) -> str:
    return (STATIC / name).read_text(encoding="utf-8")


def embedded(text: str) -> dict[str, Any]:
    """Return what a standalone page contains: the style, the script `text`, and a content policy that allows nothing
    else."""
    digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode("ascii")
    return {
        "icon": "data:image/svg+xml;base64," + base64.b64encode((STATIC / "icon.svg").read_bytes()).decode("ascii"),
        "style": Markup((STATIC / "vigil.css").read_text(encoding="utf-8")),
        "script": Markup(text),
        "policy": f"default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'sha256-{digest}'",
    }
