"""Exports: an episode as one self-contained page or a GIF, a run as a folder of pages that can be hosted anywhere."""

import base64
import hashlib
import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

from markupsafe import Markup
from PIL import Image, ImageDraw, ImageFont

from vigil.episode import FAMILIES, Episode
from vigil.errors import RecordError, SettingError, VigilError
from vigil.record import EpisodeRecord, Key
from vigil.summary import summarise
from vigil.web.drawing import Drawer, Look, Scene
from vigil.web.library import ShownPack, ShownRun
from vigil.web.plan import try_plan
from vigil.web.site import STATIC, TEMPLATES
from vigil.web.story import story_of
from vigil.web.tables import LABELS, RATE_COLUMNS, bars_of
from vigil.web.words import LABELS as LABEL_WORDS

JPEG_QUALITY = 86
GIF_SIZE = (480, 360)
GIF_STRIP_PX = 44
GIF_STEP_MS = 1100
GIF_LAST_MS = 3000
EPISODES_FOLDER = "episodes"


def episode_of(run: ShownRun, key: Key) -> tuple[Episode, EpisodeRecord, ShownPack]:
    """Returns an episode of a run with its record and its pack. Raises KeyError or RecordError."""
    if run.table is None or run.pack is None:
        raise RecordError(f"Run {run.slug!r} cannot be read: {run.fault}")
    if key not in run.table.rows:
        raise KeyError(key)
    return run.table.episodes[key[0]], run.table.record(key), run.pack


def tell(run: ShownRun, episode: Episode, record: EpisodeRecord) -> dict[str, Any]:
    """Returns the story of a record of a run."""
    if run.header is None or run.table is None:
        raise RecordError(f"Run {run.slug!r} cannot be read: {run.fault}")
    return story_of(episode, record, run.header.spec.profile, run.table.rows[record.key].outcome)


def frame_of(run: ShownRun, key: Key, step: int, drawer: Drawer) -> bytes:
    """Returns the frame (PNG) that a step's reply answered: as saved, else drawn again. Raises VigilError, KeyError."""
    episode, record, pack = episode_of(run, key)
    if not 1 <= step <= len(record.steps):
        raise KeyError(step)
    saved = run.saved_frame(record.steps[step - 1].frame_sha256)
    if saved is not None:
        return saved.read_bytes()
    return drawer.picture(_scene(run, episode, record, pack, step))


def _scene(run: ShownRun, episode: Episode, record: EpisodeRecord, pack: ShownPack, step: int) -> Scene:
    if run.header is None:
        raise RecordError(f"Run {run.slug!r} cannot be read: {run.fault}")
    spec = run.header.spec
    if spec.asset_database_sha256 is not None and run.assets is None:
        raise SettingError(
            f"Run {run.slug!r} was played with an asset database of SHA-256 {spec.asset_database_sha256[:12]}...; its "
            "frames can be drawn again when that file is given with --assets."
        )
    pack.house(episode.house.name)
    done = [each.action for each in record.steps[: step - 1]]
    return Scene(
        look=Look(spec.simulator, spec.render_quality, run.assets),
        house=pack.house_path(episode.house.name),
        start=episode.start,
        setup=episode.setup,
        actions=tuple(action for action in done if action is not None and action.skill_name != "report"),
    )


def episode_page(run: ShownRun, key: Key, drawer: Drawer) -> str:
    """Returns one HTML page with everything in it: pictures, style and script."""
    episode, record, pack = episode_of(run, key)
    story = tell(run, episode, record)
    story["frames"] = [_jpeg_uri(frame) for frame in _frames(run, key, drawer)]
    story["before"] = story["after"] = None
    return TEMPLATES.get_template("alone.html").render(
        title=f"{episode.id} · {run.name}",
        run=run,
        story=story,
        plan=try_plan(pack, episode),
        is_alone=True,
        **_carried("viewer.js"),
    )


