"""A tiny pack, two honest runs of scripted agents on it, and their bundles."""

from datetime import date
from pathlib import Path
from typing import Any

import pytest

from tests.support.commands import Vigil, command_runner
from tests.support.played_runs import make_run
from tests.support.tiny_pack import tiny_pack
from vigil.packs.pack import Pack
from vigil.web.leaderboard.metadata import EntryMetadata, Methodology, StatedFacts
from vigil.web.leaderboard.settings import CheckSettings
from vigil.web.leaderboard.submit import submit_run

ONE_WORKER = CheckSettings(workers=1)


def metadata(name: str, **facts: Any) -> EntryMetadata:
    """Return complete metadata of a scripted agent."""
    fields = {
        "model_name": name,
        "model_organization": "Us",
        "submitting_organization": "Us",
        "submission_date": date(2099, 1, 1),
        "submission_type": "custom",
        "contact_info": "us@example.org",
        "references": ("https://example.org/paper",),
        "model_release": None,
        "weights": "none",
        "trained_on_streams": False,
        "tier": "re_simulated",
        "methodology": Methodology(
            evaluation_date=date(2026, 1, 1),
            notes="None.",
            verification=StatedFacts(modified_prompts=False, omitted_questions=False),
        ),
    }
    return EntryMetadata.model_validate({**fields, **facts})


@pytest.fixture(scope="session")
def pack(tmp_path_factory: pytest.TempPathFactory) -> Pack:
    return tiny_pack(tmp_path_factory.mktemp("packs") / "tiny", 4)


@pytest.fixture(scope="session")
def runs(tmp_path_factory: pytest.TempPathFactory, pack: Pack) -> Path:
    folder = tmp_path_factory.mktemp("runs")
    for agent in ("always_success", "random"):
        host = {"pack_folder": str(pack.folder)}
        make_run(folder / agent, pack, agent, frames=False, simulator="mujoco", host=host)
    return folder


@pytest.fixture(scope="session")
def bundles(tmp_path_factory: pytest.TempPathFactory, runs: Path) -> dict[str, Path]:
    """The honest bundles, by agent."""
    folder = tmp_path_factory.mktemp("bundles")
    found = {agent: folder / f"{agent}.zip" for agent in ("always_success", "random")}
    for agent, path in found.items():
        submit_run(runs / agent, metadata(agent), path, ONE_WORKER)
    return found


@pytest.fixture
def vigil(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Vigil:
    """Runs the command line in this process."""
    return command_runner(monkeypatch, capsys)
