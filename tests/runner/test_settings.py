"""A run's settings, its identity in the header, and what its workers are told: types that must not drift apart."""

import inspect
from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest

from tests.support.tiny_pack import tiny_pack
from vigil.api import make_env
from vigil.errors import SettingError
from vigil.packs.pack import Pack
from vigil.protocol.profile import Profile
from vigil.records.costs import Prices
from vigil.records.record import RunSpec, Shard
from vigil.runner.plan import plan_run
from vigil.runner.settings import RunSettings
from vigil.runner.workers.messages import RenderSettings, WorkerPlan
from vigil.sim import BACKENDS

IDENTITY: dict[str, dict[str, Any]] = {
    "agent": {"agent": "random", "model": None},
    "agent_factory": {"agent": "solver", "model": None, "agent_factory": lambda *_: None},
    "model": {"model": "openai/another"},
    "base_url": {"base_url": "http://localhost:8000/v1"},
    "limit": {"limit": 1},
    "families": {"families": ("DA",)},
    "profile": {"profile": "action_feedback"},
    "prompt_variant": {"prompt_variant": "neutral_report"},
    "prompt_template": {"prompt_template": "Task: <TASK_INSTRUCTION>"},
    "coordinates": {"coordinates": "normalized_1000"},
    "reply_policy": {"reply_policy": "lenient"},
    "shard": {"shard": Shard(index=1, of=2)},
    "epochs": {"epochs": 2},
    "temperature": {"temperature": 0.5},
    "top_p": {"top_p": 0.5},
    "max_tokens": {"max_tokens": 99},
    "reasoning_effort": {"reasoning_effort": "low"},
    "thinking": {"model": "qwen/qwen3-vl-plus", "thinking": "on"},
    "model_args": {"model_args": {"strict": True}},
    "extra_body": {"extra_body": {"top_k": 20}},
    "image_format": {"image_format": "jpeg"},
    "system_role": {"system_role": "user"},
    "render_quality": {"render_quality": "fast"},
    "backend": {"backend": "fake"},
    "seed": {"seed": 1},
    "frame_interval_seconds": {"agent": "exec:true", "model": None, "frame_interval_seconds": 2.0},
    "keep_program": {"agent": "exec:true", "model": None, "keep_program": True},
}
"""Another value of each setting that makes another run; those of `NEED_FILES` need files."""
DEFAULTS = {name: getattr(RunSettings(), name) for name in IDENTITY}
UNSET = {
    "agent": {"agent": "noop"},
    "agent_factory": {"agent": "noop", "agent_factory": None},
    "model": {"model": "openai/one"},
}
"""What stands for a default where a run needs some value."""
NEED_FILES = {"pack", "episode_ids", "asset_database", "fork_from", "fork_at", "env", "sandbox"}
"""Settings that need files, a server or bubblewrap."""
SAME_RUN: dict[str, dict[str, Any]] = {
    "api_key_env": {"api_key_env": "HOME"},
    "env_token": {"env_token": "a long secret"},
    "log_dir": {"log_dir": Path("elsewhere")},
    "workers": {"workers": 7},
    "executor": {"executor": "ray"},
    "ray_address": {"executor": "ray", "ray_address": "localhost:1"},
    "max_connections": {"max_connections": 7},
    "save_frames": {"save_frames": True},
    "keep_reasoning": {"keep_reasoning": True},
    "simulator_factory": {"simulator_factory": BACKENDS["fake"]},
    "reply_seconds": {"reply_seconds": 7},
    "probe": {"probe": "every"},
    "probe_framing": {"probe": "every", "probe_framing": "doubt"},
    "preflight": {"preflight": False},
    "force": {"force": True},
    "reveal_private_pack": {"reveal_private_pack": True},
    "retries": {"retries": 7},
    "first_wait_s": {"first_wait_s": 7.0},
    "longest_wait_s": {"longest_wait_s": 7.0},
    "timeout_s": {"timeout_s": 7.0},
    "prices": {"prices": Prices(input=1.0, output=10.0)},
}
"""Another value of each setting under which the same run goes on."""
OF_THE_MOMENT = {"versions", "pack_versions"}
"""Fields of a header whose default stands for what was not written down."""


