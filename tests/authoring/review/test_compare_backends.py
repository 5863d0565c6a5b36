"""One pack through two back ends: what is the same is not told, and each kind of difference is."""

import json
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from tests.support.thor_client import in_process
from tests.support.tiny_pack import FRIDGE, MUG, tiny_episode, tiny_house, tiny_pack
from vigil.assets.database import AssetDatabase
from vigil.authoring.review.compare_backends import (
    KINDS,
    SEEN,
    BackendComparison,
    BackendDifference,
    compare_backends,
    differences,
)
from vigil.authoring.review.validate import Validator
from vigil.base.geometry import Vec3
from vigil.cli import app
from vigil.packs.pack import Pack
from vigil.protocol.actions import InteractPixel, Look, Navigate, Report
from vigil.protocol.episode import Episode
from vigil.protocol.goals import ReportStatus
from vigil.records.record import EpisodeRecord
from vigil.sim import make_simulator
from vigil.sim.thor.differences import DIFFERENCES

ACTIONS = (
    Navigate(mode="forward", magnitude=2),
    Look(direction="down", magnitude=12.5),
    InteractPixel(intent="ground", x=320, y=240),
    Report(status="success", summary=""),
)


@pytest.fixture(scope="module")
def pack(tmp_path_factory: pytest.TempPathFactory) -> Pack:
    folder = tmp_path_factory.mktemp("packs") / "tiny"
    tiny_pack(folder, 2)
    return Pack.load(folder)


@pytest.fixture(scope="module")
def played(pack: Pack) -> tuple[Episode, EpisodeRecord]:
    episode = pack.episodes[0]
    validator = Validator(make_simulator("fake", assets=AssetDatabase.default()))
    return episode, validator.play(episode, pack.house_of(episode), ACTIONS)


def changed(record: EpisodeRecord, step: int, *, effect: Any = None, agent: Any = None, **state: Any) -> EpisodeRecord:
    """Return a record in which one step differs."""
    old = record.steps[step - 1]
    world = old.world
    name, seen = next(iter(world.objects.items()))
    world = world.model_copy(update={"objects": {**world.objects, name: seen.model_copy(update=state)}})
    world = world.model_copy(update={"agent": world.agent.model_copy(update=agent or {})})
    assert old.effect is not None
    new = old.model_copy(update={"world": world, "effect": old.effect.model_copy(update=effect or {})})
    return record.model_copy(update={"steps": (*record.steps[: step - 1], new, *record.steps[step:])})


def test_the_same_record_has_no_difference(played):
    episode, record = played
    assert list(differences(episode, record, record)) == []


@pytest.mark.parametrize(
    ("kind", "change"),
    {
        "pose": {"agent": {"rotation": 0.05}},
        "place": {"position": Vec3(0.0, 0.0, 0.0)},
        "state": {"is_toggled": True},
        "hand": {"is_held": True},
        "support": {"inside": (FRIDGE,)},
        "pixels": {"visible_px": 1},
        "nearest": {"nearest_visible_m": 9.0},
        "hit": {"effect": {"hit": MUG}},
        "near": {"effect": {"near": (MUG, FRIDGE)}},
        "moved": {"effect": {"moved_m": 0.25}},
        "refusal": {"effect": {"refusal": "too_far"}},
        "changed": {"effect": {"changed": (MUG,)}},
    }.items(),
)
def test_each_kind_is_told_with_its_step(played, kind: str, change: dict[str, Any]):
    episode, record = played
    found = list(differences(episode, record, changed(record, 3, **change)))
    assert {(each.kind, each.step) for each in found} == {(kind, 3)}


def test_an_end_and_a_verdict_are_told(played):
    episode, record = played
    cut = record.model_copy(update={"steps": record.steps[:-1], "end": "fail_no_report"})
    assert {each.kind for each in differences(episode, record, cut)} == {"end", "verdict"}


def test_a_verdict_that_only_hangs_on_what_is_seen_is_told_as_such():
    goal = ReportStatus(object_id=FRIDGE, state="is_open")
    episode = tiny_episode(0, "SV", goal=goal)
    validator = Validator(make_simulator("fake", assets=AssetDatabase.default()))
    record = validator.play(episode, tiny_house(), (Report(status="closed", summary=""),))
    assert record.initial is not None
    unseen = dict.fromkeys(SEEN, 0) | {"visible": False, "nearest_visible_m": None}
    hidden = record.initial.objects[FRIDGE].model_copy(update=unseen)
    world = record.initial.model_copy(update={"objects": {FRIDGE: hidden}})
    step = record.steps[0].model_copy(update={"world": world})
    blind = record.model_copy(update={"initial": world, "steps": (step,)})
    assert "verdict by sight" in {each.kind for each in differences(episode, record, blind)}
    opened = {"objects": {FRIDGE: hidden.model_copy(update={"openness": 1.0})}}
    other = blind.model_copy(update={"steps": (step.model_copy(update={"world": world.model_copy(update=opened)}),)})
    assert "verdict" in {each.kind for each in differences(episode, record, other)}


def test_every_kind_that_is_explained_is_one():
    assert {kind for each in DIFFERENCES for kind in each.kinds} <= set(KINDS)


def test_a_pack_in_thor_is_as_in_the_embedded_simulator(pack: Pack):
    simulators = make_simulator("mujoco", assets=AssetDatabase.default(), quality="fast"), in_process()
    found = compare_backends(pack, pack.episodes, *simulators)
    explained = {kind for each in DIFFERENCES for kind in each.kinds}
    assert [each for each in found.differences if each.kind not in explained] == []
    assert (found.episodes, found.a, found.b) == (2, simulators[0].name, "thor/in-process")


def test_the_command_counts_and_exits_with_what_is_unexplained(pack: Pack, monkeypatch: pytest.MonkeyPatch):
    words = ["compare-backends", str(Path(pack.folder)), "--first", "fake", "--second", "fake", "--json"]
    same = CliRunner().invoke(app, words)
    assert same.exit_code == 0
    assert json.loads(same.stdout)["differences"] == dict.fromkeys(KINDS, 0)
    monkeypatch.setattr("vigil.authoring.review.compare_backends.compare_backends", lambda *_: _with_a_difference(pack))
    other = CliRunner().invoke(app, words[:-1])
    assert other.exit_code == 1
    assert "step 1: held: None / Mug" in other.stdout


def _with_a_difference(pack: Pack) -> Any:
    one = BackendDifference(pack.episodes[0].id, 1, "hand", "held", None, "Mug")
    return BackendComparison("a", "b", 1, 4, (one,))
