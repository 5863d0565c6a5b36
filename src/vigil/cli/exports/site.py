"""Exports one run as a static site, or one of its episodes as a page or a film."""

from collections.abc import Sequence
from contextlib import closing
from pathlib import Path

from vigil.cli.text import print_notes
from vigil.errors import RecordError, SettingError, did_you_mean
from vigil.records.record import Key
from vigil.web.drawing import RenderService
from vigil.web.export import FilmForm, episode_film, episode_page, export_site
from vigil.web.library import Library, LibraryRun

FILM_FORMS: dict[str, FilmForm] = {".gif": "gif", ".webp": "webp", ".mp4": "mp4"}


def write_run_site(
    folder: Path, out: Path, key: Key | None, packs: Sequence[str], assets: Path | None, *, reveals: bool
) -> Path:
    """Write the run in `folder`, or only the episode `key`, and return the file that a user should open.

    Raises RecordError, or SettingError if the pack is private and `reveals` is false.
    """
    library = Library([folder], packs or ["starter"], assets)
    found = library.runs()
    if len(found) > 1:
        names = ", ".join(str(each.folder) for each in found[:5])
        raise RecordError(
            f"{str(folder)!r} contains {len(found)} runs, but only one can be exported. Give one of: {names}."
        )
    if not found or found[0].table is None:
        raise RecordError(
            f"{str(folder)!r} is not a run that can be exported: {found[0].fault if found else 'no records'}"
        )
    shown = found[0]
    print_notes(shown.notes)
    with closing(RenderService()) as render_service:
        if key is None:
            return export_site(shown, out, render_service, print, reveals=reveals)
        out.write_bytes(_one_episode(shown, key, out.suffix, render_service, reveals=reveals))
        return out


def _one_episode(run: LibraryRun, key: Key, suffix: str, render_service: RenderService, *, reveals: bool) -> bytes:
    rows = run.table.rows if run.table else {}
    if key not in rows:
        hint = did_you_mean(key[0], [name for name, _ in rows])
        raise SettingError(f"Run {run.slug!r} has no episode {key[0]!r} (epoch {key[1]}).{hint}")
    if suffix in FILM_FORMS:
        return episode_film(run, key, render_service, FILM_FORMS[suffix], reveals=reveals)
    if suffix == ".html":
        return episode_page(run, key, render_service, reveals=reveals).encode()
    found = suffix or "without an ending"
    raise SettingError(f"--out: an episode is written as {', '.join(FILM_FORMS)} or .html, not {found!r}.")
