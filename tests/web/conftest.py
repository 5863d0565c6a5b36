"""Two small runs on the engine-free backend, served on loopback; and a browser, where there is one."""

from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest

from tests.support.browser_page import DESKTOP, PHONE, Visitor
from tests.support.tiny_pack import tiny_pack
from tests.support.web_server import Site, served
from vigil.agents.scripted import scripted_agent
from vigil.assets.database import AssetDatabase
from vigil.base.json_lines import dump_line
from vigil.base.versions import Versions
from vigil.env import Env
from vigil.packs.pack import Pack
from vigil.protocol.profile import Profile
from vigil.protocol.prompt import policy_sha256, policy_version
from vigil.records.record import FRAMES_FOLDER, RunHeader, RunSpec
from vigil.runner.run_folder import new_nonce, write_header
from vigil.runner.workers.frames import FrameStore
from vigil.runner.workers.messages import RenderSettings
from vigil.runner.workers.play import EpisodeObserver, play
from vigil.sim import make_simulator
from vigil.web.drawing import RenderService
from vigil.web.library import Library
from vigil.web.view import make_view


@pytest.fixture(scope="session")
def pack(tmp_path_factory: pytest.TempPathFactory) -> Pack:
    return tiny_pack(tmp_path_factory.mktemp("packs") / "tiny", 8)


def make_run(folder: Path, pack: Pack, agent: str, *, frames: bool) -> Path:
    """Plays a pack with a scripted agent on the fake backend, without any worker process."""
    folder.mkdir(parents=True)
    profile = Profile()
    spec = RunSpec(
        agent=agent,
        agent_kind="scripted",
        profile=profile,
        prompt_policy=policy_version(profile),
        prompt_policy_sha256=policy_sha256(profile),
        pack=pack.name,
        pack_sha256=pack.sha256,
        episode_ids=tuple(episode.id for episode in pack.episodes),
        versions=Versions.current(),
        pack_versions=pack.manifest.versions,
        simulator="fake",
    )
    now = datetime.now(UTC)
    header = RunHeader(run_id=folder.name, nonce=new_nonce(), spec=spec, package_version="0", started=now, ended=now)
    write_header(folder, header)
    store = FrameStore(folder / FRAMES_FOLDER)
    env = Env(make_simulator("fake", assets=AssetDatabase.default()), pack.house_of, profile)
    with (folder / "episodes.jsonl").open("wb") as rows:
        for episode in pack.episodes:
            watcher = (
                EpisodeObserver(on_reply=lambda observation, _: store.save(observation.rgb))
                if frames
                else EpisodeObserver()
            )
            play(episode, env, scripted_agent(agent, 3), watcher)
            record = env.record()
            assert record.end != "error", record.error
            rows.write(dump_line(header.stamp(record)))
    return folder


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
