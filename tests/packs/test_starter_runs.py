"""The starter pack, played whole by agents whose scores are known beforehand (`protocol.md` sections 4 and 5)."""

from pathlib import Path

import pytest

from vigil.actions import InteractPixel
from vigil.authoring.solving.solvers import PRIVILEGED, privileged_agent
from vigil.episode import FAMILIES
from vigil.pack import Pack
from vigil.runner.run import RunResult, run_pack
from vigil.runner.settings import RunSettings
from vigil.runner.verify_run import VerifySettings, verify_run
from vigil.scoring import Outcome, settle
from vigil.summary import settle_run, summarise

OTHERS = [family for family in FAMILIES if family != "SV"]


def play(agent: str, folder: Path, limit: int | None = None) -> RunResult:
    settings = RunSettings(
        pack="starter",
        agent=agent,
        agent_factory=privileged_agent if agent in PRIVILEGED else None,
        log_dir=folder,
        workers=1,
        limit=limit,
    )
    result = run_pack(settings)
    assert result.is_complete
    return result


def outcomes(result: RunResult) -> list[Outcome]:
    by_id = {episode.id: episode for episode in result.episodes}
    return [settle(by_id[record.episode_id], record) for record in result.records]


def families(result: RunResult) -> dict:
    summary = summarise(settle_run(result.episodes, result.records))
    assert list(summary["families"]) == list(FAMILIES)
    return summary["families"]


@pytest.fixture(scope="module")
def solved(tmp_path_factory: pytest.TempPathFactory) -> RunResult:
    return play("solver", tmp_path_factory.mktemp("solver"))


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


def test_the_run_verifies_and_another_one_is_the_same_but_for_times(solved: RunResult, tmp_path: Path) -> None:
    assert verify_run(solved.folder, VerifySettings(workers=1, exact=True)).differences == ()
    again = play("solver", tmp_path / "again", limit=24)
    of_again = {record.key for record in again.records}

    def facts(result: RunResult) -> list[dict]:
        timeless = {"run_id": True, "started": True, "ended": True, "steps": {"__all__": {"reply": {"seconds"}}}}
        return [record.model_dump(exclude=timeless) for record in result.records if record.key in of_again]

    assert facts(solved) == facts(again)


def test_noop_completes_nothing(tmp_path: Path) -> None:
    rates = families(play("noop", tmp_path, limit=40))
    assert all(rates[family]["W"] == 0 for family in OTHERS)
    assert all(rates[family]["B"] == 0 and rates[family]["NR"] == 1 for family in FAMILIES)


def test_never_report_completes_and_never_closes(tmp_path: Path) -> None:
    for rates in families(play("never_report", tmp_path, limit=40)).values():
        assert rates["W"] > 0
        assert rates["B"] == 0
        assert rates["NR"] == 1


def test_premature_claims_what_is_not_so(tmp_path: Path) -> None:
    found = outcomes(play("premature", tmp_path))
    assert all(outcome.is_reported and outcome.reported == "success" for outcome in found)
    assert sum(outcome.subtype == "false_success" for outcome in found) > len(found) / 2


def test_always_success_is_false_success_at_zero_progress(tmp_path: Path) -> None:
    for outcome in outcomes(play("always_success", tmp_path, limit=24)):
        assert not outcome.B
        if outcome.family == "SV":
            assert outcome.subtype == "off_mode_label"
        else:
            assert (outcome.subtype, outcome.is_at_zero_progress) == ("false_success", True)


def test_malformed_ends_at_the_invalid_action_limit(tmp_path: Path) -> None:
    found = outcomes(play("malformed", tmp_path, limit=24))
    assert {outcome.label for outcome in found} == {"IL"}
    assert all(outcome.invalid == FAMILIES[outcome.family].max_invalid + 1 for outcome in found)


@pytest.mark.parametrize("agent", ["sweep", "forward"])
def test_blind_walks_complete_little(agent: str, tmp_path: Path) -> None:
    rates = families(play(agent, tmp_path))
    assert all(rates[family]["W"] <= 0.4 for family in OTHERS)


def test_the_starter_pack_is_composed_as_promised() -> None:
    pack = Pack.load("starter")
    assert pack.manifest.families == dict.fromkeys(FAMILIES, 10)
    assert pack.manifest.houses >= 20
    two_rooms = [name for name in sorted({episode.house.name for episode in pack.episodes}) if rooms(pack, name) == 2]
    assert len(two_rooms) >= pack.manifest.houses / 2
    for family in FAMILIES:
        houses = [episode.house.name for episode in pack.episodes if episode.family == family]
        assert max(houses.count(name) for name in houses) <= 2
    sizes = [episode.difficulty for episode in pack.episodes if episode.family == "PG"]
    assert [sizes.count(size) for size in ("large", "medium", "small")] == [3, 4, 3]


def rooms(pack: Pack, name: str) -> int:
    episode = next(episode for episode in pack.episodes if episode.house.name == name)
    return len(pack.house_of(episode).document.rooms)
