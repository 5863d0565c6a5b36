"""Reasoning in every form that servers send it, whole and as a stream, from a loopback server to the record."""

from pathlib import Path

import pytest
from inspect_marks import INSPECT
from quick_runs import quick
from reasoning_forms import REASONING_FORMS, REPORT, THOUGHT, check_judged
from tiny_pack import loose_pack, tiny_episode, tiny_house
from wire_server import ScriptedModel, WireServer

from vigil.record import StepRecord
from vigil.runner.run import run_pack

pytestmark = INSPECT
PAGE = Path(__file__).parents[2] / "docs" / "models.md"
NAMES = list(REASONING_FORMS)


@pytest.fixture(scope="module", params=[False, True], ids=["whole", "streamed"])
def steps(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> dict[str, StepRecord]:
    """The first step of an episode for each form, in a run against one server."""
    folder = tmp_path_factory.mktemp("forms")
    episodes = [tiny_episode(number, "DA", max_steps=1) for number in range(len(NAMES))]
    loose_pack(folder / "pack", episodes, [tiny_house()])
    model = ScriptedModel(lambda episode, _: REASONING_FORMS[NAMES[episode]].said)
    with WireServer(model) as server:
        settings = quick(folder / "pack", folder / "run", model="vllm/m", base_url=f"{server.url}/v1", preflight=False)
        settings.model_args.update({"stream": request.param})
        records = run_pack(settings).records
    return {NAMES[int(record.episode_id[-3:])]: record.steps[0] for record in records}


@pytest.mark.parametrize("name", NAMES)
def test_a_form_is_judged_as_the_protocol_says(steps: dict[str, StepRecord], name: str) -> None:
    check_judged(name, steps[name])


def test_every_form_is_a_row_of_the_page() -> None:
    rows = [line for line in PAGE.read_text(encoding="utf-8").splitlines() if line.startswith("| ")]
    assert set(NAMES) <= {row.split(" | ")[0].removeprefix("| ") for row in rows}


def test_a_draft_in_the_reasoning_is_not_the_answer() -> None:
    assert "skill_name" in THOUGHT
    assert "report" not in THOUGHT
    assert "report" in REPORT
