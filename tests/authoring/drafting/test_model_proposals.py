"""Proposals by a model: asked with an inventory, answered in a schema, judged by the same rules."""

import json
from dataclasses import replace

import numpy as np
import pytest

from tests.support.chat_server import ChatAnswer, ChatRequest, serving
from tests.support.inspect_marks import INSPECT
from vigil.authoring.drafting.drafts import Draft, Rejection
from vigil.authoring.drafting.generation import FAMILY_GRAMMAR, DraftWorker, GenerationSettings, Proposer
from vigil.authoring.drafting.house_context import HouseContext
from vigil.authoring.drafting.model_proposals import inventory, model_proposer, question
from vigil.authoring.drafting.sources import HouseInFile
from vigil.packs.pack import Pack
from vigil.runner.models.access import Endpoint, model_access
from vigil.runner.models.completion import open_completion
from vigil.sim.privileged import PrivilegedSimulator

pytestmark = INSPECT

TERMS = GenerationSettings(("AI",), seed=3)


def worker(proposer: Proposer) -> DraftWorker:
    """Return a worker that proposes with a model."""
    return DraftWorker(replace(TERMS, grammar=replace(FAMILY_GRAMMAR, make_proposer=lambda seed: proposer)))


IN_THE_OPEN = ("Box|", "Statue|", "Vase|")
"""Things of the house that can be walked up to and seen."""


@pytest.fixture(scope="module")
def source(starter: Pack) -> HouseInFile:
    episode = next(episode for episode in starter.episodes if episode.house.name == "bedroom-living_106")
    return HouseInFile(starter.folder / "houses" / f"{episode.house.name}.json")


@pytest.fixture(scope="module")
def context(source: HouseInFile, simulator: PrivilegedSimulator) -> HouseContext:
    return HouseContext(simulator, source.house(), np.random.default_rng(0))


def test_the_question_names_things_and_kinds_but_no_place(context: HouseContext) -> None:
    asked = question(context, "AI", 3)
    rows = inventory(context)
    assert rows
    assert len({row["name"] for row in rows}) == len(rows)
    for row in rows:
        assert row["id"] in asked
    for word in ("open, close, turn_on, turn_off, pick", '"drafts"', "Approach and Interact"):
        assert word in asked


def test_answers_are_drafted_validated_and_counted(source: HouseInFile, context: HouseContext) -> None:
    can = {row["id"]: row for row in inventory(context)}
    picks = [row for row in can.values() if "pick" in row["can"]]
    good = [
        {"kind": "pick", "things": {"target": row["id"]}, "instruction": f"Please bring me {row['name']}: pick it up."}
        for row in picks
        if row["id"].startswith(IN_THE_OPEN)
    ]
    bad = [
        {"kind": "pick", "things": {"target": "Unicorn|1"}, "instruction": "Pick up the unicorn."},
        {"kind": "juggle", "things": {"target": picks[0]["id"]}, "instruction": "Juggle."},
        {"kind": "pick", "instruction": "Pick it up."},
        {"kind": "open", "things": {"target": picks[0]["id"]}, "instruction": "Open it."},
        {**good[0], "instruction": "Pick up that thing."},
    ]

    def brain(asked: ChatRequest) -> ChatAnswer:
        assert picks[0]["id"] in asked.texts[-1]
        return ChatAnswer(f"```json\n{json.dumps({'drafts': [*bad, *good]})}\n```")

    with (
        serving(brain) as server,
        open_completion(Endpoint(model_access("openai/anything", server.url, {}))) as complete,
    ):
        _, lines = worker(model_proposer(complete, 4, "openai/anything")).work(source, ("AI",))
        assert len(server.asked) == 1
    drafts = [line for line in lines if isinstance(line, Draft)]
    rules = [line.rule for line in lines if isinstance(line, Rejection)]
    assert len(drafts) == len(good)
    assert all(each.episode.provenance.author == "openai/anything" for each in drafts)
    assert all(each.episode.instruction.startswith("Please bring me") for each in drafts)
    assert {"things_known", "kind_known", "draft_fits_schema", "can_be_set_up"} <= set(rules)
    assert rules.count("target_named") == 1


def test_prose_is_one_rejection(source: HouseInFile) -> None:
    proposer = model_proposer(lambda text: "I would rather not.", 2, "m")
    _, lines = worker(proposer).work(source, ("AI",))
    found = [line for line in lines if isinstance(line, Rejection)]
    assert [line.rule for line in found] == ["reply_parses"]
    assert "I would rather not." in found[0].message
