"""Where a frame comes from, and whether it is the recorded one; also in houses that need THOR's asset database."""

import gzip
import json
import shutil
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from tests.support.tiny_pack import loose_pack, tiny_episode
from tests.support.web_server import Site, served
from vigil.agents.frame_encoding import encode_frame
from vigil.agents.scripted import scripted_agent
from vigil.assets.database import AssetDatabase
from vigil.base.files import file_sha256
from vigil.base.geometry import Pose
from vigil.base.json_lines import dump_line
from vigil.base.versions import Versions
from vigil.env import Env
from vigil.errors import SettingError
from vigil.packs.pack import Pack
from vigil.protocol.house import House
from vigil.protocol.profile import Profile
from vigil.protocol.prompt import policy_sha256, policy_version
from vigil.records.record import RunHeader, RunSpec
from vigil.records.record_file import read_records
from vigil.runner.run_folder import write_header
from vigil.runner.workers.messages import RenderSettings
from vigil.runner.workers.worker import play
from vigil.sim import make_simulator
from vigil.web.drawing import RenderService
from vigil.web.library import Library
from vigil.web.timeline import Frame, frame_of
from vigil.web.view import make_view


@pytest.fixture
def bare(runs: Path, tmp_path: Path) -> Path:
    """The run with recorded hashes, its frames gone."""
    folder = tmp_path / "runs" / "bare"
    shutil.copytree(runs / "sweep", folder, ignore=shutil.ignore_patterns("frames"))
    return folder


def first_frame(folder: Path, pack: Path, render_service: RenderService, assets: Path | None = None) -> Frame:
    library = Library([folder], [pack], assets)
    (run,) = library.runs()
    assert run.table is not None, run.fault
    return frame_of(run, min(run.table.rows), 1, render_service)


def test_a_saved_frame_is_held_against_its_hash(
    runs: Path, pack: Pack, render_service: RenderService, tmp_path: Path
) -> None:
    folder = Path(shutil.copytree(runs / "sweep", tmp_path / "sweep"))
    frame = first_frame(folder, pack.folder, render_service)
    assert (frame.origin, frame.is_recorded) == ("saved", True)
    sha256 = read_records(folder / "episodes.jsonl")[0].steps[0].frame_sha256
    assert sha256 is not None
    file = folder / "frames" / sha256[:2] / f"{sha256}.png"
    file.write_bytes(encode_frame(np.zeros((480, 640, 3), np.uint8)).data)
    frame = first_frame(folder, pack.folder, render_service)
    assert (frame.origin, frame.is_recorded) == ("saved", False)
    assert "NOT the recorded frame" in frame.note
    file.write_bytes(b"half a pict")
    assert first_frame(folder, pack.folder, render_service).origin == "redrawn"


def test_a_redrawn_frame_is_held_against_its_hash(
    bare: Path, runs: Path, pack: Pack, render_service: RenderService
) -> None:
    frame = first_frame(bare, pack.folder, render_service)
    assert (frame.origin, frame.is_recorded) == ("redrawn", True)
    rows = (bare / "episodes.jsonl").read_text()
    record = read_records(bare / "episodes.jsonl")[0]
    (bare / "episodes.jsonl").write_text(rows.replace(str(record.steps[0].frame_sha256), "0" * 64))
    frame = first_frame(bare, pack.folder, render_service)
    assert (frame.origin, frame.is_recorded) == ("redrawn", False)
    assert "NOT equal to the recorded frame" in frame.note
    frame = first_frame(runs / "random", pack.folder, render_service)
    assert (frame.origin, frame.is_recorded) == ("redrawn", None)
    assert "does not hold a hash" in frame.note


def test_the_page_is_told_for_each_step(bare: Path, view: Site, pack: Pack, render_service: RenderService) -> None:
    path = f"episodes/{pack.episodes[0].id}/1/frames"
    told = json.loads(view.get(f"/runs/sweep/{path}/2.json").body)
    assert (told["origin"], told["is_recorded"]) == ("saved", True)
    with served(make_view(Library([bare], [pack.folder]), render_service)) as site:
        for step in range(1, 6):
            told = json.loads(site.get(f"/runs/bare/{path}/{step}.json").body)
            assert (told["origin"], told["is_recorded"]) == ("redrawn", True)
        assert site.get(f"/runs/bare/{path}/6.json", Accept="application/json").status == 404


