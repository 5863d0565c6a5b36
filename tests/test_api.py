"""The public face of the package."""

import inspect
import subprocess
import sys
from pathlib import Path

import pytest

import vigil
from vigil import api
from vigil.analysis.measures.rows import read_runs
from vigil.errors import PackMismatch
from vigil.runner.verify_run import VerifySettings, verify_run
from vigil.scoring.saved_run import read_run
from vigil.scoring.summary import summarise
from vigil.web.library import Library

NAMES = [
    *("Agent", "Env", "Episode", "EpisodeRecord", "Feedback", "House", "Observation", "Outcome", "Pack", "Profile"),
    *("Reply", "VigilError", "generate_house", "load_pack", "make_env", "play", "read_records", "reply", "save_run"),
    *("score", "summarise", "thor_engine"),
]
"""What users rely on: a name may come, none may go."""


class LooksRound:
    """Turns round once, then claims success."""

    name = "looks_round"

    def start(self, instruction: str) -> None:
        self.instruction, self.frames = instruction, []

    def act(self, observation: vigil.Observation) -> vigil.Reply:
        self.frames.append(observation.rgb.shape)
        if len(self.frames) <= 3:
            return vigil.reply("navigate", mode="turn_right", magnitude=90)
        return vigil.reply("report", status="success", summary="looked round")


def test_the_names_are_offered_and_explained() -> None:
    assert sorted(api.__all__) == NAMES
    assert set(NAMES) <= set(dir(vigil))
    for name in NAMES:
        assert getattr(vigil, name) is getattr(api, name)
        assert inspect.getdoc(getattr(vigil, name))


def test_other_names_are_none() -> None:
    with pytest.raises(AttributeError, match="no attribute 'load_packs'"):
        vigil.load_packs  # noqa: B018


@pytest.mark.parametrize("statement", ["import vigil", "import vigil.env", "import vigil.api"])
def test_what_an_import_loads(statement: str) -> None:
    heavy = {"mujoco", "OpenGL", "inspect_ai", "matplotlib"}
    heavy |= {"numpy", "pydantic"} if statement == "import vigil" else set()
    code = f"import sys; {statement}; print(*sorted({heavy!r} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


def test_an_agent_of_ones_own_plays_and_is_judged() -> None:
    pack = vigil.load_pack("vigil_smoke")
    episodes = pack.episodes[:2]
    agent = LooksRound()
    with vigil.make_env(pack, backend="fake") as env:
        records = [vigil.play(episode, env, agent) for episode in episodes]
    assert agent.instruction == episodes[1].instruction
    assert agent.frames == [(480, 640, 3)] * 4
    outcomes = [vigil.score(episode, record) for episode, record in zip(episodes, records, strict=True)]
    overall = vigil.summarise(episodes, records)["overall"]
    assert overall["W"] == sum(outcome.W for outcome in outcomes) / 2


def test_records_are_written_as_a_run_that_is_read_scored_and_verified(tmp_path: Path) -> None:
    pack = vigil.load_pack("vigil_smoke")
    some = pack.episodes[:3]
    with vigil.make_env(pack, backend="fake") as env:
        records = [vigil.play(episode, env, LooksRound()) for episode in some]
    run = vigil.save_run(tmp_path / "run", pack, records, env, agent="looks_round")
    read = read_run(run)
    assert (read.notes, read.header.spec.agent, read.header.spec.simulator) == (
        read.header.version_notes,
        "looks_round",
        "fake",
    )
    assert summarise(read.table.scores()) == vigil.summarise(some, records)
    assert verify_run(run, VerifySettings()).is_verified
    (shown,) = Library([tmp_path]).runs()
    assert shown.fault == ""
    (rows,) = read_runs([run])
    assert rows.n == 3
    with pytest.raises(vigil.VigilError, match="already holds a run"):
        vigil.save_run(run, pack, records, env, agent="looks_round")
    with pytest.raises(vigil.VigilError, match="has no episode"):
        vigil.save_run(tmp_path / "other", vigil.load_pack("starter"), records, env, agent="looks_round")


def test_what_fails_in_an_agent_is_an_error_and_no_result() -> None:
    class Broken(LooksRound):
        def act(self, observation: vigil.Observation) -> vigil.Reply:
            raise ZeroDivisionError("mine")

    pack = vigil.load_pack("vigil_smoke")
    with vigil.make_env(pack, backend="fake") as env:
        record = vigil.play(pack.episodes[0], env, Broken())
    assert record.end == "error"
    assert record.error is not None
    assert "ZeroDivisionError: mine" in record.error.message


def test_bad_input_is_named() -> None:
    with pytest.raises(PackMismatch, match="no_such_pack"):
        vigil.load_pack("no_such_pack")
    with pytest.raises(vigil.VigilError, match="'mujocco' is unknown"):
        vigil.make_env(vigil.load_pack("vigil_smoke"), backend="mujocco")


def test_a_house_is_generated() -> None:
    house = vigil.generate_house(3, "bathroom")
    assert len(house.document.rooms) == 1
