"""Exports stand on their own."""

import io
import re
from pathlib import Path

import pytest
from PIL import Image

from tests.support.web_server import Site
from vigil.errors import SettingError
from vigil.packs.pack import Pack
from vigil.records.record_file import read_records
from vigil.web.drawing import RenderService
from vigil.web.export import export_site
from vigil.web.library import Library


def test_an_episode_is_one_page_with_everything_in_it(view: Site, pack: Pack) -> None:
    answer = view.get(f"/runs/sweep/episodes/{pack.episodes[0].id}/1/export.html")
    assert answer.status == 200
    assert "attachment" in answer.headers["content-disposition"]
    assert answer.text.count("data:image/jpeg;base64,") == 5
    assert not re.search(r'(src|href)="(?!#|data:)', answer.text)
    assert "equal to the recorded frame" in answer.text
    assert "script-src &#39;sha256-" in answer.text


def test_a_gif_has_a_slide_for_each_step_and_one_for_the_verdict(view: Site, runs: Path) -> None:
    for run in ("sweep", "random"):
        shortest = min(read_records(runs / run / "episodes.jsonl"), key=lambda record: len(record.steps))
        steps = len(shortest.steps)
        answer = view.get(f"/runs/{run}/episodes/{shortest.episode_id}/1/export.gif")
        image = Image.open(io.BytesIO(answer.body))
        assert image.format == "GIF"
        assert 2 <= getattr(image, "n_frames", 1) <= steps + 1  # equal neighbours are merged
        assert image.size == (840, 462)


def test_a_run_becomes_a_site_with_relative_links(
    runs: Path, pack: Pack, render_service: RenderService, tmp_path: Path
) -> None:
    library = Library([runs], [pack.folder])
    library.runs()
    index = export_site(library.run("sweep"), tmp_path / "site", render_service)
    text = index.read_text()
    links = re.findall(r'<a href="([^"#]+)"', text)
    assert len(links) == len(pack.episodes) + 1  # the glossary
    assert all((index.parent / link).is_file() for link in links)
    glossary = (index.parent / "glossary.html").read_text()
    words = re.findall(r'<a class="word" href="glossary\.html#([^"]+)"', text)
    assert words
    assert all(f'<dt id="{word}">' in glossary for word in words)
    with pytest.raises(SettingError, match="not empty"):
        export_site(library.run("sweep"), tmp_path / "site", render_service)
