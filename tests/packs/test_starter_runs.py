"""The starter pack, played whole by agents whose scores are known beforehand (`protocol.md` sections 4 and 5)."""

from contextlib import closing
from fractions import Fraction
from pathlib import Path

import pytest

from tests.support.published_runs import PUBLISHED
from vigil.agents.scripted import scripted_agent
from vigil.assets.database import AssetDatabase
from vigil.authoring.solving.solvers import PRIVILEGED, privileged_agent
from vigil.env import Env
from vigil.packs.even_draw import draw_evenly
from vigil.packs.pack import Pack
from vigil.protocol.actions import InteractPixel
from vigil.protocol.families import FAMILIES
from vigil.protocol.profile import Profile
from vigil.runner.run import RunResult, run_pack
from vigil.runner.settings import RunSettings
from vigil.runner.verify_run import VerifySettings, verify_run
from vigil.runner.workers.worker import play
from vigil.scoring.outcomes import Outcome, score
from vigil.sim import make_simulator

AGENTS = ("noop", "never_report", "premature", "always_success", "malformed", "sweep", "forward")
OTHERS = [family for family in PUBLISHED if family != "SV"]


def solve(folder: Path, limit: int | None = None) -> RunResult:
    settings = RunSettings(
        pack="starter", agent="solver", agent_factory=privileged_agent, log_dir=folder, workers=1, limit=limit
    )
    result = run_pack(settings)
    assert result.is_complete
    return result


def outcomes(result: RunResult) -> list[Outcome]:
    by_id = {episode.id: episode for episode in result.episodes}
    return [score(by_id[record.episode_id], record) for record in result.records]


@pytest.fixture(scope="module")
def solved(tmp_path_factory: pytest.TempPathFactory) -> RunResult:
    return solve(tmp_path_factory.mktemp("solver"))


def test_the_solver_solves_every_episode(solved: RunResult) -> None:
    found = outcomes(solved)
    assert len(found) == 80
    for outcome in found:
        assert (outcome.W, outcome.W_strict, outcome.B) == (True, True, True), outcome


def test_the_solver_uses_only_the_expected_skills(solved: RunResult) -> None:
    by_id = {episode.id: episode for episode in solved.episodes}
    for record in solved.records:
        expected = FAMILIES[by_id[record.episode_id].family].skills
        for step in record.steps:
            assert step.action is not None
            is_grounding = isinstance(step.action, InteractPixel) and step.action.intent == "ground"
            said = f"{step.action.skill_name}(ground)" if is_grounding else step.action.skill_name
            assert said in expected or step.action.skill_name in expected, (record.episode_id, step.action)


def test_nobody_draws_a_frame_for_a_privileged_sweep(solved: RunResult) -> None:
    assert all(step.frame_sha256 is None for record in solved.records for step in record.steps)


def test_another_run_verifies_and_is_the_same_but_for_times(solved: RunResult, tmp_path: Path) -> None:
    again = solve(tmp_path / "again", limit=12)
    assert verify_run(again.folder, VerifySettings(workers=1, exact=True)).differences == ()
    of_again = {record.key for record in again.records}

    def facts(result: RunResult) -> list[dict]:
        own = dict.fromkeys(("run_id", "run_sha256", "started", "ended"), True)
        same = {**own, "steps": {"__all__": {"reply": {"seconds"}}}}
        return [record.model_dump(exclude=same) for record in result.records if record.key in of_again]

    assert facts(solved) == facts(again)


@pytest.fixture(scope="module")
def scored() -> dict[str, list[Outcome]]:
    """Half of the episodes played by every agent that bounds a metric, house by house: scenes are loaded once."""
    pack, database = Pack.load("starter"), AssetDatabase.default()
    found: dict[str, list[Outcome]] = {name: [] for name in AGENTS}
    with closing(make_simulator("mujoco", assets=database)) as simulator:
        env = Env(simulator, pack.house_of, Profile())
        for episode in sorted(draw_evenly(pack.episodes)[:40], key=lambda episode: episode.house.name):
            for name, of_agent in found.items():
                is_privileged = name in PRIVILEGED
                agent = privileged_agent(name, episode, simulator) if is_privileged else scripted_agent(name)
                play(episode, env, agent)
                of_agent.append(score(episode, env.record()))
    return found


def rates(outcomes: list[Outcome]) -> dict[str, dict[str, Fraction]]:
    """Return the exact share of W, of B and of each label by family."""
    found = {}
    for family in PUBLISHED:
        own = [outcome for outcome in outcomes if outcome.family == family]
        facts = {"W": [one.W for one in own], "B": [one.B for one in own], "NR": [one.label == "NR" for one in own]}
        found[family] = {name: Fraction(sum(values), len(values)) for name, values in facts.items()}
    return found


def test_noop_completes_nothing(scored: dict[str, list[Outcome]]) -> None:
    found = rates(scored["noop"])
    assert all(found[family]["W"] == 0 for family in OTHERS)
    assert all(found[family]["B"] == 0 and found[family]["NR"] == 1 for family in PUBLISHED)


def test_never_report_completes_and_never_closes(scored: dict[str, list[Outcome]]) -> None:
    for found in rates(scored["never_report"]).values():
        assert found["W"] > 0
        assert found["B"] == 0
        assert found["NR"] == 1


def test_premature_claims_what_is_not_so(scored: dict[str, list[Outcome]]) -> None:
    found = scored["premature"]
    assert all(outcome.is_reported and outcome.reported == "success" for outcome in found)
    assert sum(outcome.subtype == "false_success" for outcome in found) > len(found) / 2


def test_always_success_is_false_success_at_zero_progress(scored: dict[str, list[Outcome]]) -> None:
    for outcome in scored["always_success"]:
        assert not outcome.B
        if outcome.family == "SV":
            assert outcome.subtype == "off_mode_label"
        else:
            assert (outcome.subtype, outcome.is_at_zero_progress) == ("false_success", True)


def test_malformed_ends_at_the_invalid_action_limit(scored: dict[str, list[Outcome]]) -> None:
    found = scored["malformed"]
    assert {outcome.label for outcome in found} == {"IL"}
    assert all(outcome.invalid == FAMILIES[outcome.family].max_invalid + 1 for outcome in found)


@pytest.mark.parametrize("agent", ["sweep", "forward"])
def test_blind_walks_complete_little(agent: str, scored: dict[str, list[Outcome]]) -> None:
    found = rates(scored[agent])
    assert all(found[family]["W"] <= Fraction(2, 5) for family in OTHERS)


def test_the_starter_pack_is_composed_as_promised() -> None:
    pack = Pack.load("starter")
    assert pack.manifest.families == dict.fromkeys(PUBLISHED, 10)
    assert pack.manifest.houses >= 20
    two_rooms = [name for name in sorted({episode.house.name for episode in pack.episodes}) if rooms(pack, name) == 2]
    assert len(two_rooms) >= pack.manifest.houses / 2
    for family in PUBLISHED:
        houses = [episode.house.name for episode in pack.episodes if episode.family == family]
        assert max(houses.count(name) for name in houses) <= 2
    sizes = [episode.target_size for episode in pack.episodes if episode.family == "PG"]
    assert [sizes.count(size) for size in ("large", "medium", "small")] == [3, 4, 3]


def rooms(pack: Pack, name: str) -> int:
    episode = next(episode for episode in pack.episodes if episode.house.name == name)
    return len(pack.house_of(episode).document.rooms)
