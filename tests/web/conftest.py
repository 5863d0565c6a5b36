"""Two small runs on the engine-free backend, served on loopback; and a browser, where there is one."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.support.browser_page import DESKTOP, PHONE, Visitor
from tests.support.played_runs import make_run
from tests.support.tiny_pack import tiny_pack
from tests.support.web_server import Site, served
from vigil.packs.pack import Pack
from vigil.runner.workers.messages import RenderSettings
from vigil.web.drawing import RenderService
from vigil.web.library import Library
from vigil.web.view import make_view


@pytest.fixture(scope="session")
def pack(tmp_path_factory: pytest.TempPathFactory) -> Pack:
    return tiny_pack(tmp_path_factory.mktemp("packs") / "tiny", 8)


@pytest.fixture(scope="session")
def run_maker() -> Callable[..., Path]:
    return make_run


@pytest.fixture(scope="session")
def runs(tmp_path_factory: pytest.TempPathFactory, pack: Pack) -> Path:
    folder = tmp_path_factory.mktemp("runs")
    make_run(folder / "random", pack, "random", frames=False)
    make_run(folder / "sweep", pack, "sweep", frames=True)
    return folder


@pytest.fixture(scope="session")
def render_service() -> Iterator[RenderService]:
    render_service = RenderService()
    yield render_service
    render_service.close()


@pytest.fixture(scope="session")
def view(runs: Path, pack: Pack, render_service: RenderService) -> Iterator[Site]:
    with served(
        make_view(Library([runs], [pack.folder]), render_service, render_settings=RenderSettings("fake"))
    ) as site:
        yield site


@pytest.fixture(params=[(DESKTOP, "light"), (PHONE, "dark")], ids=["desktop-light", "phone-dark"])
def visitor(chromium: Any, request: pytest.FixtureRequest) -> Iterator[Visitor]:
    size, scheme = request.param
    context = chromium.new_context(viewport=size, color_scheme=scheme)
    yield Visitor(context.new_page())
    context.close()