@pytest.fixture(scope="module")
def thor_run(thor_files: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A run in a real house of ProcTHOR's, sized by its asset database, drawn by the default backend; and its pack."""
    with gzip.open(thor_files / "one_room_train.jsonl.gz", "rt") as lines:
        house = House("real", json.loads(next(lines)))
    start = house.start
    assert start is not None
    folder = tmp_path_factory.mktemp("thor")
    target = house.document.objects[0].id
    start = Pose.model_validate(start.model_dump() | {"horizon": 30.0})
    episode = tiny_episode(0, "DA", house, start=start, bindings={"target": target})
    episode = episode.model_copy(update={"goal": episode.goal.model_copy(update={"object_id": target})})
    pack = loose_pack(folder / "pack", [episode], [house])
    profile = Profile()
    database = thor_files / "asset-database.json"
    spec = RunSpec(
        agent="sweep",
        agent_kind="scripted",
        profile=profile,
        prompt_policy=policy_version(profile),
        prompt_policy_sha256=policy_sha256(profile),
        pack=pack.name,
        pack_sha256=pack.sha256,
        episode_ids=(episode.id,),
        versions=Versions.current(),
        simulator="mujoco",
        asset_database_sha256=file_sha256(database, "it"),
        render_quality="fast",
    )
    run = folder / "run"
    run.mkdir()
    now = datetime.now(UTC)
    header = RunHeader(run_id="thor", nonce="0" * 32, spec=spec, package_version="0", started=now, ended=now)
    write_header(run, header)
    simulator = make_simulator("mujoco", assets=AssetDatabase.load(database), quality="fast")
    try:
        env = Env(simulator, pack.house_of, profile)
        play(episode, env, scripted_agent("sweep", 3), on_reply=lambda observation, _: observation.rgb)
        record = header.stamp(env.record())
        assert record.end != "error", record.error
        (run / "episodes.jsonl").write_bytes(dump_line(record))
    finally:
        simulator.close()
    return run, pack.folder


def test_frames_of_thors_assets_are_drawn_again_with_their_database(
    thor_run: tuple[Path, Path], thor_files: Path, render_service: RenderService
) -> None:
    run, pack = thor_run
    frame = first_frame(run, pack, render_service, thor_files / "asset-database.json")
    assert (frame.origin, frame.is_recorded) == ("redrawn", True)


def test_without_their_database_the_error_says_what_to_give(
    thor_run: tuple[Path, Path], thor_files: Path, render_service: RenderService, tmp_path: Path
) -> None:
    run, pack = thor_run
    other = Path(shutil.copy(thor_files / "asset-database.json", tmp_path / "other.json"))
    other.write_bytes(other.read_bytes() + b"\n")
    for assets in (None, other):
        with pytest.raises(SettingError, match=r"asset database of SHA-256 .* --assets"):
            first_frame(run, pack, render_service, assets)


def test_the_pages_of_such_a_house_work(
    thor_run: tuple[Path, Path], thor_files: Path, render_service: RenderService
) -> None:
    run, pack = thor_run
    database = thor_files / "asset-database.json"
    library = Library([run], [pack], database)
    with served(make_view(library, render_service, render_settings=RenderSettings("mujoco", "fast", database))) as site:
        assert "<svg" in site.get("/houses/pack/real").text
        pose = {"position": [*read_records(run / "episodes.jsonl")[0].worlds[0].agent.position], "rotation": 0}
        body = json.dumps({"pose": {**pose, "horizon": 30}})
        assert site.post("/houses/pack/real/walk", body).status == 200
        told = site.get("/runs/run/episodes/tiny-DA-000/1/frames/2.json", Accept="application/json")
        assert json.loads(told.body)["is_recorded"] is True
