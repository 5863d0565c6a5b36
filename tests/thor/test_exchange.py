"""A kept exchange of AI2-THOR's real client with the engine: the engine still gives the same answers."""

from typing import Any

from tests.support.thor_exchange import SIZE, STEPS, golden, kept
from vigil.assets.database import AssetDatabase
from vigil.sim import make_simulator
from vigil.sim.conformance.reference_house import reference_house
from vigil.sim.scene_editor import SceneEditor
from vigil.thor.base.settings import Settings
from vigil.thor.base.world import World
from vigil.thor.engine import ThorEngine


def test_the_engine_answers_as_it_did_the_real_client():
    editor = make_simulator("fake", assets=AssetDatabase.default())
    assert isinstance(editor, SceneEditor)
    engine = ThorEngine(World(editor, Settings(screen_width=SIZE["width"], screen_height=SIZE["height"])))
    metadata: dict[str, Any] = {}
    lines = golden()
    assert [line["sent"]["action"] for line in lines][-len(STEPS) :] == [name for name, _ in STEPS]
    for line in lines:
        sent = {**line["sent"], "house": reference_house().data} if "house" in line["sent"] else line["sent"]
        answer = engine.respond(sent)
        metadata = {**metadata, **answer.metadata} if answer.is_patch else answer.metadata["agents"][0]
        assert kept(sent, metadata) == line