def episode_gif(run: ShownRun, key: Key, drawer: Drawer) -> bytes:
    """Returns an animated GIF: each frame with the click marked and the action below. Raises SettingError."""
    episode, record, _ = episode_of(run, key)
    story = tell(run, episode, record)
    frames = _frames(run, key, drawer)
    slides = [_slide(data, step) for data, step in zip(frames, story["steps"], strict=True) if data is not None]
    if not slides:
        raise SettingError(f"Episode {episode.id!r} has no frame that could be shown in a GIF.")
    buffer = io.BytesIO()
    durations = [GIF_STEP_MS] * (len(slides) - 1) + [GIF_LAST_MS]
    slides[0].save(buffer, "GIF", save_all=True, append_images=slides[1:], duration=durations, loop=0)
    return buffer.getvalue()


def export_site(run: ShownRun, out: Path, drawer: Drawer, report: Callable[[str], None] = lambda line: None) -> Path:
    """Writes a run as pages into `out`, new or empty, and returns its index; `report` is told of each episode.

    Raises SettingError or RecordError.
    """
    if run.table is None or run.header is None:
        raise RecordError(f"Run {run.slug!r} cannot be read: {run.fault}")
    if out.exists() and any(out.iterdir()):
        raise SettingError(f"Folder {str(out)!r} is not empty; export into a new one.")
    (out / EPISODES_FOLDER).mkdir(parents=True, exist_ok=True)
    settlement = run.table.settlement()
    index = TEMPLATES.get_template("run_alone.html").render(
        title=run.name,
        run=run,
        settlement=settlement,
        summary=summarise(settlement),
        bars=bars_of(settlement),
        outcomes=settlement.outcomes,
        labels=LABELS,
        label_words=LABEL_WORDS,
        columns=RATE_COLUMNS,
        families=FAMILIES,
        link=lambda family="", label="": f"#family={family}&label={label}",
        episode_link=lambda episode_id, epoch: f"{EPISODES_FOLDER}/{_file_name(episode_id, epoch)}",
        **_carried("filter.js"),
    )
    for key in sorted(run.table.rows):
        (out / EPISODES_FOLDER / _file_name(*key)).write_text(episode_page(run, key, drawer), encoding="utf-8")
        report(key[0])
    (out / "index.html").write_text(index, encoding="utf-8")
    return out / "index.html"


def _file_name(episode_id: str, epoch: int) -> str:
    return f"{episode_id}.{epoch}.html"


def _frames(run: ShownRun, key: Key, drawer: Drawer) -> list[bytes | None]:
    """Returns all frames of an episode; None for what was not saved and cannot be drawn."""
    _, record, _ = episode_of(run, key)
    found: list[bytes | None] = []
    for step in record.steps:
        try:
            found.append(frame_of(run, key, step.index, drawer))
        except VigilError:
            found.append(None)
    return found


def _jpeg_uri(png: bytes | None) -> str:
    if png is None:
        return ""
    buffer = io.BytesIO()
    Image.open(io.BytesIO(png)).convert("RGB").save(buffer, "JPEG", quality=JPEG_QUALITY)
    return "data:image/jpeg;base64," + base64.b64encode(buffer.getvalue()).decode("ascii")


def _slide(png: bytes, step: dict[str, Any]) -> Image.Image:
    frame = Image.open(io.BytesIO(png)).convert("RGB").resize(GIF_SIZE)
    slide = Image.new("RGB", (GIF_SIZE[0], GIF_SIZE[1] + GIF_STRIP_PX), (24, 28, 32))
    slide.paste(frame, (0, 0))
    draw = ImageDraw.Draw(slide)
    if step["click"] is not None:
        x, y = (value * GIF_SIZE[0] / 640 for value in step["click"])
        for radius, colour, width in ((11, (255, 255, 255), 4), (11, (214, 21, 95), 2)):
            draw.ellipse((x - radius, y - radius, x + radius, y + radius), outline=colour, width=width)
    text = f"{step['index']}. {step['action']}"[:64].encode("ascii", "replace").decode("ascii").replace("?", " ")
    draw.text((12, GIF_SIZE[1] + 13), text, fill=(240, 242, 244), font=ImageFont.load_default(16))
    return slide.quantize(128)


def _carried(script: str) -> dict[str, Any]:
    """Returns what a page that stands alone carries: our style and script, and the policy that runs no other."""
    text = (STATIC / script).read_text(encoding="utf-8")
    digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode("ascii")
    return {
        "style": Markup((STATIC / "vigil.css").read_text(encoding="utf-8")),
        "script": Markup(text),
        "policy": f"default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'sha256-{digest}'",
    }
