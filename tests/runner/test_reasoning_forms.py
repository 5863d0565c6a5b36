"""Reasoning in every form that servers send it, whole and as a stream, from a loopback server to the record."""

from collections import Counter
from pathlib import Path

from tests.support.inspect_marks import INSPECT
from tests.support.quick_runs import quick
from tests.support.reasoning_forms import REASONING_FORMS, REPORT, THOUGHT, FormsInTurn, shared_simulator
from tests.support.wire_server import WireServer
from vigil.packs.pack import Pack
from vigil.runner.run import run_pack

pytestmark = INSPECT
PAGE = Path(__file__).parents[2] / "docs" / "models.md"
NAMES = list(REASONING_FORMS)


def test_the_smoke_pack_is_played_in_every_form(tmp_path: Path) -> None:
    """Each of its episodes in each form, one half of these plays whole and the other streamed."""
    pack, half = Pack.load("vigil_smoke"), len(NAMES) // 2
    model, played = FormsInTurn(pack), Counter[tuple[str, str]]()
    with WireServer(model) as server, shared_simulator(pack):
        asked = {"model": "vllm/m", "base_url": f"{server.url}/v1", "preflight": False, "max_connections": 1}
        for is_streamed in (False, True):
            told = {**asked, "model_args": {"stream": is_streamed}}
            for record in run_pack(quick(pack.folder, tmp_path / str(is_streamed), epochs=half, **told)).records:
                played[record.episode_id, model.check(record, record.epoch - 1 + half * is_streamed)] += 1
    assert {bool(request.body.get("stream")) for request in server.requests} == {False, True}
    assert played == Counter((episode.id, name) for episode in pack.episodes for name in NAMES)


def test_every_form_is_a_row_of_the_page() -> None:
    rows = [line for line in PAGE.read_text(encoding="utf-8").splitlines() if line.startswith("| ")]
    assert set(NAMES) <= {row.split(" | ")[0].removeprefix("| ") for row in rows}


def test_a_draft_in_the_reasoning_is_not_the_answer() -> None:
    assert "skill_name" in THOUGHT
    assert "report" not in THOUGHT
    assert "report" in REPORT