@pytest.fixture(scope="module")
def pack(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("packs") / "tiny"
    tiny_pack(folder, 8)
    return folder


def spec_of(folder: Path, **changes: Any) -> RunSpec:
    return plan_run(RunSettings(**{"pack": folder, "model": "openai/one", **changes})).spec


def test_of_every_setting_is_known_whether_it_makes_another_run() -> None:
    named = [*IDENTITY, *SAME_RUN, *NEED_FILES]
    assert sorted(named) == sorted(field.name for field in fields(RunSettings))


@pytest.mark.parametrize("name", IDENTITY)
def test_another_value_makes_another_run(pack: Path, name: str) -> None:
    other = IDENTITY[name]
    assert spec_of(pack, **other) != spec_of(pack, **{**other, **UNSET.get(name, {name: DEFAULTS[name]})})


def test_another_pack_episode_or_database_makes_another_run(pack: Path, tmp_path: Path) -> None:
    tiny_pack(tmp_path / "other", 4)
    database = tmp_path / "asset-database.json"
    database.write_text('{"Chair": []}', encoding="utf-8")
    episode = Pack.load(pack).episodes[0].id
    others = [{"pack": tmp_path / "other"}, {"episode_ids": (episode,)}, {"asset_database": database}]
    assert all(spec_of(pack, **other) != spec_of(pack) for other in others)


@pytest.mark.parametrize("name", SAME_RUN)
def test_another_value_leaves_the_run_the_same(pack: Path, name: str) -> None:
    assert spec_of(pack, **SAME_RUN[name]) == spec_of(pack)


def test_a_header_without_a_field_is_of_a_run_with_that_settings_default(pack: Path) -> None:
    spec = spec_of(pack, model=None, agent="noop")
    optional = {name: one for name, one in RunSpec.model_fields.items() if not one.is_required()}
    defaults = {name: one.get_default(call_default_factory=True) for name, one in optional.items()}
    assert {name: getattr(spec, name) for name in defaults.keys() - OF_THE_MOMENT} == {
        name: defaults[name] for name in defaults.keys() - OF_THE_MOMENT
    }


def test_workers_are_told_the_settings_that_concern_them(pack: Path, tmp_path: Path) -> None:
    database = tmp_path / "asset-database.json"
    database.write_text('{"Chair": []}', encoding="utf-8")
    told = {
        "agent_factory": print,
        "asset_database": database,
        "simulator_factory": print,
        "backend": "fake",
        "seed": 5,
    }
    told |= {"agent": "noop", "reply_seconds": 9, "frame_interval_seconds": 2.5, "keep_program": True}
    plan = plan_run(RunSettings(pack=pack, **told, render_quality="fast")).worker
    assert {name: getattr(plan, name) for name in told} == told
    assert plan.quality == "fast"
    own = {"pack", "pack_sha256", "run_id", "profile", "frames", "quality", "recorded_profile", "hidden"}
    assert {field.name for field in fields(WorkerPlan)} == own | told.keys()


def test_workers_and_environments_have_the_defaults_of_a_runs_settings(pack: Path) -> None:
    settings = RunSettings(pack=pack, agent="noop")
    same = WorkerPlan(pack, "", Profile(), agent="noop", pack_sha256=Pack.load(pack).sha256)
    assert plan_run(settings).worker == same
    expected = RenderSettings(settings.backend, settings.render_quality, settings.asset_database)
    assert expected == RenderSettings()
    given = inspect.signature(make_env).parameters
    assert expected == RenderSettings(*(given[field.name].default for field in fields(RenderSettings)))


def test_more_plays_than_can_be_planned_are_refused() -> None:
    with pytest.raises(SettingError, match=r"epochs is 99999999999; it must be 10000 or less"):
        RunSettings(agent="noop", epochs=99_999_999_999)
